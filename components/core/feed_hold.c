/* SPDX-License-Identifier: GPL-2.0-or-later */
/* feed_hold.c - see feed_hold.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "feed_hold.h"

/* mm2, below this the tool is in air */
#define CHIP_HOLD_MIN_AREA 1e-6

/* [1] A period with a known load. */
static void note(struct chip_feed_hold *hold, const struct chip_feed_in *in, const struct chip_feed_out *law)
{
    int in_cut = in->section_area_mm2 > CHIP_HOLD_MIN_AREA;
    hold->last.scale = law->scale;
    hold->last.vel_mm_s = law->scale * in->requested_vel_mm_s;
    if (in_cut && (!hold->is_in_cut || hold->last.vel_mm_s < hold->lowest.vel_mm_s)) {
        hold->lowest = hold->last;
        hold->has_cut = 1;
    }
    hold->is_in_cut = in_cut;
    hold->is_begun = 1;
}

struct chip_feed_out chip_feed_hold_step(struct chip_feed_hold *hold, const struct chip_feed_in *in, int is_lost,
                                         struct chip_feed_out law)
{
    int on = in->feed_mode >= CHIP_FEED_LIMIT && in->feed_mode <= CHIP_FEED_WINDOW;
    int moves = in->motion == CHIP_MOTION_FEED || in->motion == CHIP_MOTION_ARC;
    int valid = moves && chip_finite(in->requested_vel_mm_s) && in->requested_vel_mm_s > 0.0;

    CHIP_FAULT(FEED_NOT_HELD, return law);
    if (!on) {
        hold->is_begun = hold->is_in_cut = hold->has_cut = hold->is_held = 0;
        return law;
    }
    if (!is_lost) {
        hold->is_held = 0;
        if (valid && law.limit != CHIP_LIMIT_FALLBACK) note(hold, in, &law);
    } else if (hold->is_begun && !hold->is_held) {
        hold->held = hold->is_in_cut || !hold->has_cut ? hold->last : hold->lowest; /* [2] */
        hold->is_held = 1;
    }
    if (!hold->is_held || !valid) return law;
    law.scale = chip_min(law.scale, hold->held.scale); /* [3] */
    law.scale = chip_clamp(chip_min(law.scale, hold->held.vel_mm_s / in->requested_vel_mm_s), 0.0, 1.0);
    law.limit = CHIP_LIMIT_FALLBACK;
    return law;
}
