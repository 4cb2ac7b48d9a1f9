/* SPDX-License-Identifier: GPL-2.0-or-later */
/* lookahead.c - takes the samples of the look-ahead: see lookahead.h; the numbers in brackets are those of its
 * principle. */
#include "samples.h"

#define CHIP_PATH_TOLERANCE 0.05  /* cells the tool may deviate from its predicted path */
#define CHIP_GRAIN 0.5            /* cells between the points the predicted path is read from */
#define CHIP_SAME_POINT 0.04      /* cells between an old and a new point that are treated as one */
#define CHIP_NEAR_POINT 4.0       /* cells: an old sample this near may replace a new one */
#define CHIP_SAME_DIRECTION 0.9   /* cosine between old and new direction from which samples are carried over */
#define CHIP_REVERSED (-0.5)      /* and from which the load at the tool stays a lower bound */
#define CHIP_SPACING_RADII 0.0625 /* tool radii between samples; never below one cell nor above four */
#define CHIP_SAMPLE_NODES 8       /* work of a sample beside that of its nodes, in nodes */
#define CHIP_CARRY_NODES 2        /* and of carrying one over to a new predicted path */
#define CHIP_TURN_STEP 0.35       /* rad the path turns by between two samples at most */
#define CHIP_TIGHT_TURN 2.0       /* tool radius over the path's, from which an arc counts as a corner (a blend) */
#define CHIP_PASSED_TURN 0.35     /* rad, a sample behind more turn than this is taken again [2] */
/* tool radius over the path's, above which a sample near the tool reads low and is not taken again */
#define CHIP_TIGHT_ARC 1.05
#define CHIP_LATENCY 2.0 /* periods until a command given now takes effect */

double chip_lookahead_spacing(const struct chip_stock *stock, const struct chip_tool *tool)
{
    return chip_clamp(CHIP_SPACING_RADII * tool->radius, stock->cell, 4.0 * stock->cell);
}

void chip_lookahead_reset(struct chip_lookahead *lookahead)
{
    chip_predicted_path_reset(&lookahead->predicted);
    lookahead->first = lookahead->count = lookahead->stale = lookahead->on_path = 0;
    lookahead->begin_area = lookahead->at_s = lookahead->spacing = lookahead->next_spacing = lookahead->begin_s =
        lookahead->period = lookahead->latency_travel = lookahead->jerk_travel = lookahead->jerk_gain =
            lookahead->begin_tooth.load = 0.0;
    lookahead->begin_tooth.limit = CHIP_TOOTH_CHIP;
}

/* Cosine between the old predicted path at `s` and the beginning of the new one. */
static double direction_cosine(const struct chip_predicted_path *old, const struct chip_predicted_path *new, double s)
{
    double at[3], was[3], is[3];
    chip_segment_at(&old->segment, s, at, was);
    chip_segment_at(&new->segment, 0.0, at, is);
    return was[0] * is[0] + was[1] * is[1] + was[2] * is[2];
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
            && off2 < CHIP_SAME_POINT * CHIP_SAME_POINT * stock->cell * stock->cell)
            same++;
        share = s - a;
        area[n] =
            (float)(sample_area(lookahead, a) + share * (sample_area(lookahead, a + 1) - sample_area(lookahead, a)));
        depth[n] = (float)chip_max(lookahead->depth[slot_of(a)], lookahead->depth[slot_of(a + 1)]);
        if (limits_tooth(lookahead)) chip_tooth_carry(lookahead, a, n);
        n++;
    }
    for (i = 0; i < n; i++) {
        lookahead->s[i] = i * spacing;
        lookahead->area[i] = area[i];
        lookahead->full_area[i] = (float)full_area(tool, along, depth[i]);
        lookahead->position_error[i] = (float)cell_error(tool, along[0]);
        lookahead->turn[i] = 0.0f;
        lookahead->corner_turn[i] = 0.0;
        lookahead->corner[i] = lookahead->read_clear[i] = lookahead->completed[i] = 0;
        lookahead->depth[i] = depth[i];
        if (limits_tooth(lookahead)) chip_tooth_carried(lookahead, i);
    }
    lookahead->first = 0;
    lookahead->count = n;
    lookahead->stale = same;
}

/* Reads the load at a point into sample i; returns its work, in nodes. */
static int read_sample(struct chip_lookahead *lookahead, const struct chip_stock *stock, const struct chip_tool *tool,
                       int i, const struct chip_path_point *at)
{
    double in_front = chip_max(0.0, at->s - lookahead->at_s);
    const double *tip = at->tip, *dir = at->dir;
    struct chip_section met;
    int n = slot_of(i);
    met = chip_section_at(stock, tool, tip, dir, in_front, at->curvature);
    CHIP_FAULT(CELLS_COUNTED, double cells = stock->cell * stock->cell * met.depth / 0.1;
               met.area = cells * floor(met.area / cells));
    lookahead->area[n] = (float)met.area;
    lookahead->depth[n] = (float)met.depth;
    if (limits_tooth(lookahead)) chip_tooth_sample(lookahead, n, &met);
    lookahead->full_area[n] = (float)full_area(tool, at->dir, met.depth);
    lookahead->read_clear[n] = (unsigned char)(in_front < chip_section_reach(stock, tool));
    lookahead->position_error[n] = (float)cell_error(tool, chip_sqrt(dir[0] * dir[0] + dir[1] * dir[1]));
    return met.nodes + CHIP_SAMPLE_NODES;
}

/* The point `s` on the path the samples lie on. */
static void find_point(const struct chip_lookahead *lookahead, const struct chip_path *path, double s,
                       struct chip_path_point *at)
{
    at->s = s;
    at->curvature = lookahead->predicted.segment.curvature;
    if (lookahead->on_path)
        at->curvature = chip_path_at(path, s, at->tip, at->dir);
    else
        chip_segment_at(&lookahead->predicted.segment, s, at->tip, at->dir);
}

/* Takes sample i again at its position; returns its work. */
static int resample(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock,
                    const struct chip_tool *tool, int i)
{
    struct chip_path_point at;
    find_point(lookahead, path, lookahead->s[slot_of(i)], &at);
    if (lookahead->on_path && fabs(at.curvature) * tool->radius > CHIP_TIGHT_ARC) return 1;
    chip_load_forget(lookahead, stock, i);
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
    chip_load_forget(lookahead, stock, i);
    jump = lookahead->on_path && lookahead->count > 1 && chip_load_jumps(lookahead, stock, i);
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
    int first = lookahead->first, count;
    while (lookahead->count > 2 + CHIP_CLEAR_BACK
           && sample_s(lookahead, lookahead->first + 1 + CHIP_CLEAR_BACK) < back) {
        lookahead->first++;
        lookahead->count--;
    }
    if (lookahead->first != first) chip_load_forget(lookahead, stock, lookahead->first);
    if (lookahead->on_path) end = chip_min(path->changed_s, path->end_s) + 2.0 * CHIP_PATH_BEYOND;
    count = lookahead->count;
    while (lookahead->count > 0 && sample_s(lookahead, lookahead->first + lookahead->count - 1) > end)
        lookahead->count--;
    if (lookahead->count != count) chip_load_forget(lookahead, stock, lookahead->first + lookahead->count - 1);
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
            && (!lookahead->on_path || lookahead->corner_turn[slot_of(lookahead->stale)] <= bend))
            lookahead->stale++;
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
    if (turned) lookahead->begin_tooth.load = 0.0;
}

void chip_lookahead_step(struct chip_lookahead *lookahead, const struct chip_path *path, const struct chip_stock *stock,
                         const struct chip_tool *tool, const double from[3], const double to[3], double period,
                         double horizon, int budget)
{
    struct chip_predicted_path old = lookahead->predicted;
    double spacing = chip_lookahead_spacing(stock, tool);
    double now = lookahead->count && lookahead->spacing > 0.0 ? chip_load_bound_now(lookahead, stock) : 0.0;
    int on_path = path && path->known && path->count > 0, begun = 1;
    int new_path = chip_predicted_path_step(&lookahead->predicted, from, to, period, CHIP_PATH_TOLERANCE * stock->cell,
                                            CHIP_GRAIN * stock->cell);
    if (on_path != lookahead->on_path || (on_path && path->new_chain) || spacing != lookahead->spacing) {
        lookahead->begin_area = on_path && lookahead->on_path ? now : 0.0;
        lookahead->begin_tooth = chip_tooth_now(lookahead);
        if (!on_path || !lookahead->on_path) lookahead->begin_tooth.load = 0.0;
        lookahead->spacing = spacing;
        begin_samples(lookahead, on_path);
    } else if (!on_path && new_path) {
        lookahead->begin_tooth = chip_tooth_now(lookahead);
        change_predicted_path(lookahead, &old, now, stock, tool);
        budget -= CHIP_CARRY_NODES * lookahead->count;
        if (budget < 1) budget = 1;
    } else {
        begun = 0;
    }
    lookahead->at_s = on_path ? path->s : lookahead->predicted.travelled;
    lookahead->period = period;
    lookahead->latency_travel = CHIP_LATENCY * lookahead->predicted.speed * period;
    if (begun) lookahead->begin_s = lookahead->at_s;
    if (on_path || lookahead->predicted.known) update_samples(lookahead, path, stock, tool, horizon, budget);
    chip_load_complete(lookahead, stock);
}
