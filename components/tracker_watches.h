/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracker_watches.h - the watches of stock_tracker.comp over tool and load: pins to the input of core/tool_watch.h and core/load_watch.h, and
 * their results.
 *
 * Who includes it: stock_tracker.comp, behind the macros of its pins.
 */
#ifndef CHIPWISE_TRACKER_WATCHES_H
#define CHIPWISE_TRACKER_WATCHES_H

/* Checks that the tool is still the described one. A dead monitor cannot report itself, so the message to the operator
 * comes from here (motion passes error messages of realtime on to the user interface). */
static void watch_tool(struct __comp_state *__comp_inst, long period, struct chip_tracker_in *in)
{
    struct chip_tool_watch_in seen;
    double now = (double)rtapi_get_time();
    seen.tool_in_spindle_number = tool_in_spindle;
    seen.tool_followed_number = tool_followed;
    seen.heartbeat_count = heartbeat;
    seen.monitor_timeout_s = monitor_timeout;
    seen.period_s = fperiod;
    seen.since_last_s = last_ns > 0.0 ? 1e-9 * (now - last_ns) : 0.0;
    last_ns = now;
    chip_tool_watch_step(&watch, &seen);
    in->tool_unknown = watch.is_unknown;
    in->watch_fault = watch.code;
    if (watch.code != CHIP_TOOL_UNWATCHED)
        is_reported = 0;
    else if (!is_reported) {
        is_reported = 1;
        rtapi_print_msg(RTAPI_MSG_ERR,
                        "chipwise: chipwise-monitor does not answer, so tool changes are not "
                        "followed and M251 does not raise the feed; start `chipwise monitor` in a shell\n");
    }
}

/* Says once that length or shape of a tool have placed its tip in the stock. The guard stops a traverse from there sideways, but
 * no feed, so this comes first. */
static void watch_buried(struct __comp_state *__comp_inst, const struct chip_tracker_out *out)
{
    int is_inch = units_per_mm < 0.5;
    long parts = is_inch ? 10000 : 100;
    char text[24];
    long deep = (long)(chip_clamp(out->buried_depth_mm * units_per_mm, 0.0, 1e6) * (double)parts + 0.5);
    if (out->buried_depth_mm == told_buried && (deep == 0 || tool_in_spindle == told_tool)) return;
    told_buried = out->buried_depth_mm;
    told_tool = tool_in_spindle;
    if (deep == 0) return;
    rtapi_snprintf(text, sizeof text, is_inch ? "%ld.%04ld in" : "%ld.%02ld mm", deep / parts, deep % parts);
    rtapi_print_msg(
        RTAPI_MSG_ERR,
        "chipwise: by its length or shape the tip of tool %d is %s deep in the stock; press Stop, then check the "
        "tool table, H of G43 and the stock (M250)\n",
        (int)tool_in_spindle, text);
}

/* Whether a load that was known is not known any more, and nobody has decided what holds instead. */
static int watch_load(struct __comp_state *__comp_inst, const struct chip_tracker_in *in)
{
    struct chip_load_watch_in seen;
    seen.is_ready = ready && certain;
    seen.is_unwatched = watch.is_unwatched;
    seen.stock_changes = in->define_request || in->external_writer;
    seen.is_decided = feed_decided;
    seen.tool_in_spindle_number = tool_in_spindle;
    seen.tool_mu[0] = in->tool_diameter_mu;
    seen.tool_mu[1] = in->tool_corner_radius_mu;
    seen.tool_mu[2] = in->tool_tip_angle_deg;
    seen.tool_mu[3] = in->tool_flute_length_mu;
    return chip_load_watch_step(&load_state, &seen);
}

#endif
