// SPDX-License-Identifier: GPL-2.0-or-later
component tracer "Profiling control: follow a model with a tracer head";
description """
Turns the deflection of a tracer head into the velocity of the axes, so that the stylus follows a model: along the normal
of the surface gain x (deflection - target), along the surface the feed. Friction of the stylus is estimated and removed;
in bends the direction is turned ahead by the dead time.

Wire the head's sensors to
.B deflection-x -y -z,
the axes' positions to
.B pos-x -y -z,
and
.B pos-cmd-x -y -z
to the joints. While
.B enable
is FALSE pos-cmd follows pos. A rising edge starts the approach along approach-dir; the trace ends with
.B done.
enable FALSE stops at the acceleration.

Modes: 1 lines from one side, 2 lines to and fro, both along scan-axis in the window; 3 contour round the model at a height;
4 partial contour between the sides of the window. The pick feed is along the other axis, in modes 3 and 4 along Z.

The velocity is held below the one from which the head stops within its range, and the gain below 0.75 / (dead time +
period), whatever is asked for;
.B limited-by
shows it. A sensor that jumps, freezes, contradicts the movement of the head or is not finite, over-range, a soft
limit, a model that is not found: the head brakes, and rests until enable is FALSE. The deflection asked for swings by a
thousandth, more if nothing changes, so that a dead sensor shows.

.B sequence, count-low, count-high, step
are the packet of this period for tracer_slave(9).

All lengths on pins are in machine units. Add the function to the servo thread after that of motion or of the joints.
""";

pin in bool enable "rising edge: begin; FALSE: stop, pos-cmd follows pos";
pin in bool retract "leave the model and end";
pin in si32 mode = 2 "1 lines from one side, 2 lines to and fro, 3 contour, 4 partial contour";
pin in si32 scan_axis "axis of the lines: 0 X, 1 Y";
pin in si32 direction = 1 "first line towards + (1) or - (-1); contour: model on the right (1) or on the left (-1) of the travel";
pin in real feed "along the surface, machine units/s";
pin in real feed_override = 1.0 "share of every velocity, 0..1";
pin in real pick_feed "from line to line, machine units; its sign is its direction; 0: one line";
pin in real deflection_target = 0.3 "deflection to hold, machine units; must be below range";
pin in real deflection_x "of the stylus, from the head's rest position, machine units";
pin in real deflection_y "";
pin in real deflection_z "";
pin in real pos_x "position of the head, machine units";
pin in real pos_y "";
pin in real pos_z "";
pin in real window_min_x "lines end here, machine units";
pin in real window_min_y "";
pin in real window_min_z "";
pin in real window_max_x "lines end here, machine units";
pin in real window_max_y "";
pin in real window_max_z "";

pin out real pos_cmd_x "commanded position, machine units";
pin out real pos_cmd_y "";
pin out real pos_cmd_z "";
pin out real vel_x "commanded velocity, machine units/s";
pin out real vel_y "";
pin out real vel_z "";
pin out si32 state "0 idle, 1 approach, 2 trace, 3 pick feed, 4 retract, 5 return, 6 lost, 7 over-range, 8 fault, 9 done";
pin out si32 fault_code "0 none, 1 settings, 2 not finite, 3 sensor jump, 4 position jump, 5 no contact, 6 soft limit, 7 collision, 8 over-range, 9 below the model, 10 frozen sensor, 11 deflection contradicts the movement";
pin out si32 last_fault "fault-code of the last fault, kept until enable is TRUE again";
pin out bool fault "the trace has ended with a fault";
pin out bool done "the trace has ended";
pin out bool in_contact "the deflection is above half of its target in states 2 and 3";
pin out si32 limited_by "0 nothing, 1 range, 2 max-vel, 3 bend, 4 deflection, 5 window, 6 gain";
pin out si32 lines "lines or laps completed";
pin out real deflection "length of the deflection, machine units";
pin out real deflection_error "deflection - deflection-target, machine units";
pin out real normal_vel "asked for along the normal, machine units/s";
pin out real tangential_vel "asked for along the surface, machine units/s";
pin out real vel_limit "largest velocity in force, machine units/s";
pin out real gain_in_force "1/s";
pin out real friction_estimate "sine of the friction angle";
pin out real normal_x "unit normal of the surface, friction removed";
pin out real normal_y "";
pin out real normal_z "";
pin out real ball_x "centre of the stylus' ball: position and deflection of the same moment, machine units";
pin out real ball_y "";
pin out real ball_z "";
pin out ui32 sequence "packet for the slave: its number";
pin out ui32 sequence_check "the same number; a transport writes it before the packet, and sequence after it";
pin out ui32 count_low_#[3] "packet: position in counts, lower 32 bits";
pin out si32 count_high_#[3] "packet: position in counts, upper 32 bits";
pin out si32 step_#[3] "packet: counts since the packet before";

param rw real units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw real gain = 100.0 "normal velocity per deflection error, 1/s";
param rw real range = 1.0 "the head's range: the deflection stays below it, machine units";
param rw real acceleration = 500.0 "of the head in any direction, machine units/s2";
param rw real max_vel = 50.0 "of the head in any direction, machine units/s";
param rw real approach_vel = 5.0 "approach, and back to the model when contact is lost, machine units/s";
param rw real return_vel = 20.0 "retract and return, machine units/s";
param rw real dead_time = 0.0 "from velocity to measured deflection, without the period itself, s";
param rw real drive_time = 0.0 "part of dead-time from velocity to pos-x -y -z, of drives or LinuxCNC; the rest is the sensor's, s";
param rw real max_jump = 0.5 "a larger change of deflection or position in a period is a fault, machine units; so is a fall of the deflection that is faster than the head";
param rw real friction = 0.0 "sine of the friction angle to begin with, 0..0.6";
param rw real retract_distance = 5.0 "clearance of retract and return, machine units";
param rw real search_distance = 50.0 "longest approach, machine units";
param rw real lost_distance = 10.0 "longest travel back to the model when contact is lost, machine units";
param rw real approach_dir_x = 0.0 "direction of the approach";
param rw real approach_dir_y = 0.0 "";
param rw real approach_dir_z = -1.0 "";
param rw real soft_min_x = -1000.0 "the axis stops before it, machine units";
param rw real soft_min_y = -1000.0 "";
param rw real soft_min_z = -1000.0 "";
param rw real soft_max_x = 1000.0 "the axis stops before it, machine units";
param rw real soft_max_y = 1000.0 "";
param rw real soft_max_z = 1000.0 "";
param rw real counts_per_unit = 1000.0 "counts of the packet per machine unit";

variable chip_tracer_t control;
variable chip_master_t sender;

function _;
license "GPL";
author "chipwise";
see_also "tracer_slave(9), tracer_model(9)";
include "core/tracer_core.h";
;;

/* Pins and parameters -> settings, mm and s. */
static void read_settings(struct __comp_state *__comp_inst, struct chip_tracer_settings *s)
{
    double per_mm = chip_units(units_per_mm); /* 0: the settings are infinite or NaN, which is a fault */
    s->mode_number = per_mm > 0.0 ? mode : 0;
    s->scan_axis_number = scan_axis;
    s->direction_sign = direction;
    s->feed_mm_s = feed / per_mm;
    s->approach_vel_mm_s = approach_vel / per_mm;
    s->return_vel_mm_s = return_vel / per_mm;
    s->max_vel_mm_s = max_vel / per_mm;
    s->acceleration_mm_s2 = acceleration / per_mm;
    s->gain_hz = gain;
    s->deflection_mm = deflection_target / per_mm;
    s->range_mm = range / per_mm;
    s->dead_time_s = dead_time;
    s->drive_time_s = drive_time;
    s->max_jump_mm = max_jump / per_mm;
    s->friction_share = friction;
    s->pick_mm = pick_feed / per_mm;
    s->retract_mm = retract_distance / per_mm;
    s->search_mm = search_distance / per_mm;
    s->lost_mm = lost_distance / per_mm;
}

static void three(double to[3], double x, double y, double z, double per_mm)
{
    to[0] = x / per_mm;
    to[1] = y / per_mm;
    to[2] = z / per_mm;
}

/* What the operator and a recorder see. */
static void show(struct __comp_state *__comp_inst, const struct chip_tracer_out *out)
{
    double per_mm = chip_units(units_per_mm);
    state_set(out->state_number);
    fault_code_set(out->fault_number);
    fault_set(out->fault_number != CHIP_TRACER_NO_FAULT);
    if (fault || enable) last_fault_set(out->fault_number);
    done_set(out->state_number == CHIP_TRACER_DONE);
    in_contact_set((out->state_number == CHIP_TRACER_TRACE || out->state_number == CHIP_TRACER_PICK)
        && out->deflection_mm * per_mm > 0.5 * deflection_target);
    limited_by_set(out->limit_number);
    lines_set(out->line_count);
    deflection_set(out->deflection_mm * per_mm);
    deflection_error_set(out->error_mm * per_mm);
    normal_vel_set(out->normal_vel_mm_s * per_mm);
    tangential_vel_set(out->tangential_vel_mm_s * per_mm);
    vel_limit_set(out->velocity_limit_mm_s * per_mm);
    gain_in_force_set(out->gain_hz);
    friction_estimate_set(out->friction_share);
    normal_x_set(out->normal[0]);
    normal_y_set(out->normal[1]);
    normal_z_set(out->normal[2]);
    ball_x_set(out->ball_mm[0] * per_mm);
    ball_y_set(out->ball_mm[1] * per_mm);
    ball_z_set(out->ball_mm[2] * per_mm);
}

/* The commanded position; at rest without enable it is where the head is. */
static void move(struct __comp_state *__comp_inst, const struct chip_tracer_out *out, double period_s)
{
    double per_mm = chip_units(units_per_mm);
    int moves = out->velocity_mm_s[0] != 0.0 || out->velocity_mm_s[1] != 0.0 || out->velocity_mm_s[2] != 0.0;
    vel_x_set(out->velocity_mm_s[0] * per_mm);
    vel_y_set(out->velocity_mm_s[1] * per_mm);
    vel_z_set(out->velocity_mm_s[2] * per_mm);
    if (out->state_number == CHIP_TRACER_IDLE && !moves) {
        if (chip_finite(pos_x) && chip_finite(pos_y) && chip_finite(pos_z)) {
            pos_cmd_x_set(pos_x);
            pos_cmd_y_set(pos_y);
            pos_cmd_z_set(pos_z);
        }
        return;
    }
    pos_cmd_x_set(vel_x * period_s + pos_cmd_x);
    pos_cmd_y_set(vel_y * period_s + pos_cmd_y);
    pos_cmd_z_set(vel_z * period_s + pos_cmd_z);
}

/* The packet of this period. */
static void send(struct __comp_state *__comp_inst)
{
    double at[3], per_unit[3];
    int i;
    three(at, pos_cmd_x, pos_cmd_y, pos_cmd_z, 1.0);
    per_unit[0] = per_unit[1] = per_unit[2] = counts_per_unit;
    chip_master_step(&sender, at, per_unit);
    sequence_check_set(sender.packet.sequence_number);
    for (i = 0; i < 3; i++) {
        count_low_set(i, (uint32_t)sender.packet.position_counts[i]);
        count_high_set(i, (int32_t)(sender.packet.position_counts[i] >> 32));
        step_set(i, sender.packet.step_counts[i]);
    }
    sequence_set(sender.packet.sequence_number);
}

FUNCTION(_) {
    struct chip_tracer_settings settings;
    struct chip_tracer_in in;
    struct chip_tracer_out out;
    double per_mm = chip_units(units_per_mm);

    read_settings(__comp_inst, &settings);
    three(settings.approach_dir, approach_dir_x, approach_dir_y, approach_dir_z, 1.0);
    three(settings.window_min_mm, window_min_x, window_min_y, window_min_z, per_mm);
    three(settings.window_max_mm, window_max_x, window_max_y, window_max_z, per_mm);
    three(settings.soft_min_mm, soft_min_x, soft_min_y, soft_min_z, per_mm);
    three(settings.soft_max_mm, soft_max_x, soft_max_y, soft_max_z, per_mm);
    three(in.position_mm, pos_x, pos_y, pos_z, per_mm);
    three(in.deflection_mm, deflection_x, deflection_y, deflection_z, per_mm);
    in.is_enabled = enable;
    in.wants_retract = retract;
    in.feed_share = feed_override;
    in.period_s = fperiod;
    chip_tracer_step(&control, &settings, &in, &out);
    move(__comp_inst, &out, fperiod);
    show(__comp_inst, &out);
    send(__comp_inst);
}
