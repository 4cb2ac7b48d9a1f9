// SPDX-License-Identifier: GPL-2.0-or-later
component tracer_model "Simulation: the stylus of a tracer head against a surface";
description """
For simulation and tests, in the place of a tracer head: a ball on a spring against a plane, ball, hollow ball, step,
inside corner, cylinder or square, with friction, noise and dead time. Wire the axes' positions to
.B pos-x -y -z
and
.B deflection-x -y -z
to tracer(9).

All lengths are in machine units. Add the function to the servo thread before that of tracer.
""";

pin in real pos_x "position of the head, machine units";
pin in real pos_y "";
pin in real pos_z "";
pin out real deflection_x "as measured: late and with noise, machine units";
pin out real deflection_y "";
pin out real deflection_z "";
pin out real true_deflection "its length as it is, without dead time and noise, machine units";
pin out bool touches "the stylus touches the model";

param rw si32 surface = 0 "0 plane, 1 ball, 2 hollow ball, 3 step, 4 inside corner, 5 upright cylinder, 6 upright square";
param rw real at_x = 0.0 "a point of the plane; centre of 1, 2, 5, 6; edge of 3; corner of 4, machine units";
param rw real at_y = 0.0 "";
param rw real at_z = 0.0 "";
param rw real normal_x = 0.0 "normal of the plane";
param rw real normal_y = 0.0 "";
param rw real normal_z = 1.0 "";
param rw real size = 10.0 "radius, half width, height of the step, machine units";
param rw real angle = 90.0 "of the wall of the corner to its floor, degrees";
param rw real ball_radius = 1.0 "of the stylus, machine units";
param rw real friction = 0.15 "coefficient";
param rw real noise = 0.0 "standard deviation of each axis, machine units";
param rw si32 delay = 0 "periods from position to deflection";
param rw real units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";

variable chip_stylus_t stylus;

function _;
license "GPL";
author "chipwise";
see_also "tracer(9)";
include "core/tracer_model_core.h";
;;

/* A unit vector of three numbers; Z if they cannot make one. */
static void unit(double to[3], double x, double y, double z)
{
    double length = sqrt(x * x + y * y + z * z);
    int sound = length > 1e-9 && length < 1e9;
    to[0] = sound ? x / length : 0.0;
    to[1] = sound ? y / length : 0.0;
    to[2] = sound ? z / length : 1.0;
}

/* Parameters -> settings in mm; 0 if one of them cannot be. */
static int read_settings(struct __comp_state *__comp_inst, struct chip_stylus_settings *s, double per_mm)
{
    double all;
    int i;
    s->surface_number = surface < CHIP_STYLUS_GRID ? surface : CHIP_STYLUS_PLANE;
    s->at_mm[0] = at_x / per_mm;
    s->at_mm[1] = at_y / per_mm;
    s->at_mm[2] = at_z / per_mm;
    unit(s->normal, normal_x, normal_y, normal_z);
    s->size_mm = size / per_mm;
    s->angle_deg = angle;
    s->ball_mm = ball_radius / per_mm;
    s->friction_share = friction;
    s->noise_mm = noise / per_mm;
    s->delay_periods = delay;
    all = fabs(s->size_mm) + fabs(angle) + fabs(s->ball_mm) + fabs(friction) + fabs(s->noise_mm);
    for (i = 0; i < 3; i++) all += fabs(s->at_mm[i]);
    return all < 1e6;
}

FUNCTION(_) {
    struct chip_stylus_settings settings = { 0 };
    double p[3], measured[3] = { 0.0 }, now[3] = { 0.0 }, per_mm = chip_units(units_per_mm);
    int i, sound;

    p[0] = pos_x / per_mm;
    p[1] = pos_y / per_mm;
    p[2] = pos_z / per_mm;
    sound = per_mm > 0.0 && fabs(p[0]) + fabs(p[1]) + fabs(p[2]) < 1e6 && read_settings(__comp_inst, &settings, per_mm);
    if (sound) chip_stylus_step(&stylus, &settings, p, measured, now);
    for (i = 0; i < 3; i++) {
        if (!chip_finite(measured[i])) measured[i] = 0.0;
        if (!chip_finite(now[i])) now[i] = 0.0;
    }
    deflection_x_set(measured[0] * per_mm);
    deflection_y_set(measured[1] * per_mm);
    deflection_z_set(measured[2] * per_mm);
    true_deflection_set(sqrt(now[0] * now[0] + now[1] * now[1] + now[2] * now[2]) * per_mm);
    touches_set(sound && stylus.is_touching);
}
