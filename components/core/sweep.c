/* SPDX-License-Identifier: GPL-2.0-or-later */
/* sweep.c - see sweep.h; the numbers in brackets are those of its principle. */
#include "sweep_segment.h"

#define CHIP_MERGE_DEVIATION 1e-3 /* mm a merged segment may deviate, for each that waits [5] */
#define CHIP_BACK_CELLS 1.5       /* cells of the path before a segment that count for a round end [4] */
#define CHIP_HEADING_CORNER 0.1   /* rad, a larger turn is a corner; of the slope, mm per mm */
#define CHIP_STRAIGHT_MAX 1.0     /* mm of straight path that are remembered [4] */
#define CHIP_PLUNGE_SLOPE 10.0    /* mm per mm, a steeper path is a plunge [4] */
/* of the radius: an end that meets stock only up to there has no outline in it */
#define CHIP_INNER_SHARE 0.98

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
    sweep->straight = 0.0;
}

/* The tip `slot` of those that wait, oldest first; -1: where everything is cut. */
static const double *waiting_tip(const struct chip_sweep *sweep, int slot)
{
    return slot < 0 ? sweep->at : sweep->queue[slot];
}

/* Distance, mm, of the tip `slot` from the straight line between the one before it and `next`; above CHIP_MAX_COORDINATE if it is
 * not between them. */
static double off_the_line(const struct chip_sweep *sweep, int slot, const double next[3])
{
    const double *tip = waiting_tip(sweep, slot), *begin = waiting_tip(sweep, slot - 1);
    double along = 0.0, whole2 = 0.0, first2 = 0.0;
    int i;
    for (i = 0; i < 3; i++) {
        along += (tip[i] - begin[i]) * (next[i] - begin[i]);
        whole2 += (next[i] - begin[i]) * (next[i] - begin[i]);
        first2 += (tip[i] - begin[i]) * (tip[i] - begin[i]);
    }
    if (along < 0.0 || along > whole2 || !(whole2 > 0.0)) return 2.0 * CHIP_MAX_COORDINATE;
    return chip_sqrt(chip_max(0.0, first2 - along * along / whole2));
}

/* [5] Deviation, mm, of the one segment to `next` that takes the place of those to the tips `slot` and `slot` + 1. */
static double deviation_without(const struct chip_sweep *sweep, int slot, const double next[3], double of_next)
{
    return chip_max(sweep->deviation[slot], of_next) + off_the_line(sweep, slot, next);
}

/* Takes one tip out of the queue; the later ones move up. */
static void drop_tip(struct chip_sweep *sweep, int slot)
{
    int i;
    for (sweep->waiting--; slot < sweep->waiting; slot++) {
        for (i = 0; i < 3; i++) sweep->queue[slot][i] = sweep->queue[slot + 1][i];
        sweep->deviation[slot] = sweep->deviation[slot + 1];
    }
}

/* [2] The one tip of a full queue whose segments deviate least without it, `tip` coming next; *least: by how much. A segment
 * of which a part is cut stays. */
static int least_needed(const struct chip_sweep *sweep, const double tip[3], double *least)
{
    int j, best = sweep->waiting - 1;
    *least = deviation_without(sweep, best, tip, 0.0);
    for (j = best - 1; j >= (sweep->row >= 0 ? 1 : 0); j--) {
        double deviation = deviation_without(sweep, j, sweep->queue[j + 1], sweep->deviation[j + 1]);
        if (deviation >= *least) continue;
        *least = deviation;
        best = j;
    }
    return best;
}

/* Appends a tip, whose segment goes straight to it; a full queue leaves another one out [2]. */
static void append(struct chip_sweep *sweep, const double tip[3])
{
    double least = 0.0;
    int i, slot = sweep->waiting;
    if (slot == CHIP_SWEEP_QUEUE) {
        slot = least_needed(sweep, tip, &least);
        drop_tip(sweep, slot);
    }
    for (i = 0; i < 3; i++) sweep->queue[sweep->waiting][i] = tip[i];
    sweep->deviation[sweep->waiting++] = 0.0;
    sweep->deviation[slot] = least;
}

/* [5] Whether the newest waiting segment was made to end at `tip`: everything merged into it stays near it. */
static int merged(struct chip_sweep *sweep, const double tip[3])
{
    int i, last = sweep->waiting - 1;
    double deviation;
    if (last < 0 || (last == 0 && sweep->row >= 0)) return 0; /* part of it is cut */
    deviation = deviation_without(sweep, last, tip, 0.0);
    if (deviation > CHIP_MERGE_DEVIATION * chip_max(1.0, last)) return 0;
    sweep->deviation[last] = deviation;
    for (i = 0; i < 3; i++) sweep->queue[last][i] = tip[i];
    return 1;
}

void chip_sweep_to(struct chip_sweep *sweep, const double tip[3])
{
    if (!is_position(tip)) return;
    if (!sweep->known) {
        chip_sweep_start(sweep, tip);
        return;
    }
    if (!sweep->waiting && sweep->start_is_cut && tip[0] == sweep->at[0] && tip[1] == sweep->at[1]
        && tip[2] == sweep->at[2])
        return; /* it is at rest, and all is cut */
    if (!merged(sweep, tip)) append(sweep, tip);
}

/* How far back, mm, a path that turns or tilts by `bend` over `length` stays within CHIP_MERGE_DEVIATION of its line [4]. */
static double line_before(double length, double bend)
{
    if (bend > CHIP_HEADING_CORNER) return 0.0;
    return bend > 0.0 ? chip_sqrt(2.0 * CHIP_MERGE_DEVIATION * length / bend) : CHIP_STRAIGHT_MAX;
}

/* [4] How far before the start of the segment (dx, dy, dz), mm in XY, the tool was on its line: less if the path bends. */
static double straight_before(const struct chip_sweep *sweep, double dx, double dy, double dz, double length)
{
    double turn, tilt;
    if (!(sweep->straight > 0.0) || !(length > 0.0)) return 0.0;
    if (dx * sweep->heading[0] + dy * sweep->heading[1] <= 0.0) return 0.0;
    CHIP_FAULT(ONE_SEGMENT_ONLY, return 0.0);
    CHIP_FAULT(RAMPS_BY_ONE_SEGMENT, if (dz != 0.0) return 0.0);
    turn = fabs(dy * sweep->heading[0] - dx * sweep->heading[1]) / length;
    tilt = fabs(dz / length - sweep->rise);
    return chip_min(sweep->straight, line_before(length, chip_max(turn, tilt)));
}

/* [4] The segment is finished. */
static void note_straight(struct chip_sweep *sweep, const double from[3], const double to[3])
{
    double dx = to[0] - from[0], dy = to[1] - from[1], dz = to[2] - from[2];
    double length = chip_sqrt(dx * dx + dy * dy), before = straight_before(sweep, dx, dy, dz, length);
    if (!(length > 0.0) || fabs(dz) > CHIP_PLUNGE_SLOPE * length) {
        sweep->straight = 0.0;
        return;
    }
    sweep->straight = chip_min(before + length, CHIP_STRAIGHT_MAX);
    sweep->heading[0] = dx / length;
    sweep->heading[1] = dy / length;
    sweep->rise = dz / length;
}

/* The distances from the axis at which all four points of a cell are below the arc of the tool's end, or its cone. */
static void round_zones(struct chip_sweep_segment *segment, const struct chip_stock *stock,
                        const struct chip_tool *tool)
{
    double reach = CHIP_GAUSS_REACH * stock->cell, from = tool->r_flat > 0.0 ? tool->r_flat + reach : 0.0;
    double arc = tool->r_arc - reach, rim = tool->radius - reach;
    segment->round_not_up = !segment->flat_end && segment->dz <= 0.0;
    if (!segment->round_not_up) return;
    segment->arc_from2 = from * from;
    segment->arc_to2 = arc > 0.0 ? arc * arc : 0.0;
    segment->cone_from2 = (tool->r_arc + reach) * (tool->r_arc + reach);
    segment->cone_to2 = rim > 0.0 ? rim * rim : 0.0;
}

static struct chip_sweep_segment make_segment(const struct chip_sweep *sweep, const struct chip_stock *stock,
                                              const struct chip_tool *tool, long *work)
{
    const double *from = sweep->at, *to = sweep->queue[0];
    struct chip_sweep_segment segment;
    double inner, lowest;
    int level_or_up = to[2] >= from[2];

    segment.x = from[0];
    segment.y = from[1];
    segment.z = from[2];
    segment.dx = to[0] - from[0];
    segment.dy = to[1] - from[1];
    segment.dz = to[2] - from[2];
    segment.length2 = segment.dx * segment.dx + segment.dy * segment.dy;
    segment.length = chip_sqrt(segment.length2);
    segment.per_length2 = segment.length2 > 0.0 ? 1.0 / segment.length2 : 0.0;
    segment.flat_end = chip_tool_is_flat(tool);
    segment.earliest = 0.0;
    if (!segment.flat_end)
        segment.earliest = -chip_min(straight_before(sweep, segment.dx, segment.dy, segment.dz, segment.length),
                                     CHIP_BACK_CELLS * stock->cell)
                         * segment.length * segment.per_length2;
    lowest = segment.z + chip_min(segment.dz, segment.earliest * segment.dz);
    segment.margin = stock->cell * 0.7071067811865476;
    segment.cell_area = stock->cell * stock->cell;
    segment.reach = chip_tool_reach(tool, stock->z_max - lowest);
    segment.bottom = (float)chip_max(lowest, stock->z_min);
    inner = tool->radius - segment.margin;
    segment.inner2 = inner > 0.0 ? inner * inner : -1.0;
    inner = (tool->r_flat < tool->radius ? tool->r_flat : tool->radius) - segment.margin;
    segment.floor2 = inner > 0.0 ? inner * inner : -1.0;
    segment.outer2 = (segment.reach + segment.margin) * (segment.reach + segment.margin);
    /* its rim is above the stock */
    if (segment.reach < CHIP_INNER_SHARE * tool->radius) segment.inner2 = segment.outer2;
    round_zones(&segment, stock, tool);
    segment.flat = segment.flat_end && segment.dz == 0.0;
    segment.skip_disc = sweep->start_is_cut && level_or_up && segment.floor2 > 0.0;
    segment.skip_back = sweep->start_is_cut && level_or_up;
    segment.back_is_cut = sweep->start_is_cut && segment.dz < 0.0 && !segment.flat_end && segment.length2 > 0.0;
    if (segment.skip_back && segment.length2 <= 0.0) segment.reach = 0.0; /* a retract cuts nothing */
    segment.work = work;
    return segment;
}

/* Rows a segment touches. */
static struct chip_span segment_rows(const struct chip_sweep_segment *segment, const struct chip_stock *stock)
{
    double radius = segment->reach + segment->margin;
    double lo = chip_min(segment->y, segment->y + segment->dy) - radius;
    double hi = chip_max(segment->y, segment->y + segment->dy) + radius;
    struct chip_span rows;
    rows.first = (int)chip_clamp(floor((lo - stock->y0) / stock->cell), 0.0, stock->ny);
    rows.last = (int)chip_clamp(floor((hi - stock->y0) / stock->cell), -1.0, stock->ny - 1.0);
    if (segment->reach <= 0.0) rows.last = rows.first - 1;
    return rows;
}

/* Removes the finished segment from the queue. */
static void advance(struct chip_sweep *sweep)
{
    int i;
    note_straight(sweep, sweep->at, sweep->queue[0]);
    for (i = 0; i < 3; i++) sweep->at[i] = sweep->queue[0][i];
    drop_tip(sweep, 0);
    sweep->start_is_cut = 1;
    sweep->finished++;
    sweep->row = -1;
}

long chip_sweep_level_work(const struct chip_stock *stock, const struct chip_tool *tool)
{
    double radius = tool->radius / stock->cell, flat = tool->r_flat / stock->cell;
    double front = 0.5 * CHIP_PI * (radius * radius - flat * flat);
    return (long)chip_min((2.0 + CHIP_WORK_CURVED) * front + 2.0 * CHIP_WORK_ROW * radius, 1e9);
}

double chip_sweep_run(struct chip_sweep *sweep, struct chip_stock *stock, const struct chip_tool *tool, long bound,
                      long *spent)
{
    double removed = 0.0;
    long work = 0;
    if (!sweep->waiting) return 0.0;
    chip_stock_begin_write(stock);
    while (sweep->waiting > 0 && work < bound) {
        struct chip_sweep_segment segment = make_segment(sweep, stock, tool, &work);
        if (sweep->row < 0) {
            struct chip_span rows = segment_rows(&segment, stock);
            sweep->row = rows.first;
            sweep->row_end = rows.last;
            sweep->column = 0;
        }
        while (sweep->row <= sweep->row_end && work < bound) {
            removed += chip_sweep_row(&segment, stock, tool, sweep->row, 0, &sweep->column, bound);
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

double chip_sweep_meets(const struct chip_stock *stock, const struct chip_tool *tool, const double from[3],
                        const double to[3], int start_is_cut, double enough, long *spent)
{
    struct chip_sweep sweep;
    struct chip_sweep_segment segment;
    struct chip_span rows;
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
        met += chip_sweep_row(&segment, stock, tool, rows.first, 1, &column, CHIP_ROW_DONE);
    if (spent) *spent += work;
    return met;
}
