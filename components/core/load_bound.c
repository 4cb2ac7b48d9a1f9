/* SPDX-License-Identifier: GPL-2.0-or-later */
/* load_bound.c - how high the load between the samples of the look-ahead may be: see samples.h and lookahead.h; the
 * numbers in brackets are those of its principle. */
#include "samples.h"

/* of a load, a change from one sample to the next that is a jump; larger reads steep walls as ramps */
#define CHIP_LOAD_JUMP 0.15
/* of the mean of load and full area: change of the slope per cell that marks an edge of the stock */
#define CHIP_SLOPE_CHANGE 0.025
#define CHIP_MIN_CHANGE 0.01  /* of the full area, a change that is ignored */
#define CHIP_LATE_RISE 0.5    /* cells [6] */
#define CHIP_LATE_STEEP 1.0   /* the same if it rises within a cell by */
#define CHIP_STEEP_RISE 0.28  /* of the full area */
#define CHIP_LATE_AT_ONCE 0.5 /* the same if it comes at once (a tool that meets a wall of its own radius) */
#define CHIP_AT_ONCE 0.45     /* of the full area, a rise within a cell that counts as at once */
#define CHIP_STEP_WIDTH 2.5   /* cells over which the map spreads such a rise */
/* cells from a sample to others that its interval depends on, and some room: a cell ahead, CHIP_STEP_WIDTH behind */
#define CHIP_CELLS_AHEAD 1.01
#define CHIP_CELLS_TOOTH 2.01 /* and CHIP_TOOTH_AHEAD of tooth_profile.c, if the tool has limits */
#define CHIP_CELLS_BEHIND (CHIP_STEP_WIDTH + 0.01)
/* cells behind the tool whose load it may still meet: the map spreads a fall to both sides [6] */
#define CHIP_TRAILING 0.5
/* cells of width that a reading beside a wall or a rim misses at most: 0.22, 0.29, 0.33 were measured; smaller reads
 * low */
#define CHIP_WIDTH_ERROR 0.33
#define CHIP_PEAK 1.0 /* of the height of a sample above its neighbours' line, added to it [6] */
/* the same up to the higher neighbour: where a rise bends to level, cells spread the bend over both */
#define CHIP_BENT_RISE 2.0
#define CHIP_BEND 0.5 /* of the slope before a sample, at most, that behind it if a rise bends there */
/* of its height above the line between the samples a cell away: cells smooth a peak */
#define CHIP_SMOOTHED_PEAK 1.0
#define CHIP_DIP 0.5 /* of its depth below that line */

/* Whether the path turns a corner, sharp or blended, from sample i to sample k: there the load changes with the
 * direction, which no cell smooths [7]. */
static int turns_corner(const struct chip_lookahead *lookahead, int i, int k)
{
    int n;
    for (n = i + 1; n <= k; n++)
        if (is_corner(lookahead, n)) return 1;
    return lookahead->corner_turn[sample_slot(lookahead, k)] > lookahead->corner_turn[sample_slot(lookahead, i)];
}

/* Height of the load at sample i above the line between sample `before` and sample `behind`, mm2. */
static double above_chord(const struct chip_lookahead *lookahead, int before, int i, int behind)
{
    double a = sample_s(lookahead, i) - sample_s(lookahead, before),
           b = sample_s(lookahead, behind) - sample_s(lookahead, i);
    return sample_area(lookahead, i)
         - (sample_area(lookahead, before) * b + sample_area(lookahead, behind) * a) / (a + b);
}

/* The same at sample i if a rise bends there: the cells spread the bend over the samples on both sides. `off`: its
 * height above their line. */
static double bent_rise(const struct chip_lookahead *lookahead, int i, double off)
{
    double before = (sample_area(lookahead, i) - sample_area(lookahead, i - 1))
                  / chip_max(CHIP_MIN_LOAD, sample_s(lookahead, i) - sample_s(lookahead, i - 1)),
           behind = (sample_area(lookahead, i + 1) - sample_area(lookahead, i))
                  / chip_max(CHIP_MIN_LOAD, sample_s(lookahead, i + 1) - sample_s(lookahead, i));
    if (behind <= 0.0 || behind > CHIP_BEND * before) return 0.0;
    return chip_min(CHIP_BENT_RISE * off, sample_area(lookahead, i + 1) - sample_area(lookahead, i));
}

/* How far the load may exceed a sample, mm2 [6]: as far as the sample leaves the line between its neighbours or, where
 * the cells smooth a peak or the end of a rise, by a share of its height above the line between the samples a cell
 * away. */
static double curvature_allowance(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double off, direct, smoothed, higher, s = sample_s(lookahead, i);
    int last = lookahead->first + lookahead->count - 1, before = i - 1, behind = i + 1;
    if (i <= lookahead->first || i + 1 >= lookahead->first + lookahead->count) return 0.0;
    if (turns_corner(lookahead, before, behind)) return 0.0;
    off = above_chord(lookahead, before, i, behind);
    direct = off > 0.0 ? chip_max(CHIP_PEAK * off, bent_rise(lookahead, i, off)) : -CHIP_DIP * off;
    if (s - sample_s(lookahead, before) >= stock->cell && sample_s(lookahead, behind) - s >= stock->cell) return direct;
    while (before > lookahead->first && !is_corner(lookahead, before) && s - sample_s(lookahead, before) < stock->cell)
        before--;
    while (behind < last && !is_corner(lookahead, behind + 1) && sample_s(lookahead, behind) - s < stock->cell)
        behind++;
    smoothed = CHIP_SMOOTHED_PEAK * above_chord(lookahead, before, i, behind);
    higher = chip_max(sample_area(lookahead, before), sample_area(lookahead, behind)) - sample_area(lookahead, i);
    if (higher > 0.0) smoothed = chip_min(smoothed, higher);
    return chip_max(direct, smoothed);
}

/* Area of a sample, never too low [6]. */
static double bound_of(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double area = sample_area(lookahead, i), full = lookahead->full_area[sample_slot(lookahead, i)];
    int k;
    if (lookahead->read_clear[sample_slot(lookahead, i)])
        for (k = 1; k <= CHIP_CLEAR_BACK && i - k >= lookahead->first && !turns_corner(lookahead, i - k, i); k++)
            area = chip_max(area, sample_area(lookahead, i - k));
    return area >= full ? area : chip_max(area, chip_min(area + curvature_allowance(lookahead, stock, i), full));
}

/* Load at the tool, the best estimate: between the samples around it [3]. */
double chip_load_now(const struct chip_lookahead *lookahead)
{
    double a, b;
    int i;
    if (lookahead->count == 0) return lookahead->begin_area;
    i = last_passed(lookahead);
    a = sample_s(lookahead, i);
    b = sample_s(lookahead, i + 1);
    if (b <= a) return sample_area(lookahead, i);
    return sample_area(lookahead, i)
         + (lookahead->at_s - a) / (b - a) * (sample_area(lookahead, i + 1) - sample_area(lookahead, i));
}

/* Whether the slope of the load changes at sample i as it does at an edge of the stock [6]. */
static int slope_changes(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double closest = CHIP_CLOSEST * stock->cell, a = sample_area(lookahead, i - 1), m = sample_area(lookahead, i),
           b = sample_area(lookahead, i + 1);
    double before, behind;
    if (i <= lookahead->first || i + 1 >= lookahead->first + lookahead->count || is_corner(lookahead, i)
        || is_corner(lookahead, i + 1))
        return 0;
    before = (m - a) / chip_max(closest, sample_s(lookahead, i) - sample_s(lookahead, i - 1));
    behind = (b - m) / chip_max(closest, sample_s(lookahead, i + 1) - sample_s(lookahead, i));
    return fabs(behind - before) * stock->cell
         > CHIP_SLOPE_CHANGE * 0.5 * (lookahead->full_area[sample_slot(lookahead, i)] + chip_max(m, chip_max(a, b)))
               + CHIP_MIN_LOAD;
}

/* Whether the load jumps from sample i - 1 to i. */
int chip_load_jumps(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double a = sample_area(lookahead, i - 1), b = sample_area(lookahead, i), change = fabs(b - a), slope;
    double full = lookahead->full_area[sample_slot(lookahead, i)], least = CHIP_CLOSEST * stock->cell;
    if (is_corner(lookahead, i) || i <= lookahead->first) return 0;
    if (limits_tooth(lookahead) && chip_tooth_jumps(lookahead, i)) return 1;
    if (change > CHIP_LOAD_JUMP * chip_max(a, b) + CHIP_MIN_CHANGE * full + CHIP_MIN_LOAD) return 1;
    slope = change * stock->cell / chip_max(least, sample_s(lookahead, i) - sample_s(lookahead, i - 1));
    return slope > CHIP_MIN_CHANGE * full + CHIP_MIN_LOAD
        && (slope_changes(lookahead, stock, i - 1) || slope_changes(lookahead, stock, i));
}

/* How far along the path the cells may displace the reading of sample i, mm [6]. */
static double position_error(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    return lookahead->position_error[sample_slot(lookahead, i)] * stock->cell;
}

/* Where the load of sample i may begin if it comes at once: the rise within CHIP_STEP_WIDTH cells then belongs to
 * that step. Otherwise the position of the sample before [6]. */
static double step_begin(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double at_once = CHIP_AT_ONCE * lookahead->full_area[sample_slot(lookahead, i)] + CHIP_MIN_LOAD,
           begin = sample_s(lookahead, i - 1);
    double reach = sample_s(lookahead, i) - CHIP_STEP_WIDTH * position_error(lookahead, stock, i);
    int k, up = i;
    if (sample_area(lookahead, i) < at_once || sample_area(lookahead, i) <= sample_area(lookahead, i - 1)) return begin;
    for (k = i - 1; k >= lookahead->first && sample_s(lookahead, k) > reach && !is_corner(lookahead, k + 1); k--) {
        while (up - 1 > k && sample_s(lookahead, up - 1) - sample_s(lookahead, k) >= stock->cell) up--;
        if (sample_area(lookahead, up) - sample_area(lookahead, k) > at_once)
            begin = sample_s(lookahead, k) - CHIP_LATE_AT_ONCE * position_error(lookahead, stock, i);
    }
    return begin;
}

/* How far, mm, before the jump up from sample i - 1 to i the load may rise [6]. */
static double late_rise(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    int k = i - 1;
    while (k > lookahead->first && !is_corner(lookahead, k)
           && sample_s(lookahead, i) - sample_s(lookahead, k) < stock->cell)
        k--;
    return (sample_area(lookahead, i) - sample_area(lookahead, k)
                    > CHIP_STEEP_RISE * lookahead->full_area[sample_slot(lookahead, i)]
                ? CHIP_LATE_STEEP
                : CHIP_LATE_RISE)
         * position_error(lookahead, stock, i);
}

/* The load between sample i - 1, whose bound is `bound_before`, and sample i. */
static struct chip_load_interval interval_between(const struct chip_lookahead *lookahead,
                                                  const struct chip_stock *stock, int i, double bound_before)
{
    struct chip_load_interval interval;
    double begin, half = 0.5 * lookahead->turn[sample_slot(lookahead, i)];
    interval.from = sample_s(lookahead, i - 1);
    interval.to = sample_s(lookahead, i);
    interval.a = bound_before;
    interval.b = interval.bound = bound_of(lookahead, stock, i);
    interval.jump = !chip_load_jumps(lookahead, stock, i)
                      ? 0
                      : (sample_area(lookahead, i) > sample_area(lookahead, i - 1) ? 1 : -1);
    if (half > 0.0 && !is_corner(lookahead, i)) { /* 1 / cos of a small angle */
        interval.a *= 1.0 + 0.55 * half * half;
        interval.b *= 1.0 + 0.55 * half * half;
    }
    begin = is_corner(lookahead, i) ? interval.from : step_begin(lookahead, stock, i);
    if (begin < interval.from) interval.jump = 1;
    if (interval.jump) {
        if (interval.jump > 0)
            interval.from = chip_min(begin, interval.from - late_rise(lookahead, stock, i));
        else
            interval.to += CHIP_LATE_FALL * position_error(lookahead, stock, i);
        interval.a = interval.b = chip_max(interval.a, interval.b);
    }
    return interval;
}

/* [6] An interval depends on the samples up to the first one that is a cell farther on, and back to the first one that is
 * CHIP_STEP_WIDTH cells behind. */
void chip_load_forget(struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double before = sample_s(lookahead, i - 1), behind = sample_s(lookahead, i + 1);
    double ahead = (limits_tooth(lookahead) ? CHIP_CELLS_TOOTH : CHIP_CELLS_AHEAD) * stock->cell;
    int k, last = lookahead->first + lookahead->count - 1;
    CHIP_FAULT(INTERVALS_KEPT, lookahead->completed[slot_of(i)] = 0; return );
    for (k = i; k >= lookahead->first && (k > i - 3 || before - sample_s(lookahead, k) <= ahead); k--)
        lookahead->completed[slot_of(k)] = 0;
    for (k = i; k <= last && (k < i + 4 || sample_s(lookahead, k - 1) - behind <= CHIP_CELLS_BEHIND * stock->cell); k++)
        lookahead->completed[slot_of(k)] = 0;
}

void chip_load_complete(struct chip_lookahead *lookahead, const struct chip_stock *stock)
{
    int i, last = lookahead->first + lookahead->count - 1;
    for (i = lookahead->first; i <= last; i++) {
        if (lookahead->completed[slot_of(i)]) continue;
        lookahead->interval[slot_of(i)] = interval_between(lookahead, stock, i,
                                                           i > lookahead->first ? interval_of(lookahead, i - 1)->bound
                                                                                : bound_of(lookahead, stock, i));
        if (limits_tooth(lookahead)) lookahead->between[slot_of(i)] = chip_tooth_between(lookahead, stock, i);
        lookahead->completed[slot_of(i)] = 1;
    }
}

/* Largest load from `from` to `to`, which overlap the interval. */
static double largest(const struct chip_load_interval *interval, double from, double to)
{
    double length = interval->to - interval->from, slope = length > 0.0 ? (interval->b - interval->a) / length : 0.0;
    double u = chip_clamp(from - interval->from, 0.0, length), v = chip_clamp(to - interval->from, 0.0, length);
    return interval->a + chip_max(slope * u, slope * v);
}

/* Largest load at the tool and as far ahead as it travels before another command takes effect, never too
 * low [3] [6]. If it falls without a jump the load CHIP_TRAILING cells back counts, as far as cells may hide it. */
double chip_load_bound_now(const struct chip_lookahead *lookahead, const struct chip_stock *stock)
{
    double to = lookahead->at_s + lookahead->latency_travel, full = 0.0, behind = 0.0, max_depth = 0.0;
    int i, last = lookahead->first + lookahead->count - 1;
    if (lookahead->count == 0) return lookahead->begin_area;
    if (sample_s(lookahead, lookahead->first) > lookahead->at_s) full = interval_of(lookahead, lookahead->first)->bound;
    if (lookahead->at_s < lookahead->begin_s + lookahead->spacing) full = chip_max(full, lookahead->begin_area);
    if (sample_s(lookahead, last) <= to) full = chip_max(full, interval_of(lookahead, last)->bound);
    for (i = lookahead->first + 1; i <= last; i++) {
        const struct chip_load_interval *interval = interval_of(lookahead, i);
        double back;
        if (sample_s(lookahead, i - 1) - (CHIP_STEP_WIDTH + CHIP_LATE_AT_ONCE) * stock->cell > to) break;
        if (interval->from > to) continue;
        if (interval->to > lookahead->at_s) full = chip_max(full, largest(interval, lookahead->at_s, to));
        back = lookahead->at_s - (interval->jump ? 0.0 : CHIP_TRAILING * position_error(lookahead, stock, i));
        if (interval->to <= back) continue;
        behind = chip_max(behind, largest(interval, back, to));
        max_depth = chip_max(max_depth, lookahead->depth[sample_slot(lookahead, i)]);
    }
    return chip_max(full, chip_min(behind, full + CHIP_WIDTH_ERROR * stock->cell * max_depth));
}
