// SPDX-License-Identifier: GPL-2.0-or-later
component tracer_offset "Move LinuxCNC's axes by external offsets, without the lag of their planner";
description """
Moves the axes of a running LinuxCNC by their external offsets to follow a commanded position: that of tracer(9), or of
tracer_slave(9). LinuxCNC plans external offsets with a lag of v^2 / (2 A), which is 2.8 mm at 50 mm/s and 450 mm/s2; the
request is as far ahead as its planner needs, so that the axes move as commanded, four periods later.

Each [AXIS_L] needs
.B OFFSET_AV_RATIO;
wire
.B max-acceleration-L, max-velocity-L, av-ratio-L
to the same values of the INI file. The axes have to be homed, and the kinematics that of identity.

A rising edge of
.B request
begins while
.B permit
and
.B machine-on
are TRUE. If one of them falls the axes brake and the offset is kept; it begins again with the next rising edge only.
LinuxCNC keeps the place at machine-off, and counts its offset as 0 from machine-on.
While there is an offset the axes are not where a program has sent them:
.B off
to motion.feed-inhibit keeps it from moving them.
.B clear
takes the offset back to 0 while it is TRUE: upwards first, then X and Y, then downwards.

Add the function to the servo thread after those of motion and of tracer.
""";

pin in bool request "rising edge: follow the position; FALSE: brake and hold";
pin in bool permit = 1 "FALSE: brake and hold, until the next rising edge of request; not halui.program.is-idle";
pin in bool machine_on "motion.motion-enabled";
pin in bool clear "rising edge: the offset back to 0; FALSE: brake and hold";
pin in real pos_cmd_x "position to follow, machine units; only its changes count";
pin in real pos_cmd_y "";
pin in real pos_cmd_z "";
pin in real deflection "tracer.N.deflection: a growth by more than contact stops clear, machine units";
pin in real eoffset_x "axis.x.eoffset";
pin in real eoffset_y "";
pin in real eoffset_z "";
pin in real eoffset_request_x "axis.x.eoffset-request";
pin in real eoffset_request_y "";
pin in real eoffset_request_z "";

pin out bool enable "to tracer.N.enable: TRUE while the axes follow";
pin out bool eoffset_enable = 1 "to axis.L.eoffset-enable; always TRUE";
pin out real eoffset_scale "to axis.L.eoffset-scale: machine units per count";
pin out si32 counts_x "to axis.x.eoffset-counts";
pin out si32 counts_y "";
pin out si32 counts_z "";
pin out si32 state "0 hold, 1 follow, 2 clear, 3 fault";
pin out si32 fault_code "0 none, 1 settings, 2 not finite, 3 astray, 4 behind, 5 collision, 6 too far";
pin out si32 last_fault "fault-code of the last fault, kept until request or clear is TRUE again";
pin out bool fault "the axes brake and rest, until request and clear are FALSE";
pin out bool cleared "the offset is 0";
pin out bool off "to motion.feed-inhibit: the axes are off their place, so that no program may move them";
pin out bool stranded "the axes are off their place, and neither follow nor go back, while permit is TRUE";
pin out real behind "what is missing of the position, largest of the axes, machine units";
pin out real lead "how far the request is ahead, largest of the axes, machine units";
pin out real astray "LinuxCNC's offset from the one computed a period before, largest of the axes, machine units";

param rw real units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw real max_acceleration_x = 0.0 "[AXIS_X]MAX_ACCELERATION, machine units/s2";
param rw real max_acceleration_y = 0.0 "";
param rw real max_acceleration_z = 0.0 "";
param rw real max_velocity_x = 0.0 "[AXIS_X]MAX_VELOCITY, machine units/s";
param rw real max_velocity_y = 0.0 "";
param rw real max_velocity_z = 0.0 "";
param rw real av_ratio_x = 0.0 "[AXIS_X]OFFSET_AV_RATIO";
param rw real av_ratio_y = 0.0 "";
param rw real av_ratio_z = 0.0 "";
param rw real count = 0.000001 "one count, machine units; 2e9 of them are the largest offset";
param rw real clear_vel = 20.0 "of clear, machine units/s";
param rw real max_astray = 0.0005 "a larger one is a fault, machine units";
param rw real max_behind = 1.0 "more that is missing is a fault, machine units";
param rw real contact = 0.1 "growth of the deflection on the return that is a fault, machine units";

variable chip_axis_offset_t axes;

function _;
license "GPL";
author "chipwise";
see_also "tracer(9), tracer_slave(9)";
include "core/tracer_offset_core.h";
;;

static void three(double to[3], double x, double y, double z, double per_mm)
{
    to[0] = x / per_mm;
    to[1] = y / per_mm;
    to[2] = z / per_mm;
}

/* Parameters -> settings, mm; with impossible units they are infinite or NaN, which is a fault. */
static void read_settings(struct __comp_state *__comp_inst, struct chip_axis_offset_settings *s, double per_mm)
{
    three(s->acceleration_mm_s2, max_acceleration_x * av_ratio_x, max_acceleration_y * av_ratio_y,
          max_acceleration_z * av_ratio_z, per_mm);
    three(s->max_vel_mm_s, max_velocity_x * av_ratio_x, max_velocity_y * av_ratio_y, max_velocity_z * av_ratio_z,
          per_mm);
    s->count_mm = count / per_mm;
    s->clear_vel_mm_s = clear_vel / per_mm;
    s->max_astray_mm = max_astray / per_mm;
    s->max_behind_mm = max_behind / per_mm;
    s->contact_mm = contact / per_mm;
}

/* What the operator sees. */
static void show(struct __comp_state *__comp_inst, const struct chip_axis_offset_out *out, double per_mm)
{
    state_set(out->state_number);
    fault_code_set(out->fault_number);
    fault_set(out->fault_number != CHIP_AXIS_OFFSET_NO_FAULT);
    if (fault || request || clear) last_fault_set(out->fault_number);
    cleared_set(out->is_cleared);
    off_set(out->is_off);
    stranded_set(out->is_off && permit && out->state_number == CHIP_AXIS_OFFSET_HOLD);
    behind_set(out->behind_mm * per_mm);
    lead_set(out->lead_mm * per_mm);
    astray_set(out->astray_mm * per_mm);
}

FUNCTION(_) {
    struct chip_axis_offset_settings settings;
    struct chip_axis_offset_in in;
    struct chip_axis_offset_out out;
    double per_mm = chip_units(units_per_mm);

    read_settings(__comp_inst, &settings, per_mm);
    in.has_request = request;
    in.has_permit = permit;
    in.has_machine = machine_on;
    in.wants_clear = clear;
    in.period_s = fperiod;
    three(in.position_mm, pos_cmd_x, pos_cmd_y, pos_cmd_z, per_mm);
    three(in.offset_mm, eoffset_x, eoffset_y, eoffset_z, per_mm);
    three(in.requested_mm, eoffset_request_x, eoffset_request_y, eoffset_request_z, per_mm);
    in.deflection_mm = deflection / per_mm;
    chip_axis_offset_step(&axes, &settings, &in, &out);
    eoffset_enable_set(1);
    if (chip_setting(count) > 0.0) eoffset_scale_set(count); /* else a fault, and LinuxCNC keeps the one it has */
    enable_set(out.is_enabled);
    counts_x_set(out.counts[0]);
    counts_y_set(out.counts[1]);
    counts_z_set(out.counts[2]);
    show(__comp_inst, &out, per_mm);
}
