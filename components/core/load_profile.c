/* SPDX-License-Identifier: GPL-2.0-or-later */
/* load_profile.c - the load profile of the samples of the look-ahead: see lookahead.h; the numbers in brackets are
 * those of its principle. */
#include "samples.h"

/* a rise by this share between two samples: larger ones make the velocity's straight line exceed the bound */
#define CHIP_EVEN_RISE 0.05
#define CHIP_BRAKE_MARGIN 1.2  /* of the braking distance: no load step beyond it binds */
#define CHIP_BRAKE_PERIODS 6.0 /* periods of acceleration that may add to the velocity meanwhile */
#define CHIP_BLEND_MOST 2.0    /* times its velocity before that a tool can have in a blend [8] */


/* Frees an entry: of all pairs of neighbours, merges on the safe side the one that loses least (length
 * times how much slower) [4]. Returns 1 if that is the last one and the new one. */
static int merge_steps(struct chip_load_step *steps, int *count, double distance, double area, int limit)
{
    int i, best = CHIP_LOAD_STEPS - 1;
    double least = 1e300;
    for (i = 1; i < CHIP_LOAD_STEPS; i++) {
        const struct chip_load_step *step = &steps[i];
        double next = i + 1 < CHIP_LOAD_STEPS ? step[1].area : area;
        double far = i + 1 < CHIP_LOAD_STEPS ? step[1].distance : distance;
        double cost = (next / chip_max(step->area, CHIP_MIN_LOAD) - 1.0) * (far - step->distance);
        if (cost < least) {
            least = cost;
            best = i;
        }
    }
    if (best == CHIP_LOAD_STEPS - 1) {
        steps[best].area = area;
        steps[best].limit = limit;
        return 1;
    }
    steps[best].area = steps[best + 1].area;
    steps[best].limit = steps[best + 1].limit;
    for (i = best + 1; i + 1 < CHIP_LOAD_STEPS; i++) steps[i] = steps[i + 1];
    --*count;
    return 0;
}

/* Adds a load step above all before it [4]. */
static void add_load(struct chip_load_step *steps, int *count, double distance, double area, int limit)
{
    struct chip_load_step *last = &steps[*count - 1];
    if (area <= last->area) return;
    while (*count > 1 && last->distance >= distance) { /* the new one covers it */
        --*count;
        last--;
    }
    if (*count == CHIP_LOAD_STEPS && merge_steps(steps, count, distance, area, limit)) return;
    steps[*count].distance = distance;
    steps[*count].area = area;
    steps[*count].limit = limit;
    ++*count;
}

/* Of the area. */
static void add_step(struct chip_load_profile *profile, double distance, double area)
{
    add_load(profile->step, &profile->steps, distance, area, 0);
}

/* Of the tooth load. */
static void add_tooth(struct chip_load_profile *profile, double distance, struct chip_tooth_load load)
{
    add_load(profile->tooth_step, &profile->tooth_steps, distance, load.load, load.limit);
}

/* The braking available to the planner until each load step. */
static void add_braking(const struct chip_lookahead *lookahead, const struct chip_path *path,
                        struct chip_load_step *steps, int count)
{
    int i;
    for (i = 0; i < count; i++) {
        struct chip_load_step *step = &steps[i];
        step->accel = 0.0;
        if (lookahead->on_path && step->distance > 0.0)
            step->accel = chip_path_braking(path, lookahead->at_s + step->distance) / step->distance;
    }
}

/* Adds the largest load this tool can meet at its depth: a full slot and a full plunge. */
static void add_worst(const struct chip_lookahead *lookahead, const struct chip_path *path,
                      const struct chip_stock *stock, const struct chip_tool *tool, double distance,
                      struct chip_load_profile *profile)
{
    double tip[3], dir[3], depth;
    if (lookahead->on_path)
        chip_path_at(path, lookahead->at_s + distance, tip, dir);
    else
        chip_segment_at(&lookahead->predicted.segment, lookahead->at_s + distance, tip, dir);
    depth = chip_max(0.0, stock->z_max - chip_max(tip[2], stock->z_min));
    add_step(profile, distance, full_area(tool, dir, depth));
    if (profile->tooth_steps) add_tooth(profile, distance, chip_tooth_worst(lookahead, tool, dir, depth));
}

/* How far, mm, before sample i its load must apply [6]: a jump from where it may begin; another rise so far
 * that a velocity falling linearly to it stays below what the line between the samples allows. */
static double rise_begins_before(const struct chip_lookahead *lookahead, const struct chip_load_interval *interval,
                                 int i)
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

/* [8] A parabolic blend ahead, of half a segment on either side at most. */
struct blend_ahead {
    int segment;         /* number of the segment it leaves, from the one the tool is on */
    double end;          /* mm from the tool to the end of that segment */
    double begin, until; /* mm from the tool to where the blend begins and ends */
    double excess;       /* how many times the velocity at its beginning the tool may have in it */
    double far;          /* mm from the tool, up to where segments with blends may begin */
};

/* mm behind the corner at which a blend begun with `speed` ends: the second segment is at that speed after speed / b, and
 * goes on at it until the first one has ended, after speed / a. */
static double blend_behind(const struct chip_segment *segment, const struct chip_segment *next, double speed)
{
    double rising = 0.5 * speed * speed / chip_segment_blend_accel(next, 0);
    double whole = speed * speed / chip_segment_blend_accel(segment, 1) - rising;
    if (whole <= rising) return chip_min(0.5 * next->length, rising);
    return chip_min(next->length, whole);
}

/* Finds the next one behind `blend`; if there is none it begins nowhere. */
static void next_blend(const struct chip_lookahead *lookahead, const struct chip_path *path, struct blend_ahead *blend)
{
    double speed = lookahead->predicted.speed;
    blend->begin = blend->until = 1e300;
    while (blend->segment + 2 < path->count && blend->end <= blend->far) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, ++blend->segment)];
        const struct chip_segment *next = &path->segment[chip_path_slot(path, blend->segment + 1)];
        double falls = chip_segment_blend_accel(segment, 1), rises = chip_segment_blend_accel(next, 0);
        blend->end += segment->length;
        if (segment->join != CHIP_JOIN_PARABOLIC || !(segment->accel > 0.0) || !(next->accel > 0.0)) continue;
        blend->begin = blend->end - 0.5 * chip_min(segment->length, speed * speed / falls) - lookahead->latency_travel;
        blend->until = blend->end + blend_behind(segment, next, speed);
        blend->excess = rises > falls ? 2.0 - falls / rises : 1.0;
        if (blend->excess * speed + rises * lookahead->period < CHIP_BLEND_MOST * speed)
            blend->excess += rises * lookahead->period / speed;
        else
            blend->excess = CHIP_BLEND_MOST;
        return;
    }
}

/* [8] Adds the blends in which the path from `from` to `to` mm before the tool lies; its load is at most `area`. */
static void add_blends(const struct chip_lookahead *lookahead, const struct chip_path *path, double from, double to,
                       double area, struct blend_ahead *blend, struct chip_load_profile *profile)
{
    while (blend->begin <= to) {
        if (blend->until >= from) add_step(profile, chip_max(0.0, blend->begin), area * blend->excess);
        if (blend->until > to) return;
        next_blend(lookahead, path, blend);
    }
}

/* Finds the first one ahead, of those up to `until` mm on the path; on a predicted path there is none. */
static inline __attribute__((always_inline)) void first_blend(const struct chip_lookahead *lookahead,
                                                              const struct chip_path *path, double until,
                                                              struct blend_ahead *blend)
{
    blend->segment = -1;
    blend->begin = blend->until = 1e300;
    if (!lookahead->on_path) return;
    blend->end = path->begin_s - lookahead->at_s;
    blend->far = until - lookahead->at_s;
    next_blend(lookahead, path, blend);
}

/* The steps of the tooth load up to `until` mm on the path (tooth.h, 6); none without limits. */
static void add_tooth_steps(const struct chip_lookahead *lookahead, const struct chip_path *path, double until,
                            struct chip_load_profile *profile)
{
    struct blend_ahead blend;
    struct chip_tooth_load load = chip_tooth_now(lookahead);
    double most = load.load;
    int i, now = last_passed(lookahead), here = sample_slot(lookahead, now),
           last = lookahead->first + lookahead->count - 1;
    first_blend(lookahead, path, until, &blend);
    profile->tooth_steps = 1;
    profile->tooth_step[0].distance = profile->tooth_step[0].accel = 0.0;
    profile->tooth_step[0].area = load.load;
    profile->tooth_step[0].limit = load.limit;
    if (!lookahead->count) return;
    profile->chip = lookahead->chip[here];
    profile->power = lookahead->power[here];
    profile->force = lookahead->force[here];
    profile->force_mean = lookahead->force_mean[here];
    for (i = now < lookahead->first ? lookahead->first + 1 : now + 1; i <= last; i++) {
        double from = lookahead->s[slot_of(i - 1)], to;
        const struct chip_tooth_load *met = &lookahead->between[slot_of(i)];
        if (from > until) break;
        from -= lookahead->at_s;
        if (met->load > most) add_tooth(profile, chip_max(0.0, from), *met);
        most = chip_max(most, met->load);
        if (blend.begin >= 1e300) continue;
        to = lookahead->s[slot_of(i)] - lookahead->at_s;
        load = *met;
        for (; blend.begin <= to; next_blend(lookahead, path, &blend)) { /* [8] */
            struct chip_tooth_load more = { load.load * blend.excess, load.limit };
            if (blend.until >= from) add_tooth(profile, chip_max(0.0, blend.begin), more);
            if (blend.until > to) break;
        }
    }
}

void chip_lookahead_profile(const struct chip_lookahead *lookahead, const struct chip_path *path,
                            const struct chip_stock *stock, const struct chip_tool *tool, double horizon,
                            struct chip_load_profile *profile)
{
    struct blend_ahead blend;
    double reached = 0.0, until;
    int i, now, last = lookahead->first + lookahead->count - 1,
                known = lookahead->on_path || lookahead->predicted.known;
    profile->area = known ? chip_load_now(lookahead) : 0.0;
    profile->depth = 0.0;
    profile->steps = 1;
    profile->step[0].distance = profile->step[0].accel = 0.0;
    profile->step[0].area = known ? chip_load_bound_now(lookahead, stock) : 0.0;
    profile->tooth_steps = 0;
    profile->chip = profile->power = profile->force = profile->force_mean = 0.0;
    if (!known) return;
    now = last_passed(lookahead);
    for (i = now; i <= now + 1; i++)
        if (i >= lookahead->first && i <= last) profile->depth = chip_max(profile->depth, lookahead->depth[slot_of(i)]);
    until = chip_min(lookahead->at_s + horizon, binding_until(lookahead, path, horizon));
    first_blend(lookahead, path, until, &blend);
    if (limits_tooth(lookahead)) add_tooth_steps(lookahead, path, until, profile);
    for (i = now + 1; i <= last; i++) {
        const struct chip_load_interval *interval = interval_of(lookahead, i);
        double at = sample_s(lookahead, i) - lookahead->at_s, area;
        if (sample_s(lookahead, i - 1) > until && i > lookahead->first) break;
        area = interval->b;
        reached = at;
        if (interval->jump < 0 || i == lookahead->first)
            area = interval->bound;
        else if (lookahead->turn[slot_of(i)] > 0.0 && !is_corner(lookahead, i)
                 && sample_s(lookahead, i - 1) > lookahead->at_s)
            area = chip_max(interval->a, interval->b);
        CHIP_FAULT(SAMPLES_LATE, at += lookahead->spacing + rise_begins_before(lookahead, interval, i));
        if (area > profile->step[profile->steps - 1].area)
            add_step(profile, chip_max(0.0, at - rise_begins_before(lookahead, interval, i)), area);
        if (blend.begin <= at)
            add_blends(lookahead, path, i > lookahead->first ? sample_s(lookahead, i - 1) - lookahead->at_s : 0.0, at,
                       chip_max(area, interval->a), &blend, profile);
    }
    if (i <= last) reached = horizon; /* there are more, which do not bind */
    if (lookahead->on_path) horizon = chip_min(horizon, path->end_s - lookahead->at_s);
    if (reached < horizon - 1e-9 && tool->radius > 0.0) add_worst(lookahead, path, stock, tool, reached, profile);
    add_braking(lookahead, path, profile->step, profile->steps);
    if (profile->tooth_steps) add_braking(lookahead, path, profile->tooth_step, profile->tooth_steps);
}
