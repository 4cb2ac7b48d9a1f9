// SPDX-License-Identifier: GPL-2.0-or-later
component volumetric_feed "Set the feed override so that the removal rate stays constant";
description """
Turns the section area that stock_tracker(9) reports into a feed override: velocity = removal
rate / section area at the tool, reduced early enough that the planner's braking
ends where the load begins. Wire
.B adaptive-feed
or, where programs probe while F is replaced by a ceiling,
.B override
to motion.adaptive-feed; the program or the INI file must enable it with M52 P1.

Modes: 0 off; 1 limit, never faster than the programmed feed; 2 constant, up to the requested
velocity, which is then a ceiling above the programmed feed; 3 window, the programmed feed is
kept while the rate lies between mrr-lower and mrr-target.

The output is never negative, never NaN and never above 1. In every motion type but 2 (feed)
and 3 (arc) it is 1. Invalid inputs leave the programmed feed. While
.B load-lost
is TRUE neither the output nor the velocity rises above what it was when the load was known last: in the stock that of
the moment, in air the lowest of the last cut.

.B override
is the same, except in a probing move (motion type 5) and in mode 0 while requested-vel is above programmed-vel (a
ceiling is left over from a feed that has ended by E-stop or abort): there it is programmed-vel / requested-vel.

.B override-ignored
is TRUE if F is replaced by a ceiling and the machine goes faster than the override allows: adaptive feed is disabled
(M52 P0). It stays TRUE until nothing moves any more; chipwise_guard(9) stops the machine.

A limit of 0 is off. All lengths on pins, distances and accelerations included, are in machine units; volumes are in
mm3, areas in mm2. Add the function to the servo thread after that of stock_tracker.
""";

pin in si32 mode "0 off, 1 limit, 2 constant, 3 window";
pin in real mrr_target "removal rate to hold, mm3/min; 0 in modes 2 and 3: none, limits of chip, power and torque alone, and F where none is known";
pin in real mrr_lower "mode 3: lower end of the window, mm3/min";
pin in real tool_max_rate "largest removal rate of the tool in the spindle, mm3/min; the smaller of this and mrr-target counts; 0: unknown";
pin in real programmed_vel "F of the program, machine units/s; 0: the same as requested-vel";
pin in real requested_vel "motion.requested-vel, machine units/s";
pin in si32 motion_type "motion.motion-type";
pin in real acceleration "acceleration the planner really uses, machine units/s2";
pin in real section_area "stock-tracker.N.section-area, mm2";
pin in bool ready "stock-tracker.N.ready";
pin in bool certain = 1 "stock-tracker.N.certain; FALSE: the areas are of a stock that nobody has confirmed, so they are shown and the feed is F";
pin in bool fault "stock-tracker.N.fault";
pin in real load_step_distance_#[8] "stock-tracker.N.load-step-distance-M, machine units";
pin in real load_step_accel_#[8] "stock-tracker.N.load-step-accel-M, machine units/s2; 0: half the acceleration";
pin in real load_step_area_#[8] "stock-tracker.N.load-step-area-M, mm2";
pin in real direction_z "stock-tracker.N.direction-z, for plunge-vel";
pin in bool keep_f_down "moves that go down are at most as fast as F (chipwise-command.N.job-active)";
pin in real descent_distance = -1.0 "stock-tracker.N.descent-distance, machine units, for keep-f-down";
pin in real descent_accel "stock-tracker.N.descent-accel, machine units/s2, for keep-f-down";
pin in bool air "feeds above the stock are as fast as the axes; requested-vel is what these allow (chipwise-command.N.air)";
pin in real ceiling = 1.0 "times F that other feeds may be fast then (chipwise-monitor.job-ceiling)";
pin in real pace_distance = -2.0 "stock-tracker.N.pace-distance, machine units, for air";
pin in real pace_vel "stock-tracker.N.pace-vel, machine units/s, for air";
pin in real pace_accel "stock-tracker.N.pace-accel, machine units/s2, for air";
pin in real depth "stock-tracker.N.depth, machine units, for max-chip-thickness";
pin in real tool_diameter "tool diameter, machine units, for max-chip-thickness";
pin in real tool_flutes "number of cutting edges, for max-chip-thickness; 0: unknown";
pin in real spindle_speed "spindle.0.speed-out-rps, 1/s of either sign, for max-chip-thickness";
pin in real current_vel "motion.current-vel, machine units/s, for override-ignored";
pin in real blend_vel "stock-tracker.N.blend-vel, machine units/s: the part of current-vel that a parabolic blend adds";
pin in real braking_accel "stock-tracker.N.braking-accel, machine units/s2; 0: unknown, a quarter of acceleration";
pin in bool index_enable "spindle.0.index-enable: the move waits for the spindle and then follows it";
pin in real feed_override = 1.0 "the operator's feed override in effect, 1 = 100 % (chipwise-monitor.feed-override); 0 or negative: 1";
pin in bool load_lost "the load was known and is not any more (stock-tracker.N.load-lost): neither adaptive-feed nor the velocity rises";
pin in bool program_running "chipwise-monitor.program-running: the sums begin with a program, and its end leaves them as they are";
pin in real removed_volume "stock-tracker.N.removed-volume, mm3, for mean-rate";
pin in bool adaptive_off "LinuxCNC's status says that adaptive feed is disabled (chipwise-monitor.adaptive-off)";

pin in real max_chip "largest chip of an edge, mm (chipwise-monitor.max-chip); needs tool-flutes and spindle-speed; 0: no limit";
pin in real min_chip "smallest chip that is cut and not rubbed, mm (chipwise-monitor.min-chip), for rub-time; 0: unknown";
pin in real max_power "largest power at the edges, W (chipwise-monitor.max-power); needs specific-force, tool-flutes and spindle-speed; 0: no limit";
pin in real max_torque "largest torque at the edges, Nm; needs what max-power needs; 0: no limit";
pin in real max_force "largest side force on the tool, N (chipwise-monitor.max-force); needs what max-power needs; 0: no limit";
pin in real tool_stiffness "N of side force that bend the tool by 1 mm (chipwise-monitor.tool-stiffness), for deflection; 0: unknown";
pin in real specific_force "Kienzle's kc1.1 of the material, N/mm2 (chipwise-monitor.specific-force); 0: unknown";
pin in real force_exponent "Kienzle's mc of the material (chipwise-monitor.force-exponent)";
pin in real chip_share "stock-tracker.N.chip-share";
pin in real power_root "stock-tracker.N.power-root";
pin in real force_root "stock-tracker.N.force-root";
pin in real force_mean_share "stock-tracker.N.force-mean-share";
pin in real tooth_step_distance_#[8] "stock-tracker.N.tooth-step-distance-M, machine units";
pin in real tooth_step_load_#[8] "stock-tracker.N.tooth-step-load-M, 1/mm";
pin in real tooth_step_accel_#[8] "stock-tracker.N.tooth-step-accel-M, machine units/s2; 0: half the acceleration";
pin in si32 tooth_step_limit_#[8] "stock-tracker.N.tooth-step-limit-M";

pin in real spindle_load "load of the spindle as its inverter measures it; times spindle-load-scale it is W. Unconnected, or never above 0: not measured";
pin in real load_factor "measured / predicted power of the tool in the material, as it was taught (chipwise-monitor.load-factor); 0: not known";
pin in si32 tool_followed "chipwise-monitor.tool-followed: another tool, another cut";
pin in bool feed_decided "chipwise-command.N.feed-decided: ends load-alarm";

pin out real adaptive_feed = 1.0 "to motion.adaptive-feed, 0..1";
pin out real override = 1.0 "to motion.adaptive-feed: adaptive-feed, or F over requested-vel in a probing move (motion type 5) and while a ceiling is left over in mode 0";
pin out si32 limited_by "0 nothing, 1 stock here, 2 stock ahead, 3 floor, 4 ceiling or another limit of the velocity, 5 fallback to the programmed feed, 6 chip, 7 power, 8 torque, 9 side force";
pin out real mrr_effective "the effective removal rate, mm3/min: the smaller of mrr-target and tool-max-rate; 0: none, and in mode 0";
pin out bool override_ignored "the machine ignores the override; to chipwise-guard.N.override-ignored";
pin out real run_time "s since the program began, pauses included; it stays after its end";
pin out real cut_time "s of it in feed moves that cut: section-area at least 0.01 mm2, and 0.01 mm wide over the depth; thinner if the map loses as much";
pin out real air_time "s of it in feed moves that do not";
pin out real fed_time "s of it in feed moves with the volumetric feed on";
pin out real saved_time "s that the program at its F, with the operator's override, would have taken longer in that time; negative: less";
pin out real mean_rate "volume the map has lost since the program began over cut-time, mm3/min";
pin out real rub_time "s that the tool has cut since the program began with a largest chip below min-chip; needs max-chip, too";
pin out real peak_rate "largest removal rate since the program began, mean over 10 ms, mm3/min";

pin out real chip_weight "to stock-tracker.N.chip-weight";
pin out real power_weight "to stock-tracker.N.power-weight";
pin out real force_weight "to stock-tracker.N.force-weight";
pin out real chip "largest chip that is cut now, mm; 0: unknown, or max-chip is 0";
pin out real power "power at the edges now, mean of a revolution, W; 0: unknown, or there is no max-power, no max-torque and no spindle-load";
pin out real torque "torque at the edges now, mean of a revolution, Nm; 0: as power";

pin out real side_force "largest side force on the tool over a turn now, N; 0: unknown, or max-force is 0";
pin out real side_force_mean "its mean over a turn, N";
pin out real deflection "how far side-force bends the tool at its tip, mm; 0: as side-force, or tool-stiffness is 0";

pin out real load_ratio "power of the cut as measured over the one predicted; 0: unknown";
pin out real load_idle "what the spindle takes at this speed without a cut, W; 0: unknown";
pin out bool load_trusted "tool, stock, idle power and load-factor are known, and the cut stands out of the noise";
pin out si32 load_alarm "0 none, 1 the load has fallen in stock: the tool is broken, 2 no load in stock, 3 load in air, 4 too high, 5 too low for the tool, 6 the sensor cannot be used; 1 to 5 stay until the motion is over";
pin out bool load_stop "an alarm 1 to 5 with load-action 1; to chipwise-guard.N.load-stop";
pin out real load_cut_factor "measured / predicted of the last cut";
pin out si32 load_cuts "counts the cuts that gave a factor";
pin out real load_lag "delay of the sensor, s; 0: unknown";

param rw real units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw real min_vel = 0.0 "machine units/s: the stock never slows the tool below this, nor below F if F is less";
param rw real max_vel = 0.0 "machine units/s: never faster while cutting";
param rw real min_scale = 0.0 "min-vel as a share of F";
param rw real max_scale = 0.0 "max-vel as a share of F";
param rw real air_vel = 0.0 "velocity outside the stock in modes 2 and 3, machine units/s, up to requested-vel; 0: as the mode says";
param rw real plunge_vel = 0.0 "largest downward part of the velocity while cutting, machine units/s";
param rw real max_chip_thickness = 0.0 "largest mean chip thickness, mm; needs depth, tool-diameter, tool-flutes, spindle-speed";
param rw real recover_accel = 0.0 "acceleration at which the velocity may rise, machine units/s2; 0: at once";
param rw real deadband = 0.0 "share by which the allowed velocity must exceed the present one before it rises, 0..1";
param rw real max_jerk = 0.0 "jerk limit of the planner ([TRAJ]PLANNER_TYPE = 1), machine units/s3; 0: not limited";
param rw real spindle_load_scale = 1.0 "W that 1 of spindle-load is; 0: not measured";
param rw si32 load_action = 0 "what an alarm 1 to 5 does: 0 nothing (chipwise-monitor says it), 1 hold, 2 slow down";
param rw real load_feed = 0.5 "share of the feed with load-action 2";
param rw real max_override = 1.0 "largest feed override of the operator ([DISPLAY]MAX_FEED_OVERRIDE), for override-ignored";

variable chip_feed_easing_t easing;
variable chip_feed_hold_t hold;
variable chip_run_sums_t sums;
variable chip_watchdog_t watchdog_state;
variable chip_spindle_load_t spindle;
variable double last_vel;

function _;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), chipwise_command(9)";
include "core/volumetric_feed_core.h";
;;

#define PER_MINUTE (1.0 / 60.0)

/* Pins and settings -> input of the law, mm and s. */
static void read_law(struct __comp_state *__comp_inst, long period, struct chip_feed_in *in)
{
    double per_mm = units_per_mm;
    int i;
    in->feed_mode = mode;
    in->motion = motion_type;
    in->mrr_target_mm3_s = mrr_target * PER_MINUTE;
    in->mrr_lower_mm3_s = mrr_lower * PER_MINUTE;
    in->tool_max_rate_mm3_s = tool_max_rate * PER_MINUTE;
    in->programmed_vel_mm_s = programmed_vel / per_mm;
    in->requested_vel_mm_s = requested_vel / per_mm;
    in->acceleration_mm_s2 = acceleration / per_mm;
    in->period_s = fperiod;
    in->is_trusted = ready && !fault && certain;
    in->section_area_mm2 = section_area;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++) {
        in->load_distance_mm[i] = load_step_distance(i) / per_mm;
        in->load_accel_mm_s2[i] = load_step_accel(i) / per_mm;
        in->load_area_mm2[i] = load_step_area(i);
        in->tooth_distance_mm[i] = tooth_step_distance(i) / per_mm;
        in->tooth_accel_mm_s2[i] = tooth_step_accel(i) / per_mm;
        in->tooth_load_per_mm[i] = tooth_step_load(i);
        in->tooth_limit[i] = tooth_step_limit(i);
    }
    in->min_vel_mm_s = min_vel / per_mm;
    in->max_vel_mm_s = max_vel / per_mm;
    in->min_scale_of_f = min_scale;
    in->max_scale_of_f = max_scale;
    in->air_vel_mm_s = air_vel / per_mm;
    in->plunge_vel_mm_s = plunge_vel / per_mm;
    in->dir_z = direction_z;
    in->keeps_f_down = keep_f_down;
    in->descent_mm = descent_distance < 0.0 ? -1.0 : descent_distance / per_mm;
    in->descent_accel_mm_s2 = descent_accel / per_mm;
    in->is_air_free = air;
    in->ceiling_of_f = ceiling;
    in->pace_mm = pace_distance < 0.0 ? pace_distance : pace_distance / per_mm;
    in->pace_vel_mm_s = pace_vel / per_mm;
    in->pace_accel_mm_s2 = pace_accel / per_mm;
    in->max_chip_thickness_mm = max_chip_thickness;
    in->flutes = tool_flutes;
    in->spindle_speed_rps = spindle_speed;
    in->tool_diameter_mm = tool_diameter / per_mm;
    in->depth_mm = depth / per_mm;
    in->feed_override_share = feed_override;
    in->max_jerk_mm_s3 = max_jerk / per_mm;
    in->current_vel_mm_s = current_vel / per_mm;
    in->current_accel_mm_s2 = (current_vel - last_vel) / per_mm / fperiod;
    last_vel = current_vel;
}

/* The limits of the tooth: pins -> law. */
static void read_limits(struct __comp_state *__comp_inst, struct chip_feed_in *in)
{
    in->max_chip_mm = max_chip;
    in->min_chip_mm = min_chip;
    in->max_power_w = max_power;
    in->max_torque_nm = max_torque;
    in->max_force_n = max_force;
    in->tool_stiffness_n_mm = tool_stiffness;
    in->specific_force_n_mm2 = specific_force;
    in->force_exponent_mc = force_exponent;
    in->chip_share_now = chip_share;
    in->power_root_now = power_root;
    in->force_root_now = force_root;
    in->force_mean_share_now = force_mean_share;
    in->is_load_measured = spindle.is_seen;
}

/* What the tracker is given for them, and what is cut now -> pins. */
static void show_limits(struct __comp_state *__comp_inst, const struct chip_feed_in *in)
{
    struct chip_tooth_out out = chip_tooth_law(in);
    chip_weight_set(out.chip_weight_per_mm);
    power_weight_set(out.power_weight_per_mm);
    chip_set(out.chip_mm);
    power_set(out.power_w);
    torque_set(out.torque_nm);
    force_weight_set(out.force_weight_per_mm);
    side_force_set(out.side_force_n);
    side_force_mean_set(out.mean_force_n);
    deflection_set(out.deflection_mm);
}

/* The load that is measured against the power: pins -> core -> pins. Nothing without a sensor. */
static void judge_load(struct __comp_state *__comp_inst, const struct chip_feed_in *law)
{
    struct chip_load_in in;
    in.spindle_load_w = spindle_load * chip_setting(spindle_load_scale);
    in.power_w = power;
    in.spindle_speed_rps = law->spindle_speed_rps;
    in.load_factor_share = load_factor;
    in.section_area_mm2 = law->section_area_mm2;
    in.period_s = law->period_s;
    in.specific_force_n_mm2 = law->specific_force_n_mm2;
    in.is_known = law->is_trusted && chip_edges_per_s(law) > 0.0 && chip_setting(law->specific_force_n_mm2) > 0.0;
    in.feeds = (law->motion == CHIP_MOTION_FEED || law->motion == CHIP_MOTION_ARC) && law->current_vel_mm_s > 0.0;
    in.moves = law->motion != CHIP_MOTION_NONE;
    in.tool_number = tool_followed;
    in.is_decided = feed_decided;
    load_alarm_set(chip_spindle_load_step(&spindle, &in));
    load_stop_set(load_action == CHIP_LOAD_HOLD && spindle.alarm != CHIP_LOAD_SOUND);
    load_ratio_set(spindle.cut_ratio);
    load_idle_set(spindle.idle_s > 0.0 ? spindle.idle_w : 0.0);
    load_trusted_set(spindle.is_trusted);
    load_cut_factor_set(spindle.cut_factor);
    load_cuts_set(spindle.cuts);
    load_lag_set(spindle.lag_s);
}

/* An alarm of the last period may slow the feed down, never up. */
static double slowed(struct __comp_state *__comp_inst, double scale)
{
    if (load_action != CHIP_LOAD_SLOW || spindle.alarm == CHIP_LOAD_SOUND || !(load_feed < 1.0)) return scale;
    return scale * chip_clamp(load_feed, 0.05, 1.0);
}

/* Whether the machine ignores the override `given` for `in`. */
static int watch(struct __comp_state *__comp_inst, const struct chip_feed_in *in, double given)
{
    struct chip_watchdog_in seen;
    seen.feed_mode = in->feed_mode;
    seen.motion = in->motion;
    seen.programmed_vel_mm_s = in->programmed_vel_mm_s;
    seen.requested_vel_mm_s = in->requested_vel_mm_s;
    seen.override_share = given;
    seen.current_vel_mm_s = current_vel / units_per_mm;
    seen.blend_vel_mm_s = blend_vel / units_per_mm;
    seen.braking_mm_s2 = braking_accel / units_per_mm;
    seen.acceleration_mm_s2 = in->acceleration_mm_s2;
    seen.max_override_share = max_override;
    seen.period_s = in->period_s;
    seen.max_jerk_mm_s3 = in->max_jerk_mm_s3;
    seen.is_index_enabled = index_enable;
    seen.is_adaptive_off = adaptive_off;
    return chip_watchdog_step(&watchdog_state, &seen);
}

/* The sums of the program that runs, or of the last one: in an assumed stock, too. */
static void count_period(struct __comp_state *__comp_inst, const struct chip_feed_in *in)
{
    const struct chip_run_totals *so_far = &sums.program;
    struct chip_feed_in seen = *in;
    seen.is_trusted = ready && !fault;
    chip_run_sums_step(&sums, &seen, program_running, removed_volume);
    run_time_set(so_far->run_s);
    cut_time_set(so_far->cut_s);
    air_time_set(so_far->air_s);
    fed_time_set(so_far->fed_s);
    rub_time_set(so_far->rub_s);
    saved_time_set(so_far->saved_s);
    mean_rate_set(60.0 * chip_run_mean(so_far));
    peak_rate_set(60.0 * so_far->peak_mm3_s);
}

FUNCTION(_) {
    struct chip_feed_in in;
    struct chip_feed_out out;

    read_law(__comp_inst, period, &in);
    read_limits(__comp_inst, &in);
    out = chip_feed(&in, adaptive_feed);
    out = chip_feed_ease(&easing, &in, out, recover_accel / units_per_mm, deadband);
    out = chip_feed_hold_step(&hold, &in, load_lost, out);

    out.scale = slowed(__comp_inst, out.scale);
    adaptive_feed_set(out.scale);
    override_set(chip_feed_override(&in, out.scale));
    limited_by_set(out.limit);
    show_limits(__comp_inst, &in);
    judge_load(__comp_inst, &in);
    mrr_effective_set(in.feed_mode ? 60.0 * chip_feed_target(&in) : 0.0);
    override_ignored_set(watch(__comp_inst, &in, override));
    count_period(__comp_inst, &in);
}
