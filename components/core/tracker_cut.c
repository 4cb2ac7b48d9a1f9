/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_cut.c - what the tracker cuts in a period: see tracker.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "motion_kind.h"
#include "tracker_map.h"

void chip_tracker_set_work(struct chip_tracker *tracker, int percent)
{
    tracker->work_percent = (int)chip_clamp(percent, CHIP_WORK_MIN_PERCENT, 100.0);
}

/* [4] Bound on the work of cutting: less on the feeds of a round end, unless too much waits. Behind a feed, too, until the map
 * does not lag any more: then the traverse is checked. */
static long work_to_cut(struct chip_tracker *tracker, const struct chip_stock *stock, const struct chip_tracker_in *in)
{
    const struct chip_sweep *sweep = &tracker->sweep;
    if (in->motion > CHIP_MOTION_TRAVERSE)
        tracker->parts_left = CHIP_WORK_PARTS + 1;
    else if (tracker->parts_left > 0)
        tracker->parts_left--;
    if (!tracker->parts_left || chip_tool_is_flat(&tracker->tool)) return CHIP_WORK_TO_CUT;
    if (sweep->waiting && sweep->queue[0][2] != sweep->at[2])
        return sweep->waiting > CHIP_WAITING_MAX ? CHIP_WORK_TO_RAMP_LATE : CHIP_WORK_TO_RAMP;
    if (sweep->waiting > CHIP_WAITING_MAX) return CHIP_WORK_TO_CUT;
    return (long)chip_clamp((double)chip_sweep_level_work(stock, &tracker->tool) / CHIP_WORK_PARTS, CHIP_WORK_LEAST,
                            CHIP_WORK_TO_CUT);
}

long chip_tracker_cut(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                      const double tip[3])
{
    long work = 0;
    if (in->motion > CHIP_MOTION_TRAVERSE && tracker->tip_known)
        chip_guard_shank(&tracker->guard, stock, &tracker->tool, tracker->tip, tip,
                         tracker->sweep.known && tracker->sweep.start_is_cut, &work);
    else
        tracker->guard.excess = 0;
    if (!tracker->sweep.known) {
        chip_sweep_start(&tracker->sweep, tracker->has_start   ? tracker->start
                                          : tracker->tip_known ? tracker->tip
                                                               : tip);
        tracker->sweep.start_is_cut = tracker->has_start; /* at rest there it cuts nothing [1] */
    }
    tracker->has_start = 0;
    chip_sweep_to(&tracker->sweep, tip);
    chip_sweep_run(&tracker->sweep, stock, &tracker->tool, chip_tracker_bound(tracker, work_to_cut(tracker, stock, in)),
                   &work);
    if (in->motion > CHIP_MOTION_TRAVERSE)
        tracker->feed_finished = tracker->sweep.finished + (uint32_t)tracker->sweep.waiting;
    return work;
}

long chip_tracker_flush(struct chip_tracker *tracker, struct chip_stock *stock)
{
    long work = 0;
    chip_sweep_run(
        &tracker->sweep, stock, &tracker->tool,
        chip_tracker_bound(tracker, chip_tool_is_flat(&tracker->tool) ? CHIP_WORK_TO_CUT : CHIP_WORK_TO_RAMP_LATE),
        &work);
    if (!tracker->sweep.waiting) tracker->sweep.known = 0;
    return work;
}

int chip_tracker_feeds_are_cut(const struct chip_tracker *tracker)
{
    return !tracker->sweep.waiting || (int32_t)(tracker->sweep.finished - tracker->feed_finished) >= 0;
}
