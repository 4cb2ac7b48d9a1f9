/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep.c - see sweep.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "sweep.h"

#define CHIP_MAX_HALVINGS 24        /* halvings that find the lowest tool position over a cell */
#define CHIP_WORK_ROW 35          /* work of a row, in cells of a flat end: about a dozen instructions each [2] */
#define CHIP_ROWS_AHEAD 3         /* rows between the one that is cut and the one that is prefetched */
#define CHIP_WORK_EDGE 20         /* of a cell on the outline */
#define CHIP_WORK_RIM 20          /* more, if it is on the stock's rim too */
#define CHIP_WORK_LOWEST 14       /* of the lowest tool position over a point */
#define CHIP_WORK_HALVING 12      /* of each halving for that */
#define CHIP_WORK_CURVED 14       /* of a cell below an end that is not flat */
#define CHIP_ROW_DONE 0x7fffffff  /* a column beyond all rows */
#define CHIP_MERGE_DEVIATION 1e-3           /* mm a merged segment may deviate, at most [5] */
#define CHIP_BACK_CELLS 1.5           /* cells of the path before a segment that count for a round end [4] */
#define CHIP_HEADING_CORNER 0.1             /* rad, a larger turn is a corner */
/* of the radius: an end that meets stock only up to there has no outline in it */
#define CHIP_INNER_SHARE 0.98
#define CHIP_GAUSS_REACH 0.41     /* cells from a cell's middle to the points it is read at */
#define CHIP_HALVING_END 1e-4            /* mm, where the halving ends */

#define CHIP_INLINE inline __attribute__((always_inline))    /* executed for every cell */

struct sweep_segment {                    /* a segment with what all its cells share; mm */
    double x, y, z;             /* start of the tip */
    double dx, dy, dz;          /* to the end */
    double length, length2;     /* of the XY part; squared */
    double per_length2;         /* 1 / length2; 0 for a plunge */
    double earliest;            /* share of the segment, not above 0: the tool was on its line from there on [4] */
    double reach;               /* radius in which the tool can be below the stock's top */
    double margin;              /* half the diagonal of a cell */
    double inner2, outer2;      /* mm2: nearer to the axis a cell is inside, beyond it outside; -1: none is inside */
    /* mm2: nearer to the axis a cell lies below the flat part of the end; -1: there is none */
    double floor2;
    double cell_area;           /* mm2 */
    float bottom;               /* lowest tip: nothing is cut below */
    int flat_end;               /* the tool's end is flat */
    int flat;                   /* and the height is constant along the segment */
    int skip_disc, skip_back;   /* `at` has cut the disc, what lies behind [4] */
    long *work;                 /* counted against a period's bound [2] */
};

struct span { int first, last; };

static int is_position(const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++)
        if (!(tip[i] >= -CHIP_MAX_COORDINATE && tip[i] <= CHIP_MAX_COORDINATE)) return 0;
    return 1;
}

void chip_sweep_start(struct chip_sweep *sweep, const double tip[3])
{
    int i;
    sweep->known = is_position(tip);
    for (i = 0; i < 3; i++) sweep->at[i] = sweep->known ? tip[i] : 0.0;
    sweep->waiting = 0;
    sweep->start_is_cut = 0;
    sweep->row = -1;
    sweep->straight = sweep->deviation = 0.0;
}

/* Whether the newest waiting segment can continue to `tip` as one straight segment [5]: its end stays on
 * the path within CHIP_MERGE_DEVIATION over everything merged into it. */
static int continues_straight(struct chip_sweep *sweep, const double tip[3])
{
    const double *end = sweep->queue[sweep->waiting - 1];
    const double *begin = sweep->waiting > 1 ? sweep->queue[sweep->waiting - 2] : sweep->at;
    double along = 0.0, whole2 = 0.0, first2 = 0.0, deviation;
    int i;
    if (sweep->waiting == 1 && sweep->row >= 0) return 0;       /* part of it is cut */
    for (i = 0; i < 3; i++) {
        along += (end[i] - begin[i]) * (tip[i] - begin[i]);
        whole2 += (tip[i] - begin[i]) * (tip[i] - begin[i]);
        first2 += (end[i] - begin[i]) * (end[i] - begin[i]);
    }
    if (along < 0.0 || along > whole2 || !(whole2 > 0.0)) return 0;
    deviation = sweep->deviation + chip_sqrt(chip_max(0.0, first2 - along * along / whole2));
    if (deviation > CHIP_MERGE_DEVIATION) return 0;
    sweep->deviation = deviation;
    return 1;
}

void chip_sweep_to(struct chip_sweep *sweep, const double tip[3])
{
    int i, slot;
    if (!is_position(tip)) return;
    if (!sweep->known) {
        chip_sweep_start(sweep, tip);
        return;
    }
    if (!sweep->waiting && sweep->start_is_cut && tip[0] == sweep->at[0] && tip[1] == sweep->at[1]
        && tip[2] == sweep->at[2]) return;      /* it is at rest, and all is cut */
    if (sweep->waiting == 0 || !continues_straight(sweep, tip)) {
        sweep->deviation = 0.0;
        if (sweep->waiting < CHIP_SWEEP_QUEUE) sweep->waiting++;  /* otherwise the newest is replaced [2] */
    }
    slot = sweep->waiting - 1;
    for (i = 0; i < 3; i++) sweep->queue[slot][i] = tip[i];
}

/* Distance^2 of a point (relative to the segment's start) from the tool's axis at t. */
static CHIP_INLINE double axis_distance2(const struct sweep_segment *segment, double px, double py, double t)
{
    double ex = px - t * segment->dx, ey = py - t * segment->dy;
    return ex * ex + ey * ey;
}

/* Profile of the tool at the distance^2 r2 from its axis; constant beyond its rim. */
static CHIP_INLINE double profile(const struct chip_tool *tool, double r2)
{
    double r = 0.0, rest;
    if (r2 >= tool->radius * tool->radius) return tool->shoulder;
    if (r2 > tool->r_arc * tool->r_arc) return tool->arc_top + tool->slope * (chip_sqrt(r2) - tool->r_arc);
    if (tool->r_flat > 0.0) {
        if (r2 <= tool->r_flat * tool->r_flat) return 0.0;
        r = chip_sqrt(r2) - tool->r_flat;
        r2 = r * r;
    }
    rest = tool->corner * tool->corner - r2;
    return rest > 0.0 ? tool->corner - chip_sqrt(rest) : tool->corner;
}

static double height_at(const struct sweep_segment *segment, const struct chip_tool *tool,
                               double px, double py, double t)
{
    return segment->z + t * segment->dz + profile(tool, axis_distance2(segment, px, py, t));
}

/* The part [lo, hi] of the segment in which the tool's disc covers the point; 0 if none. */
static int covering(const struct sweep_segment *segment, double radius, double px, double py,
                    double *lo, double *hi)
{
    double along = px * segment->dx + py * segment->dy;
    double off2 = px * px + py * py - radius * radius;
    double root;
    *lo = 0.0;
    *hi = 1.0;
    if (segment->length2 <= 0.0) return off2 <= 0.0;
    root = along * along - segment->length2 * off2;
    if (root < 0.0) return 0;
    root = chip_sqrt(root);
    *lo = chip_max(0.0, (along - root) * segment->per_length2);
    *hi = chip_min(1.0, (along + root) * segment->per_length2);
    return *lo <= *hi;
}

/* Whether the height over a point rises with t. */
static int rises(const struct sweep_segment *segment, const struct chip_tool *tool, double px, double py, double t)
{
    double r = chip_sqrt(axis_distance2(segment, px, py, t));
    double outward = t * segment->length2 - px * segment->dx - py * segment->dy;
    if (r < 1e-12) return segment->dz > 0.0;
    return segment->dz * r + chip_tool_slope(tool, chip_min(r, tool->radius)) * outward > 0.0;
}

/* Lowest tool surface over a point along the segment. The height is convex in t (a convex
 * profile of a distance that is convex in t, plus a straight slope): its minimum is at an end of the part
 * that covers the point, or halving finds it [3]. */
static double lowest(const struct sweep_segment *segment, const struct chip_tool *tool,
                     double px, double py, double nearest)
{
    double lo, hi;
    int i;
    *segment->work += CHIP_WORK_LOWEST;
    if (segment->dz == 0.0) return height_at(segment, tool, px, py, nearest);
    if (segment->dz < 0.0 && axis_distance2(segment, px, py, 1.0) <= tool->r_flat * tool->r_flat)
        return segment->z + segment->dz;                /* nothing is lower than the end of the segment */
    if (!covering(segment, tool->radius, px, py, &lo, &hi))
        return height_at(segment, tool, px, py, nearest);
    if (chip_tool_is_flat(tool) || segment->length2 <= 0.0)
        return height_at(segment, tool, px, py, segment->dz < 0.0 ? hi : lo);
    if (!rises(segment, tool, px, py, hi)) return height_at(segment, tool, px, py, hi);
    if (rises(segment, tool, px, py, lo)) return height_at(segment, tool, px, py, lo);
    for (i = 0; i < CHIP_MAX_HALVINGS && (hi - lo) * segment->length > CHIP_HALVING_END; i++) {
        double t = 0.5 * (lo + hi);
        if (rises(segment, tool, px, py, t)) hi = t; else lo = t;
    }
    *segment->work += CHIP_WORK_HALVING * i;
    return height_at(segment, tool, px, py, 0.5 * (lo + hi));
}

/* Share of the segment at which it is nearest to a point. */
static CHIP_INLINE double nearest_on(const struct sweep_segment *segment, double px, double py)
{
    double t = (px * segment->dx + py * segment->dy) * segment->per_length2;
    CHIP_FAULT(PLUNGE_OUTLINE_MISSED, if (segment->length2 <= 0.0) return 0.0);
    if (segment->length2 <= 0.0) return segment->dz < 0.0 ? 1.0 : 0.0;      /* the lower end of a plunge */
    return t < segment->earliest ? segment->earliest : (t > 1.0 ? 1.0 : t);
}

/* A cell under a tool that is not flat: four points of it. In the stock's original top they give a plane,
 * and where that leaves the top gives the share that is cut. A cell cut before is a slope itself, so only the
 * mean of all four may be compared with it (otherwise each pass would take a bit more). */
static double cut_curved(const struct sweep_segment *segment, const struct chip_stock *stock,
                         const struct chip_tool *tool, struct chip_cell *cell, double px, double py)
{
    double step = stock->cell * 0.28867513459481287;    /* Gauss points: cell / (2 sqrt 3) */
    double z[4], mean, gx, gy, slope, over, share, below;
    int i;
    *segment->work += CHIP_WORK_CURVED;
    for (i = 0; i < 4; i++) {
        double qx = px + (i & 1 ? step : -step), qy = py + (i & 2 ? step : -step);
        double t = nearest_on(segment, qx, qy);
        if (segment->dz == 0.0) z[i] = segment->z + profile(tool, axis_distance2(segment, qx, qy, t));
        else z[i] = lowest(segment, tool, qx, qy, t);
    }
    mean = 0.25 * (z[0] + z[1] + z[2] + z[3]);
    if (cell->top < (float)stock->z_max && !CHIP_FAULTY(ROUND_END_AGAIN)) return chip_cell_cut(stock, cell, 1.0, mean);
    gx = 0.8660254037844386 * (z[1] + z[3] - z[0] - z[2]);      /* rise of the plane over the cell */
    gy = 0.8660254037844386 * (z[2] + z[3] - z[0] - z[1]);
    over = mean - (double)cell->top;
    if (over <= -0.5 * (fabs(gx) + fabs(gy))) return chip_cell_cut(stock, cell, 1.0, mean);
    slope = chip_sqrt(gx * gx + gy * gy);
    if (!(slope > 0.0)) return 0.0;
    *segment->work += CHIP_WORK_EDGE;
    share = chip_cell_covered(over / slope, gx / slope, gy / slope);
    below = slope * chip_cell_wedge(over / slope, gx / slope, gy / slope);
    return share > 0.0 ? chip_cell_cut(stock, cell, share, (double)cell->top - below / share) : 0.0;
}

/* A cell on the outline of the sweep: the share inside, at the height of the middle of that
 * share. */
static double cut_edge(const struct sweep_segment *segment, const struct chip_stock *stock,
                       const struct chip_tool *tool, struct chip_cell *cell,
                       double px, double py, double t, double distance)
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
        return chip_cell_cut(stock, cell, k, segment->flat ? segment->z : lowest(segment, tool, px, py, t));
    if (k >= 1.0) return cut_curved(segment, stock, tool, cell, px, py);
    inward = distance - chip_max(tool->radius - 0.5 * k * stock->cell, 0.0);
    return chip_cell_cut(stock, cell, k, lowest(segment, tool, px - inward * ex, py - inward * ey, t));
}

/* A cell well below a flat end, or below the flat part of one, that is at height z. */
static CHIP_INLINE double cut_inside(const struct sweep_segment *segment, const struct chip_stock *stock,
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

/* One cell; its centre is (px, py) from the segment's start. */
static CHIP_INLINE double cut_cell(const struct sweep_segment *segment, const struct chip_stock *stock,
                              const struct chip_tool *tool, struct chip_cell *cell, double px, double py)
{
    double t, distance2;
    if (segment->bottom >= cell->top) return 0.0;
    if (segment->dz <= 0.0 && axis_distance2(segment, px, py, 1.0) <= segment->floor2)
        return cut_inside(segment, stock, cell, segment->z + segment->dz);
    t = nearest_on(segment, px, py);
    distance2 = axis_distance2(segment, px, py, t);
    if (distance2 >= segment->outer2) return 0.0;
    if (distance2 > segment->inner2)
        return cut_edge(segment, stock, tool, cell, px, py, t, chip_max(chip_sqrt(distance2), 1e-9));
    if (distance2 <= segment->floor2 && (segment->flat_end || segment->dz == 0.0))
        return cut_inside(segment, stock, cell, segment->dz == 0.0 ? segment->z : lowest(segment, tool, px, py, t));
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
static void drop_behind(const struct sweep_segment *segment, const struct chip_stock *stock, double y,
                        double *lo, double *hi)
{
    double keep = (segment->flat_end ? 0.0 : CHIP_GAUSS_REACH * stock->cell * segment->length)
        + (y - segment->y) * segment->dy;
    if (segment->dx > 0.0) *lo = chip_max(*lo, segment->x - keep / segment->dx);
    else if (segment->dx < 0.0) *hi = chip_min(*hi, segment->x - keep / segment->dx);
    else if (keep < 0.0) *hi = *lo - 1.0;
}

/* Columns of a row that the capsule, a margin wider, touches; empty: first > last [1]. */
static struct span row_span(const struct sweep_segment *segment, const struct chip_stock *stock, int iy)
{
    double y = stock->y0 + (iy + 0.5) * stock->cell;
    double radius = segment->reach + segment->margin;
    double lo = 1e300, hi = -1e300;
    struct span span = { 0, -1 };

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
static struct span row_floor(const struct sweep_segment *segment, const struct chip_stock *stock, double x, double y,
                             int iy)
{
    double row = stock->y0 + (iy + 0.5) * stock->cell - y, half = segment->floor2 - row * row;
    struct span span = { 1, 0 };

    if (!(half > 0.0)) return span;
    half = chip_sqrt(half);
    x -= stock->x0;
    span.first = (int)chip_clamp(ceil((x - half) / stock->cell - 0.5), -1.0, stock->nx);
    span.last = (int)chip_clamp(floor((x + half) / stock->cell - 0.5), -1.0, stock->nx);
    return span;
}

/* [4] How far before the segment's start, mm, the tool was on its line: less if the path bends. */
static double straight_before(const struct chip_sweep *sweep, const struct sweep_segment *segment, double cell)
{
    double far = chip_min(sweep->straight, CHIP_BACK_CELLS * cell), turn;
    if (!(far > 0.0) || segment->dz != 0.0 || !(segment->length > 0.0)) return 0.0;
    if (segment->dx * sweep->heading[0] + segment->dy * sweep->heading[1] <= 0.0) return 0.0;
    turn = fabs(segment->dy * sweep->heading[0] - segment->dx * sweep->heading[1]) / segment->length;
    CHIP_FAULT(ONE_SEGMENT_ONLY, return 0.0);
    if (turn > CHIP_HEADING_CORNER) return 0.0;
    return chip_min(far, turn > 0.0 ? chip_sqrt(2.0 * CHIP_MERGE_DEVIATION * segment->length / turn) : far);
}

/* [4] The segment is finished. */
static void note_straight(struct chip_sweep *sweep, const double from[3], const double to[3])
{
    double dx = to[0] - from[0], dy = to[1] - from[1], length = chip_sqrt(dx * dx + dy * dy), turn;
    if (!(length > 0.0) || to[2] != from[2]) {
        sweep->straight = 0.0;
        return;
    }
    dx /= length;
    dy /= length;
    turn = fabs(dy * sweep->heading[0] - dx * sweep->heading[1]);
    if (dx * sweep->heading[0] + dy * sweep->heading[1] <= 0.0 || turn > CHIP_HEADING_CORNER) sweep->straight = 0.0;
    sweep->straight = chip_min(sweep->straight + length, 1.0);
    sweep->heading[0] = dx;
    sweep->heading[1] = dy;
}

static struct sweep_segment make_segment(const struct chip_sweep *sweep, const struct chip_stock *stock,
                           const struct chip_tool *tool, long *work)
{
    const double *from = sweep->at, *to = sweep->queue[0];
    struct sweep_segment segment;
    double inner;
    int level_or_up = to[2] >= from[2];

    segment.x = from[0]; segment.y = from[1]; segment.z = from[2];
    segment.dx = to[0] - from[0]; segment.dy = to[1] - from[1]; segment.dz = to[2] - from[2];
    segment.length2 = segment.dx * segment.dx + segment.dy * segment.dy;
    segment.length = chip_sqrt(segment.length2);
    segment.per_length2 = segment.length2 > 0.0 ? 1.0 / segment.length2 : 0.0;
    segment.earliest = 0.0;
    segment.margin = stock->cell * 0.7071067811865476;
    segment.cell_area = stock->cell * stock->cell;
    segment.reach = chip_tool_reach(tool, stock->z_max - (segment.z + chip_min(segment.dz, 0.0)));
    segment.bottom = (float)chip_max(segment.z + chip_min(segment.dz, 0.0), stock->z_min);
    inner = tool->radius - segment.margin;
    segment.inner2 = inner > 0.0 ? inner * inner : -1.0;
    inner = (tool->r_flat < tool->radius ? tool->r_flat : tool->radius) - segment.margin;
    segment.floor2 = inner > 0.0 ? inner * inner : -1.0;
    segment.outer2 = (segment.reach + segment.margin) * (segment.reach + segment.margin);
    segment.flat_end = chip_tool_is_flat(tool);
    if (!segment.flat_end)
        segment.earliest = -straight_before(sweep, &segment, stock->cell) * segment.length * segment.per_length2;
    /* its rim is above the stock */
    if (segment.reach < CHIP_INNER_SHARE * tool->radius) segment.inner2 = segment.outer2;
    segment.flat = segment.flat_end && segment.dz == 0.0;
    segment.skip_disc = sweep->start_is_cut && level_or_up && segment.floor2 > 0.0;
    segment.skip_back = sweep->start_is_cut && level_or_up;
    if (segment.skip_back && segment.length2 <= 0.0) segment.reach = 0.0;      /* a retract cuts nothing */
    segment.work = work;
    return segment;
}

/* Rows a segment touches. */
static struct span segment_rows(const struct sweep_segment *segment, const struct chip_stock *stock)
{
    double radius = segment->reach + segment->margin;
    double lo = chip_min(segment->y, segment->y + segment->dy) - radius;
    double hi = chip_max(segment->y, segment->y + segment->dy) + radius;
    struct span rows;
    rows.first = (int)chip_clamp(floor((lo - stock->y0) / stock->cell), 0.0, stock->ny);
    rows.last = (int)chip_clamp(floor((hi - stock->y0) / stock->cell), -1.0, stock->ny - 1.0);
    if (segment->reach <= 0.0) rows.last = rows.first - 1;
    return rows;
}

/* Cells below the flat part of the end at the end of a segment that does not rise: nothing of
 * the segment is lower. */
static double cut_floor(const struct sweep_segment *segment, const struct chip_stock *stock, struct chip_cell *cell,
                        int count, int dry)
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

/* Cuts one row of a segment, or copies of its cells (`dry`), from a column on; returns the volume in mm3.
 * `*column` is where to continue: beyond the row if it is done, otherwise the bound
 * on the work was reached [2]. */
static double cut_row(const struct sweep_segment *segment, const struct chip_stock *stock, const struct chip_tool *tool,
                      int iy, int dry, int *column, long bound)
{
    struct span span = row_span(segment, stock, iy), none = { 1, 0 };
    struct span skip = segment->skip_disc ? row_floor(segment, stock, segment->x, segment->y, iy) : none;
    struct span floor_span = segment->dz <= 0.0
        ? row_floor(segment, stock, segment->x + segment->dx, segment->y + segment->dy, iy) : none;
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

/* Removes the finished segment from the queue. */
static void advance(struct chip_sweep *sweep)
{
    int i, j;
    note_straight(sweep, sweep->at, sweep->queue[0]);
    for (i = 0; i < 3; i++) sweep->at[i] = sweep->queue[0][i];
    for (j = 1; j < sweep->waiting; j++)
        for (i = 0; i < 3; i++) sweep->queue[j - 1][i] = sweep->queue[j][i];
    sweep->waiting--;
    sweep->start_is_cut = 1;
    sweep->row = -1;
}

double chip_sweep_run(struct chip_sweep *sweep, struct chip_stock *stock, const struct chip_tool *tool,
                    long bound, long *spent)
{
    double removed = 0.0;
    long work = 0;
    if (!sweep->waiting) return 0.0;
    chip_stock_begin_write(stock);
    while (sweep->waiting > 0 && work < bound) {
        struct sweep_segment segment = make_segment(sweep, stock, tool, &work);
        if (sweep->row < 0) {
            struct span rows = segment_rows(&segment, stock);
            sweep->row = rows.first;
            sweep->row_end = rows.last;
            sweep->column = 0;
        }
        while (sweep->row <= sweep->row_end && work < bound) {
            removed += cut_row(&segment, stock, tool, sweep->row, 0, &sweep->column, bound);
            if (sweep->column != CHIP_ROW_DONE) break;
            sweep->column = 0;
            sweep->row++;
        }
        if (sweep->row > sweep->row_end) advance(sweep);
        work++;
    }
    stock->removed += removed;
    chip_stock_end_write(stock);
    if (spent) *spent += work;
    return removed;
}

double chip_sweep_meets(const struct chip_stock *stock, const struct chip_tool *tool,
                      const double from[3], const double to[3], int start_is_cut, double enough,
                      long *spent)
{
    struct chip_sweep sweep;
    struct sweep_segment segment;
    struct span rows;
    double met = 0.0;
    long work = 1;
    int column = 0;
    if (!is_position(from) || !is_position(to)) return 0.0;
    chip_sweep_start(&sweep, from);
    chip_sweep_to(&sweep, to);
    sweep.start_is_cut = start_is_cut;
    segment = make_segment(&sweep, stock, tool, &work);
    rows = segment_rows(&segment, stock);
    for (; rows.first <= rows.last && met < enough; rows.first++, column = 0)
        met += cut_row(&segment, stock, tool, rows.first, 1, &column, CHIP_ROW_DONE);
    if (spent) *spent += work;
    return met;
}
