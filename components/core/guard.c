/* SPDX-License-Identifier: GPL-2.0-or-later */
/* guard.c - see guard.h; the numbers in brackets are those of its principle. */
#include "guard_probe.h"

#define CHIP_GUARD_MIN_STEP 1e-6  /* mm, a shorter step has no direction */
#define CHIP_GUARD_OFF_LINE 0.02  /* cells the tool may deviate from its line */
#define CHIP_GUARD_DIRECTION 1e-4 /* rad between step and line; the probe is up to 20 mm ahead */
#define CHIP_GUARD_SHARE 0.01     /* of a step by which the change of the distance to go may differ from it [5] */
#define CHIP_GUARD_ROUNDING 1e-5  /* mm, the same if the step is small */
#define CHIP_GUARD_STEADY 3       /* periods on a line before it is checked [5] */
/* periods of travel until the planner brakes, and one in reserve; fewer stop too late */
#define CHIP_GUARD_LATE 3.0
#define CHIP_GUARD_BRAKING 0.3  /* share of the acceleration above which the tool is braking [4] */
#define CHIP_GUARD_GROWING 1.02 /* braking that has grown by this factor in a period is only beginning [4] */
#define CHIP_GUARD_JERK 1.75    /* of the least jerk of an axis, on a slanted line */
#define CHIP_GUARD_UNKNOWN 20.0 /* mm, braking distance if the acceleration is unknown */
#define CHIP_GUARD_DRIFT 0.2    /* cells the tool may be off the predicted blend before it is predicted anew [5b] */
/* of the braking the planner is capable of on its path; in arcs less than half the acceleration */
#define CHIP_GUARD_CERTAIN 0.8
/* of a step by which the position on the path may differ before it is a new path [5a] */
#define CHIP_GUARD_OFF_PATH 0.05

void chip_guard_reset_line(struct chip_guard *guard)
{
    guard->periods = guard->blend.active = 0;
    guard->travelled = guard->speed = guard->distance = 0.0;
    guard->slowing = guard->slowing_before = guard->distance_to_go = 0.0;
    guard->path_s = -1e30;
    begin_probe(&guard->on_line, 0.0);
    begin_probe(&guard->on_path, 0.0);
}

void chip_guard_reset(struct chip_guard *guard)
{
    chip_guard_reset_line(guard);
    guard->excess = 0;
}

/* Follows the tool: speed, and the line it is on [1]. */
static void follow(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_guard_in *in,
                   double step)
{
    double dir[3], off2 = 0.0, aim = 0.0;
    int i, whole;
    whole = !(in->distance_to_go_mm > 0.0)
         || fabs(guard->distance_to_go - in->distance_to_go_mm - step) < CHIP_GUARD_SHARE * step + CHIP_GUARD_ROUNDING;
    guard->distance_to_go = in->distance_to_go_mm;
    if (step < CHIP_GUARD_MIN_STEP) return;
    for (i = 0; i < 3; i++) {
        double off = in->to[i] - guard->origin[i] - guard->dir[i] * (guard->travelled + step);
        dir[i] = (in->to[i] - in->from[i]) / step;
        off2 += off * off;
        aim += (dir[i] - guard->dir[i]) * (dir[i] - guard->dir[i]);
    }
    if (whole && guard->periods > 0 && aim < CHIP_GUARD_DIRECTION * CHIP_GUARD_DIRECTION
        && off2 < CHIP_GUARD_OFF_LINE * CHIP_GUARD_OFF_LINE * stock->cell * stock->cell) {
        guard->travelled += step;
        guard->periods++;
        return;
    }
    for (i = 0; i < 3; i++) {
        guard->origin[i] = in->to[i];
        guard->dir[i] = dir[i];
    }
    guard->travelled = 0.0;
    guard->blend.active = 0;
    begin_probe(&guard->on_line, 0.0);
    guard->periods = 1;
}

/* Speed and deceleration, mm/s, mm/s2. */
static void measure_speed(struct chip_guard *guard, double speed, double period)
{
    guard->slowing_before = guard->slowing;
    guard->slowing = (guard->speed - speed) / period;
    guard->speed = speed;
}

/* [5b] Uses the line of the next segment as the tool's, with the blend that leads to it. */
static void enter_blend(struct chip_guard *guard, const struct chip_blend *parabola, const double tip[3])
{
    struct chip_guard_blend *blend = &guard->blend;
    int i;
    for (i = 0; i < 3; i++) {
        guard->origin[i] = parabola->start[i];
        guard->dir[i] = parabola->dir[i];
        blend->offset[i] = tip[i] - parabola->start[i] - parabola->travelled * parabola->dir[i];
    }
    blend->active = 1;
    blend->time =
        parabola->first_speed > CHIP_GUARD_MIN_STEP ? 2.0 * parabola->first_left / parabola->first_speed : 0.0;
    blend->from = parabola->travelled;
    blend->speed = parabola->speed;
    blend->rise = chip_max(0.0, parabola->end_speed - parabola->speed);
    blend->end = blend->from + (blend->speed + 0.5 * blend->rise) * blend->time;
    begin_probe(&guard->on_line, parabola->travelled);
}

/* [5b] Follows the tool through a parabolic blend. */
static void follow_blend(struct chip_guard *guard, const struct chip_blend *parabola, const struct chip_stock *stock,
                         const struct chip_guard_in *in)
{
    double there[3], off2 = 0.0, aim = 0.0;
    int i;
    chip_guard_point_on_line(guard, parabola->travelled, there);
    for (i = 0; i < 3; i++) {
        off2 += (in->to[i] - there[i]) * (in->to[i] - there[i]);
        aim += (parabola->dir[i] - guard->dir[i]) * (parabola->dir[i] - guard->dir[i]);
    }
    if (!guard->blend.active || aim > CHIP_GUARD_DIRECTION * CHIP_GUARD_DIRECTION
        || off2 > CHIP_GUARD_DRIFT * CHIP_GUARD_DRIFT * stock->cell * stock->cell)
        enter_blend(guard, parabola, in->to);
    guard->travelled = parabola->travelled;
    guard->distance_to_go = in->distance_to_go_mm;
    guard->periods = CHIP_GUARD_STEADY;
}

/* Acceleration the planner uses along the line, mm/s2; 0: unknown. */
static double accel_along(const struct chip_guard *guard, const struct chip_guard_in *in)
{
    double least = 1e30;
    int i;
    if (!chip_finite(in->acceleration_mm_s2) || !(in->acceleration_mm_s2 > 0.0)) return 0.0;
    for (i = 0; i < 3; i++) {
        if (!chip_finite(in->axis_acceleration_mm_s2[i]) || !(in->axis_acceleration_mm_s2[i] > 0.0))
            return in->acceleration_mm_s2;
        if (fabs(guard->dir[i]) > 1e-9) least = chip_min(least, in->axis_acceleration_mm_s2[i] / fabs(guard->dir[i]));
    }
    return least;
}

/* Braking distance at acceleration `accel`, and the travel until braking begins, mm. */
static double stopping(const struct chip_guard *guard, const struct chip_guard_in *in, double accel)
{
    double late = CHIP_GUARD_LATE * guard->speed * in->period_s;
    if (!(accel > 0.0)) return CHIP_GUARD_UNKNOWN;
    if (chip_finite(in->max_jerk_mm_s3) && in->max_jerk_mm_s3 > 0.0)
        late += 1.5 * guard->speed * accel / in->max_jerk_mm_s3;
    return 0.5 * guard->speed * guard->speed / accel + late;
}

/* The shortest braking distance, mm, of a planner that limits the jerk: its braking, mm/s2, of now grows to `accel`
 * and vanishes again as it stops. */
static double shortest_stop(double speed, double slowing, double accel, double jerk)
{
    double held = chip_min(chip_max(slowing, 0.0), accel), peak, rise, after, end;
    if (held * held >= 2.0 * jerk * speed) return 0.0; /* it is ending its braking already */
    peak = chip_min(sqrt(jerk * speed + 0.5 * held * held), accel);
    rise = (peak - held) / jerk;
    after = speed - 0.5 * (held + peak) * rise;
    end = 0.5 * peak * peak / jerk;
    return (speed - (2.0 * held + peak) / 6.0 * rise) * rise + 0.5 * chip_max(after * after - end * end, 0.0) / peak
         + end * peak / (3.0 * jerk);
}

/* Whether the present traverse continues into another one without a stop [5a]. (If no more segments are known
 * the next one is beyond the braking distance.) */
static int goes_over(const struct chip_path *path)
{
    return path && path->count > 0 && path->segment[path->first].join == CHIP_JOIN_TANGENT
        && path->segment[path->first].rapid && (path->count == 1 || path->segment[chip_path_slot(path, 1)].rapid);
}

/* [3], [4] */
static int must_stop(const struct chip_guard *guard, const struct chip_stock *stock, const struct chip_guard_in *in,
                     double accel)
{
    double near = guard->on_line.hit_near - guard->travelled, far = guard->on_line.hit_far - guard->travelled;
    double braking = 0.5 * guard->speed * guard->speed, travel = guard->speed * in->period_s;
    double slowing = chip_max(guard->slowing, guard->slowing_before), thin = ignored_strip(stock);
    double jerk = chip_finite(in->max_jerk_mm_s3) ? in->max_jerk_mm_s3 : 0.0;
    int begins = guard->slowing > CHIP_GUARD_GROWING * guard->slowing_before;
    if (far <= -thin) return 1;
    if (in->distance_to_go_mm > 0.0 && far + thin <= in->distance_to_go_mm)
        return near <= stopping(guard, in, 0.5 * accel);
    if (goes_over(in->path)) return 0; /* the path is checked instead of the line */
    if (!(accel > 0.0)) return near <= CHIP_GUARD_UNKNOWN;
    if (jerk > 0.0 && (in->distance_to_go_mm > 0.0 || slowing > CHIP_GUARD_BRAKING * accel))
        return far <= shortest_stop(guard->speed, guard->slowing, accel, CHIP_GUARD_JERK * jerk) - travel;
    if (jerk > 0.0) return near <= shortest_stop(guard->speed, 0.0, accel, jerk) + travel;
    if (chip_min(guard->slowing, guard->slowing_before) > CHIP_GUARD_BRAKING * accel)
        return far <= braking / (begins ? accel : slowing) - travel;
    if (in->distance_to_go_mm > 0.0) return far <= braking / accel - travel;
    return near <= braking / accel + travel;
}

/* [5a] Position on the path up to which the tool is certain to go by traverses without a stop. A blend takes
 * half of a segment at most. */
static double certain_until(const struct chip_path *path)
{
    double begin = path->begin_s;
    int n;
    for (n = 0; n < path->count; n++) {
        const struct chip_segment *segment = &path->segment[chip_path_slot(path, n)];
        if (!segment->rapid) break;
        if (segment->join == CHIP_JOIN_PARABOLIC) return begin + 0.5 * segment->length;
        begin += segment->length;
        if (segment->join == CHIP_JOIN_STOP) break;
    }
    return begin;
}

/* [5a] Probes the programmed path; 1 if the tool has to stop. The present straight segment belongs to check_line(). */
static int check_path(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                      const struct chip_guard_in *in, double step, long bound, long *work)
{
    const struct chip_path *path = in->path;
    struct chip_guard_probe *probe = &guard->on_path;
    struct chip_probe_track track = { guard, path, bound };
    double near, far = stopping(guard, in, 0.5 * in->acceleration_mm_s2), last = guard->path_s;
    double until, brakes;
    if (!path || path->count == 0) {
        guard->path_s = -1e30;
        return 0;
    }
    guard->path_s = path->s;
    if (fabs(path->s - last - step) > CHIP_GUARD_OFF_PATH * step + CHIP_GUARD_MIN_CONTACT) begin_probe(probe, path->s);
    if ((!goes_over(path) && !found(probe)) || CHIP_FAULTY(PATH_NOT_PROBED)) return 0;
    if (probe->clear < path->s) probe->clear = path->s;
    if (path->segment[path->first].curvature == 0.0 && guard->periods >= CHIP_GUARD_STEADY)
        probe->clear = chip_max(probe->clear, path->begin_s + path->segment[path->first].length);
    until = certain_until(path);
    chip_guard_send(probe, &track, stock, tool,
                    chip_min(until - CHIP_GUARD_MIN_CONTACT, path->s + far / CHIP_GUARD_CERTAIN + step), until, work);
    if (!found(probe)) return 0;
    near = chip_max(probe->hit_near - path->s, 0.0);
    if (guard->distance == 0.0 || near < guard->distance) guard->distance = near;
    brakes = chip_path_braking(path, probe->hit_near - CHIP_GUARD_LATE * guard->speed * in->period_s);
    return near <= far || 0.5 * guard->speed * guard->speed >= CHIP_GUARD_CERTAIN * brakes;
}

/* [2]..[4] on the line; 1 if the tool has to stop. */
static int check_line(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                      const struct chip_guard_in *in, long bound, long *work)
{
    struct chip_probe_track track = { guard, 0, bound };
    double accel = accel_along(guard, in);
    double end = in->distance_to_go_mm > 0.0 ? guard->travelled + in->distance_to_go_mm : 1e30;
    double wanted = guard->travelled + chip_max(stopping(guard, in, 0.5 * accel), 2.0 * stock->cell);
    if (guard->on_line.clear < guard->travelled) guard->on_line.clear = guard->travelled;
    chip_guard_send(&guard->on_line, &track, stock, tool, wanted + guard->speed * in->period_s, end, work);
    /* it was released: check what lies behind */
    if (found(&guard->on_line) && guard->travelled > guard->on_line.hit_far) {
        begin_probe(&guard->on_line, guard->travelled);
        chip_guard_send(&guard->on_line, &track, stock, tool, wanted + guard->speed * in->period_s, end, work);
    }
    if (!found(&guard->on_line) || guard->periods < CHIP_GUARD_STEADY) return 0;
    guard->distance = chip_max(guard->on_line.hit_near - guard->travelled, 0.0);
    return must_stop(guard, stock, in, accel);
}

/* [5b] As check_line(), in a parabolic blend: only what the line meets before its end counts. */
static int check_blend(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                       const struct chip_guard_in *in, long bound, long *work)
{
    const struct chip_blend *parabola = &in->path->blend;
    struct chip_guard_in on_line = *in;
    on_line.distance_to_go_mm = parabola->length - parabola->travelled;
    follow_blend(guard, parabola, stock, in);
    return check_line(guard, stock, tool, &on_line, bound, work)
        && guard->on_line.hit_far - guard->travelled + ignored_strip(stock) <= on_line.distance_to_go_mm;
}

int chip_guard_traverse(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                        const struct chip_guard_in *in, long bound, long *work)
{
    double step = 0.0;
    int i, hit, blends = in->path && in->path->blend.active;
    for (i = 0; i < 3; i++) step += (in->to[i] - in->from[i]) * (in->to[i] - in->from[i]);
    step = sqrt(step);
    guard->distance = 0.0;
    if (!chip_finite(step)) return 0;
    measure_speed(guard, blends ? in->path->blend.speed : step / in->period_s, in->period_s);
    if (blends && in->start_is_cut && !CHIP_FAULTY(BLEND_AS_LINE))
        return check_blend(guard, stock, tool, in, bound, work);
    follow(guard, stock, in, step);
    if (step < CHIP_GUARD_MIN_STEP || !in->start_is_cut) return 0;
    hit = check_line(guard, stock, tool, in, bound, work);
    return check_path(guard, stock, tool, in, step, bound, work) || hit;
}

int chip_guard_shank(struct chip_guard *guard, const struct chip_stock *stock, const struct chip_tool *tool,
                     const double from[3], const double to[3], int start_is_cut, long *work)
{
    double a[3], b[3], step = 0.0, enough;
    int i;
    for (i = 0; i < 3; i++) {
        a[i] = from[i] + (i == 2 ? tool->flute : 0.0);
        b[i] = to[i] + (i == 2 ? tool->flute : 0.0);
        step += (b[i] - a[i]) * (b[i] - a[i]);
    }
    step = sqrt(step);
    if (!(tool->flute > 0.0) || misses(stock, tool->radius, a, b)) return guard->excess = 0;
    if (step < CHIP_GUARD_MIN_STEP) return guard->excess;
    if (guard->shank.radius != tool->radius) chip_tool_init(&guard->shank, 2.0 * tool->radius, 0.0, 0.0, 0.0);
    enough = ignored(stock, stands_above(stock, chip_min(a[2], b[2])), step);
    guard->excess = chip_sweep_meets(stock, &guard->shank, a, b, start_is_cut, enough, work) >= enough;
    return guard->excess;
}
