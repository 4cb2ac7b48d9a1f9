/* SPDX-License-Identifier: GPL-2.0-or-later */
/* feed_ease.c - the easing of feed.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "feed.h"

/* Velocity of the climb after a period, mm/s: down at once, up by `recover` [7]. */
static double climb(double ramp, double goal, double recover, double dt)
{
    double step = chip_setting(recover) * (chip_finite(dt) ? chip_clamp(dt, 0.0, 0.1) : 0.0);
    CHIP_FAULT(RISES_AT_ONCE, return goal);
    return chip_setting(recover) > 0.0 ? chip_min(goal, ramp + step) : goal;
}

struct chip_feed_out chip_feed_ease(struct chip_feed_easing *easing, const struct chip_feed_in *in,
                                    struct chip_feed_out law, double recover, double deadband)
{
    double goal = law.scale * in->requested_vel_mm_s, band = chip_min(chip_setting(deadband), 1.0);
    int eased = law.limit != CHIP_LIMIT_FALLBACK && chip_feed_is_on(in->feed_mode)
             && (in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC);
    int top = law.limit == CHIP_LIMIT_NONE || law.limit == CHIP_LIMIT_CEILING;

    if (!eased || !chip_finite(goal)) {
        easing->is_begun = 0;
        return law;
    }
    if (!easing->is_begun) easing->ramp_mm_s = easing->given_mm_s = goal;
    easing->is_begun = 1;
    easing->ramp_mm_s = climb(easing->ramp_mm_s, goal, recover, in->period_s);
    if (easing->ramp_mm_s < easing->given_mm_s || easing->ramp_mm_s > (1.0 + band) * easing->given_mm_s
        || (top && easing->ramp_mm_s >= goal))
        easing->given_mm_s = easing->ramp_mm_s;
    return chip_feed_result(chip_clamp(easing->given_mm_s / in->requested_vel_mm_s, 0.0, law.scale), law.limit);
}
