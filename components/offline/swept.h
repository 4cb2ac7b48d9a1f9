/* SPDX-License-Identifier: GPL-2.0-or-later */
/* swept.h - one straight move of a rotating tool, exactly: what it leaves above a place, and when it comes there.
 *
 * Who calls it: depth_proof.c, needles.c, height_sweep.c. Never in realtime.
 * Source: CN105492980 [0045]; the solid a tool sweeps on a straight move is the Minkowski sum of the move and the tool, which is
 * convex. So chip_swept_height is a convex function of the place, and its highest value over a square is at a corner.
 */
#ifndef CHIPWISE_SWEPT_H
#define CHIPWISE_SWEPT_H

#include <math.h>

#include "core/tool.h"

#define CHIP_SWEPT_NEVER 1e30  /* a height or a share: the tool does not come there */
#define CHIP_SWEPT_STILL 1e-18 /* mm2: shorter moves go along Z only */

struct chip_swept {
    double x, y, z;    /* mm, where it begins */
    double dx, dy, dz; /* mm, to where it ends */
    double length2;    /* mm2, seen from above */
};

/* Makes a tool's profile wider by `side` (mm) all round: what is above it is within `side` of the tool, seen from above. */
static inline void chip_swept_widen(struct chip_tool *tool, double side)
{
    tool->radius += side;
    tool->r_flat += side;
    tool->r_arc += side;
}

static inline struct chip_swept chip_swept_of(const double from[3], const double to[3])
{
    struct chip_swept m = { from[0], from[1], from[2], to[0] - from[0], to[1] - from[1], to[2] - from[2], 0.0 };
    m.length2 = m.dx * m.dx + m.dy * m.dy;
    return m;
}

/* Share of the move, not limited to it, at which the axis is nearest to a place; *off2: mm2, the distance there squared. */
static inline double chip_swept_nearest(const struct chip_swept *m, double x, double y, double *off2)
{
    double u = x - m->x, v = y - m->y, t = 0.0;
    if (m->length2 > CHIP_SWEPT_STILL) {
        t = (u * m->dx + v * m->dy) / m->length2;
        u -= t * m->dx;
        v -= t * m->dy;
    }
    *off2 = u * u + v * v;
    return t;
}

/* Shares *first .. *last of the move within `radius` of a place; 0 if there are none. */
static inline int chip_swept_within(const struct chip_swept *m, double x, double y, double radius, double *first,
                                    double *last)
{
    double off2, t = chip_swept_nearest(m, x, y, &off2), room = radius * radius - off2, half;
    *first = 0.0;
    *last = 1.0;
    if (radius < 0.0 || room < 0.0) return 0;
    if (m->length2 <= CHIP_SWEPT_STILL) return 1;
    half = sqrt(room / m->length2);
    *first = t - half > 0.0 ? t - half : 0.0;
    *last = t + half < 1.0 ? t + half : 1.0;
    return *first <= *last;
}

/* Distance (mm) of a place from the move, seen from above. */
static inline double chip_swept_distance(const struct chip_swept *m, double x, double y)
{
    double off2, t = chip_swept_nearest(m, x, y, &off2), out = t < 0.0 ? t : t > 1.0 ? t - 1.0 : 0.0;
    return sqrt(off2 + out * out * m->length2);
}

/* Z of the tool's surface above a place at a share of the move. */
static inline double chip_swept_at(const struct chip_swept *m, const struct chip_tool *tool, double x, double y,
                                   double t)
{
    double u = x - m->x - t * m->dx, v = y - m->y - t * m->dy, r = sqrt(u * u + v * v);
    return m->z + t * m->dz + chip_tool_height(tool, r < tool->radius ? r : tool->radius);
}

/* The lowest Z of the tool's surface above a place on the whole move, to 1e-7 mm: what it leaves there; CHIP_SWEPT_NEVER out of its
 * reach. */
double chip_swept_height(const struct chip_swept *m, const struct chip_tool *tool, double x, double y);

#endif
