/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_lowest.c - how high a segment leaves a point of the stock: the lowest tool surface over it. See sweep_segment.h and
 * sweep.h; the numbers in brackets are those of its principle.
 *
 * The height over a point is convex in t (a convex profile of a distance that is convex in t, plus a straight slope). So
 * it is lowest at an end of the part of the segment whose disc covers the point, or between, where it stops to fall. From
 * any place between it falls on by less than its slope there over the rest of the range: that ends the search [3]. */
#include "sweep_segment.h"

#define CHIP_MAX_STEPS 48    /* of the search; from the second on, every other one halves the range */
#define CHIP_WORK_LOWEST 12  /* of the lowest tool surface over a point */
#define CHIP_WORK_ENDS 6     /* more if both ends are looked at */
#define CHIP_WORK_SEARCH 8   /* more if it is searched */
#define CHIP_WORK_STEP 8     /* and of each step of the search */
#define CHIP_LOWEST_END 2e-5 /* mm of height that the search leaves at most */

static double height_at(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double px, double py,
                        double t)
{
    return segment->z + t * segment->dz + profile(tool, axis_distance2(segment, px, py, t));
}

/* The part [lo, hi] of the segment, and of its line before it [4], in which the tool's disc covers the point; 0 if none. */
static int covering(const struct chip_sweep_segment *segment, double radius, double px, double py, double *lo,
                    double *hi)
{
    double along = px * segment->dx + py * segment->dy;
    double off2 = px * px + py * py - radius * radius;
    double root;
    *lo = segment->earliest;
    *hi = 1.0;
    if (segment->length2 <= 0.0) return off2 <= 0.0;
    root = along * along - segment->length2 * off2;
    if (root < 0.0) return 0;
    root = chip_sqrt(root);
    *lo = chip_max(segment->earliest, (along - root) * segment->per_length2);
    *hi = chip_min(1.0, (along + root) * segment->per_length2);
    return *lo <= *hi;
}

/* How fast the height over a point rises with t, mm. */
static double rise_rate(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double px, double py,
                        double t)
{
    double r = chip_sqrt(axis_distance2(segment, px, py, t));
    double outward = t * segment->length2 - px * segment->dx - py * segment->dy;
    if (r < 1e-12) return segment->dz;
    return segment->dz + chip_tool_slope(tool, chip_min(r, tool->radius)) * outward / r;
}

struct range { /* of t: the height falls at lo and rises at hi */
    double lo, hi;
    double rate_lo, rate_hi; /* mm per t */
};

/* Makes a range smaller: over the flat of the end the height changes by the segment's slope only. */
static void leave_out_flat(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double nearest,
                           double aside2, struct range *range)
{
    double half = tool->r_flat * tool->r_flat - aside2;
    if (!(half > 0.0)) return;
    half = chip_sqrt(half * segment->per_length2);
    if (segment->dz < 0.0 && nearest + half > range->lo) {
        range->lo = nearest + half;
        range->rate_lo = segment->dz;
    } else if (segment->dz > 0.0 && nearest - half < range->hi) {
        range->hi = nearest - half;
        range->rate_hi = segment->dz;
    }
}

/* Lowest height over a point within a range. Chords of the slope come near the place soon, halvings between them bound the
 * steps where it is next to vertical. */
static double lowest_within(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double px,
                            double py, struct range *range)
{
    double nearest = (px * segment->dx + py * segment->dy) * segment->per_length2;
    double aside2 = axis_distance2(segment, px, py, nearest), t, rest;
    double far = chip_tool_as_steep(tool, chip_sqrt(aside2), fabs(segment->dz) / segment->length) / segment->length;
    int i;
    leave_out_flat(segment, tool, nearest, aside2, range);
    t = segment->dz < 0.0 ? nearest + far : nearest - far;
    if (!(t > range->lo && t < range->hi)) t = 0.5 * (range->lo + range->hi);
    for (i = 1; i <= CHIP_MAX_STEPS; i++) {
        double rate = rise_rate(segment, tool, px, py, t);
        if (rate > 0.0) {
            rest = t - range->lo;
            range->hi = t;
            range->rate_hi = rate;
        } else {
            rest = range->hi - t;
            range->lo = t;
            range->rate_lo = rate;
        }
        CHIP_FAULT(LOWEST_TOO_SOON, break);
        if (fabs(rate) * rest <= CHIP_LOWEST_END) break;
        t = i & 1 ? range->lo - range->rate_lo * (range->hi - range->lo) / (range->rate_hi - range->rate_lo)
                  : 0.5 * (range->lo + range->hi);
    }
    *segment->work += CHIP_WORK_SEARCH + CHIP_WORK_STEP * i;
    return height_at(segment, tool, px, py, t);
}

double chip_sweep_lowest(const struct chip_sweep_segment *segment, const struct chip_tool *tool, double px, double py,
                         double nearest)
{
    struct range range;
    *segment->work += CHIP_WORK_LOWEST;
    if (segment->dz == 0.0) return height_at(segment, tool, px, py, nearest);
    if (segment->dz < 0.0 && axis_distance2(segment, px, py, 1.0) <= tool->r_flat * tool->r_flat)
        return segment->z + segment->dz; /* nothing is lower than the end of the segment */
    if (!covering(segment, tool->radius, px, py, &range.lo, &range.hi))
        return height_at(segment, tool, px, py, nearest);
    if (chip_tool_is_flat(tool) || segment->length2 <= 0.0)
        return height_at(segment, tool, px, py, segment->dz < 0.0 ? range.hi : range.lo);
    *segment->work += CHIP_WORK_ENDS;
    range.rate_hi = rise_rate(segment, tool, px, py, range.hi);
    if (!(range.rate_hi > 0.0)) return height_at(segment, tool, px, py, range.hi);
    range.rate_lo = rise_rate(segment, tool, px, py, range.lo);
    if (range.rate_lo > 0.0) return height_at(segment, tool, px, py, range.lo);
    return lowest_within(segment, tool, px, py, &range);
}
