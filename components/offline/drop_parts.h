/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_parts.h - what drop_triangle.c, drop_cutter.c, drop_path.c and drop_stock.c share; see drop_cutter.h. */
#ifndef CHIPWISE_DROP_PARTS_H
#define CHIPWISE_DROP_PARTS_H

#include "core/chip_math.h"
#include "core/fault.h"
#include "core/tool.h"
#include "drop_cutter.h"

#define CHIP_DROP_RIM 1e-9 /* mm: a point at the tool's radius is met */

/* A straight path of the tip. */
struct chip_drop_path {
    const struct chip_tool *tool;
    double x, y, z, ux, uy, uz; /* from, and the vector to the end */
};

/* The tip over a triangle with the axis at (x, y), if it can be above `z`; else something up to z. */
double chip_drop_over_triangle(const struct chip_tool *tool, const float *t, double x, double y, double z);

static inline double chip_drop_clamped(double v, double low, double high) { return chip_max(low, chip_min(v, high)); }

/* The bin that a coordinate is in; the first or last one if it is outside. */
static inline int32_t chip_drop_bin_of(double v, double bin, int32_t count)
{
    return (int32_t)chip_drop_clamped(floor(v / bin), 0.0, count - 1.0);
}

/* The shape of a tool. */
static inline void chip_drop_profile_of(struct chip_tool *profile, const struct chip_drop_tool *tool)
{
    chip_tool_set_profile(profile, tool->radius, tool->corner, tool->half_angle);
}

/* A number for a new search; a triangle that has it has been met. */
static inline uint32_t chip_drop_new_stamp(struct chip_drop_mesh *mesh)
{
    int32_t k;
    if (++mesh->stamp == 0) {
        for (k = 0; k < mesh->n; k++) mesh->seen[k] = 0;
        mesh->stamp = 1;
    }
    return mesh->stamp;
}

/* How far a point is from the path. */
static inline double chip_drop_off_path(const struct chip_drop_path *p, double x, double y)
{
    double uu = p->ux * p->ux + p->uy * p->uy, s;
    x -= p->x;
    y -= p->y;
    s = uu > 0.0 ? chip_drop_clamped((x * p->ux + y * p->uy) / uu, 0.0, 1.0) : 0.0;
    x -= s * p->ux;
    y -= s * p->uy;
    return sqrt(x * x + y * y);
}

#endif
