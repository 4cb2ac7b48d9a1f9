// SPDX-License-Identifier: GPL-2.0-or-later
component spindle_sim "Simulation: a spindle whose inverter measures its load";
description """
For simulation and tests, in the place of a spindle with its inverter: it turns up and down with its inertia, and shows
the load of a cut late, with noise, drift and wear. A tool breaks after some time of cutting, or at a rising edge of
.B break-now.

.B loadrt spindle_sim

Wire
.B speed-cmd
to spindle.0.speed-out-rps,
.B cut-power
to volumetric-feed.0.power and
.B load
to volumetric-feed.0.spindle-load. Power that is predicted comes back as a load that is measured then.

Add the function to the servo thread after that of motion-controller.
""";

pin in real speed_cmd "commanded speed, 1/s of either sign (spindle.0.speed-out-rps)";
pin in real cut_power "power at the edges, W (volumetric-feed.N.power)";
pin in bool break_now "rising edge: the tool breaks";
pin in bool mend "TRUE: another, sound tool";
pin out real speed_fb "speed of the spindle, 1/s";
pin out bool at_speed "within 2 % of speed-cmd";
pin out real load "as the inverter shows it, W, or a share of rated-power; to volumetric-feed.N.spindle-load";
pin out real quiet_load "the same without noise";
pin out real true_load "the load as it is, without lag, drift and noise";
pin out bool broken "the tool is broken";

param rw real inertia = 0.0 "of the spindle with its tool, kg m2; 0: as fast as commanded at once";
param rw real torque = 0.0 "of the motor while it turns up or down, Nm; 0: as fast as commanded at once";
param rw real idle = 60.0 "load of the turning spindle without a cut, W";
param rw real idle_linear = 0.5 "more for each revolution a second, W s";
param rw real idle_square = 0.001 "more for its square, W s2";
param rw real factor = 1.25 "load of a cut over cut-power";
param rw real wear = 0.0 "by which share that rises in an hour of cutting";
param rw real break_time = 0.0 "s of cutting after which the tool breaks; 0: never";
param rw real lag = 0.3 "time constant of the inverter's filter, s";
param rw real drift = 0.0 "of the inverter's gain, share an hour";
param rw real noise = 0.1 "standard deviation of the load, share of it";
param rw real sample = 0.01 "s until the noise is another";
param rw si32 seed = 1 "of the noise: the same seed, the same noise";
param rw real rated_power = 0.0 "W that are shown as 1; 0: load is in W";

variable chip_spindle_sim_t sim;
variable int was_breaking;

function _;
license "GPL";
author "chipwise";
see_also "volumetric_feed(9)";
include "core/spindle_sim_core.h";
;;

FUNCTION(_) {
    struct chip_spindle_settings set;
    struct chip_spindle_shown now;
    double unit = chip_setting(rated_power) > 1e-3 ? 1.0 / rated_power : 1.0;

    set.inertia_kg_m2 = inertia;
    set.torque_nm = torque;
    set.idle_w[0] = idle;
    set.idle_w[1] = idle_linear;
    set.idle_w[2] = idle_square;
    set.factor_share = factor;
    set.wear_per_h = wear;
    set.break_time_s = break_time;
    set.lag_s = lag;
    set.drift_per_h = drift;
    set.noise_share = noise;
    set.sample_s = sample;
    set.period_s = fperiod;
    set.seed_number = seed;
    now = chip_spindle_sim_step(&sim, &set, speed_cmd, cut_power, break_now && !was_breaking, mend);
    was_breaking = break_now;
    speed_fb_set(now.speed_rps);
    at_speed_set(now.is_at_speed);
    load_set(now.load_w * unit);
    quiet_load_set(now.quiet_w * unit);
    true_load_set(now.true_w * unit);
    broken_set(sim.is_broken);
}
