/* SPDX-License-Identifier: GPL-2.0-or-later */
/* height_stamp.h - what a tool at one position cuts and meets in a height map: a stamp.
 *
 * Who calls it: height_sweep.c, whose header has the principle; numbers in brackets are those there.
 */
#ifndef CHIPWISE_HEIGHT_STAMP_H
#define CHIPWISE_HEIGHT_STAMP_H

#include "core/chip_math.h"
#include "height_sweep.h"

#define CHIP_STAMP_ROW_MOST 4096 /* cells of a row whose old heights are kept for [4] */

/* A tool's profile, as the loop over needles needs it. */
struct chip_stamp_shape {
    float reach2, probe2; /* mm2, squares of the radius that cuts and the one that probes */
    float r_flat, corner, corner2, inner2, r_arc, arc_top, slope, skin;
};

/* What a stamp has cut and met. */
struct chip_stamp {
    double volume;         /* sum of heights, not yet times the cell's area */
    float top;             /* highest needle met */
    int row, first, width; /* where, and which needles `old` holds */
    const float *old;
};

/* One stamp of the tool, whose radius is `radius` (mm), at `tip`; keep: room for old heights, NULL: only the volume counts. */
typedef void (*chip_stamp_function)(const struct chip_height_map *map, const struct chip_stamp_shape *s, double radius,
                                    const double tip[3], float keep[2][CHIP_STAMP_ROW_MOST], struct chip_stamp *stamp);

struct chip_stamp_shape chip_stamp_make_shape(const struct chip_height_tool *tool);

/* Of a tool's kind: the stamp of the whole tool, that of the smaller shape [3], and whether the latter would cut or meet anything. */
struct chip_stamp_kind {
    chip_stamp_function cut, spare;
    int (*meets)(const struct chip_height_map *map, const struct chip_stamp_shape *s, double radius,
                 const double tip[3]);
};
struct chip_stamp_kind chip_stamp_of(const struct chip_height_tool *tool);

/* How much the stock rises steadily from the highest needle a stamp has met to those beside it [4], mm. */
double chip_stamp_margin(const struct chip_height_map *map, const struct chip_stamp *stamp);

static inline int chip_stamp_clamp(double v, int low, int high) { return v < low ? low : v > high ? high : (int)v; }

/* The rows from *first to before *end that may have needles within `radius` of y; the columns of one that may have some within `radius` of
 * (x, y). Return 0 if there are none. */
static inline int chip_stamp_rows_within(const struct chip_height_map *map, double y, double radius, int *first,
                                         int *end)
{
    *first = chip_stamp_clamp(floor((y - radius - map->y0) / map->cell) - 1.0, 0, map->ny);
    *end = chip_stamp_clamp(ceil((y + radius - map->y0) / map->cell) + 1.0, 0, map->ny);
    return *first < *end;
}

static inline int chip_stamp_columns_within(const struct chip_height_map *map, int row, double x, double y,
                                            double radius, int *first, int *end)
{
    double below = y - (map->y0 + row * map->cell), off = below < 0.0 ? -below : chip_max(below - map->cell, 0.0), half;
    if (off >= radius) return 0;
    half = sqrt(radius * radius - off * off);
    *first = chip_stamp_clamp(floor((x - half - map->x0 - map->shift_x[row]) / map->cell), 0, map->nx);
    *end = chip_stamp_clamp(ceil((x + half - map->x0 - map->shift_x[row]) / map->cell) + 1.0, 0, map->nx);
    return *first < *end;
}

#endif
