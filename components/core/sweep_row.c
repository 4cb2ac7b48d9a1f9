/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep_row.c - the cells of one row that a segment cuts: see sweep_segment.h and sweep.h; the numbers in brackets are
 * those of its principle. */
#include "sweep_segment.h"

#define CHIP_ROWS_AHEAD 3 /* rows between the one that is cut and the one that is prefetched */
#define CHIP_WORK_RIM 20  /* more, if it is on the stock's rim too */

/* A cell under a tool that is not flat: four points of it. */
static double cut_curved(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                         const struct chip_tool *tool, struct chip_cell *cell, double px, double py)
{
    double step = stock->cell * CHIP_GAUSS_STEP, z[4];
    int i;
    *segment->work += CHIP_WORK_CURVED;
    for (i = 0; i < 4; i++) {
        double qx = px + (i & 1 ? step : -step), qy = py + (i & 2 ? step : -step);
        double t = nearest_on(segment, qx, qy);
        if (segment->dz == 0.0)
            z[i] = segment->z + profile(tool, axis_distance2(segment, qx, qy, t));
        else
            z[i] = chip_sweep_lowest(segment, tool, qx, qy, t);
    }
    return chip_sweep_curved(segment, stock, cell, z);
}

/* A cell on the outline of the sweep: the share inside, at the height of the middle of that
 * share. */
static double cut_edge(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                       const struct chip_tool *tool, struct chip_cell *cell, double px, double py, double t,
                       double distance)
{
    double ex = (px - t * segment->dx) / distance, ey = (py - t * segment->dy) / distance;
    double k = chip_cell_covered((distance - tool->radius) / stock->cell, ex, ey);
    double inward;
    *segment->work += CHIP_WORK_EDGE;
    if (cell->drop & CHIP_RIM) {
        *segment->work += CHIP_WORK_RIM;
        k = chip_rim_covered(stock, cell, segment->x + px, segment->y + py, k, ex, ey);
    }
    if (k <= 0.0) return 0.0;
    if (segment->flat_end)
        return chip_cell_cut(stock, cell, k, segment->flat ? segment->z : chip_sweep_lowest(segment, tool, px, py, t));
    if (k >= 1.0) return cut_curved(segment, stock, tool, cell, px, py);
    inward = distance - chip_max(tool->radius - 0.5 * k * stock->cell, 0.0);
    return chip_cell_cut(stock, cell, k, chip_sweep_lowest(segment, tool, px - inward * ex, py - inward * ey, t));
}

/* A cell well below a flat end, or below the flat part of one, that is at height z. */
static CHIP_INLINE double cut_inside(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                                     struct chip_cell *cell, double z)
{
    double removed;
    if (cell->cut) return chip_cell_cut(stock, cell, 1.0, z);
    if (z < stock->z_min) z = stock->z_min;
    removed = (double)cell->top - z;
    if (removed <= 0.0) return 0.0;
    cell->top = (float)z;
    return removed * segment->cell_area;
}

/* [4] Whether the height over all four points of a cell rises from the start on: the tool moves away from it faster than it falls. The
 * profile gets steeper outwards. */
static int only_rises(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                      const struct chip_tool *tool, double px, double py)
{
    double reach = CHIP_GAUSS_REACH * stock->cell, r;
    double outward = -px * segment->dx - py * segment->dy - reach * segment->length;
    if (outward <= 0.0) return 0;
    r = chip_sqrt(px * px + py * py);
    if (r - reach <= tool->r_flat || r + reach >= tool->radius) return 0;
    CHIP_FAULT(BACK_LEFT, return 1);
    return segment->dz * (r + reach) + chip_tool_slope(tool, r - reach) * outward > 0.0;
}

/* One cell; its centre is (px, py) from the segment's start. */
static CHIP_INLINE double cut_cell(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                                   const struct chip_tool *tool, struct chip_cell *cell, double px, double py)
{
    double t, distance2;
    if (segment->bottom >= cell->top) return 0.0;
    if (segment->dz <= 0.0 && axis_distance2(segment, px, py, 1.0) <= segment->floor2)
        return cut_inside(segment, stock, cell, segment->z + segment->dz);
    if (segment->back_is_cut && only_rises(segment, stock, tool, px, py)) return 0.0;
    t = nearest_on(segment, px, py);
    distance2 = axis_distance2(segment, px, py, t);
    if (distance2 >= segment->outer2) return 0.0;
    if (distance2 > segment->inner2)
        return cut_edge(segment, stock, tool, cell, px, py, t, chip_max(chip_sqrt(distance2), 1e-9));
    if (distance2 <= segment->floor2 && (segment->flat_end || segment->dz == 0.0))
        return cut_inside(segment, stock, cell,
                          segment->dz == 0.0 ? segment->z : chip_sweep_lowest(segment, tool, px, py, t));
    return cut_curved(segment, stock, tool, cell, px, py);
}

/* Widens [lo, hi] by the part of the row y inside the disc round (cx, cy). */
static void widen_disc(double cx, double cy, double radius, double y, double *lo, double *hi)
{
    double d2 = radius * radius - (y - cy) * (y - cy);
    if (d2 < 0.0) return;
    d2 = chip_sqrt(d2);
    *lo = chip_min(*lo, cx - d2);
    *hi = chip_max(*hi, cx + d2);
}

/* Widens [lo, hi] by the point at which the row y crosses the straight side of the capsule. */
static void widen_side(double x, double y0, double dx, double dy, double y, double *lo, double *hi)
{
    double t;
    if (dy == 0.0) return;
    t = (y - y0) / dy;
    if (t < 0.0 || t > 1.0) return;
    *lo = chip_min(*lo, x + t * dx);
    *hi = chip_max(*hi, x + t * dx);
}

/* Removes from [lo, hi] what lies behind the segment's start: there the segment does not come nearer than the
 * one before did [4]. Cells of a curved end are read at four points, some of them before their middle. */
static void drop_behind(const struct chip_sweep_segment *segment, const struct chip_stock *stock, double y, double *lo,
                        double *hi)
{
    double keep =
        (segment->flat_end ? 0.0 : CHIP_GAUSS_REACH * stock->cell * segment->length) + (y - segment->y) * segment->dy;
    if (segment->dx > 0.0)
        *lo = chip_max(*lo, segment->x - keep / segment->dx);
    else if (segment->dx < 0.0)
        *hi = chip_min(*hi, segment->x - keep / segment->dx);
    else if (keep < 0.0)
        *hi = *lo - 1.0;
}

/* Columns of a row that the capsule, a margin wider, touches; empty: first > last [1]. */
static struct chip_span row_span(const struct chip_sweep_segment *segment, const struct chip_stock *stock, int iy)
{
    double y = stock->y0 + (iy + 0.5) * stock->cell;
    double radius = segment->reach + segment->margin;
    double lo = 1e300, hi = -1e300;
    struct chip_span span = { 0, -1 };

    widen_disc(segment->x, segment->y, radius, y, &lo, &hi);
    widen_disc(segment->x + segment->dx, segment->y + segment->dy, radius, y, &lo, &hi);
    if (segment->length > 0.0) {
        double ox = -segment->dy / segment->length * radius, oy = segment->dx / segment->length * radius;
        widen_side(segment->x + ox, segment->y + oy, segment->dx, segment->dy, y, &lo, &hi);
        widen_side(segment->x - ox, segment->y - oy, segment->dx, segment->dy, y, &lo, &hi);
    }
    if (segment->skip_back) drop_behind(segment, stock, y, &lo, &hi);
    if (lo > hi) return span;
    lo = floor((lo - stock->x0) / stock->cell);
    hi = floor((hi - stock->x0) / stock->cell);
    span.first = (int)chip_clamp(lo, 0.0, stock->nx);
    span.last = (int)chip_clamp(hi, -1.0, stock->nx - 1.0);
    return span;
}

/* Columns of the row well inside the flat part of the end at (x, y); empty: first > last. */
static struct chip_span row_floor(const struct chip_sweep_segment *segment, const struct chip_stock *stock, double x,
                                  double y, int iy)
{
    double row = stock->y0 + (iy + 0.5) * stock->cell - y, half = segment->floor2 - row * row;
    struct chip_span span = { 1, 0 };

    if (!(half > 0.0)) return span;
    half = chip_sqrt(half);
    x -= stock->x0;
    span.first = (int)chip_clamp(ceil((x - half) / stock->cell - 0.5), -1.0, stock->nx);
    span.last = (int)chip_clamp(floor((x + half) / stock->cell - 0.5), -1.0, stock->nx);
    return span;
}

/* Cells below the flat part of the end at the end of a segment that does not rise: nothing of
 * the segment is lower. */
static double cut_floor(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                        struct chip_cell *cell, int count, int dry)
{
    double z = chip_max(segment->z + segment->dz, stock->z_min), sum = 0.0, walls = 0.0;
    float low = segment->bottom;
    for (; count > 0; count--, cell++) {
        struct chip_cell copy;
        if (low >= cell->top) continue;
        if (cell->cut) {
            copy = *cell;
            walls += chip_cell_cut(stock, dry ? &copy : cell, 1.0, z);
            continue;
        }
        sum += (double)cell->top - z;
        if (!dry) cell->top = (float)z;
    }
    return sum * segment->cell_area + walls;
}

/* Prefetches the cells of a row CHIP_ROWS_AHEAD further on: each row
 * of a large map lies in cache lines and pages of its own, and the front crosses all of them. */
static CHIP_INLINE void fetch_row(const struct chip_cell *row, const struct chip_stock *stock, int first, int last)
{
    const struct chip_cell *ahead = row + CHIP_ROWS_AHEAD * (long)(stock->nx + 2);
    __builtin_prefetch(ahead + first, 1);
    __builtin_prefetch(ahead + last, 1);
}

/* The last column of those from ix to `last` that comes before the columns of `other`, behind which ix is not. */
static CHIP_INLINE int before(struct chip_span other, int last, int ix)
{
    return other.first > ix && other.first <= last && other.last >= other.first ? other.first - 1 : last;
}

/* Cuts one row of a segment, or copies of its cells (`dry`), from a column on; returns the volume in mm3.
 * `*column` is where to continue: beyond the row if it is done, otherwise the bound
 * on the work was reached [2]. */
double chip_sweep_row(const struct chip_sweep_segment *segment, const struct chip_stock *stock,
                      const struct chip_tool *tool, int iy, int dry, int *column, long bound)
{
    struct chip_span span = row_span(segment, stock, iy), none = { 1, 0 };
    struct chip_span skip = segment->skip_disc ? row_floor(segment, stock, segment->x, segment->y, iy) : none;
    struct chip_span floor_span =
        segment->dz <= 0.0 ? row_floor(segment, stock, segment->x + segment->dx, segment->y + segment->dy, iy) : none;
    double y = stock->y0 + (iy + 0.5) * stock->cell - segment->y;
    double x0 = stock->x0 + 0.5 * stock->cell - segment->x, removed = 0.0;
    struct chip_cell *row = chip_stock_cell(stock, 0, iy), copy;
    int ix = span.first > *column ? span.first : *column;

    fetch_row(row, stock, ix >= skip.first && ix <= skip.last ? skip.last + 1 : ix, span.last);
    while (ix <= span.last && *segment->work < bound) {
        if (ix >= skip.first && ix <= skip.last) {
            ix = skip.last + 1;
        } else if (ix >= floor_span.first && ix <= floor_span.last) {
            long count = (floor_span.last < span.last ? floor_span.last : span.last) - ix + 1;
            if (skip.first > ix && skip.first - ix < count) count = skip.first - ix;
            if (count > bound - *segment->work) count = bound - *segment->work;
            removed += cut_floor(segment, stock, row + ix, (int)count, dry);
            *segment->work += count;
            ix += (int)count;
        } else {
            if (segment->round_not_up && !dry) {
                int next =
                    chip_sweep_level(segment, stock, tool, row, ix, before(skip, before(floor_span, span.last, ix), ix),
                                     x0, y, bound, &removed);
                if (next > ix) {
                    ix = next;
                    continue;
                }
            }
            copy = row[ix];
            removed += cut_cell(segment, stock, tool, dry ? &copy : &row[ix], x0 + ix * stock->cell, y);
            *segment->work += 2;
            ix++;
        }
    }
    *segment->work += CHIP_WORK_ROW;
    *column = ix > span.last ? CHIP_ROW_DONE : ix;
    return removed;
}
