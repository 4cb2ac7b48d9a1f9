/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_stamp.c - see height_stamp.h. Compiled for speed, without traps and errno: the loops over a row become
 * vectors. */
#include <string.h>

#include "core/chip_math.h"
#include "core/tool.h"
#include "height_stamp.h"

#define MARGIN_MOST 0.6 /* cells, at most added to a depth [4] */
#define STEADY 3.0      /* cells: a larger difference from needle to needle is a wall */

/* Wider vectors where the processor has them. */
#if defined(__x86_64__) && defined(__gnu_linux__)
#define CLONES __attribute__((target_clones("avx2", "default"))) static
#else
#define CLONES static
#endif

enum profile { FLAT, ROUND, ANY };

struct chip_stamp_shape chip_stamp_make_shape(const struct chip_height_tool *tool)
{
    struct chip_stamp_shape s;
    struct chip_tool profile;
    double inner = chip_max(tool->radius - CHIP_HEIGHT_SKIN, 0.0);
    s.reach2 = (float)((tool->radius + CHIP_HEIGHT_RIDGE) * (tool->radius + CHIP_HEIGHT_RIDGE));
    s.probe2 = (float)(inner * inner);
    chip_tool_set_profile(&profile, tool->radius, tool->corner, tool->slope > 0.0 ? atan(1.0 / tool->slope) : 0.0);
    s.corner = (float)tool->corner;
    s.corner2 = (float)(tool->corner * tool->corner);
    inner = chip_max(tool->corner - CHIP_HEIGHT_SKIN, 0.0);
    s.inner2 = (float)(inner * inner);
    s.slope = (float)tool->slope;
    s.r_flat = (float)profile.r_flat;
    s.r_arc = (float)profile.r_arc;
    s.arc_top = (float)profile.arc_top;
    s.skin = (float)(CHIP_HEIGHT_SKIN * sqrt(1.0 + tool->slope * tool->slope));
    return s;
}

/* Heights of the profile above the tip at the distance whose square is d2: the cutting and the probing one. */
static inline __attribute__((always_inline)) void profile_at(const struct chip_stamp_shape *s, enum profile kind,
                                                             float d2, float *cut, float *probe)
{
    float r, t, under, inner;
    if (kind == FLAT) {
        *cut = 0.0f;
        *probe = (float)CHIP_HEIGHT_SKIN;
        return;
    }
    if (kind == ROUND) {
        t = d2;
    } else {
        r = sqrtf(d2);
        t = r > s->r_flat ? r - s->r_flat : 0.0f;
        t *= t;
    }
    under = s->corner2 - t;
    under = under > 0.0f ? under : 0.0f;
    inner = s->inner2 - t;
    inner = inner > 0.0f ? inner : 0.0f;
    *cut = s->corner - sqrtf(under);
    *probe = s->corner - sqrtf(inner);
    if (kind == ANY && s->slope > 0.0f) {
        float cone = s->arc_top + s->slope * (r - s->r_arc);
        *cut = r > s->r_arc ? cone : *cut;
        *probe = (r > s->r_arc ? cone : *cut) + s->skin;
    }
    if (kind == ANY && s->corner <= (float)CHIP_HEIGHT_SKIN) *probe = *cut + s->skin;
}

/* One row of needles: cuts it, with the probing profile if `spare`; returns the sum of the removed heights, *top: the
 * highest needle met. */
static inline __attribute__((always_inline)) float cut_row(const struct chip_stamp_shape *s, enum profile kind,
                                                           int spare, int n, float *height, const float *x,
                                                           const float *y, float dx, float dy, float z, float floor,
                                                           float *top)
{
    float sum = 0.0f, highest = -3e38f, reach2 = spare ? s->probe2 : s->reach2;
    int i;
    for (i = 0; i < n; i++) {
        float u = x[i] + dx, v = y[i] + dy, d2 = u * u + v * v, cut, probe, old = height[i], low, seen;
        profile_at(s, kind, d2, &cut, &probe);
        low = z + (spare ? probe : cut);
        low = low > floor ? low : floor;
        low = d2 < reach2 ? low : 3e38f;
        low = low < old ? low : old;
        sum += old - low;
        height[i] = low;
        probe += z;
        probe = probe > floor ? probe : floor + (float)CHIP_HEIGHT_SKIN;
        probe = d2 < s->probe2 ? probe : 3e38f;
        seen = old > probe ? old : -3e38f;
        highest = seen > highest ? seen : highest;
    }
    *top = highest;
    return sum;
}

/* One stamp of the tool, which cuts with the probing profile if `spare`; keep: room for old heights, NULL: only the volume counts. */
static inline __attribute__((always_inline)) void cut_rows(const struct chip_height_map *map,
                                                           const struct chip_stamp_shape *s, enum profile kind,
                                                           int spare, double radius, const double tip[3],
                                                           float keep[2][CHIP_STAMP_ROW_MOST], struct chip_stamp *stamp)
{
    int row, end, first, last, side = 0;
    stamp->volume = 0.0;
    stamp->top = -3e38f;
    stamp->row = stamp->first = stamp->width = 0;
    stamp->old = 0;
    if (!chip_stamp_rows_within(map, tip[1], radius, &row, &end)) return;
    for (; row < end; row++) {
        float *height = map->height + (long)row * map->nx, top;
        int width;
        if (!chip_stamp_columns_within(map, row, tip[0], tip[1], radius, &first, &last)) continue;
        width = last - first;
        if (keep && width <= CHIP_STAMP_ROW_MOST) memcpy(keep[side], height + first, sizeof(float) * (unsigned)width);
        last = first + ((width + 7) & ~7); /* whole vectors */
        if (last > map->nx) last = map->nx;
        stamp->volume += cut_row(s, kind, spare, last - first, height + first, map->x + first, map->shift_y + first,
                                 (float)(map->x0 + map->shift_x[row] - tip[0]),
                                 (float)(map->y0 + row * map->cell - tip[1]), (float)tip[2], (float)map->z_min, &top);
        if (keep && top > stamp->top) {
            stamp->top = top;
            stamp->row = row;
            stamp->first = first;
            stamp->width = width <= CHIP_STAMP_ROW_MOST ? width : 0;
            stamp->old = keep[side];
            side = !side;
        }
    }
}

/* Whether a stamp with the probing profile would cut or meet anything: the same comparisons, nothing is changed. */
static inline __attribute__((always_inline)) int meets_rows(const struct chip_height_map *map,
                                                            const struct chip_stamp_shape *s, enum profile kind,
                                                            double radius, const double tip[3])
{
    float z = (float)tip[2], floor = (float)map->z_min;
    int row, end, first, last, i;
    if (!chip_stamp_rows_within(map, tip[1], radius, &row, &end)) return 0;
    for (; row < end; row++) {
        const float *height = map->height + (long)row * map->nx;
        float dx = (float)(map->x0 + map->shift_x[row] - tip[0]), dy = (float)(map->y0 + row * map->cell - tip[1]);
        int any = 0;
        if (!chip_stamp_columns_within(map, row, tip[0], tip[1], radius, &first, &last)) continue;
        for (i = first; i < last; i++) {
            float u = map->x[i] + dx, v = map->shift_y[i] + dy, d2 = u * u + v * v, cut, low;
            profile_at(s, kind, d2, &cut, &low);
            low += z;
            low = low > floor ? low : floor;
            any |= d2 < s->probe2 && height[i] > low;
        }
        if (any) return 1;
    }
    return 0;
}

/* A stamp of one kind, for each of the vectors. */
#define STAMP(name, kind, spare)                                                                                       \
    CLONES void name(const struct chip_height_map *map, const struct chip_stamp_shape *s, double radius,               \
                     const double tip[3], float keep[2][CHIP_STAMP_ROW_MOST], struct chip_stamp *stamp)                \
    {                                                                                                                  \
        cut_rows(map, s, kind, spare, radius, tip, keep, stamp);                                                       \
    }

STAMP(cut_flat, FLAT, 0)
STAMP(cut_round, ROUND, 0)
STAMP(cut_any, ANY, 0)
/* The same with the smaller shape [3]. */
STAMP(spare_flat, FLAT, 1)
STAMP(spare_round, ROUND, 1)
STAMP(spare_any, ANY, 1)

#define MEETS(name, kind)                                                                                              \
    CLONES int name(const struct chip_height_map *map, const struct chip_stamp_shape *s, double radius,                \
                    const double tip[3])                                                                               \
    {                                                                                                                  \
        return meets_rows(map, s, kind, radius, tip);                                                                  \
    }

MEETS(meets_flat, FLAT)
MEETS(meets_round, ROUND)
MEETS(meets_any, ANY)

struct chip_stamp_kind chip_stamp_of(const struct chip_height_tool *tool)
{
    static const struct chip_stamp_kind flat = { cut_flat, spare_flat, meets_flat },
                                        round = { cut_round, spare_round, meets_round },
                                        any = { cut_any, spare_any, meets_any };
    if (tool->slope <= 0.0 && tool->corner <= 0.0) return flat;
    return tool->slope <= 0.0 && tool->corner >= tool->radius ? round : any;
}

double chip_stamp_margin(const struct chip_height_map *map, const struct chip_stamp *stamp)
{
    double rise = 0.0;
    int i, j, k;
    if (!stamp->width) return MARGIN_MOST * map->cell;
    for (i = 0; i < stamp->width; i++) {
        if (stamp->old[i] != stamp->top) continue;
        for (j = stamp->row - 1; j <= stamp->row + 1; j++)
            for (k = stamp->first + i - 1; k <= stamp->first + i + 1; k++) {
                int own = j == stamp->row && k >= stamp->first && k < stamp->first + stamp->width;
                double more;
                if (j < 0 || j >= map->ny || k < 0 || k >= map->nx) continue;
                more = fabs((own ? stamp->old[k - stamp->first] : map->height[(long)j * map->nx + k])
                            - (double)stamp->top);
                if (more <= STEADY * map->cell) rise = chip_max(rise, more);
            }
    }
    return chip_min(rise, MARGIN_MOST * map->cell);
}
