component volumetric_feed "Set the feed override so that the removal rate stays constant";
description """
Turns the section area that stock_tracker(9) reports into a feed override: velocity = removal
rate / section area at the tool, and early enough ahead of it that the planner's braking is
done where the load begins. Wire
.B adaptive-feed
or, where programs probe while F is replaced by a ceiling,
.B override
to motion.adaptive-feed; the program or the INI file must enable it with M52 P1.

Modes: 0 off; 1 limit, never faster than the programmed feed; 2 constant, up to the requested
velocity, which is then a ceiling above the programmed feed; 3 window, the programmed feed is
kept while the rate lies between mrr-lower and mrr-target.

The output is never negative, never NaN and never above 1. In every motion type but 2 (feed)
and 3 (arc) it is 1. Whatever cannot be judged leaves the programmed feed.

.B override
is the same, but programmed-vel / requested-vel in a probing move (motion type 5), and in mode 0 while
requested-vel is above programmed-vel: a ceiling is left over from a feed that has ended, by E-stop or abort.

While F is replaced by a ceiling and the machine goes faster than the override lets it,
.B disobeyed
is TRUE: adaptive feed is disabled (M52 P0). It stays TRUE until nothing moves any more; wire it to
motion.feed-inhibit.

A parameter that limits something is off at 0. Add the function to the servo thread after that of
stock_tracker.
""";

pin in s32 mode "0 off, 1 limit, 2 constant, 3 window";
pin in float mrr_target "removal rate to hold, mm3/min";
pin in float mrr_lower "mode 3: lower end of the window, mm3/min";
pin in float tool_max_rate "removal rate the tool in the spindle stands, mm3/min; the smaller of this and mrr-target counts; 0: unknown";
pin in float programmed_vel "F of the program, machine units/s; 0: the same as requested-vel";
pin in float requested_vel "motion.requested-vel, machine units/s";
pin in s32 motion_type "motion.motion-type";
pin in float acceleration "machine units/s2 the planner really uses";
pin in float section_area "stock-tracker.N.section-area, mm2";
pin in bit ready "stock-tracker.N.ready";
pin in bit fault "stock-tracker.N.fault";
pin in float ahead_distance_#[8] "stock-tracker.N.ahead-distance-M, machine units";
pin in float ahead_accel_#[8] "stock-tracker.N.ahead-accel-M, machine units/s2; 0: half the acceleration";
pin in float ahead_area_#[8] "stock-tracker.N.ahead-area-M, mm2";
pin in float direction_z "vertical part of the tool's direction, -1 straight down, for plunge-vel";
pin in float depth "stock-tracker.N.depth, machine units, for max-chip-thickness";
pin in float tool_diameter "machine units, for max-chip-thickness";
pin in float tool_flutes "cutting edges, for max-chip-thickness; 0: unknown";
pin in float spindle_speed "spindle.0.speed-out-rps, 1/s of either sign, for max-chip-thickness";
pin in float current_vel "motion.current-vel, machine units/s, for disobeyed";
pin in bit index_enable "spindle.0.index-enable: the move waits for the spindle and then follows it";
pin in float feed_override = 1.0 "the operator's feed override in effect, 1: 100 % (chipwise-monitor.feed-override); not positive: 1";
pin in bit adaptive_off "LinuxCNC's status says that adaptive feed is disabled (chipwise-monitor.adaptive-off)";

pin out float adaptive_feed = 1.0 "to motion.adaptive-feed, 0..1";
pin out float override = 1.0 "to motion.adaptive-feed: adaptive-feed, but F over requested-vel in a probing move (motion type 5) and where a ceiling is left over in mode 0";
pin out s32 limited_by "0 nothing, 1 stock here, 2 stock ahead, 3 floor, 4 ceiling or another limit of the velocity, 5 fallback to the programmed feed";
pin out float mrr_effective "the removal rate that counts, mm3/min: mrr-target or, where smaller, tool-max-rate; 0 in mode 0";
pin out bit disobeyed "the machine does not obey the override, to motion.feed-inhibit";

param rw float units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw float min_vel = 0.0 "machine units/s, the stock never slows the tool below this, nor below F where F is less";
param rw float max_vel = 0.0 "machine units/s, never faster while cutting";
param rw float min_scale = 0.0 "min-vel as a share of F";
param rw float max_scale = 0.0 "max-vel as a share of F";
param rw float air_vel = 0.0 "machine units/s, modes 2 and 3: velocity where there is no stock, up to requested-vel; 0: as the mode says";
param rw float plunge_vel = 0.0 "machine units/s, largest downward part of the velocity while cutting";
param rw float max_chip_thickness = 0.0 "mm, largest mean chip thickness; needs depth, tool-diameter, tool-flutes, spindle-speed";
param rw float recover_accel = 0.0 "machine units/s2 at which the velocity may rise; 0: at once";
param rw float deadband = 0.0 "share by which the velocity must be able to rise before it does, 0..1";
param rw float max_jerk = 0.0 "machine units/s3, of a planner that bounds the jerk ([TRAJ]PLANNER_TYPE = 1); 0: it does not";
param rw float max_override = 1.0 "largest feed override of the operator ([DISPLAY]MAX_FEED_OVERRIDE), for disobeyed";

variable cw_feed_easing_t easing;
variable cw_obey_t obey;
variable double last_vel;

function _ fp;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), chipwise_command(9)";
include "core/volumetric_feed_core.h";
;;

#define PER_MINUTE (1.0 / 60.0)

/* Pins and settings -> what the law needs, in mm and s. */
static void read_law(struct __comp_state *__comp_inst, long period, struct cw_feed_in *in)
{
    double per_mm = units_per_mm;
    int i;
    in->kind = mode;
    in->motion = motion_type;
    in->target = mrr_target * PER_MINUTE;
    in->lower = mrr_lower * PER_MINUTE;
    in->tool_target = tool_max_rate * PER_MINUTE;
    in->programmed = programmed_vel / per_mm;
    in->requested = requested_vel / per_mm;
    in->accel = acceleration / per_mm;
    in->dt = fperiod;
    in->trusted = ready && !fault;
    in->area = section_area;
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        in->next_distance[i] = ahead_distance(i) / per_mm;
        in->next_accel[i] = ahead_accel(i) / per_mm;
        in->next_area[i] = ahead_area(i);
    }
    in->floor = min_vel / per_mm;
    in->most = max_vel / per_mm;
    in->floor_share = min_scale;
    in->most_share = max_scale;
    in->air = air_vel / per_mm;
    in->plunge = plunge_vel / per_mm;
    in->upward = direction_z;
    in->chip = max_chip_thickness;
    in->teeth = tool_flutes;
    in->turns = spindle_speed;
    in->tool_width = tool_diameter / per_mm;
    in->stock_height = depth / per_mm;
    in->knob = feed_override;
    in->jerk = max_jerk / per_mm;
    in->speed = current_vel / per_mm;
    in->gain = (current_vel - last_vel) / per_mm / fperiod;
    last_vel = current_vel;
}

/* The override given for `in`, obeyed? */
static int watch(struct __comp_state *__comp_inst, const struct cw_feed_in *in, double given)
{
    struct cw_obey_in seen;
    seen.kind = in->kind;
    seen.motion = in->motion;
    seen.programmed = in->programmed;
    seen.requested = in->requested;
    seen.scale = given;
    seen.actual = current_vel / units_per_mm;
    seen.accel = in->accel;
    seen.most_override = max_override;
    seen.dt = in->dt;
    seen.jerk = in->jerk;
    seen.index = index_enable;
    seen.told = adaptive_off;
    return cw_obey_step(&obey, &seen);
}

FUNCTION(_) {
    struct cw_feed_in in;
    struct cw_feed_out out;

    read_law(__comp_inst, period, &in);
    out = cw_feed(&in, adaptive_feed);
    out = cw_feed_ease(&easing, &in, out, recover_accel / units_per_mm, deadband);

    adaptive_feed = out.scale;
    override = cw_feed_override(&in, out.scale);
    limited_by = out.by;
    mrr_effective = in.kind ? 60.0 * cw_feed_target(&in) : 0.0;
    disobeyed = watch(__comp_inst, &in, override);
}
