/* SPDX-License-Identifier: GPL-2.0-or-later */
/* lookahead.c - see lookahead.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "lookahead.h"

#define CHIP_PATH_TOLERANCE 0.05      /* cells the tool may deviate from its predicted path */
#define CHIP_GRAIN 0.5            /* cells between the points the predicted path is read from */
#define CHIP_SAME_POINT 0.04            /* cells between an old and a new point that are treated as one */
#define CHIP_NEAR_POINT 4.0             /* cells: an old sample this near may replace a new one */
#define CHIP_SAME_DIRECTION 0.9           /* cosine between old and new direction from which samples are carried over */
#define CHIP_REVERSED (-0.5)        /* and from which the load at the tool stays a lower bound */
#define CHIP_SPACING_RADII 0.0625     /* tool radii between samples; never below one cell nor above four */
#define CHIP_SAMPLE_NODES 8       /* work of a sample beside that of its nodes, in nodes */
#define CHIP_CARRY_NODES 2        /* and of carrying one over to a new predicted path */
/* cells between samples where the load jumps [5]; smaller takes more work, larger places jumps too early */
#define CHIP_CLOSEST 0.25
/* of a load, a change from one sample to the next that is a jump; larger reads steep walls as ramps */
#define CHIP_LOAD_JUMP 0.15
/* of the mean of load and full area: change of the slope per cell that marks an edge of the stock */
#define CHIP_SLOPE_CHANGE 0.025
#define CHIP_MIN_CHANGE 0.01          /* of the full area, a change that is ignored */
#define CHIP_LATE_RISE 0.5        /* cells [6] */
#define CHIP_LATE_STEEP 1.0       /* the same if it rises within a cell by */
#define CHIP_STEEP_RISE 0.28           /* of the full area */
#define CHIP_LATE_AT_ONCE 0.5        /* the same if it comes at once (a tool that meets a wall of its own radius) */
#define CHIP_AT_ONCE 0.45         /* of the full area, a rise within a cell that counts as at once */
#define CHIP_STEP_WIDTH 2.5            /* cells over which the map spreads such a rise */
#define CHIP_LATE_FALL 1.0        /* cells [6] */
/* cells behind the tool whose load it may still meet: the map spreads a fall to both sides [6] */
#define CHIP_TRAILING 0.5
/* cells of width that a reading beside a wall or a rim misses at most: 0.22, 0.29, 0.33 were measured; smaller reads
 * low */
#define CHIP_WIDTH_ERROR 0.33
/* a rise by this share between two samples: larger ones make the velocity's straight line exceed the bound */
#define CHIP_EVEN_RISE 0.05
#define CHIP_PEAK 1.0             /* of the height of a sample above its neighbours' line, added to it [6] */
/* of its height above the line between the samples a cell away: cells smooth a peak */
#define CHIP_SMOOTHED_PEAK 1.0
#define CHIP_DIP 0.5              /* of its depth below that line */
#define CHIP_CLEAR_BACK 2          /* samples before one that is read clear which count for it too */
#define CHIP_TURN_STEP 0.35       /* rad the path turns by between two samples at most */
#define CHIP_TIGHT_TURN 2.0       /* tool radius over the path's, from which an arc counts as a corner (a blend) */
#define CHIP_PASSED_TURN 0.35           /* rad, a sample behind more turn than this is taken again [2] */
/* tool radius over the path's, above which a sample near the tool reads low and is not taken again */
#define CHIP_TIGHT_ARC 1.05
#define CHIP_MIN_LOAD 1e-3           /* mm2, smaller loads do not count as contact */
#define CHIP_BRAKE_MARGIN 1.2       /* of the braking distance: no load step beyond it binds */
#define CHIP_BRAKE_PERIODS 6.0    /* periods of acceleration that may add to the velocity meanwhile */
#define CHIP_LATENCY 2.0          /* periods until a command given now takes effect */

double chip_lookahead_spacing(const struct chip_stock *stock, const struct chip_tool *tool)
{
    return chip_clamp(CHIP_SPACING_RADII * tool->radius, stock->cell, 4.0 * stock->cell);
}

void chip_lookahead_reset(struct chip_lookahead *lookahead)
{
    chip_predicted_path_reset(&lookahead->predicted);
    lookahead->first = lookahead->count = lookahead->stale = lookahead->on_path = 0;
    lookahead->begin_area = lookahead->at_s = lookahead->spacing = lookahead->next_spacing = lookahead->begin_s =
        lookahead->latency_travel = lookahead->jerk_travel = lookahead->jerk_gain = 0.0;
}

/* Index of sample i. */
static int slot_of(int i) { return i % CHIP_LOOKAHEAD_SAMPLES; }

/* Slot of sample i; beyond the ends that of the nearest one. */
static int sample_slot(const struct chip_lookahead *lookahead, int i)
{
    int last = lookahead->first + lookahead->count - 1;
    return slot_of(i < lookahead->first ? lookahead->first : (i > last ? last : i));
}

static double sample_area(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->area[sample_slot(lookahead, i)];
}

static double sample_s(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->s[sample_slot(lookahead, i)];
}

static int is_corner(const struct chip_lookahead *lookahead, int i)
{
    return lookahead->corner[sample_slot(lookahead, i)];
}

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
    direct = off > 0.0 ? CHIP_PEAK * off : -CHIP_DIP * off;
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
static double area_bound(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double area = sample_area(lookahead, i), full = lookahead->full_area[sample_slot(lookahead, i)];
    int k;
    if (lookahead->read_clear[sample_slot(lookahead, i)])
        for (k = 1; k <= CHIP_CLEAR_BACK && i - k >= lookahead->first && !turns_corner(lookahead, i - k, i); k++)
            area = chip_max(area, sample_area(lookahead, i - k));
    return area >= full ? area : chip_max(area, chip_min(area + curvature_allowance(lookahead, stock, i), full));
}

/* Number of the last sample the tool has passed; one less than the first if there is none. */
static int last_passed(const struct chip_lookahead *lookahead)
{
    int i = lookahead->first, last = lookahead->first + lookahead->count - 1;
    while (i <= last && lookahead->s[slot_of(i)] <= lookahead->at_s) i++;
    return i - 1;
}

/* Load at the tool, the best estimate: between the samples around it [3]. */
static double area_now(const struct chip_lookahead *lookahead)
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

/* The load between sample i - 1 and sample i [6] [7]. */
struct interval {
    double from, to;            /* mm, where it applies */
    double a, b;                /* mm2 at its ends; linear between them, or the larger one throughout */
    int jump;                   /* 1: up, -1: down */
};

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
static int jumps(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    double a = sample_area(lookahead, i - 1), b = sample_area(lookahead, i), change = fabs(b - a), slope;
    double full = lookahead->full_area[sample_slot(lookahead, i)], least = CHIP_CLOSEST * stock->cell;
    if (is_corner(lookahead, i) || i <= lookahead->first) return 0;
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

static struct interval interval_bound(const struct chip_lookahead *lookahead, const struct chip_stock *stock, int i)
{
    struct interval interval;
    double begin, half = 0.5 * lookahead->turn[sample_slot(lookahead, i)];
    interval.from = sample_s(lookahead, i - 1);
    interval.to = sample_s(lookahead, i);
    interval.a = area_bound(lookahead, stock, i - 1);
    interval.b = area_bound(lookahead, stock, i);
    interval.jump =
        !jumps(lookahead, stock, i) ? 0 : (sample_area(lookahead, i) > sample_area(lookahead, i - 1) ? 1 : -1);
    if (half > 0.0 && !is_corner(lookahead, i)) {          /* 1 / cos of a small angle */
        interval.a *= 1.0 + 0.55 * half * half;
        interval.b *= 1.0 + 0.55 * half * half;
    }
    begin = is_corner(lookahead, i) ? interval.from : step_begin(lookahead, stock, i);
    if (begin < interval.from) interval.jump = 1;
    if (interval.jump) {
        if (interval.jump > 0) interval.from = chip_min(begin, interval.from - late_rise(lookahead, stock, i));
        else interval.to += CHIP_LATE_FALL * position_error(lookahead, stock, i);
        interval.a = interval.b = chip_max(interval.a, interval.b);
    }
    return interval;
}

/* Largest load from `from` to `to`, which overlap the interval. */
static double largest(const struct interval *interval, double from, double to)
{
    double length = interval->to - interval->from, slope = length > 0.0 ? (interval->b - interval->a) / length : 0.0;
    double u = chip_clamp(from - interval->from, 0.0, length), v = chip_clamp(to - interval->from, 0.0, length);
    return interval->a + chip_max(slope * u, slope * v);
}

/* Largest load at the tool and as far ahead as it travels before another command takes effect, never too
 * low [3] [6]. If it falls without a jump the load CHIP_TRAILING cells back counts, as far as cells may hide it. */
static double area_bound_now(const struct chip_lookahead *lookahead, const struct chip_stock *stock)
{
    double to = lookahead->at_s + lookahead->latency_travel, full = 0.0, behind = 0.0, max_depth = 0.0;
    int i, last = lookahead->first + lookahead->count - 1;
    if (lookahead->count == 0) return lookahead->begin_area;
    if (sample_s(lookahead, lookahead->first) > lookahead->at_s) full = area_bound(lookahead, stock, lookahead->first);
    if (lookahead->at_s < lookahead->begin_s + lookahead->spacing) full = chip_max(full, lookahead->begin_area);
    if (sample_s(lookahead, last) <= to) full = chip_max(full, area_bound(lookahead, stock, last));
    for (i = lookahead->first + 1; i <= last; i++) {
        struct interval interval;
        double back;
        if (sample_s(lookahead, i - 1) - (CHIP_STEP_WIDTH + CHIP_LATE_AT_ONCE) * stock->cell > to) break;
        interval = interval_bound(lookahead, stock, i);
        if (interval.from > to) continue;
        if (interval.to > lookahead->at_s) full = chip_max(full, largest(&interval, lookahead->at_s, to));
        back = lookahead->at_s - (interval.jump ? 0.0 : CHIP_TRAILING * position_error(lookahead, stock, i));
        if (interval.to <= back) continue;
        behind = chip_max(behind, largest(&interval, back, to));
        max_depth = chip_max(max_depth, lookahead->depth[sample_slot(lookahead, i)]);
    }
    return chip_max(full, chip_min(behind, full + CHIP_WIDTH_ERROR * stock->cell * max_depth));
}

/* Cosine between the old predicted path at `s` and the beginning of the new one. */
static double direction_cosine(const struct chip_predicted_path *old, const struct chip_predicted_path *new, double s)
{
    double at[3], was[3], is[3];
    chip_segment_at(&old->segment, s, at, was);
    chip_segment_at(&new->segment, 0.0, at, is);
    return was[0] * is[0] + was[1] * is[1] + was[2] * is[2];
}

/* Area met by a tool with stock all round, mm2: a full slot and a full plunge. */
static double full_area(const struct chip_tool *tool, const double dir[3], double depth)
{
    double plunge = dir[2] < 0.0 ? -dir[2] * CHIP_PI * tool->radius * tool->radius : 0.0;
    return 2.0 * tool->radius * depth * chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]) + plunge;
}

/* Cells along the path by which the cells may displace a reading: one horizontally; none for a flat end that goes
 * straight down, as heights are known; a sloping end meets slopes, where a cell sideways changes the height by the
 * slope [6]. */
static double cell_error(const struct chip_tool *tool, double level)
{
    return tool->corner > 0.0 ? 1.0 : chip_max(level, chip_min(1.0, tool->slope));
}

/* [2] Carries the usable samples of the old predicted path over to the new one. `old` is the
 * path before, whose `travelled` is where the new one begins. */
static void carry_over(struct chip_lookahead *lookahead, const struct chip_predicted_path *old, double step,
                       const struct chip_stock *stock, const struct chip_tool *tool)
{
    const double along[3] = { lookahead->predicted.segment.horizontal, 0.0, lookahead->predicted.segment.vertical };
    float area[CHIP_LOOKAHEAD_SAMPLES], depth[CHIP_LOOKAHEAD_SAMPLES];
    double spacing = lookahead->spacing, begin = (old->travelled + step) / spacing;
    int last = lookahead->first + lookahead->count - 1, n = 0, same = 0, i;

    if (direction_cosine(old, &lookahead->predicted, begin * spacing) < CHIP_SAME_DIRECTION)
        last = lookahead->first - 1;
    for (i = 0; i < CHIP_LOOKAHEAD_SAMPLES; i++) {
        double was[3], is[3], dir[3], off2, s = begin + i, share;
        int a = (int)floor(s), k;
        if (a < lookahead->first || a + 1 > last) break;
        chip_segment_at(&old->segment, s * spacing, was, dir);
        chip_segment_at(&lookahead->predicted.segment, i * spacing, is, dir);
        off2 = 0.0;
        for (k = 0; k < 3; k++) off2 += (was[k] - is[k]) * (was[k] - is[k]);
        if (off2 > CHIP_NEAR_POINT * CHIP_NEAR_POINT * stock->cell * stock->cell) break;
        if (same == n && a + 1 < lookahead->stale
            && off2 < CHIP_SAME_POINT * CHIP_SAME_POINT * stock->cell * stock->cell) same++;
        share = s - a;
        area[n] =
            (float)(sample_area(lookahead, a) + share * (sample_area(lookahead, a + 1) - sample_area(lookahead, a)));
        depth[n] = (float)chip_max(lookahead->depth[a % CHIP_LOOKAHEAD_SAMPLES],
                                 lookahead->depth[(a + 1) % CHIP_LOOKAHEAD_SAMPLES]);
        n++;
    }
    for (i = 0; i < n; i++) {
        lookahead->s[i] = i * spacing;
        lookahead->area[i] = area[i];
        lookahead->full_area[i] = (float)full_area(tool, along, depth[i]);
        lookahead->position_error[i] = (float)cell_error(tool, along[0]);
        lookahead->turn[i] = 0.0f;
        lookahead->corner_turn[i] = 0.0;
        lookahead->corner[i] = lookahead->read_clear[i] = 0;
        lookahead->depth[i] = depth[i];
    }
    lookahead->first = 0;
    lookahead->count = n;
    lookahead->stale = same;
}

/* How far clear of the tool's outline a point `in_front` mm in front of the tool must be read, mm [2]: so far that
 * beside the path, where the outlines part last, the reading lies chip_section_clear outside the tool's present
 * outline. */
static double clear_of_cut(const struct chip_stock *stock, const struct chip_tool *tool, double in_front)
{
    double left = chip_section_reach(stock, tool) - chip_max(0.0, in_front);
    return left > 0.0 ? chip_sqrt(tool->radius * tool->radius + left * left) - tool->radius : 0.0;
}

/* Reads the load at a point into sample i; returns its work, in nodes. */
static int read_sample(struct chip_lookahead *lookahead, const struct chip_stock *stock, const struct chip_tool *tool,
                   int i, const struct chip_path_point *at)
{
    double clear = clear_of_cut(stock, tool, at->s - lookahead->at_s);
    const double *tip = at->tip, *dir = at->dir;
    struct chip_section met;
    int n = slot_of(i);
    met = chip_section_at(stock, tool, tip, dir, clear, at->curvature);
    CHIP_FAULT(CELLS_COUNTED, double cells = stock->cell * stock->cell * met.depth / 0.1;
               met.area = cells * floor(met.area / cells));
    lookahead->area[n] = (float)met.area;
    lookahead->depth[n] = (float)met.depth;
    lookahead->full_area[n] = (float)full_area(tool, at->dir, met.depth);
    lookahead->read_clear[n] = (unsigned char)(clear > 0.0);
    lookahead->position_error[n] = (float)cell_error(tool, chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]));
    return met.nodes + CHIP_SAMPLE_NODES;
}

/* The point `s` on the path the samples lie on. */
static void find_point(const struct chip_lookahead *lookahead, const struct chip_path *path, double s,
                       struct chip_path_point *at)
{
    at->s = s;
    at->curvature = lookahead->predicted.segment.curvature;
    if (lookahead->on_path) at->curvature = chip_path_at(path, s, at->tip, at->dir);
    else chip_segment_at(&lookahead->predicted.segment, s, at->tip, at->dir);
}

/* Takes sample i again at its position; returns its work. */
static int resample(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock,
                    const struct chip_tool *tool, int i)
{
    struct chip_path_point at;
    find_point(lookahead, path, lookahead->s[slot_of(i)], &at);
    if (lookahead->on_path && fabs(at.curvature) * tool->radius > CHIP_TIGHT_ARC) return 1;
    return read_sample(lookahead, stock, tool, i, &at);
}

/* The point of the sample behind the last one; 0 if it is the first. */
static int next_sample_point(const struct chip_lookahead *lookahead, const struct chip_path *path,
                             struct chip_path_point *at)
{
    double last = sample_s(lookahead, lookahead->first + lookahead->count - 1);
    at->turn = 0.0;
    at->corner = 0;
    if (lookahead->count == 0) {
        double first = lookahead->spacing * ceil(chip_max(lookahead->at_s / lookahead->spacing, 0.0));
        find_point(lookahead, path, lookahead->on_path ? lookahead->at_s : first, at);
        return 1;
    }
    if (lookahead->on_path) return chip_path_next(path, last, lookahead->next_spacing, CHIP_TURN_STEP, at);
    find_point(lookahead, path, last + lookahead->spacing, at);
    return 1;
}

/* Adds a sample at the far end; where the load jumps, at a closer point first [5]. Returns its work. */
static int add_sample(struct chip_lookahead *lookahead, const struct chip_stock *stock, const struct chip_tool *tool,
                     const struct chip_path_point *at)
{
    int i = lookahead->first + lookahead->count, n = slot_of(i), work, jump;
    double closest = CHIP_CLOSEST * stock->cell, before = lookahead->count ? at->s - sample_s(lookahead, i - 1) : 0.0;
    double bend = lookahead->count ? lookahead->corner_turn[slot_of(i - 1)] : 0.0;
    int sharp = at->corner ? at->turn > CHIP_PASSED_TURN : fabs(at->curvature) * tool->radius > CHIP_TIGHT_TURN;
    work = read_sample(lookahead, stock, tool, i, at);
    lookahead->s[n] = at->s;
    lookahead->turn[n] = (float)at->turn;
    lookahead->corner_turn[n] = bend + (sharp ? at->turn : 0.0);
    lookahead->corner[n] = (unsigned char)at->corner;
    lookahead->count++;
    jump = lookahead->on_path && lookahead->count > 1 && jumps(lookahead, stock, i);
    if (jump && before > 1.01 * closest) {
        lookahead->count--;
        lookahead->next_spacing = closest;
        return work;
    }
    lookahead->next_spacing =
        jump ? closest : chip_min(2.0 * chip_max(lookahead->next_spacing, closest), lookahead->spacing);
    return work;
}

/* Drops the samples behind the tool, except one and those that still count at the tool [6], and the samples where
 * the programmed path has changed. */
static void drop_samples(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock)
{
    double back = lookahead->at_s - (CHIP_LATE_FALL + 0.01) * stock->cell, end = 1e300;
    while (lookahead->count > 2 + CHIP_CLEAR_BACK
           && sample_s(lookahead, lookahead->first + 1 + CHIP_CLEAR_BACK) < back) {
        lookahead->first++;
        lookahead->count--;
    }
    if (lookahead->on_path) end = chip_min(path->changed_s, path->end_s) + 2.0 * CHIP_PATH_BEYOND;
    while (lookahead->count > 0 && sample_s(lookahead, lookahead->first + lookahead->count - 1) > end)
        lookahead->count--;
    if (lookahead->stale < lookahead->first) lookahead->stale = lookahead->first;
    if (lookahead->stale > lookahead->first + lookahead->count) lookahead->stale = lookahead->first + lookahead->count;
}

/* [1] [2] Takes stale samples again, nearest first, and new ones in front. */
static void update_samples(struct chip_lookahead *lookahead, const struct chip_path *path,
                           const struct chip_stock *stock, const struct chip_tool *tool, double horizon, int budget)
{
    double far = lookahead->at_s + horizon, bend;
    struct chip_path_point at;
    int here;
    drop_samples(lookahead, path, stock);
    here = last_passed(lookahead);
    bend = lookahead->count ? lookahead->corner_turn[sample_slot(lookahead, here)] + CHIP_PASSED_TURN : 0.0;
    while (budget > 0 && lookahead->stale < lookahead->first + lookahead->count
           && (!lookahead->on_path || lookahead->corner_turn[slot_of(lookahead->stale)] <= bend)) {
        if (lookahead->stale >= here) budget -= resample(lookahead, path, stock, tool, lookahead->stale);
        lookahead->stale++;
    }
    while (budget > 0 && lookahead->count < CHIP_LOOKAHEAD_SAMPLES && next_sample_point(lookahead, path, &at)) {
        int all_current = lookahead->stale == lookahead->first + lookahead->count;
        if (lookahead->count && sample_s(lookahead, lookahead->first + lookahead->count - 1) > far) break;
        if (lookahead->count == 0) bend = CHIP_PASSED_TURN;
        budget -= add_sample(lookahead, stock, tool, &at);
        if (all_current && lookahead->stale < lookahead->first + lookahead->count
            && (!lookahead->on_path || lookahead->corner_turn[slot_of(lookahead->stale)] <= bend)) lookahead->stale++;
    }
}

/* [1] Changes between programmed and predicted path, or begins a new chain: all samples are dropped. */
static void begin_samples(struct chip_lookahead *lookahead, int on_path)
{
    lookahead->on_path = on_path;
    lookahead->first = lookahead->count = lookahead->stale = 0;
    lookahead->next_spacing = lookahead->spacing;
}

/* [2] The tool has left its predicted path: keeps what can be kept of the samples. */
static void change_predicted_path(struct chip_lookahead *lookahead, const struct chip_predicted_path *old, double now,
                          const struct chip_stock *stock, const struct chip_tool *tool)
{
    double step = lookahead->predicted.last_step;
    int turned = !old->known || direction_cosine(old, &lookahead->predicted, old->travelled + step) < CHIP_REVERSED;
    carry_over(lookahead, old, step, stock, tool);
    lookahead->begin_area = turned ? 0.0 : now;
}

void chip_lookahead_step(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock,
                         const struct chip_tool *tool, const double from[3], const double to[3], double period,
                         double horizon, int budget)
{
    struct chip_predicted_path old = lookahead->predicted;
    double spacing = chip_lookahead_spacing(stock, tool);
    double now = lookahead->count && lookahead->spacing > 0.0 ? area_bound_now(lookahead, stock) : 0.0;
    int on_path = path && path->known && path->count > 0, begun = 1;
    int new_path = chip_predicted_path_step(&lookahead->predicted, from, to, period,
                                    CHIP_PATH_TOLERANCE * stock->cell, CHIP_GRAIN * stock->cell);
    if (on_path != lookahead->on_path || (on_path && path->new_chain) || spacing != lookahead->spacing) {
        lookahead->begin_area = on_path && lookahead->on_path ? now : 0.0;
        lookahead->spacing = spacing;
        begin_samples(lookahead, on_path);
    } else if (!on_path && new_path) {
        change_predicted_path(lookahead, &old, now, stock, tool);
        budget -= CHIP_CARRY_NODES * lookahead->count;
        if (budget < 1) budget = 1;
    } else {
        begun = 0;
    }
    lookahead->at_s = on_path ? path->s : lookahead->predicted.travelled;
    lookahead->latency_travel = CHIP_LATENCY * lookahead->predicted.speed * period;
    if (begun) lookahead->begin_s = lookahead->at_s;
    if (on_path || lookahead->predicted.known) update_samples(lookahead, path, stock, tool, horizon, budget);
}

/* Frees an entry: of all pairs of neighbours, merges on the safe side the one that loses least (length
 * times how much slower) [4]. Returns 1 if that is the last one and the new one. */
static int merge_steps(struct chip_load_profile *profile, double distance, double area)
{
    int i, best = CHIP_LOAD_STEPS - 1;
    double least = 1e300;
    for (i = 1; i < CHIP_LOAD_STEPS; i++) {
        const struct chip_load_step *step = &profile->step[i];
        double next = i + 1 < CHIP_LOAD_STEPS ? step[1].area : area;
        double far = i + 1 < CHIP_LOAD_STEPS ? step[1].distance : distance;
        double cost = (next / chip_max(step->area, CHIP_MIN_LOAD) - 1.0) * (far - step->distance);
        if (cost < least) {
            least = cost;
            best = i;
        }
    }
    if (best == CHIP_LOAD_STEPS - 1) {
        profile->step[best].area = area;
        return 1;
    }
    profile->step[best].area = profile->step[best + 1].area;
    for (i = best + 1; i + 1 < CHIP_LOAD_STEPS; i++) profile->step[i] = profile->step[i + 1];
    profile->steps--;
    return 0;
}

/* Adds a load step above all before it [4]. */
static void add_step(struct chip_load_profile *profile, double distance, double area)
{
    struct chip_load_step *last = &profile->step[profile->steps - 1];
    if (area <= last->area) return;
    while (profile->steps > 1 && last->distance >= distance) {    /* the new one covers it */
        profile->steps--;
        last--;
    }
    if (profile->steps == CHIP_LOAD_STEPS && merge_steps(profile, distance, area)) return;
    profile->step[profile->steps].distance = distance;
    profile->step[profile->steps].area = area;
    profile->steps++;
}

/* The braking available to the planner until each load step. */
static void add_braking(const struct chip_lookahead *lookahead, const struct chip_path *path,
                        struct chip_load_profile *profile)
{
    int i;
    for (i = 0; i < profile->steps; i++) {
        struct chip_load_step *step = &profile->step[i];
        step->accel = 0.0;
        if (lookahead->on_path && step->distance > 0.0)
            step->accel = chip_path_braking(path, lookahead->at_s + step->distance) / step->distance;
    }
}

/* The largest area this tool can meet at its depth: a full slot and a full plunge. */
static double worst_area(const struct chip_lookahead *lookahead, const struct chip_path *path,
                         const struct chip_stock *stock, const struct chip_tool *tool, double s)
{
    double tip[3], dir[3];
    if (lookahead->on_path) chip_path_at(path, s, tip, dir);
    else chip_segment_at(&lookahead->predicted.segment, s, tip, dir);
    return full_area(tool, dir, chip_max(0.0, stock->z_max - chip_max(tip[2], stock->z_min)));
}

/* How far, mm, before sample i its load must apply [6]: a jump from where it may begin; another rise so far
 * that a velocity falling linearly to it stays below what the line between the samples allows. */
static double rise_begins_before(const struct chip_lookahead *lookahead, const struct interval *interval, int i)
{
    double length = sample_s(lookahead, i) - sample_s(lookahead, i - 1);
    if (is_corner(lookahead, i) || i <= lookahead->first) return 0.0;
    if (interval->jump > 0) return sample_s(lookahead, i) - interval->from;
    if (lookahead->turn[sample_slot(lookahead, i)] > 0.0) return length;
    return length
         * chip_clamp((interval->b / chip_max(interval->a, CHIP_MIN_LOAD) - 1.0 - CHIP_EVEN_RISE) / CHIP_EVEN_RISE, 0.0,
                      1.0);
}

/* Position beyond which no load can bind before the tool has moved on, mm. */
static double binding_until(const struct chip_lookahead *lookahead, const struct chip_path *path, double horizon)
{
    double speed = lookahead->predicted.speed, accel, full;
    if (!lookahead->on_path || path->count == 0) return lookahead->at_s + horizon;
    accel = path->segment[path->first].accel;
    if (!(accel > 0.0)) return lookahead->at_s + horizon;
    full = lookahead->latency_travel > 0.0 && speed > 0.0
             ? accel * lookahead->latency_travel / speed * CHIP_BRAKE_PERIODS
             : accel * 0.01;
    return lookahead->at_s
         + CHIP_BRAKE_MARGIN * (chip_path_stop(path, speed + full + lookahead->jerk_gain, 0.0) - lookahead->at_s)
         + lookahead->spacing + 2.0 * lookahead->latency_travel + lookahead->jerk_travel;
}

void chip_lookahead_profile(const struct chip_lookahead *lookahead, const struct chip_path *path,
                            const struct chip_stock *stock, const struct chip_tool *tool, double horizon,
                            struct chip_load_profile *profile)
{
    double reached = 0.0, until;
    int i, now, last = lookahead->first + lookahead->count - 1,
                known = lookahead->on_path || lookahead->predicted.known;
    profile->area = known ? area_now(lookahead) : 0.0;
    profile->depth = 0.0;
    profile->steps = 1;
    profile->step[0].distance = profile->step[0].accel = 0.0;
    profile->step[0].area = known ? area_bound_now(lookahead, stock) : 0.0;
    if (!known) return;
    now = last_passed(lookahead);
    for (i = now; i <= now + 1; i++)
        if (i >= lookahead->first && i <= last) profile->depth = chip_max(profile->depth, lookahead->depth[slot_of(i)]);
    until = chip_min(lookahead->at_s + horizon, binding_until(lookahead, path, horizon));
    for (i = now + 1; i <= last; i++) {
        struct interval interval = interval_bound(lookahead, stock, i);
        double at = sample_s(lookahead, i) - lookahead->at_s, area = interval.b;
        if (sample_s(lookahead, i - 1) > until && i > lookahead->first) break;
        reached = at;
        if (interval.jump < 0 || i == lookahead->first) area = area_bound(lookahead, stock, i);
        else if (lookahead->turn[slot_of(i)] > 0.0 && !is_corner(lookahead, i)
                 && sample_s(lookahead, i - 1) > lookahead->at_s)
            area = chip_max(interval.a, interval.b);
        CHIP_FAULT(SAMPLES_LATE, at += lookahead->spacing + rise_begins_before(lookahead, &interval, i));
        if (area > profile->step[profile->steps - 1].area)
            add_step(profile, chip_max(0.0, at - rise_begins_before(lookahead, &interval, i)), area);
    }
    if (i <= last) reached = horizon;               /* there are more, which do not bind */
    if (lookahead->on_path) horizon = chip_min(horizon, path->end_s - lookahead->at_s);
    if (reached < horizon - 1e-9 && tool->radius > 0.0)
        add_step(profile, reached, worst_area(lookahead, path, stock, tool, lookahead->at_s + reached));
    add_braking(lookahead, path, profile);
}
