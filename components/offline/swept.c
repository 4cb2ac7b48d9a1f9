/* SPDX-License-Identifier: GPL-2.0-or-later */
/* swept.c - see swept.h: the lowest height over a place. It is convex along the move: from anywhere it falls by less than its slope there
 * over the rest of the range, which ends the search. */
#include "core/chip_math.h"
#include "swept.h"

#define CHIP_SWEPT_STEPS 60   /* of the search at most; every other one halves the range */
#define CHIP_SWEPT_EXACT 1e-7 /* mm of height that it leaves at most */

/* How fast the height over a place rises with the share, mm. */
static double rise_rate(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double t)
{
    double u = x - m->x - t * m->dx, v = y - m->y - t * m->dy, r = sqrt(u * u + v * v);
    if (r < 1e-12) return m->dz;
    return m->dz - chip_tool_slope(tool, chip_min(r, tool->radius)) * (u * m->dx + v * m->dy) / r;
}

/* Share first .. last where a rotating tool that is not flat, on a ramp, is lowest over a place; nearest, off2: as of chip_swept_nearest. */
static double lowest(const struct chip_swept *m, const struct chip_tool *tool, double x, double y, double nearest,
                     double off2, double first, double last)
{
    double length = sqrt(m->length2), at_first, at_last;
    double far = chip_tool_as_steep(tool, sqrt(off2), fabs(m->dz) / length) / length;
    double t = m->dz < 0.0 ? nearest + far : nearest - far;
    int i;
    if (tool->corner >= tool->radius) return chip_clamp(t, first, last); /* a ball: there it is */
    at_first = rise_rate(m, tool, x, y, first);
    at_last = rise_rate(m, tool, x, y, last);
    if (at_first >= 0.0) return first;
    if (at_last <= 0.0) return last;
    if (!(t > first && t < last)) t = 0.5 * (first + last);
    for (i = 1; i <= CHIP_SWEPT_STEPS; i++) {
        double rate = rise_rate(m, tool, x, y, t), rest = rate > 0.0 ? t - first : last - t;
        if (fabs(rate) * rest <= CHIP_SWEPT_EXACT) break;
        if (rate > 0.0) {
            last = t;
            at_last = rate;
        } else {
            first = t;
            at_first = rate;
        }
        t = i & 1 ? first - at_first * (last - first) / (at_last - at_first) : 0.5 * (first + last);
    }
    return t;
}

double chip_swept_height(const struct chip_swept *m, const struct chip_tool *tool, double x, double y)
{
    double first, last, off2, t;
    if (!chip_swept_within(m, x, y, tool->radius, &first, &last)) return CHIP_SWEPT_NEVER;
    if (m->length2 <= CHIP_SWEPT_STILL || chip_tool_is_flat(tool))
        return chip_swept_at(m, tool, x, y, m->dz < 0.0 ? last : first);
    t = chip_swept_nearest(m, x, y, &off2);
    if (m->dz != 0.0) return chip_swept_at(m, tool, x, y, lowest(m, tool, x, y, t, off2, first, last));
    return chip_swept_at(m, tool, x, y, t < first ? first : t > last ? last : t);
}
