/* SPDX-License-Identifier: GPL-2.0-or-later */
/* axis_offset.c - see axis_offset.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "axis_offset.h"

#define CHIP_AXIS_OFFSET_LARGEST 1e6     /* mm, mm/s, mm/s2: no sound value is above */
#define CHIP_AXIS_OFFSET_CORRECT 0.2     /* share of what is missing that is made up in a period */
#define CHIP_AXIS_OFFSET_ARRIVED_MM 1e-5 /* from 0 */
#define CHIP_AXIS_OFFSET_COUNTS 2e9      /* of a request, from 0 */
#define CHIP_AXIS_OFFSET_PERMIT_S 1.0    /* from the request to `permit` */

static double size_of(double x) { return x < 0.0 ? -x : x; }

static int within(double value, double low, double high) { return value >= low && value <= high; }

static int is_sound(const struct chip_axis_offset_settings *s)
{
    const double most = CHIP_AXIS_OFFSET_LARGEST;
    int i;
    for (i = 0; i < 3; i++)
        if (!within(s->acceleration_mm_s2[i], 1.0, most) || !within(s->max_vel_mm_s[i], 1e-3, most)) return 0;
    return within(s->count_mm, 1e-9, 1e-2) && within(s->clear_vel_mm_s, 1e-3, most)
        && within(s->max_astray_mm, 1e-6, most) && within(s->max_behind_mm, 1e-6, most)
        && within(s->contact_mm, 1e-6, most);
}

static int is_finite(const struct chip_axis_offset_in *in)
{
    const double most = CHIP_AXIS_OFFSET_LARGEST;
    int i, sound = 1;
    for (i = 0; i < 3; i++)
        sound &= within(in->position_mm[i], -most, most) && within(in->offset_mm[i], -most, most)
              && within(in->requested_mm[i], -most, most);
    CHIP_FAULT(OFFSET_NAN_AS_NUMBER, sound = 1);
    return sound;
}

static void fail(struct chip_axis_offset *axes, int fault)
{
    if (axes->state == CHIP_AXIS_OFFSET_FAULT) return;
    axes->state = CHIP_AXIS_OFFSET_FAULT;
    axes->fault = fault;
}

/* s left for `permit` after an edge of the signal: LinuxCNC's status, which it comes from, is later than a program's outputs. */
static double after_edge(int now, int before, double left_s, double period_s)
{
    if (!now) return 0.0;
    CHIP_FAULT(STARTS_BY_LEVEL, return 1.0);
    return before ? chip_max(left_s - period_s, 0.0) : CHIP_AXIS_OFFSET_PERMIT_S;
}

/* What the operator's signals make of the state [5]. */
static void serve_signals(struct chip_axis_offset *axes, const struct chip_axis_offset_in *in)
{
    int i;
    axes->begin_s = after_edge(in->has_request, axes->had_request, axes->begin_s, in->period_s);
    axes->clear_s = after_edge(in->wants_clear, axes->had_clear, axes->clear_s, in->period_s);
    axes->had_request = in->has_request;
    axes->had_clear = in->wants_clear;
    if (axes->state == CHIP_AXIS_OFFSET_FAULT && !in->has_request && !in->wants_clear) {
        axes->state = CHIP_AXIS_OFFSET_HOLD;
        axes->fault = CHIP_AXIS_OFFSET_NO_FAULT;
    }
    if (axes->state == CHIP_AXIS_OFFSET_FOLLOW && (!in->has_permit || !in->has_request))
        axes->state = CHIP_AXIS_OFFSET_HOLD;
    if (axes->state == CHIP_AXIS_OFFSET_CLEAR && (!in->has_permit || !in->wants_clear))
        axes->state = CHIP_AXIS_OFFSET_HOLD;
    if (axes->state != CHIP_AXIS_OFFSET_HOLD || !in->has_permit) return;
    if (axes->begin_s > 0.0) {
        axes->state = CHIP_AXIS_OFFSET_FOLLOW;
        for (i = 0; i < 3; i++) axes->from_mm[i] = in->position_mm[i];
    } else if (axes->clear_s > 0.0) {
        axes->state = CHIP_AXIS_OFFSET_CLEAR;
        axes->stage = 0;
        axes->least_mm = CHIP_AXIS_OFFSET_LARGEST;
    }
    axes->begin_s = axes->clear_s = 0.0;
}

/* Velocity to make up for a distance, so that half of A is enough to end it. */
static double make_up(double distance_mm, double acceleration, double period_s)
{
    double size = size_of(distance_mm), vel;
    vel = chip_min(CHIP_AXIS_OFFSET_CORRECT * size / period_s, chip_sqrt(acceleration * size));
    return distance_mm < 0.0 ? -vel : vel;
}

/* FOLLOW: the velocity of the position and of what is missing [3]. */
static void follow(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *s,
                   const struct chip_axis_offset_in *in, double wanted[3])
{
    int i;
    for (i = 0; i < 3; i++) {
        double step = in->position_mm[i] - axes->from_mm[i];
        axes->from_mm[i] = in->position_mm[i];
        wanted[i] = step / in->period_s + make_up(axes->missing_mm[i], s->acceleration_mm_s2[i], in->period_s);
        axes->missing_mm[i] += step;
        if (size_of(axes->missing_mm[i]) > s->max_behind_mm) fail(axes, CHIP_AXIS_OFFSET_BEHIND);
    }
}

/* Whether the axis moves in a stage of CLEAR [6]. */
static int is_in_stage(int axis, int stage, double offset_mm)
{
    return axis < 2 ? stage == 1 : stage == 0 ? offset_mm < 0.0 : stage == 2;
}

/* CLEAR: along a straight line, the axes of the stage together [6]. */
static void go_back(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *s,
                    const struct chip_axis_offset_in *in, const double next_mm[3], double wanted[3])
{
    double left[3] = { 0.0, 0.0, 0.0 }, size, accel = CHIP_AXIS_OFFSET_LARGEST, most = s->clear_vel_mm_s, vel;
    double speed = 0.0;
    int i, moves = 0;
    axes->least_mm = chip_min(axes->least_mm, in->deflection_mm);
    if (!(in->deflection_mm <= axes->least_mm + s->contact_mm)) {
        fail(axes, CHIP_AXIS_OFFSET_COLLISION);
        return;
    }
    for (i = 0; i < 3; i++) {
        moves |= axes->velocity_mm_s[i] != 0.0;
        speed += axes->velocity_mm_s[i] * axes->velocity_mm_s[i];
        accel = chip_min(accel, s->acceleration_mm_s2[i]);
        most = chip_min(most, s->max_vel_mm_s[i]);
        if (is_in_stage(i, axes->stage, next_mm[i])) left[i] = -next_mm[i];
    }
    size = chip_sqrt(left[0] * left[0] + left[1] * left[1] + left[2] * left[2]);
    if (size < CHIP_AXIS_OFFSET_ARRIVED_MM) {
        if (moves) return;
        if (axes->stage < 3) axes->stage++;
        return;
    }
    vel = chip_min(chip_min(most, chip_sqrt(speed) + accel * in->period_s), make_up(size, accel, in->period_s));
    for (i = 0; i < 3; i++) wanted[i] = vel * left[i] / size;
}

/* The request that makes LinuxCNC's planner move with v from `next` on [1]. */
static double request_for(double next_mm, double vel, double acceleration, double period_s)
{
    double speed = size_of(vel), lead = 0.5 * speed * speed / acceleration + speed * period_s;
    CHIP_FAULT(LAG_LEFT, lead = speed * period_s);
    return vel < 0.0 ? next_mm - lead : next_mm + lead;
}

/* The counts of an axis for a request; a request in steps of a count. */
static void ask(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *s,
                const struct chip_axis_offset_in *in, int axis, double request_mm)
{
    double more = floor((request_mm - in->requested_mm[axis]) / s->count_mm + 0.5), all = axes->counts[axis] + more;
    if (!within(all, -CHIP_AXIS_OFFSET_COUNTS, CHIP_AXIS_OFFSET_COUNTS)) {
        fail(axes, CHIP_AXIS_OFFSET_TOO_FAR);
        return;
    }
    axes->counts[axis] = (int32_t)all;
}

/* Compares the offset with what it should be, and foresees the next one [2] [4]. */
static void foresee(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *s,
                    const struct chip_axis_offset_in *in, struct chip_axis_offset_out *out, double next_mm[3])
{
    int i;
    for (i = 0; i < 3; i++) {
        double off = axes->known ? in->offset_mm[i] - axes->expected_mm[i] : 0.0;
        out->astray_mm = chip_max(out->astray_mm, size_of(off));
        if (axes->state == CHIP_AXIS_OFFSET_FOLLOW) axes->missing_mm[i] -= off;
        next_mm[i] = axes->expected_mm[i] = in->offset_mm[i] + in->period_s * axes->velocity_mm_s[i];
    }
    axes->known = 1;
    if (out->astray_mm > s->max_astray_mm && !CHIP_FAULTY(ASTRAY_IGNORED)
        && (axes->state == CHIP_AXIS_OFFSET_FOLLOW || axes->state == CHIP_AXIS_OFFSET_CLEAR))
        fail(axes, CHIP_AXIS_OFFSET_ASTRAY);
}

/* The velocity given, within A of the one before, and the request for it [1] [3]. */
static void give(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *s,
                 const struct chip_axis_offset_in *in, const double next_mm[3], const double wanted[3],
                 struct chip_axis_offset_out *out)
{
    int i, ends = axes->state == CHIP_AXIS_OFFSET_CLEAR && axes->stage > 2;
    for (i = 0; i < 3; i++) {
        double before = axes->velocity_mm_s[i], most = s->acceleration_mm_s2[i] * in->period_s, vel, request;
        vel = chip_clamp(wanted[i], before - most, before + most);
        vel = chip_clamp(vel, -s->max_vel_mm_s[i], s->max_vel_mm_s[i]);
        axes->velocity_mm_s[i] = vel;
        if (axes->state == CHIP_AXIS_OFFSET_FOLLOW) axes->missing_mm[i] -= vel * in->period_s;
        request = ends ? 0.0 : request_for(next_mm[i], vel, s->acceleration_mm_s2[i], in->period_s);
        if (vel != 0.0 || before != 0.0 || ends) {
            ask(axes, s, in, i, request);
            out->lead_mm = chip_max(out->lead_mm, size_of(request - next_mm[i]));
        }
        out->behind_mm = chip_max(out->behind_mm, size_of(axes->missing_mm[i]));
    }
    if (ends) axes->state = CHIP_AXIS_OFFSET_HOLD;
}

static void report(const struct chip_axis_offset *axes, const struct chip_axis_offset_in *in,
                   struct chip_axis_offset_out *out)
{
    int i;
    out->state_number = axes->state;
    out->fault_number = axes->fault;
    out->is_enabled = axes->state == CHIP_AXIS_OFFSET_FOLLOW;
    out->is_cleared = axes->state == CHIP_AXIS_OFFSET_HOLD;
    for (i = 0; i < 3; i++) {
        out->counts[i] = axes->counts[i];
        if (!within(in->offset_mm[i], -CHIP_AXIS_OFFSET_ARRIVED_MM, CHIP_AXIS_OFFSET_ARRIVED_MM)) out->is_cleared = 0;
    }
    out->is_off = in->has_machine && !out->is_cleared;
}

void chip_axis_offset_init(struct chip_axis_offset *axes)
{
    static const struct chip_axis_offset nothing;
    *axes = nothing;
}

void chip_axis_offset_step(struct chip_axis_offset *axes, const struct chip_axis_offset_settings *settings,
                           const struct chip_axis_offset_in *given, struct chip_axis_offset_out *out)
{
    static const struct chip_axis_offset_out nothing;
    struct chip_axis_offset_in in = *given;
    double next_mm[3], wanted[3] = { 0.0, 0.0, 0.0 };
    int i, moves = 0;
    *out = nothing;
    in.period_s = chip_finite(in.period_s) ? chip_clamp(in.period_s, 1e-5, 0.1) : 0.001;
    if (!in.has_machine || !axes->had_machine) {
        /* LinuxCNC neither moves nor counts; once it is on again the offset is 0 [5] */
        axes->had_machine = in.has_machine;
        axes->state = CHIP_AXIS_OFFSET_HOLD;
        axes->fault = axes->known = 0;
        axes->had_request = in.has_request;
        axes->had_clear = in.wants_clear;
        axes->begin_s = axes->clear_s = 0.0;
        for (i = 0; i < 3; i++) axes->velocity_mm_s[i] = axes->missing_mm[i] = 0.0;
        report(axes, &in, out);
        return;
    }
    if (!is_sound(settings) || !is_finite(&in)) {
        if (axes->state != CHIP_AXIS_OFFSET_HOLD || in.has_request || in.wants_clear)
            fail(axes, is_sound(settings) ? CHIP_AXIS_OFFSET_NOT_FINITE : CHIP_AXIS_OFFSET_SETTINGS);
        /* LinuxCNC's planner ends at the last request, a braking distance ahead */
        for (i = 0; i < 3; i++) axes->velocity_mm_s[i] = 0.0;
        axes->known = 0;
        report(axes, &in, out);
        return;
    }
    serve_signals(axes, &in);
    foresee(axes, settings, &in, out, next_mm);
    if (axes->state == CHIP_AXIS_OFFSET_FOLLOW) follow(axes, settings, &in, wanted);
    if (axes->state == CHIP_AXIS_OFFSET_CLEAR) go_back(axes, settings, &in, next_mm, wanted);
    if (axes->state == CHIP_AXIS_OFFSET_FAULT || axes->state == CHIP_AXIS_OFFSET_HOLD)
        for (i = 0; i < 3; i++) wanted[i] = 0.0;
    if (axes->state != CHIP_AXIS_OFFSET_FOLLOW)
        for (i = 0; i < 3; i++) axes->missing_mm[i] = 0.0;
    for (i = 0; i < 3; i++) moves |= axes->velocity_mm_s[i] != 0.0;
    if (moves || axes->state != CHIP_AXIS_OFFSET_HOLD) give(axes, settings, &in, next_mm, wanted, out);
    report(axes, &in, out);
}
