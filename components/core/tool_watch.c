/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tool_watch.c - see tool_watch.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "tool_watch.h"

#define CHIP_LONGEST_S 1e6 /* s, times are not counted any further */

/* s of this period in which the monitor could have been at work [4]. */
static double time_given(struct chip_tool_watch *watch, const struct chip_tool_watch_in *in)
{
    double period_s = chip_finite(in->period_s) ? chip_clamp(in->period_s, 0.0, 1.0) : 0.0, made_up;
    if (chip_finite(in->since_last_s) && in->since_last_s > CHIP_STOPPED_S)
        watch->stopped_s = chip_min(watch->stopped_s + in->since_last_s, CHIP_LONGEST_S);
    CHIP_FAULT(STANDSTILL_COUNTED, watch->stopped_s = 0.0);
    made_up = chip_min(period_s, watch->stopped_s);
    watch->stopped_s -= made_up;
    return period_s - made_up;
}

void chip_tool_watch_step(struct chip_tool_watch *watch, const struct chip_tool_watch_in *in)
{
    double period_s = time_given(watch, in);
    int beats = in->heartbeat_count != watch->last_heartbeat;
    int watched = chip_finite(in->monitor_timeout_s) && in->monitor_timeout_s > 0.0;
    int begins = in->heartbeat_count < watch->last_heartbeat;

    watch->last_heartbeat = in->heartbeat_count;
    watch->silent_s = beats ? 0.0 : chip_min(watch->silent_s + period_s, CHIP_LONGEST_S);
    watch->is_unknown = in->tool_in_spindle_number != in->tool_followed_number;
    watch->changed_s = watch->is_unknown ? chip_min(watch->changed_s + period_s, CHIP_LONGEST_S) : 0.0;
    if (watched && watch->silent_s > in->monitor_timeout_s)
        watch->code = CHIP_TOOL_UNWATCHED;
    else if (watch->changed_s > CHIP_TOOL_GRACE_S)
        watch->code = CHIP_TOOL_CHANGED;
    else
        watch->code = CHIP_TOOL_WATCHED;
    watch->is_unwatched = begins || watch->code == CHIP_TOOL_UNWATCHED;
    watch->is_awaited =
        watch->is_unknown && watched && watch->code != CHIP_TOOL_UNWATCHED && watch->changed_s <= in->monitor_timeout_s;
    CHIP_FAULT(TOOL_NOT_AWAITED, watch->is_awaited = 0);
    CHIP_FAULT(AWAITED_FOR_EVER, watch->is_awaited = watch->is_unknown);
}
