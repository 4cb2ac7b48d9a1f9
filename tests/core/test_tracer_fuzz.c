/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Hostile numbers on every input of the tracer, at random.
 *
 * A head follows a model; again and again some settings or inputs are NaN, infinite or absurd for a while. In every period: no
 * output that is not finite, no velocity above the limit in force unless it falls with A, no change of velocity above A, the
 * limit below sqrt(2 A (range - eps0)) in contact, gain x (dead time + period) <= 0.75, a fault just in the states of faults.
 * Sound again and switched off and on, the head lands and traces.
 *
 * CHIPWISE_RANDOM_COUNT episodes (default 2000 of 500 periods), CHIPWISE_SEED; a failure prints seed, episode, period and what.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/stylus.h"
#include "core/tracer.h"
#include "random_numbers.h"

#define PERIODS 500 /* of an episode */
#define SETTLE 3000 /* until a sound tracer has landed again */

static long episode, period, failures, hostile_periods, traced;
static struct chip_tracer tracer;
static struct chip_tracer_settings sound, settings;
static struct chip_tracer_in in;
static struct chip_tracer_out out;
static struct chip_stylus stylus;
static struct chip_stylus_settings model;
static double head[3];

static void expect(int good, const char *what, double value)
{
    if (good || failures++ > 20) return;
    printf("CHIPWISE_SEED=%lu episode %ld period %ld: %s: %.17g (state %d, fault %d)\n", start_seed, episode, period,
           what, value, out.state_number, out.fault_number);
}

static double length(const double v[3]) { return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

static void begin(void)
{
    int i;
    memset(&sound, 0, sizeof sound);
    memset(&model, 0, sizeof model);
    memset(&stylus, 0, sizeof stylus);
    memset(head, 0, sizeof head);
    sound.mode_number = 1 + pick(4);
    sound.scan_axis_number = pick(2);
    sound.direction_sign = chance() < 0.5 ? 1 : -1;
    sound.feed_mm_s = 100.0 * chance();
    sound.approach_vel_mm_s = 5.0 + 20.0 * chance();
    sound.return_vel_mm_s = 10.0 + 100.0 * chance();
    sound.max_vel_mm_s = 10.0 + 200.0 * chance();
    sound.acceleration_mm_s2 = 300.0 + 5000.0 * chance();
    sound.gain_hz = 50.0 + 1000.0 * chance();
    sound.deflection_mm = 0.1 + 0.4 * chance();
    sound.range_mm = sound.deflection_mm + 0.3 + 3.0 * chance();
    model.delay_periods = pick(8);
    sound.dead_time_s = 0.001 * model.delay_periods;
    sound.max_jump_mm = 2.0;
    sound.pick_mm = chance() - 0.5;
    sound.retract_mm = 2.0 * chance();
    sound.search_mm = 50.0;
    sound.lost_mm = 20.0;
    sound.approach_dir[sound.mode_number > 2 ? 0 : 2] = sound.mode_number > 2 ? 1.0 : -2.0;
    for (i = 0; i < 3; i++) {
        sound.window_min_mm[i] = -3.0;
        sound.window_max_mm[i] = 3.0;
        sound.soft_min_mm[i] = -100.0;
        sound.soft_max_mm[i] = 100.0;
    }
    model.surface_number = sound.mode_number > 2 ? CHIP_STYLUS_CYLINDER + pick(2) : pick(5);
    model.normal[2] = 1.0;
    model.size_mm = 2.0 + 10.0 * chance();
    model.angle_deg = 90.0;
    model.ball_mm = 0.1 + chance();
    model.friction_share = 0.3 * chance();
    model.noise_mm = 0.001 * chance();
    head[sound.mode_number > 2 ? 0 : 2] =
        (sound.mode_number > 2 ? -1.0 : 1.0)
        * (2.0 + model.ball_mm
           + (sound.mode_number > 2 || model.surface_number == CHIP_STYLUS_BALL ? model.size_mm : 0.0));
    if (model.surface_number == CHIP_STYLUS_BOWL) head[2] = 0.0;
    if (model.surface_number == CHIP_STYLUS_CORNER) head[0] = -5.0;
    chip_tracer_init(&tracer);
}

/* Numbers of the settings and the inputs by number; -> how many there are. */
static int number(int which, double **place)
{
    double *first = &settings.feed_mm_s, *last = &settings.soft_max_mm[2];
    int of_settings = (int)(last - first) + 1;
    double *others[] = { &in.feed_share,     &in.period_s,         &in.position_mm[0],   &in.position_mm[1],
                         &in.position_mm[2], &in.deflection_mm[0], &in.deflection_mm[1], &in.deflection_mm[2] };
    if (place) *place = which < of_settings ? first + which : others[which - of_settings];
    return of_settings + COUNT(others);
}

static void check(const double before[3])
{
    const struct chip_tracer_settings *s = &tracer.settings;
    double dt = isfinite(in.period_s) ? fmin(fmax(in.period_s, 1e-5), 0.1) : 0.001, step[3],
           most = s->acceleration_mm_s2 * dt;
    double speed = length(out.velocity_mm_s), fell = length(before) - most;
    int i, ended = out.state_number == CHIP_TRACER_FAULT || out.state_number == CHIP_TRACER_OVER_RANGE;
    for (i = 0; i < 3; i++) {
        step[i] = out.velocity_mm_s[i] - before[i];
        expect(isfinite(out.velocity_mm_s[i]) && isfinite(out.normal[i]) && isfinite(out.ball_mm[i]), "not finite",
               out.velocity_mm_s[i]);
    }
    expect(isfinite(out.deflection_mm) && isfinite(out.error_mm) && isfinite(out.normal_vel_mm_s)
               && isfinite(out.tangential_vel_mm_s),
           "not finite", out.normal_vel_mm_s);
    expect(out.friction_share >= 0.0 && out.friction_share <= 0.6, "friction", out.friction_share);
    expect(out.state_number >= 0 && out.state_number <= CHIP_TRACER_DONE, "state", out.state_number);
    expect(ended == (out.fault_number != 0), "fault without a state of faults, or the other way", out.fault_number);
    if (!tracer.has_settings) {
        expect(speed == 0.0, "moves without settings", speed);
        return;
    }
    expect(length(step) <= most * (1.0 + 1e-9) + 1e-12, "acceleration", length(step) / dt);
    expect(speed <= fmax(out.velocity_limit_mm_s, fell) * (1.0 + 1e-9) + 1e-12, "velocity", speed);
    expect(out.velocity_limit_mm_s <= s->max_vel_mm_s, "limit", out.velocity_limit_mm_s);
    expect(out.gain_hz * (s->dead_time_s + dt) <= 0.75 * (1.0 + 1e-12), "gain", out.gain_hz);
    traced += out.state_number == CHIP_TRACER_TRACE;
}

static void one(int spoilt[], double value[], int count)
{
    double before[3], now[3], *place;
    int i;
    for (i = 0; i < 3; i++) before[i] = tracer.velocity_mm_s[i];
    chip_stylus_step(&stylus, &model, head, in.deflection_mm, now);
    memcpy(in.position_mm, head, sizeof head);
    settings = sound;
    in.is_enabled = 1;
    in.wants_retract = 0;
    in.feed_share = 1.0;
    in.period_s = 0.001;
    for (i = 0; i < count; i++) {
        number(spoilt[i], &place);
        *place = value[i];
        if (chance() < 0.1) settings.mode_number = pick(9) - 2;
        if (chance() < 0.05) settings.direction_sign = pick(5) - 2;
        if (chance() < 0.05) in.wants_retract = 1;
        if (chance() < 0.1) in.is_enabled = 0;
    }
    chip_tracer_step(&tracer, &settings, &in, &out);
    check(before);
    for (i = 0; i < 3; i++) head[i] = fmin(fmax(head[i] + 0.001 * out.velocity_mm_s[i], -1e3), 1e3);
}

static void run_episode(void)
{
    int spoilt[4], left = 0, count = 0, i, reached = 0;
    double value[4];
    begin();
    for (period = 0; period < PERIODS; period++) {
        if (left == 0 && chance() < 0.02) {
            left = 1 + pick(chance() < 0.5 ? 3 : 40);
            count = 1 + pick(4);
            for (i = 0; i < count; i++) {
                spoilt[i] = pick(number(0, 0));
                value[i] = hostile();
            }
        }
        if (left > 0) left--, hostile_periods++;
        one(spoilt, value, left > 0 ? count : 0);
        if (out.fault_number && chance() < 0.05)
            tracer.state = CHIP_TRACER_IDLE, tracer.fault = 0; /* the operator: off and on */
    }
    begin();
    for (period = 0; period < SETTLE && !reached && episode % 20 == 0; period++) {
        one(spoilt, value, 0);
        reached = out.state_number == CHIP_TRACER_TRACE;
    }
    expect(reached || episode % 20, "never lands when all is sound", out.state_number);
}

int main(void)
{
    long episodes = random_begin(2000);
    for (episode = 0; episode < episodes; episode++) run_episode();
    printf("%ld episodes, %ld hostile periods, %ld traced, %ld failures\n", episodes, hostile_periods, traced,
           failures);
    return failures != 0 || traced == 0 || (episodes > 100 && hostile_periods == 0);
}
