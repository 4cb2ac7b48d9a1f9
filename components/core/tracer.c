/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer.c - one period of profiling control: checks, output; the states are in tracer_state.c. See tracer.h. */
#include "chip_math.h"
#include "tracer.h"
#include "tracer_law.h"
#include "tracer_sensor.h"
#include "tracer_state.h"

#define CHIP_TRACER_LARGEST 1e6      /* mm, mm/s, mm/s2, 1/s: no sound value is above */
#define CHIP_TRACER_AT_LIMIT_MM 0.02 /* of a soft limit */

static double length_of(const double v[3]) { return chip_sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static int within(double value, double low, double high) { return value >= low && value <= high; }

/* Whether the settings can be worked with; comparisons are FALSE for NaN. */
static int is_sound(const struct chip_tracer_settings *s)
{
    const double most = CHIP_TRACER_LARGEST;
    double size = 0.0;
    int i;
    for (i = 0; i < 3; i++) {
        size += s->approach_dir[i] * s->approach_dir[i];
        if (!chip_finite(s->window_min_mm[i]) || !chip_finite(s->window_max_mm[i]) || !chip_finite(s->soft_min_mm[i])
            || !chip_finite(s->soft_max_mm[i]))
            return 0;
    }
    return s->mode_number >= CHIP_TRACER_ONE_WAY && s->mode_number <= CHIP_TRACER_PARTIAL
        && (s->scan_axis_number == 0 || s->scan_axis_number == 1) && (s->direction_sign == 1 || s->direction_sign == -1)
        && within(s->feed_mm_s, 0.0, most) && within(s->approach_vel_mm_s, 1e-3, most)
        && within(s->return_vel_mm_s, 1e-3, most) && within(s->max_vel_mm_s, 1e-3, most)
        && within(s->acceleration_mm_s2, 1.0, most) && within(s->gain_hz, 1e-2, most)
        && within(s->deflection_mm, 1e-3, 100.0) && within(s->range_mm, 1.01 * s->deflection_mm, 100.0)
        && within(s->dead_time_s, 0.0, 1.0) && within(s->drive_time_s, 0.0, s->dead_time_s)
        && within(s->max_jump_mm, 1e-4, 100.0) && within(s->friction_share, 0.0, 0.6) && within(s->pick_mm, -most, most)
        && within(s->retract_mm, 0.0, most) && within(s->search_mm, 0.0, most) && within(s->lost_mm, 0.0, most)
        && within(size, 1e-6, 1e6);
}

/* The settings in force, directions of length 1. */
static void take_settings(struct chip_tracer *tracer, const struct chip_tracer_settings *settings)
{
    double *d = tracer->settings.approach_dir, size;
    int i;
    tracer->settings = *settings;
    size = chip_sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (i = 0; i < 3; i++) d[i] /= size;
    tracer->has_settings = 1;
}

static void fail(struct chip_tracer *tracer, int fault)
{
    if (tracer->state == CHIP_TRACER_FAULT || tracer->state == CHIP_TRACER_OVER_RANGE) return;
    tracer->fault = fault;
    tracer->state = fault == CHIP_TRACER_TOO_FAR ? CHIP_TRACER_OVER_RANGE : CHIP_TRACER_FAULT;
}

/* Largest change of three numbers. */
static double change(const double a[3], const double b[3])
{
    double most = 0.0;
    int i;
    for (i = 0; i < 3; i++) most = chip_max(most, a[i] > b[i] ? a[i] - b[i] : b[i] - a[i]);
    return most;
}

/* What was measured can be, and keeps the position; 0 if it is a fault. */
static int take_measured(struct chip_tracer *tracer, const struct chip_tracer_in *in, double period_s)
{
    double most = tracer->settings.max_jump_mm;
    int i, sound = 1, running = tracer->state != CHIP_TRACER_IDLE;
    for (i = 0; i < 3; i++)
        sound &= within(in->position_mm[i], -CHIP_TRACER_LARGEST, CHIP_TRACER_LARGEST)
              && within(in->deflection_mm[i], -CHIP_TRACER_LARGEST, CHIP_TRACER_LARGEST);
    CHIP_FAULT(NAN_AS_NUMBER, sound = 1);
    if (!sound) {
        tracer->stored = tracer->sensor.has_late = 0;
        if (running) fail(tracer, CHIP_TRACER_NOT_FINITE);
        return 0;
    }
    if (running && tracer->stored > 0) {
        if (change(in->position_mm, tracer->position_mm[tracer->newest]) > most)
            fail(tracer, CHIP_TRACER_POSITION_JUMP);
        else if ((change(in->deflection_mm, tracer->deflection_mm) > most && !CHIP_FAULTY(JUMP_FOLLOWED))
                 || chip_tracer_fell(tracer, in->deflection_mm, tracer->deflection_mm, period_s))
            fail(tracer, CHIP_TRACER_SENSOR_JUMP);
    }
    tracer->newest = (tracer->newest + 1) % CHIP_TRACER_DELAY;
    if (tracer->stored < CHIP_TRACER_DELAY) tracer->stored++;
    for (i = 0; i < 3; i++) {
        tracer->position_mm[tracer->newest][i] = in->position_mm[i];
        tracer->deflection_mm[i] = in->deflection_mm[i];
    }
    return 1;
}

/* No axis passes its soft limit: `wanted` falls in time to stop before it. */
static void keep_soft_limits(struct chip_tracer *tracer, const struct chip_tracer_in *in, double wanted[3])
{
    const struct chip_tracer_settings *s = &tracer->settings;
    int i;
    for (i = 0; i < 3; i++) {
        double up = s->soft_max_mm[i] - in->position_mm[i], down = in->position_mm[i] - s->soft_min_mm[i];
        double most_up = chip_tracer_normal_vel(s, chip_max(up, 0.0), CHIP_TRACER_END_GAIN);
        double most_down = chip_tracer_normal_vel(s, chip_max(down, 0.0), CHIP_TRACER_END_GAIN);
        CHIP_FAULT(SOFT_LIMITS_OFF, continue);
        if ((wanted[i] > 0.0 && up < CHIP_TRACER_AT_LIMIT_MM) || (wanted[i] < 0.0 && down < CHIP_TRACER_AT_LIMIT_MM))
            fail(tracer, CHIP_TRACER_SOFT_LIMIT);
        wanted[i] = chip_clamp(wanted[i], -most_down, most_up);
    }
}

/* `step` shortened to `most`, its part along the normal first; without a normal as it is. */
static void shorten(double step[3], const double normal[3], double most)
{
    double along = step[0] * normal[0] + step[1] * normal[1] + step[2] * normal[2], rest, share;
    int i;
    for (i = 0; i < 3; i++) step[i] -= along * normal[i];
    rest = length_of(step);
    along = chip_clamp(along, -most, most);
    CHIP_FAULT(FEED_FIRST, along *= 0.2);
    share = chip_sqrt(chip_max(0.0, most * most - along * along));
    share = rest > share ? share / rest : 1.0;
    for (i = 0; i < 3; i++) step[i] = share * step[i] + along * normal[i];
}

/* The velocity given: `wanted` within the limit, reached with A [5] [7]. */
static void give(struct chip_tracer *tracer, double period_s, const double wanted[3], double limit,
                 struct chip_tracer_out *out)
{
    static const double no_normal[3];
    double most = tracer->settings.acceleration_mm_s2 * period_s, size = length_of(wanted), scale, step[3];
    double before = length_of(tracer->velocity_mm_s);
    int i, in_contact = tracer->state == CHIP_TRACER_TRACE || tracer->state == CHIP_TRACER_PICK;
    scale = size > limit ? limit / size : 1.0;
    CHIP_FAULT(VELOCITY_UNLIMITED, scale = 1.0; limit = 1e9);
    for (i = 0; i < 3; i++) {
        double goal = before > limit ? limit / before * tracer->velocity_mm_s[i] : scale * wanted[i];
        step[i] = goal - tracer->velocity_mm_s[i];
    }
    shorten(step, in_contact && before <= limit ? tracer->normal : no_normal, most);
    for (i = 0; i < 3; i++) step[i] += tracer->velocity_mm_s[i];
    size = length_of(step);
    if (size > limit && before <= limit)
        scale = limit / size; /* onto the sphere of the limit: that does not lengthen the change */
    else
        scale = 1.0;
    for (i = 0; i < 3; i++) {
        double given = scale * step[i];
        if (!chip_finite(given)) given = 0.0;
        out->velocity_mm_s[i] = tracer->velocity_mm_s[i] = given;
    }
}

void chip_tracer_init(struct chip_tracer *tracer)
{
    static const struct chip_tracer nothing;
    *tracer = nothing;
}

/* What the machine is doing is shown, whatever it is. */
static void report(const struct chip_tracer *tracer, double eps, struct chip_tracer_out *out)
{
    int i;
    out->state_number = tracer->state;
    out->fault_number = tracer->fault;
    out->line_count = tracer->lines;
    out->deflection_mm = eps;
    out->error_mm = tracer->has_settings ? eps - tracer->settings.deflection_mm : 0.0;
    out->friction_share = tracer->law.friction_share;
    for (i = 0; i < 3; i++) out->normal[i] = tracer->normal[i];
}

void chip_tracer_step(struct chip_tracer *tracer, const struct chip_tracer_settings *settings,
                      const struct chip_tracer_in *in, struct chip_tracer_out *out)
{
    static const struct chip_tracer_out nothing;
    double wanted[3] = { 0.0, 0.0, 0.0 }, before[3], eps = 0.0, period_s = in->period_s;
    int measured, i;
    *out = nothing;
    period_s = chip_finite(period_s) ? chip_clamp(period_s, 1e-5, 0.1) : 0.001;
    if (is_sound(settings))
        take_settings(tracer, settings);
    else if (tracer->state != CHIP_TRACER_IDLE || in->is_enabled)
        fail(tracer, CHIP_TRACER_SETTINGS);
    if (!in->is_enabled) {
        tracer->state = CHIP_TRACER_IDLE;
        tracer->fault = CHIP_TRACER_NO_FAULT;
    }
    if (chip_finite(in->deflection_mm[0]) && chip_finite(in->deflection_mm[1]) && chip_finite(in->deflection_mm[2]))
        eps = chip_min(length_of(in->deflection_mm), 1e9);
    for (i = 0; i < 3; i++) before[i] = tracer->deflection_mm[i];
    measured = take_measured(tracer, in, period_s);
    if (!tracer->has_settings) {
        report(tracer, eps, out);
        return;
    }
    if (tracer->state == CHIP_TRACER_IDLE && in->is_enabled && measured) chip_tracer_begin(tracer, in);
    if (measured && tracer->state != CHIP_TRACER_IDLE && eps >= tracer->settings.range_mm
        && !CHIP_FAULTY(OVER_RANGE_IGNORED))
        fail(tracer, CHIP_TRACER_TOO_FAR);
    if (measured) {
        int fault = chip_tracer_sensor(tracer, before, eps, period_s);
        if (fault) fail(tracer, fault);
    }
    out->velocity_limit_mm_s = tracer->settings.max_vel_mm_s;
    out->gain_hz = chip_tracer_gain(&tracer->settings, period_s);
    if (measured) {
        int fault = chip_tracer_run(tracer, in, eps, period_s, wanted, out);
        if (fault) fail(tracer, fault);
        keep_soft_limits(tracer, in, wanted);
    }
    if (tracer->state == CHIP_TRACER_FAULT || tracer->state == CHIP_TRACER_OVER_RANGE || !measured)
        wanted[0] = wanted[1] = wanted[2] = 0.0;
    give(tracer, period_s, wanted, out->velocity_limit_mm_s, out);
    report(tracer, eps, out);
    if (measured)
        for (i = 0; i < 3; i++) out->ball_mm[i] = chip_tracer_late(tracer, period_s)[i] + in->deflection_mm[i];
}
