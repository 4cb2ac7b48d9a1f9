/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Inputs of the feed law, sound and hostile: for test_fuzz.c. */
#ifndef CHIPWISE_HOSTILE_LAW_H
#define CHIPWISE_HOSTILE_LAW_H

#include <string.h>

#include "core/feed.h"
#include "core/tracker.h"
#include "random_numbers.h"

/* The law's inputs, sound, with what the tracker says. */
static void set_law(struct chip_feed_in *law, int motion, const struct chip_tracker_out *out)
{
    int i;
    memset(law, 0, sizeof *law);
    law->feed_mode = pick(5) - 1;
    law->motion = motion;
    law->mrr_target_mm3_s = 60.0;
    law->mrr_lower_mm3_s = 20.0;
    law->programmed_vel_mm_s = 20.0;
    law->requested_vel_mm_s = 50.0;
    law->acceleration_mm_s2 = 500.0;
    law->period_s = 0.001;
    law->is_trusted = out->is_ready && !out->has_fault;
    law->section_area_mm2 = out->section_area_mm2;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++) {
        int used = i < out->load.steps;
        law->load_distance_mm[i] = used ? out->load.step[i].distance : 0.0;
        law->load_area_mm2[i] = used ? out->load.step[i].area : 0.0;
        law->load_accel_mm_s2[i] = used ? out->load.step[i].accel : 0.0;
    }
    law->feed_override_share = 1.0;
}

/* Makes some of the law's numbers hostile. */
static void spoil_law(struct chip_feed_in *law)
{
    double *numbers[] = { &law->mrr_target_mm3_s,
                          &law->mrr_lower_mm3_s,
                          &law->programmed_vel_mm_s,
                          &law->requested_vel_mm_s,
                          &law->acceleration_mm_s2,
                          &law->min_vel_mm_s,
                          &law->period_s,
                          &law->section_area_mm2,
                          &law->load_distance_mm[3],
                          &law->load_area_mm2[0],
                          &law->load_accel_mm_s2[1],
                          &law->tool_max_rate_mm3_s,
                          &law->max_vel_mm_s,
                          &law->min_scale_of_f,
                          &law->max_scale_of_f,
                          &law->air_vel_mm_s,
                          &law->plunge_vel_mm_s,
                          &law->dir_z,
                          &law->max_chip_thickness_mm,
                          &law->flutes,
                          &law->spindle_speed_rps,
                          &law->tool_diameter_mm,
                          &law->depth_mm,
                          &law->feed_override_share,
                          &law->max_jerk_mm_s3,
                          &law->current_vel_mm_s,
                          &law->current_accel_mm_s2 };
    int i;
    for (i = pick(4); i >= 0; i--) *numbers[pick(COUNT(numbers))] = hostile();
    if (chance() < 0.3) law->feed_mode = hostile_whole();
    if (chance() < 0.3) law->motion = hostile_whole();
}

#endif
