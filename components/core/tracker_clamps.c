/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_clamps.c - the tracker's look at clamps: see tracker.h [5] and clamp.h. */
#include "chip_math.h"
#include "motion_kind.h"
#include "tracker_map.h"

#define CHIP_CLAMPS_TAKEN_MASK 0x7fffffffu

/* Whether the machine makes a move that must not touch a clamp. */
static int is_watched(const struct chip_tracker_in *in)
{
    return in->is_enabled && in->motion != CHIP_MOTION_NONE && in->motion != CHIP_MOTION_PROBING;
}

void chip_tracker_watch_clamps(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3],
                               int bad, struct chip_tracker_out *out)
{
    struct chip_clamps *clamps = &tracker->clamps;
    struct chip_clamp_in move;
    int i, any = chip_clamps_take(clamps, in->clamps);
    out->has_clamp_contact = out->met_clamp = out->met_part = 0;
    out->clamp_distance_mm = 0.0;
    out->clamps_in_force = (int)clamps->table.count;
    out->tables_taken = clamps->refused ? -1 : (int)(clamps->seen / 2 & CHIP_CLAMPS_TAKEN_MASK);
    clamps->window = 0.0;
    if (!any || bad || !tracker->tip_known || chip_tracker_offset_changed(tracker, in)) return;
    if (!is_watched(in)) {
        chip_clamps_begin(clamps);
        return;
    }
    chip_clamps_build(clamps, tracker->tool_error == 0 ? &tracker->tool : 0, in->tool_stick_out_mu / in->mu_per_mm,
                      in->tool_holder_diameter_mu / in->mu_per_mm);
    for (i = 0; i < 3; i++) {
        move.from[i] = tracker->tip[i];
        move.to[i] = tip[i];
    }
    move.period_s = in->period_s;
    move.acceleration_mm_s2 = in->acceleration_mu_s2 / in->mu_per_mm;
    move.current_vel_mm_s = in->current_vel_mu_s / in->mu_per_mm;
    move.max_jerk_mm_s3 = in->max_jerk_mu_s3 / in->mu_per_mm;
    move.distance_to_go_mm = in->distance_to_go_mu / in->mu_per_mm;
    move.path = tracker->path.known && tracker->path.count > 0 ? &tracker->path : 0;
    out->has_clamp_contact = chip_clamps_check(clamps, &move);
    out->clamp_distance_mm = clamps->distance;
    out->met_clamp = clamps->number;
    out->met_part = clamps->part;
}
