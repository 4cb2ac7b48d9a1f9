/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_level.c - cells below a round end that moves level, or falls towards them: most of what such a tool cuts in a
 * period. See sweep_segment.h and sweep.h; the numbers in brackets are those of its principle.
 *
 * The height over a point depends on its distance from the segment alone, or on that from its end. The four points of a cell are computed in
 * pairs, and the cases that need more are left to sweep_row.c: the results are the same bit for bit. */
#include "pair.h"
#include "sweep_segment.h"

/* Height over two points at the distance^2 r2 from the axis, the distance^2 of the cell's middle is in one zone. */
static CHIP_INLINE pair arc_height_of(const struct chip_sweep_segment *segment, const struct chip_tool *tool, pair r2)
{
    if (tool->r_flat > 0.0) {
        pair r = pair_root(r2) - tool->r_flat;
        r2 = r * r;
    }
    return segment->z + segment->dz + (tool->corner - pair_root(tool->corner * tool->corner - r2));
}

static CHIP_INLINE pair cone_height_of(const struct chip_sweep_segment *segment, const struct chip_tool *tool, pair r2)
{
    return segment->z + segment->dz + (tool->arc_top + tool->slope * (pair_root(r2) - tool->r_arc));
}

/* Cuts a cell that was cut before, as a whole, to the height z [3]. */
static CHIP_INLINE double cut_plain(const struct chip_stock *stock, struct chip_cell *cell, double z)
{
    double before = (double)cell->top - stock->z_min, after;
    if (z < stock->z_min) z = stock->z_min;
    if (z >= (double)cell->top) return 0.0;
    cell->top = (float)z;
    after = (double)cell->top - stock->z_min;
    return (before - (after > 0.0 ? after : 0.0)) * stock->cell * stock->cell;
}

struct level_row {         /* what the cells of a row share; mm from the segment's start */
    double y;              /* of the row's middle */
    double y_low, y_high;  /* of the points */
    double low2, high2;    /* mm2, squared distance in Y of the points from the end of the segment */
    double last_x, last_y; /* from the middle, and along the segment: the point that comes before the end last */
    double from2, inside2; /* mm2: the cells between belong to this file */
    pair steps;            /* of the points in X, from the middle */
};

static CHIP_INLINE struct level_row level_row_at(const struct chip_sweep_segment *segment,
                                                 const struct chip_stock *stock, double y)
{
    double step = stock->cell * CHIP_GAUSS_STEP;
    struct level_row row = { .y = y, .y_low = y - step, .y_high = y + step, .steps = { -step, step } };
    row.low2 = (row.y_low - segment->dy) * (row.y_low - segment->dy);
    row.high2 = (row.y_high - segment->dy) * (row.y_high - segment->dy);
    row.last_x = segment->dx > 0.0 ? -step : step;
    row.last_y = (segment->dy > 0.0 ? row.y_low : row.y_high) * segment->dy;
    row.from2 = segment->floor2;
    row.inside2 = chip_min(segment->inner2, segment->outer2);
    return row;
}

/* Whether all four points of a cell are beyond the end of the segment: the one that comes last is. */
static CHIP_INLINE int is_beyond(const struct chip_sweep_segment *segment, const struct level_row *row, double px)
{
    return ((px + row->last_x) * segment->dx + row->last_y) * segment->per_length2 >= 1.0;
}

/* Squared distance of the middle of a cell from the segment, mm2. */
static CHIP_INLINE double middle_distance2(const struct chip_sweep_segment *segment, const struct level_row *row,
                                           double px, int beyond)
{
    return axis_distance2(segment, px, row->y, beyond ? 1.0 : nearest_on(segment, px, row->y));
}

/* The same of the four points, which may be anywhere beside the segment. */
static __attribute__((noinline)) void points_beside(const struct chip_sweep_segment *segment,
                                                    const struct level_row *row, double px, pair r2[2])
{
    int i;
    for (i = 0; i < 2; i++) {
        double qx = px + row->steps[i];
        r2[0][i] = axis_distance2(segment, qx, row->y_low, nearest_on(segment, qx, row->y_low));
        r2[1][i] = axis_distance2(segment, qx, row->y_high, nearest_on(segment, qx, row->y_high));
    }
}

/* Heights over four points of which some are below another part of the profile. */
static __attribute__((noinline)) void mixed_heights(const struct chip_sweep_segment *segment,
                                                    const struct chip_tool *tool, pair z[2])
{
    int i;
    for (i = 0; i < 4; i++) z[i >> 1][i & 1] = segment->z + segment->dz + profile(tool, z[i >> 1][i & 1]);
}

/* Heights over the four points of a cell: two with the lower Y, two with the higher one. */
static CHIP_INLINE void level_heights(const struct chip_sweep_segment *segment, const struct chip_tool *tool,
                                      const struct level_row *row, double px, int beyond, double middle2, pair z[2])
{
    pair low, high;
    if (beyond) {
        pair ex = px + row->steps - segment->dx, ex2 = ex * ex;
        low = ex2 + row->low2;
        high = ex2 + row->high2;
    } else {
        pair r2[2];
        points_beside(segment, row, px, r2);
        low = r2[0];
        high = r2[1];
    }
    if (middle2 >= segment->arc_from2 && middle2 < segment->arc_to2) {
        low = arc_height_of(segment, tool, low);
        high = arc_height_of(segment, tool, high);
    } else if (middle2 >= segment->cone_from2 && middle2 < segment->cone_to2) {
        low = cone_height_of(segment, tool, low);
        high = cone_height_of(segment, tool, high);
    } else {
        pair mixed[2] = { low, high };
        mixed_heights(segment, tool, mixed);
        low = mixed[0];
        high = mixed[1];
    }
    z[0] = low;
    z[1] = high;
}

int chip_sweep_level(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                     const struct chip_tool *tool, struct chip_cell *cells, int ix, int last, double x0, double y,
                     long bound, double *removed)
{
    const struct level_row row = level_row_at(segment, stock, y);
    const float top = (float)stock->z_max;
    long work = *segment->work;
    double sum = *removed;

    for (; ix <= last && work < bound; ix++) {
        struct chip_cell *cell = cells + ix;
        double px = x0 + ix * stock->cell, middle2;
        pair z[2];
        int beyond;
        if (segment->bottom >= cell->top) {
            work += 2;
            continue;
        }
        beyond = is_beyond(segment, &row, px);
        if (!beyond && segment->dz < 0.0) break;
        middle2 = middle_distance2(segment, &row, px, beyond);
        if (!(middle2 > row.from2 && middle2 < row.inside2)) break;
        level_heights(segment, tool, &row, px, beyond, middle2, z);
        work += 2 + CHIP_WORK_CURVED;
        if (is_slope(cell, top) && !cell->cut) {
            sum += cut_plain(stock, cell, 0.25 * (z[0][0] + z[0][1] + z[1][0] + z[1][1]));
        } else {
            const double height[4] = { z[0][0], z[0][1], z[1][0], z[1][1] };
            *segment->work = work;
            sum += chip_sweep_curved(segment, stock, cell, height);
            work = *segment->work;
        }
    }
    *segment->work = work;
    *removed = sum;
    return ix;
}
