/* tool_watch.c - see tool_watch.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "tool_watch.h"

#define CHIP_LONGEST_S 1e6          /* s, times are not counted any further */

void chip_tool_watch_step(struct chip_tool_watch *watch, const struct chip_tool_watch_in *in)
{
    double period_s = cw_finite(in->period_s) ? cw_clamp(in->period_s, 0.0, 1.0) : 0.0;
    int beats = in->beats != watch->last_heartbeat;
    int watched = cw_finite(in->limit_s) && in->limit_s > 0.0;

    watch->last_heartbeat = in->beats;
    watch->silent_s = beats ? 0.0 : cw_min(watch->silent_s + period_s, CHIP_LONGEST_S);
    watch->is_unknown = in->machine_tool != in->followed_tool;
    watch->changed_s = watch->is_unknown ? cw_min(watch->changed_s + period_s, CHIP_LONGEST_S) : 0.0;
    if (watched && watch->silent_s > in->limit_s) watch->code = CHIP_TOOL_UNWATCHED;
    else if (watch->changed_s > CHIP_TOOL_GRACE_S) watch->code = CHIP_TOOL_CHANGED;
    else watch->code = CHIP_TOOL_WATCHED;
}
