/* sweep.c - see sweep.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "sweep.h"

#define CW_FINE_STEPS 24        /* halvings that find the lowest tool position over a cell */
#define CW_WORK_ROW 35          /* work on a row, in cells of a flat end: about a dozen instructions each [2] */
#define CW_ROWS_AHEAD 3         /* rows by which memory is asked for cells before they are cut */
#define CW_WORK_EDGE 20         /* on a cell of the outline */
#define CW_WORK_RIM 20          /* on one that is on the stock's rim too */
#define CW_WORK_LOWEST 14       /* on finding the lowest tool position over a point */
#define CW_WORK_HALVING 12      /* and on each halving of the way for that */
#define CW_WORK_CURVED 14       /* on a cell below an end that is not flat */
#define CW_ROW_DONE 0x7fffffff  /* a column beyond all rows */
#define CW_STRAY 1e-3           /* mm from a way of several legs made one, at most [5] */
#define CW_BEHIND 1.5           /* cells of the way before a leg that a round end is followed back [4] */
#define CW_BENT 0.1             /* rad, a larger turn is a corner */
#define CW_INNER 0.98           /* of the radius: an end that meets stock up to there only has no outline in it */
#define CW_GAUSS_REACH 0.41     /* cells from a cell's middle to the points it is read at */
#define CW_FINE 1e-4            /* mm, and how near is near enough */
#define CW_FARTHEST 1e6         /* mm, a tip beyond this (or NaN) is no position */

#define CW_INLINE inline __attribute__((always_inline))    /* what every cell goes through */

struct leg {                    /* a leg of the way with what all its cells share; mm */
    double x, y, z;             /* start of the tip */
    double dx, dy, dz;          /* to the end */
    double length, length2;     /* of the XY part; squared */
    double per_length2;         /* 1 / length2; 0 for a plunge */
    double earliest;            /* share of the leg, not above 0: the tool was on its line from there on [4] */
    double reach;               /* radius in which the tool can be below the stock's top */
    double margin;              /* half the diagonal of a cell */
    double inner2, outer2;      /* mm2: nearer to the axis a cell is inside, from there on outside; -1: none is inside */
    double floor2;              /* mm2: nearer to the axis a cell lies below the flat part of the end; -1: there is none */
    double cell_area;           /* mm2 */
    float bottom;               /* lowest tip: nothing is cut below */
    int flat_end;               /* the tool's end is flat */
    int flat;                   /* and nothing is to be looked for along the leg's slope */
    int skip_disc, skip_back;   /* what `at` has cut already [4] */
    long *work;                 /* what a period's bound counts [2] */
};

struct span { int first, last; };

static int is_position(const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++)
        if (!(tip[i] >= -CW_FARTHEST && tip[i] <= CW_FARTHEST)) return 0;
    return 1;
}

void cw_sweep_place(struct cw_sweep *sweep, const double tip[3])
{
    int i;
    sweep->known = is_position(tip);
    for (i = 0; i < 3; i++) sweep->at[i] = sweep->known ? tip[i] : 0.0;
    sweep->waiting = 0;
    sweep->trail = 0;
    sweep->row = -1;
    sweep->straight = sweep->stray = 0.0;
}

/* Whether the newest leg that waits can go on to `tip` as one straight leg [5]: its end stays on
 * the way, but for CW_STRAY in all that was put into this leg. */
static int goes_on(struct cw_sweep *sweep, const double tip[3])
{
    const double *end = sweep->queue[sweep->waiting - 1];
    const double *begin = sweep->waiting > 1 ? sweep->queue[sweep->waiting - 2] : sweep->at;
    double along = 0.0, whole2 = 0.0, leg2 = 0.0, stray;
    int i;
    if (sweep->waiting == 1 && sweep->row >= 0) return 0;       /* part of it is cut */
    for (i = 0; i < 3; i++) {
        along += (end[i] - begin[i]) * (tip[i] - begin[i]);
        whole2 += (tip[i] - begin[i]) * (tip[i] - begin[i]);
        leg2 += (end[i] - begin[i]) * (end[i] - begin[i]);
    }
    if (along < 0.0 || along > whole2 || !(whole2 > 0.0)) return 0;
    stray = sweep->stray + cw_sqrt(cw_max(0.0, leg2 - along * along / whole2));
    if (stray > CW_STRAY) return 0;
    sweep->stray = stray;
    return 1;
}

void cw_sweep_to(struct cw_sweep *sweep, const double tip[3])
{
    int i, slot;
    if (!is_position(tip)) return;
    if (!sweep->known) {
        cw_sweep_place(sweep, tip);
        return;
    }
    if (!sweep->waiting && sweep->trail && tip[0] == sweep->at[0] && tip[1] == sweep->at[1]
        && tip[2] == sweep->at[2]) return;      /* it stands, and all is cut */
    if (sweep->waiting == 0 || !goes_on(sweep, tip)) {
        sweep->stray = 0.0;
        if (sweep->waiting < CW_SWEEP_QUEUE) sweep->waiting++;  /* else the newest is replaced [2] */
    }
    slot = sweep->waiting - 1;
    for (i = 0; i < 3; i++) sweep->queue[slot][i] = tip[i];
}

/* Distance^2 of a point (relative to the leg's start) from the tool's axis at t. */
static CW_INLINE double axis_distance2(const struct leg *leg, double px, double py, double t)
{
    double ex = px - t * leg->dx, ey = py - t * leg->dy;
    return ex * ex + ey * ey;
}

/* Profile of the tool at the distance^2 r2 from its axis, held at its rim outside. */
static CW_INLINE double profile(const struct cw_tool *tool, double r2)
{
    double r = 0.0, rest;
    if (r2 >= tool->radius * tool->radius) return tool->shoulder;
    if (r2 > tool->r_arc * tool->r_arc) return tool->arc_top + tool->slope * (cw_sqrt(r2) - tool->r_arc);
    if (tool->r_flat > 0.0) {
        if (r2 <= tool->r_flat * tool->r_flat) return 0.0;
        r = cw_sqrt(r2) - tool->r_flat;
        r2 = r * r;
    }
    rest = tool->corner * tool->corner - r2;
    return rest > 0.0 ? tool->corner - cw_sqrt(rest) : tool->corner;
}

static double height_at(const struct leg *leg, const struct cw_tool *tool,
                               double px, double py, double t)
{
    return leg->z + t * leg->dz + profile(tool, axis_distance2(leg, px, py, t));
}

/* The part [lo, hi] of the leg in which the tool's disc covers the point; 0 if none. */
static int covering(const struct leg *leg, double radius, double px, double py,
                    double *lo, double *hi)
{
    double along = px * leg->dx + py * leg->dy;
    double off2 = px * px + py * py - radius * radius;
    double root;
    *lo = 0.0;
    *hi = 1.0;
    if (leg->length2 <= 0.0) return off2 <= 0.0;
    root = along * along - leg->length2 * off2;
    if (root < 0.0) return 0;
    root = cw_sqrt(root);
    *lo = cw_max(0.0, (along - root) * leg->per_length2);
    *hi = cw_min(1.0, (along + root) * leg->per_length2);
    return *lo <= *hi;
}

/* Whether the height over a point rises with t. */
static int rises(const struct leg *leg, const struct cw_tool *tool, double px, double py, double t)
{
    double r = cw_sqrt(axis_distance2(leg, px, py, t));
    double outward = t * leg->length2 - px * leg->dx - py * leg->dy;
    if (r < 1e-12) return leg->dz > 0.0;
    return leg->dz * r + cw_tool_slope(tool, cw_min(r, tool->radius)) * outward > 0.0;
}

/* Lowest tool surface over a point along the leg. The height is convex in t (a convex
 * profile of a distance that is convex in t, plus a straight slope): it is at an end of the part
 * that covers the point, or else halving finds it [3]. */
static double lowest(const struct leg *leg, const struct cw_tool *tool,
                     double px, double py, double nearest)
{
    double lo, hi;
    int i;
    *leg->work += CW_WORK_LOWEST;
    if (leg->dz == 0.0) return height_at(leg, tool, px, py, nearest);
    if (leg->dz < 0.0 && axis_distance2(leg, px, py, 1.0) <= tool->r_flat * tool->r_flat)
        return leg->z + leg->dz;                /* nothing is lower than the end of the leg */
    if (!covering(leg, tool->radius, px, py, &lo, &hi))
        return height_at(leg, tool, px, py, nearest);
    if (cw_tool_is_flat(tool) || leg->length2 <= 0.0)
        return height_at(leg, tool, px, py, leg->dz < 0.0 ? hi : lo);
    if (!rises(leg, tool, px, py, hi)) return height_at(leg, tool, px, py, hi);
    if (rises(leg, tool, px, py, lo)) return height_at(leg, tool, px, py, lo);
    for (i = 0; i < CW_FINE_STEPS && (hi - lo) * leg->length > CW_FINE; i++) {
        double t = 0.5 * (lo + hi);
        if (rises(leg, tool, px, py, t)) hi = t; else lo = t;
    }
    *leg->work += CW_WORK_HALVING * i;
    return height_at(leg, tool, px, py, 0.5 * (lo + hi));
}

/* Place on the leg nearest to a point. */
static CW_INLINE double nearest_on(const struct leg *leg, double px, double py)
{
    double t = (px * leg->dx + py * leg->dy) * leg->per_length2;
    if (leg->length2 <= 0.0) return leg->dz < 0.0 ? 1.0 : 0.0;      /* the lower end of a plunge */
    return t < leg->earliest ? leg->earliest : (t > 1.0 ? 1.0 : t);
}

/* A cell under a tool that is not flat: four points of it. In the stock's original top they give a plane,
 * and where that leaves the top says what share is cut; a cell cut before stands for a slope itself, so only the
 * mean of all four may be compared with it (else each pass would take a bit more). */
static double cut_curved(const struct leg *leg, const struct cw_stock *stock,
                         const struct cw_tool *tool, struct cw_cell *cell, double px, double py)
{
    double step = stock->cell * 0.28867513459481287;    /* Gauss points: cell / (2 sqrt 3) */
    double z[4], mean, gx, gy, slope, over, share, below;
    int i;
    *leg->work += CW_WORK_CURVED;
    for (i = 0; i < 4; i++) {
        double qx = px + (i & 1 ? step : -step), qy = py + (i & 2 ? step : -step);
        double t = nearest_on(leg, qx, qy);
        if (leg->dz == 0.0) z[i] = leg->z + profile(tool, axis_distance2(leg, qx, qy, t));
        else z[i] = lowest(leg, tool, qx, qy, t);
    }
    mean = 0.25 * (z[0] + z[1] + z[2] + z[3]);
    if (cell->top < (float)stock->z_max) return cw_cell_cut(stock, cell, 1.0, mean);
    gx = 0.8660254037844386 * (z[1] + z[3] - z[0] - z[2]);      /* rise of the plane over the cell */
    gy = 0.8660254037844386 * (z[2] + z[3] - z[0] - z[1]);
    over = mean - (double)cell->top;
    if (over <= -0.5 * (fabs(gx) + fabs(gy))) return cw_cell_cut(stock, cell, 1.0, mean);
    slope = cw_sqrt(gx * gx + gy * gy);
    if (!(slope > 0.0)) return 0.0;
    *leg->work += CW_WORK_EDGE;
    share = cw_cell_covered(over / slope, gx / slope, gy / slope);
    below = slope * cw_cell_wedge(over / slope, gx / slope, gy / slope);
    return share > 0.0 ? cw_cell_cut(stock, cell, share, (double)cell->top - below / share) : 0.0;
}

/* A cell on the outline of the sweep: the share inside, at the height of the middle of that
 * share. */
static double cut_edge(const struct leg *leg, const struct cw_stock *stock,
                       const struct cw_tool *tool, struct cw_cell *cell,
                       double px, double py, double t, double distance)
{
    double ex = (px - t * leg->dx) / distance, ey = (py - t * leg->dy) / distance;
    double k = cw_cell_covered((distance - tool->radius) / stock->cell, ex, ey);
    double inward;
    *leg->work += CW_WORK_EDGE;
    if (cell->drop & CW_RIM) {
        *leg->work += CW_WORK_RIM;
        k = cw_rim_covered(stock, cell, leg->x + px, leg->y + py, k, ex, ey);
    }
    if (k <= 0.0) return 0.0;
    if (leg->flat_end)
        return cw_cell_cut(stock, cell, k, leg->flat ? leg->z : lowest(leg, tool, px, py, t));
    if (k >= 1.0) return cut_curved(leg, stock, tool, cell, px, py);
    inward = distance - cw_max(tool->radius - 0.5 * k * stock->cell, 0.0);
    return cw_cell_cut(stock, cell, k, lowest(leg, tool, px - inward * ex, py - inward * ey, t));
}

/* A cell well below a flat end, or the flat part of one, that is at height z. */
static CW_INLINE double cut_inside(const struct leg *leg, const struct cw_stock *stock,
                                   struct cw_cell *cell, double z)
{
    double removed;
    if (cell->cut) return cw_cell_cut(stock, cell, 1.0, z);
    if (z < stock->z_min) z = stock->z_min;
    removed = (double)cell->top - z;
    if (removed <= 0.0) return 0.0;
    cell->top = (float)z;
    return removed * leg->cell_area;
}

/* One cell; its centre is (px, py) from the leg's start. */
static CW_INLINE double cut_cell(const struct leg *leg, const struct cw_stock *stock,
                              const struct cw_tool *tool, struct cw_cell *cell, double px, double py)
{
    double t, distance2;
    if (leg->bottom >= cell->top) return 0.0;
    if (leg->dz <= 0.0 && axis_distance2(leg, px, py, 1.0) <= leg->floor2)
        return cut_inside(leg, stock, cell, leg->z + leg->dz);
    t = nearest_on(leg, px, py);
    distance2 = axis_distance2(leg, px, py, t);
    if (distance2 >= leg->outer2) return 0.0;
    if (distance2 > leg->inner2)
        return cut_edge(leg, stock, tool, cell, px, py, t, cw_max(cw_sqrt(distance2), 1e-9));
    if (distance2 <= leg->floor2 && (leg->flat_end || leg->dz == 0.0))
        return cut_inside(leg, stock, cell, leg->dz == 0.0 ? leg->z : lowest(leg, tool, px, py, t));
    return cut_curved(leg, stock, tool, cell, px, py);
}

/* Widens [lo, hi] by what a disc round (cx, cy) has on the row y. */
static void widen_disc(double cx, double cy, double radius, double y, double *lo, double *hi)
{
    double d2 = radius * radius - (y - cy) * (y - cy);
    if (d2 < 0.0) return;
    d2 = cw_sqrt(d2);
    *lo = cw_min(*lo, cx - d2);
    *hi = cw_max(*hi, cx + d2);
}

/* Widens [lo, hi] by where the row y crosses the straight side of the capsule. */
static void widen_side(double x, double y0, double dx, double dy, double y, double *lo, double *hi)
{
    double t;
    if (dy == 0.0) return;
    t = (y - y0) / dy;
    if (t < 0.0 || t > 1.0) return;
    *lo = cw_min(*lo, x + t * dx);
    *hi = cw_max(*hi, x + t * dx);
}

/* Takes off [lo, hi] what lies behind the leg's start: there the leg does not come nearer than the
 * one before did [4]. Cells of a curved end are read at four points, some way before their middle. */
static void drop_behind(const struct leg *leg, const struct cw_stock *stock, double y,
                        double *lo, double *hi)
{
    double keep = (leg->flat_end ? 0.0 : CW_GAUSS_REACH * stock->cell * leg->length)
        + (y - leg->y) * leg->dy;
    if (leg->dx > 0.0) *lo = cw_max(*lo, leg->x - keep / leg->dx);
    else if (leg->dx < 0.0) *hi = cw_min(*hi, leg->x - keep / leg->dx);
    else if (keep < 0.0) *hi = *lo - 1.0;
}

/* Columns of a row that the capsule, a margin wider, touches; empty: first > last [1]. */
static struct span row_span(const struct leg *leg, const struct cw_stock *stock, int iy)
{
    double y = stock->y0 + (iy + 0.5) * stock->cell;
    double radius = leg->reach + leg->margin;
    double lo = 1e300, hi = -1e300;
    struct span span = { 0, -1 };

    widen_disc(leg->x, leg->y, radius, y, &lo, &hi);
    widen_disc(leg->x + leg->dx, leg->y + leg->dy, radius, y, &lo, &hi);
    if (leg->length > 0.0) {
        double ox = -leg->dy / leg->length * radius, oy = leg->dx / leg->length * radius;
        widen_side(leg->x + ox, leg->y + oy, leg->dx, leg->dy, y, &lo, &hi);
        widen_side(leg->x - ox, leg->y - oy, leg->dx, leg->dy, y, &lo, &hi);
    }
    if (leg->skip_back) drop_behind(leg, stock, y, &lo, &hi);
    if (lo > hi) return span;
    lo = floor((lo - stock->x0) / stock->cell);
    hi = floor((hi - stock->x0) / stock->cell);
    span.first = (int)cw_clamp(lo, 0.0, stock->nx);
    span.last = (int)cw_clamp(hi, -1.0, stock->nx - 1.0);
    return span;
}

/* Columns of the row well inside the flat part of the end at (x, y); empty: first > last. */
static struct span row_floor(const struct leg *leg, const struct cw_stock *stock, double x, double y, int iy)
{
    double row = stock->y0 + (iy + 0.5) * stock->cell - y, half = leg->floor2 - row * row;
    struct span span = { 1, 0 };

    if (!(half > 0.0)) return span;
    half = cw_sqrt(half);
    x -= stock->x0;
    span.first = (int)cw_clamp(ceil((x - half) / stock->cell - 0.5), -1.0, stock->nx);
    span.last = (int)cw_clamp(floor((x + half) / stock->cell - 0.5), -1.0, stock->nx);
    return span;
}

/* [4] How far before the leg's start, mm, the tool was on its line: less where the way bends. */
static double straight_before(const struct cw_sweep *sweep, const struct leg *leg, double cell)
{
    double far = cw_min(sweep->straight, CW_BEHIND * cell), turn;
    if (!(far > 0.0) || leg->dz != 0.0 || !(leg->length > 0.0)) return 0.0;
    if (leg->dx * sweep->run[0] + leg->dy * sweep->run[1] <= 0.0) return 0.0;
    turn = fabs(leg->dy * sweep->run[0] - leg->dx * sweep->run[1]) / leg->length;
    if (turn > CW_BENT) return 0.0;
    return cw_min(far, turn > 0.0 ? cw_sqrt(2.0 * CW_STRAY * leg->length / turn) : far);
}

/* [4] The leg is done. */
static void note_straight(struct cw_sweep *sweep, const double from[3], const double to[3])
{
    double dx = to[0] - from[0], dy = to[1] - from[1], length = cw_sqrt(dx * dx + dy * dy), turn;
    if (!(length > 0.0) || to[2] != from[2]) {
        sweep->straight = 0.0;
        return;
    }
    dx /= length;
    dy /= length;
    turn = fabs(dy * sweep->run[0] - dx * sweep->run[1]);
    if (dx * sweep->run[0] + dy * sweep->run[1] <= 0.0 || turn > CW_BENT) sweep->straight = 0.0;
    sweep->straight = cw_min(sweep->straight + length, 1.0);
    sweep->run[0] = dx;
    sweep->run[1] = dy;
}

static struct leg make_leg(const struct cw_sweep *sweep, const struct cw_stock *stock,
                           const struct cw_tool *tool, long *work)
{
    const double *from = sweep->at, *to = sweep->queue[0];
    struct leg leg;
    double inner;
    int level_or_up = to[2] >= from[2];

    leg.x = from[0]; leg.y = from[1]; leg.z = from[2];
    leg.dx = to[0] - from[0]; leg.dy = to[1] - from[1]; leg.dz = to[2] - from[2];
    leg.length2 = leg.dx * leg.dx + leg.dy * leg.dy;
    leg.length = cw_sqrt(leg.length2);
    leg.per_length2 = leg.length2 > 0.0 ? 1.0 / leg.length2 : 0.0;
    leg.earliest = 0.0;
    leg.margin = stock->cell * 0.7071067811865476;
    leg.cell_area = stock->cell * stock->cell;
    leg.reach = cw_tool_reach(tool, stock->z_max - (leg.z + cw_min(leg.dz, 0.0)));
    leg.bottom = (float)cw_max(leg.z + cw_min(leg.dz, 0.0), stock->z_min);
    inner = tool->radius - leg.margin;
    leg.inner2 = inner > 0.0 ? inner * inner : -1.0;
    inner = (tool->r_flat < tool->radius ? tool->r_flat : tool->radius) - leg.margin;
    leg.floor2 = inner > 0.0 ? inner * inner : -1.0;
    leg.outer2 = (leg.reach + leg.margin) * (leg.reach + leg.margin);
    leg.flat_end = cw_tool_is_flat(tool);
    if (!leg.flat_end) leg.earliest = -straight_before(sweep, &leg, stock->cell) * leg.length * leg.per_length2;
    if (leg.reach < CW_INNER * tool->radius) leg.inner2 = leg.outer2;      /* its rim is above the stock */
    leg.flat = leg.flat_end && leg.dz == 0.0;
    leg.skip_disc = sweep->trail && level_or_up && leg.floor2 > 0.0;
    leg.skip_back = sweep->trail && level_or_up;
    if (leg.skip_back && leg.length2 <= 0.0) leg.reach = 0.0;      /* a retract cuts nothing */
    leg.work = work;
    return leg;
}

/* Rows a leg touches. */
static struct span leg_rows(const struct leg *leg, const struct cw_stock *stock)
{
    double radius = leg->reach + leg->margin;
    double lo = cw_min(leg->y, leg->y + leg->dy) - radius;
    double hi = cw_max(leg->y, leg->y + leg->dy) + radius;
    struct span rows;
    rows.first = (int)cw_clamp(floor((lo - stock->y0) / stock->cell), 0.0, stock->ny);
    rows.last = (int)cw_clamp(floor((hi - stock->y0) / stock->cell), -1.0, stock->ny - 1.0);
    if (leg->reach <= 0.0) rows.last = rows.first - 1;
    return rows;
}

/* Cells that lie below the flat part of the end at the end of a leg that does not rise: nothing of
 * the leg is lower. */
static double cut_floor(const struct leg *leg, const struct cw_stock *stock, struct cw_cell *cell, int count,
                        int dry)
{
    double z = cw_max(leg->z + leg->dz, stock->z_min), sum = 0.0, walls = 0.0;
    float low = leg->bottom;
    for (; count > 0; count--, cell++) {
        struct cw_cell copy;
        if (low >= cell->top) continue;
        if (cell->cut) {
            copy = *cell;
            walls += cw_cell_cut(stock, dry ? &copy : cell, 1.0, z);
            continue;
        }
        sum += (double)cell->top - z;
        if (!dry) cell->top = (float)z;
    }
    return sum * leg->cell_area + walls;
}

/* Asks the memory for the cells of a row two further on, where the row at hand has its own: each row
 * of a large map lies in lines and pages of its own, and the front goes over all of them. */
static CW_INLINE void fetch_row(const struct cw_cell *row, const struct cw_stock *stock, int first, int last)
{
    const struct cw_cell *ahead = row + CW_ROWS_AHEAD * (long)(stock->nx + 2);
    __builtin_prefetch(ahead + first, 1);
    __builtin_prefetch(ahead + last, 1);
}

/* Cuts one row of a leg, or copies of its cells (`dry`), from a column on; returns the volume in mm3.
 * The column where it has to go on is `*column`: beyond the row when it is done, else the bound
 * on the work was met [2]. */
static double cut_row(const struct leg *leg, const struct cw_stock *stock, const struct cw_tool *tool,
                      int iy, int dry, int *column, long bound)
{
    struct span span = row_span(leg, stock, iy), none = { 1, 0 };
    struct span skip = leg->skip_disc ? row_floor(leg, stock, leg->x, leg->y, iy) : none;
    struct span floor_ = leg->dz <= 0.0
        ? row_floor(leg, stock, leg->x + leg->dx, leg->y + leg->dy, iy) : none;
    double y = stock->y0 + (iy + 0.5) * stock->cell - leg->y;
    double x0 = stock->x0 + 0.5 * stock->cell - leg->x, removed = 0.0;
    struct cw_cell *row = cw_stock_cell(stock, 0, iy), copy;
    int ix = span.first > *column ? span.first : *column;

    fetch_row(row, stock, ix >= skip.first && ix <= skip.last ? skip.last + 1 : ix, span.last);
    while (ix <= span.last && *leg->work < bound) {
        if (ix >= skip.first && ix <= skip.last) {
            ix = skip.last + 1;
        } else if (ix >= floor_.first && ix <= floor_.last) {
            long count = (floor_.last < span.last ? floor_.last : span.last) - ix + 1;
            if (skip.first > ix && skip.first - ix < count) count = skip.first - ix;
            if (count > bound - *leg->work) count = bound - *leg->work;
            removed += cut_floor(leg, stock, row + ix, (int)count, dry);
            *leg->work += count;
            ix += (int)count;
        } else {
            copy = row[ix];
            removed += cut_cell(leg, stock, tool, dry ? &copy : &row[ix], x0 + ix * stock->cell, y);
            *leg->work += 2;
            ix++;
        }
    }
    *leg->work += CW_WORK_ROW;
    *column = ix > span.last ? CW_ROW_DONE : ix;
    return removed;
}

/* Takes the finished leg off the queue. */
static void advance(struct cw_sweep *sweep)
{
    int i, j;
    note_straight(sweep, sweep->at, sweep->queue[0]);
    for (i = 0; i < 3; i++) sweep->at[i] = sweep->queue[0][i];
    for (j = 1; j < sweep->waiting; j++)
        for (i = 0; i < 3; i++) sweep->queue[j - 1][i] = sweep->queue[j][i];
    sweep->waiting--;
    sweep->trail = 1;
    sweep->row = -1;
}

double cw_sweep_run(struct cw_sweep *sweep, struct cw_stock *stock, const struct cw_tool *tool,
                    long bound, long *spent)
{
    double removed = 0.0;
    long work = 0;
    if (!sweep->waiting) return 0.0;
    cw_stock_begin_write(stock);
    while (sweep->waiting > 0 && work < bound) {
        struct leg leg = make_leg(sweep, stock, tool, &work);
        if (sweep->row < 0) {
            struct span rows = leg_rows(&leg, stock);
            sweep->row = rows.first;
            sweep->row_end = rows.last;
            sweep->column = 0;
        }
        while (sweep->row <= sweep->row_end && work < bound) {
            removed += cut_row(&leg, stock, tool, sweep->row, 0, &sweep->column, bound);
            if (sweep->column != CW_ROW_DONE) break;
            sweep->column = 0;
            sweep->row++;
        }
        if (sweep->row > sweep->row_end) advance(sweep);
        work++;
    }
    stock->removed += removed;
    cw_stock_end_write(stock);
    if (spent) *spent += work;
    return removed;
}

double cw_sweep_meets(const struct cw_stock *stock, const struct cw_tool *tool,
                      const double from[3], const double to[3], int trail, double enough,
                      long *spent)
{
    struct cw_sweep sweep;
    struct leg leg;
    struct span rows;
    double met = 0.0;
    long work = 1;
    int column = 0;
    if (!is_position(from) || !is_position(to)) return 0.0;
    cw_sweep_place(&sweep, from);
    cw_sweep_to(&sweep, to);
    sweep.trail = trail;
    leg = make_leg(&sweep, stock, tool, &work);
    rows = leg_rows(&leg, stock);
    for (; rows.first <= rows.last && met < enough; rows.first++, column = 0)
        met += cut_row(&leg, stock, tool, rows.first, 1, &column, CW_ROW_DONE);
    if (spent) *spent += work;
    return met;
}
