/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_clearance.c - see height_clearance.h. */
#include "core/chip_math.h"
#include "height_clearance.h"
#include "height_stamp.h"
#include "needles.h"
#include "swept.h"

#define SEARCH_STEPS 40 /* of a convex function, to a 1e-8 of the move */
#define GOLDEN 0.6180339887498949
#define AHEAD 1e-3 /* mm: less far ahead is beside the tool [4] */

struct traverse {
    struct chip_swept swept;
    const struct chip_tool *tool;
    struct chip_tool wide; /* [1] */
    double clearance;      /* mm */
    double lowest;         /* mm, Z of its lower end */
    int ahead;             /* only needles ahead of the axis count [4] */
    double nearest, at;    /* mm, and the share of the move */
};

/* Height of the wider tool over a place at a share of the move. */
static double over(const struct traverse *t, double x, double y, double share)
{
    return chip_swept_at(&t->swept, &t->wide, x, y, share);
}

/* The share from a to b where the wider tool is lowest over a place: it is a convex function there. */
static double lowest_share(const struct traverse *t, double x, double y, double near, double a, double b)
{
    int i;
    if (t->swept.dz == 0.0) return chip_max(a, chip_min(near, b));
    if (chip_tool_is_flat(t->tool)) return t->swept.dz < 0.0 ? b : a;
    for (i = 0; i < SEARCH_STEPS; i++) {
        double u = b - GOLDEN * (b - a), v = a + GOLDEN * (b - a);
        if (over(t, x, y, u) < over(t, x, y, v))
            b = v;
        else
            a = u;
    }
    return 0.5 * (a + b);
}

/* Distance (mm) between a place of stock and the tool at a share of the move; CHIP_CLEAR_NONE if the tip is above it there. */
static double distance_at(const struct traverse *t, double x, double y, double height, double share)
{
    double u = x - t->swept.x - share * t->swept.dx, v = y - t->swept.y - share * t->swept.dy;
    double above = height - t->swept.z - share * t->swept.dz;
    if (above <= 0.0) return CHIP_CLEAR_NONE;
    return chip_max(sqrt(u * u + v * v) - chip_tool_reach(t->tool, above), 0.0);
}

/* One needle [1]. */
static void meet(struct traverse *t, double x, double y, double height)
{
    double first, last, off2, near, share, best[3];
    int i;
    if (!chip_swept_within(&t->swept, x, y, t->wide.radius, &first, &last)) return;
    near = chip_swept_nearest(&t->swept, x, y, &off2);
    if (t->ahead && t->swept.dz >= 0.0) { /* [4] */
        if (near <= 0.0 || near * near * t->swept.length2 <= AHEAD * AHEAD) return;
        last = chip_min(last, near);
    }
    share = lowest_share(t, x, y, near, first, last);
    if (height <= over(t, x, y, share) + CHIP_CLEAR_LEVEL) return;
    best[0] = share;
    best[1] = chip_max(first, chip_min(near, last));
    best[2] = t->swept.dz < 0.0 ? last : first;
    for (i = 0; i < 3; i++) {
        double distance = distance_at(t, x, y, height, best[i]);
        if (distance >= t->nearest) continue;
        t->nearest = distance;
        t->at = best[i];
    }
}

/* The needles of a row of the map. */
static void meet_row(const struct chip_height_map *map, struct traverse *t, int row)
{
    const struct chip_swept *s = &t->swept;
    const float *height = map->height + (long)row * map->nx;
    double low = map->y0 + row * map->cell, high = low + map->cell, a = 0.0, b = 1.0, xa, xb, r = t->wide.radius;
    float least = (float)chip_max(t->lowest + CHIP_CLEAR_LEVEL, map->z_min + CHIP_HEIGHT_SKIN);
    int first, end, i;
    if (fabs(s->dy) > 1e-12) { /* the part of the move that is near the row */
        double u = (low - r - s->y) / s->dy, v = (high + r - s->y) / s->dy;
        a = chip_max(0.0, chip_min(1.0, chip_min(u, v)));
        b = chip_max(0.0, chip_min(1.0, chip_max(u, v)));
    }
    xa = s->x + chip_min(a * s->dx, b * s->dx) - r - map->x0 - map->shift_x[row];
    xb = s->x + chip_max(a * s->dx, b * s->dx) + r - map->x0 - map->shift_x[row];
    first = chip_stamp_clamp(floor(xa / map->cell), 0, map->nx);
    end = chip_stamp_clamp(ceil(xb / map->cell) + 1.0, 0, map->nx);
    for (i = first; i < end; i++)
        if (height[i] > least)
            meet(t, map->x0 + map->x[i] + map->shift_x[row], low + map->shift_y[i], (double)height[i]);
}

/* All needles, those of the cells and the single ones. */
static void meet_all(const struct chip_height_map *map, struct traverse *t)
{
    const struct chip_swept *s = &t->swept;
    double low = chip_min(s->y, s->y + s->dy) - t->wide.radius, high = chip_max(s->y, s->y + s->dy) + t->wide.radius;
    int row = chip_stamp_clamp(floor((low - map->y0) / map->cell) - 1.0, 0, map->ny);
    int end = chip_stamp_clamp(ceil((high - map->y0) / map->cell) + 1.0, 0, map->ny);
    int32_t strip, last, i;
    for (; row < end; row++) meet_row(map, t, row);
    if (!map->needles) return;
    strip = chip_needles_strip(map, low);
    last = chip_needles_strip(map, high);
    for (strip = strip > 0 ? strip : 0; strip <= last && strip < map->strips; strip++)
        for (i = chip_needles_from(map, strip, chip_min(s->x, s->x + s->dx) - t->wide.radius);
             i < map->strip[strip + 1]; i++)
            if ((double)map->needle_height[i] > map->z_min + CHIP_HEIGHT_SKIN)
                meet(t, map->needle_x[i], map->needle_y[i], (double)map->needle_height[i]);
}

static void set_clearance(struct traverse *t, double clearance)
{
    t->clearance = t->nearest = clearance;
    t->wide = *t->tool;
    chip_swept_widen(&t->wide, clearance);
}

double chip_clearance_of(const struct chip_height_map *map, const struct chip_tool *tool, double clearance,
                         const double a[3], const double b[3], int rule, double *at)
{
    struct traverse t = { .swept = chip_swept_of(a, b), .tool = tool, .lowest = chip_min(a[2], b[2]) };
    double flat = sqrt(t.swept.length2);
    *at = 1.0;
    if (t.lowest >= map->z_max - CHIP_CLEAR_LEVEL || (flat <= CHIP_CLEAR_ACROSS && b[2] >= a[2]))
        return CHIP_CLEAR_NONE; /* [2] */
    set_clearance(&t, clearance);
    t.ahead = rule == CHIP_CLEAR_AHEAD;
    if (flat <= CHIP_CLEAR_ACROSS) { /* straight down: where it ends [3] */
        t.swept = chip_swept_of(b, b);
        t.ahead = 0;
        t.at = 1.0;
    }
    if (t.ahead && b[2] - a[2] >= CHIP_CLEAR_STEEP * flat) { /* [5] */
        struct traverse begin = t;
        begin.swept = chip_swept_of(a, a);
        begin.ahead = 0;
        set_clearance(&begin, clearance + map->cell);
        meet_all(map, &begin);
        if (begin.nearest < begin.clearance) return CHIP_CLEAR_NONE;
    }
    meet_all(map, &t);
    *at = t.at;
    return t.nearest < clearance ? t.nearest : CHIP_CLEAR_NONE;
}

double chip_traverse_clearance(const struct chip_height_map *map, const struct chip_height_tool *tool, double clearance,
                               const double a[3], const double b[3])
{
    struct chip_tool profile;
    double at;
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0);
    return chip_clearance_of(map, &profile, clearance, a, b, CHIP_CLEAR_ALL, &at);
}
