/* SPDX-License-Identifier: GPL-2.0-or-later */
/* watchdog.c - see watchdog.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "feed.h"
#include "watchdog.h"

/* periods a velocity must be unexplained [3]; fewer trip on single readings, more let the tool run on */
#define CHIP_WATCHDOG_PERIODS 5
/* factor on the explained velocity; smaller trips on rounding, larger hides small excesses */
#define CHIP_WATCHDOG_SLACK 1.02
/* share of the acceleration, where the braking is not known; above the planner's own, braking reads as ignoring [2] */
#define CHIP_WATCHDOG_BRAKING 0.25
#define CHIP_WATCHDOG_BLENDED 0.5  /* share of the velocity that is on the slower of two segments, at most [2] */
#define CHIP_WATCHDOG_REST_S 0.1   /* s at rest that end a synchronised move [5] */
#define CHIP_WATCHDOG_AT_REST 1e-6 /* mm/s */
#define CHIP_WATCHDOG_LIMIT 1e9    /* mm/s, mm/s2: no machine exceeds this */
#define CHIP_WATCHDOG_LATENCY 3.0  /* periods the machine goes on accelerating after the override has dropped [2] */

/* A velocity or acceleration from a pin: 0 unless it is a finite number above 0. */
static double speed(double value) { return chip_min(chip_setting(value), CHIP_WATCHDOG_LIMIT); }

/* Velocity the override in force allows the machine, mm/s [2]. */
static double allowed_velocity(const struct chip_watchdog_in *in)
{
    double scale = chip_finite(in->override_share) ? chip_clamp(in->override_share, 0.0, 1.0) : 1.0;
    double max_override = chip_finite(in->max_override_share) ? chip_clamp(in->max_override_share, 1.0, 100.0) : 1.0;
    CHIP_FAULT(CEILING_EXPLAINS, scale = 1.0);
    return max_override * chip_max(scale * speed(in->requested_vel_mm_s), speed(in->programmed_vel_mm_s));
}

/* Velocity that has to keep to the override: that on the faster segment of a blend, mm/s [2]. */
static double checked_velocity(const struct chip_watchdog_in *in)
{
    double velocity = speed(in->current_vel_mm_s);
    CHIP_FAULT(BLEND_AS_IGNORED, return velocity);
    return velocity - chip_min(speed(in->blend_vel_mm_s), CHIP_WATCHDOG_BLENDED * velocity);
}

/* Acceleration at which an explained velocity falls, mm/s2 [2]. */
static double explained_braking(const struct chip_watchdog_in *in)
{
    double falling = CHIP_WATCHDOG_BRAKING * speed(in->acceleration_mm_s2), known = speed(in->braking_mm_s2);
    CHIP_FAULT(BRAKING_AS_IGNORED, return 2.0 * speed(in->acceleration_mm_s2));
    return known > 0.0 ? chip_min(falling, known) : falling;
}

/* Whether the move follows the spindle [5]. */
static int follow_spindle(struct chip_watchdog *watchdog, const struct chip_watchdog_in *in, int feeding,
                          double period_s)
{
    watchdog->at_rest_s = speed(in->current_vel_mm_s) > CHIP_WATCHDOG_AT_REST ? 0.0 : watchdog->at_rest_s + period_s;
    if (in->is_index_enabled)
        watchdog->is_synchronised = 1;
    else if (!feeding || watchdog->at_rest_s > CHIP_WATCHDOG_REST_S)
        watchdog->is_synchronised = 0;
    return watchdog->is_synchronised;
}

int chip_watchdog_step(struct chip_watchdog *watchdog, const struct chip_watchdog_in *in)
{
    int feeding = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC || in->motion == CHIP_MOTION_PROBING;
    int on = chip_feed_replaces(in->feed_mode, in->programmed_vel_mm_s, in->requested_vel_mm_s);
    int ceiling = speed(in->programmed_vel_mm_s) > 0.0 && speed(in->requested_vel_mm_s) > in->programmed_vel_mm_s;
    double period_s = chip_finite(in->period_s) ? chip_clamp(in->period_s, 0.0, 0.1) : 0.0;
    double allowed = allowed_velocity(in), actual = checked_velocity(in), accel = speed(in->acceleration_mm_s2),
           jerk = speed(in->max_jerk_mm_s3);
    double falling = explained_braking(in), gaining = CHIP_WATCHDOG_LATENCY * accel * period_s;

    if (!on || in->motion == 0) watchdog->override_ignored = 0;
    if (follow_spindle(watchdog, in, feeding, period_s) || !on || !feeding || !ceiling) {
        watchdog->explained_mm_s = chip_max(allowed, actual);
        watchdog->periods_above = 0;
        watchdog->faster_s = 0.0;
        return watchdog->override_ignored;
    }
    watchdog->faster_s = actual > allowed ? chip_min(watchdog->faster_s + period_s, CHIP_WATCHDOG_LIMIT) : 0.0;
    if (jerk > 0.0) {
        falling = chip_min(falling, CHIP_WATCHDOG_BRAKING * chip_max(0.0, jerk * watchdog->faster_s - accel));
        gaining += 0.5 * accel * accel / jerk;
    }
    watchdog->explained_mm_s = chip_max(allowed, watchdog->explained_mm_s - falling * period_s);
    watchdog->periods_above = actual > CHIP_WATCHDOG_SLACK * watchdog->explained_mm_s ? watchdog->periods_above + 1 : 0;
    watchdog->explained_mm_s = chip_min(watchdog->explained_mm_s, actual + gaining);
    if (watchdog->periods_above >= CHIP_WATCHDOG_PERIODS || in->is_adaptive_off) watchdog->override_ignored = 1;
    return watchdog->override_ignored;
}
