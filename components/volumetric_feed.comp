component volumetric_feed "Set the feed override so that the removal rate stays constant";
description """
Turns the section area that stock_tracker(9) reports into a feed override: velocity = removal
rate / section area at the tool, and early enough ahead of it that the planner's braking is
done where the load begins. Wire
.B adaptive-feed
to motion.adaptive-feed; the program or the INI file must enable it with M52 P1.

Modes: 0 off; 1 limit, never faster than the programmed feed; 2 constant, up to the requested
velocity, which is then a ceiling above the programmed feed; 3 window, the programmed feed is
kept while the rate lies between mrr-lower and mrr-target.

The output is never negative, never NaN and never above 1. In every motion type but 2 (feed)
and 3 (arc) it is 1. Whatever cannot be judged leaves the programmed feed.

Add the function to the servo thread after that of stock_tracker.
""";

pin in s32 mode "0 off, 1 limit, 2 constant, 3 window";
pin in float mrr_target "removal rate to hold, mm3/min";
pin in float mrr_lower "mode 3: lower end of the window, mm3/min";
pin in float programmed_vel "F of the program, machine units/s; 0: the same as requested-vel";
pin in float requested_vel "motion.requested-vel, machine units/s";
pin in s32 motion_type "motion.motion-type";
pin in float acceleration "machine units/s2 the planner really uses";
pin in float section_area "stock-tracker.N.section-area, mm2";
pin in bit ready "stock-tracker.N.ready";
pin in bit fault "stock-tracker.N.fault";
pin in float ahead_distance_#[8] "stock-tracker.N.ahead-distance-M, machine units";
pin in float ahead_area_#[8] "stock-tracker.N.ahead-area-M, mm2";

pin out float adaptive_feed = 1.0 "to motion.adaptive-feed, 0..1";
pin out s32 limited_by "0 nothing, 1 stock here, 2 stock ahead, 3 floor, 4 ceiling, 5 fallback to the programmed feed";

param rw float units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw float floor_vel = 0.0 "machine units/s, the stock never slows the tool below this";

function _ fp;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), chipwise_command(9)";
include "core/volumetric_feed_core.h";
;;

FUNCTION(_) {
    struct cw_feed_in in;
    struct cw_feed_out out;
    double per_mm = units_per_mm;
    int i;

    in.kind = mode;
    in.target = mrr_target / 60.0;
    in.lower = mrr_lower / 60.0;
    in.programmed = programmed_vel / per_mm;
    in.requested = requested_vel / per_mm;
    in.motion = motion_type;
    in.accel = acceleration / per_mm;
    in.floor = floor_vel / per_mm;
    in.dt = fperiod;
    in.trusted = ready && !fault;
    in.area = section_area;
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        in.next_distance[i] = ahead_distance(i) / per_mm;
        in.next_area[i] = ahead_area(i);
    }

    out = cw_feed(&in, adaptive_feed);

    adaptive_feed = out.scale;
    limited_by = out.by;
}
