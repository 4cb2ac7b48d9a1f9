/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_cut.c - what the tracker cuts in a period: see tracker.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "motion_kind.h"
#include "tracker_map.h"

#define CHIP_AT_REST 1e-6        /* mm, a smaller step is rest */
#define CHIP_BURIED_LEAST 0.2    /* mm in the stock; less may be a cell's share of a wall, or a length's tolerance */
#define CHIP_BURIED_DIRECTIONS 8 /* about the axis that are looked at, on two circles */

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

/* [1] How deep a tool at `tip` is in the stock, mm: at its axis, at half of its radius, and well inside its rim, so that the
 * wall of a slot of its own does not count. */
static double buried_depth(const struct chip_stock *stock, const struct chip_tool *tool, const double tip[3])
{
    double most = chip_stock_above(stock, tip[0], tip[1], tip[2]),
           rim = chip_max(0.0, tool->radius - 1.5 * stock->cell);
    int i, circle;
    for (circle = 1; circle <= 2; circle++) {
        double r = 0.5 * circle * chip_min(rim, 0.9 * tool->radius), floor;
        CHIP_FAULT(RIM_BURIED, r = 0.5 * circle * tool->radius);
        floor = tip[2] + chip_tool_height(tool, r);
        for (i = 0; i < CHIP_BURIED_DIRECTIONS; i++) {
            double turn = 2.0 * CHIP_PI * i / CHIP_BURIED_DIRECTIONS;
            most = chip_max(most, chip_stock_above(stock, tip[0] + r * cos(turn), tip[1] + r * sin(turn), floor));
        }
    }
    return most >= CHIP_BURIED_LEAST ? most : 0.0;
}

int chip_tracker_has_moved(const struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    double step = 0.0;
    int i;
    for (i = 0; i < 3; i++) step = chip_max(step, fabs(in->pos_mu[i] / in->mu_per_mm - tracker->axis[i]));
    return in->is_enabled && tracker->tip_known && step > CHIP_AT_REST;
}

/* Whether the tool moved at feed in this period: it has been where it is, then, whatever its length. */
static int is_fed(const struct chip_tracker *tracker, const struct chip_tracker_in *in)
{
    return in->motion > CHIP_MOTION_TRAVERSE && chip_tracker_has_moved(tracker, in);
}

long chip_tracker_cut(struct chip_tracker *tracker, struct chip_stock *stock, const struct chip_tracker_in *in,
                      const double tip[3])
{
    long work = 0;
    if (tracker->buried_mm > 0.0 && is_fed(tracker, in)) tracker->buried_mm = 0.0;
    if (in->motion > CHIP_MOTION_TRAVERSE && tracker->tip_known)
        chip_guard_shank(&tracker->guard, stock, &tracker->tool, tracker->tip, tip,
                         tracker->sweep.known && tracker->sweep.start_is_cut, &work);
    else
        tracker->guard.excess = 0;
    if (!tracker->sweep.known) {
        const double *from = !tracker->tip_known ? tip : tracker->has_start ? tracker->start : tracker->tip;
        chip_sweep_start(&tracker->sweep, from);
        tracker->sweep.start_is_cut = tracker->has_start; /* at rest there it cuts nothing [1] */
        tracker->buried_mm = tracker->has_start ? buried_depth(stock, &tracker->tool, from) : 0.0;
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

void chip_tracker_keep_start(struct chip_tracker *tracker, const struct chip_tracker_in *in, const double tip[3])
{
    int i, feeds = is_fed(tracker, in);
    if (feeds) tracker->buried_mm = 0.0;
    if (feeds || !in->is_enabled) tracker->has_start = 0;
    if (tracker->buried_mm > 0.0) tracker->has_start = 1;
    CHIP_FAULT(BURIED_FORGOTTEN, tracker->has_start &= in->is_enabled);
    for (i = 0; i < 3; i++) tracker->start[i] = tip[i];
    CHIP_FAULT(START_FORGOTTEN, tracker->has_start = 0);
}
