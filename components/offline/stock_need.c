/* SPDX-License-Identifier: GPL-2.0-or-later */
/* stock_need.c - see stock_need.h. */

#include "core/chip_math.h"
#include "core/tool.h"
#include "stock_need.h"

struct segment {
    double x, y, z, ux, uy, uz; /* mm: where it begins, and the vector to its end */
    double uu;                  /* mm2: length seen from above, squared */
};

struct window {
    int32_t i0, i1, j0, j1; /* the first and the last column and row whose needles a segment may meet */
};


static int32_t within(double v, int32_t count) { return (int32_t)chip_max(0.0, chip_min(v, count - 1.0)); }

static struct segment segment_of(const double from[3], const double to[3])
{
    struct segment p = { from[0], from[1], from[2], to[0] - from[0], to[1] - from[1], to[2] - from[2], 0.0 };
    p.uu = p.ux * p.ux + p.uy * p.uy;
    return p;
}

/* A needle is anywhere in its cell, and shifted by up to one. */
static struct window window_of(const struct chip_height_map *map, const struct segment *p, double radius)
{
    double x = p->x - map->x0, y = p->y - map->y0;
    struct window w;
    w.i0 = within(floor((chip_min(x, x + p->ux) - radius) / map->cell) - 1.0, map->nx);
    w.i1 = within(floor((chip_max(x, x + p->ux) + radius) / map->cell) + 1.0, map->nx);
    w.j0 = within(floor((chip_min(y, y + p->uy) - radius) / map->cell) - 1.0, map->ny);
    w.j1 = within(floor((chip_max(y, y + p->uy) + radius) / map->cell) + 1.0, map->ny);
    return w;
}

/* What the tool leaves at a share of the segment of a needle that is (x, y) away from where the segment begins, and within reach. */
static double left_at(const struct chip_tool *tool, const struct segment *p, double x, double y, double share)
{
    double dx = x - share * p->ux, dy = y - share * p->uy;
    return p->z + share * p->uz + chip_tool_height(tool, chip_min(sqrt(dx * dx + dy * dy), tool->radius));
}

/* The lowest of it along a segment, which is short: where the needle comes within reach and leaves it, and where it is nearest. */
static double left_by(const struct chip_tool *tool, const struct segment *p, double x, double y)
{
    double near = p->uu > 0.0 ? (x * p->ux + y * p->uy) / p->uu : 0.0, half = 1.0, dx, dy, room, first, last;
    dx = x - near * p->ux;
    dy = y - near * p->uy;
    room = tool->radius * tool->radius - dx * dx - dy * dy;
    if (room < 0.0) return CHIP_NEED_NONE;
    if (p->uu > 0.0) half = sqrt(room / p->uu);
    first = chip_max(near - half, 0.0);
    last = chip_min(near + half, 1.0);
    if (first > last) return CHIP_NEED_NONE;
    near = chip_max(first, chip_min(near, last));
    return chip_min(left_at(tool, p, x, y, near),
                    chip_min(left_at(tool, p, x, y, first), left_at(tool, p, x, y, last)));
}

/* Keeps the lowest height and its segment for every needle that segment k meets [1]. */
static void lower(const struct chip_height_map *map, const struct chip_tool *tool, const struct segment *p, int32_t k,
                  float *lowest, int32_t *owner)
{
    struct window w = window_of(map, p, tool->radius);
    double bottom = chip_min(p->z, p->z + p->uz);
    int32_t i, j;
    for (j = w.j0; j <= w.j1; j++)
        for (i = w.i0; i <= w.i1; i++) {
            int64_t c = (int64_t)j * map->nx + i;
            double left;
            if (map->height[c] <= bottom || lowest[c] <= bottom) continue;
            left = chip_max(left_by(tool, p, map->x0 + map->x[i] + map->shift_x[j] - p->x,
                                    map->y0 + j * map->cell + map->shift_y[i] - p->y),
                            map->z_min);
            if (left >= map->height[c] || left >= lowest[c] - CHIP_NEED_SAME) continue;
            lowest[c] = (float)left;
            owner[c] = k;
        }
}

/* Marks the segments of the needles that count, and makes `lowest` ready for the next call [2]. */
static long mark(const struct chip_height_map *map, const struct segment *p, double radius, double least, float *lowest,
                 const int32_t *owner, unsigned char *needed)
{
    struct window w = window_of(map, p, radius);
    long count = 0;
    int32_t i, j;
    for (j = w.j0; j <= w.j1; j++)
        for (i = w.i0; i <= w.i1; i++) {
            int64_t c = (int64_t)j * map->nx + i;
            if (lowest[c] >= 0.5e30f) continue;
            if (map->height[c] - (double)lowest[c] > least && !needed[owner[c]]) {
                needed[owner[c]] = 1;
                count++;
            }
            lowest[c] = (float)CHIP_NEED_NONE;
        }
    return count;
}

long chip_stock_need(const struct chip_height_map *map, const struct chip_drop_tool *tool, long n,
                     const double (*from)[3], const double (*to)[3], double least, float *lowest, int32_t *owner,
                     unsigned char *needed)
{
    struct chip_tool profile;
    struct segment p;
    long k, count = 0;
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->half_angle);
    for (k = 0; k < n; k++) {
        needed[k] = 0;
        p = segment_of(from[k], to[k]);
        lower(map, &profile, &p, (int32_t)k, lowest, owner);
    }
    for (k = 0; k < n; k++) {
        p = segment_of(from[k], to[k]);
        count += mark(map, &p, profile.radius, least, lowest, owner, needed);
    }
    return count;
}
