/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Simulated runs of programs with a spindle whose load is measured: cuts with entries, corners, ripple and changing stock, air between
 * them; the spindle is core/spindle_sim.h, which shares nothing with the judge of the load, core/spindle_load.h.
 *
 * Who uses it: test_spindle_load.c, bench/spindle_load.c.
 */
#ifndef CHIPWISE_TESTS_SPINDLE_RUNS_H
#define CHIPWISE_TESTS_SPINDLE_RUNS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "../../components/core/spindle_load.h"
#include "../../components/core/spindle_sim.h"

#define RUN_PERIOD_S 0.001
#define RUN_SAMPLES 4

struct run {
    uint64_t random;
    struct chip_spindle_sim sim, twin; /* twin: whose tool does not break, without noise */
    struct chip_spindle_settings set, twin_set;
    struct chip_spindle_load judge;
    struct chip_load_in in;
    struct chip_spindle_shown shown, whole;
    double clock_s, speed_rps;
    double left_s, age_s, level_w, entry_s, ripple, ripple_hz, dip_left_s, step_left_s,
        step; /* of the cut, or of the air, that runs */
    int cutting, cut_number;
    double missing;                         /* share of the stock that is really there, 1: all */
    double in_air_w;                        /* stock that is met where none is predicted */
    double mismatch;                        /* largest error of the predicted power, share */
    double least, most;                     /* load of a cut, times the idle power */
    double (*spoil)(const struct run *run); /* another sample than the sensor's; null: none */
    int takes_first_factor;                 /* of the first cut, as the monitor does */
};

static double run_uniform(struct run *run, double low, double high)
{
    run->random = run->random * 6364136223846793005ULL + 1442695040888963407ULL;
    return low + (high - low) * (double)(run->random >> 33) * (1.0 / 2147483648.0);
}

static double run_idle(const struct run *run)
{
    const double *idle = run->set.idle_w;
    return idle[0] + run->speed_rps * (idle[1] + run->speed_rps * idle[2]);
}

/* The next cut, or the air after it. */
static void run_next(struct run *run)
{
    run->cutting = !run->cutting;
    run->age_s = 0.0;
    run->dip_left_s = run->step_left_s = 0.0;
    run->step = 1.0;
    run->left_s = run->cutting ? run_uniform(run, 3.0, 40.0) : run_uniform(run, 0.5, 6.0);
    if (!run->cutting) return;
    run->cut_number++;
    run->level_w = run_idle(run) * run_uniform(run, run->least, run->most) / run->set.factor_share;
    run->entry_s = run_uniform(run, 0.02, 1.0);
    run->ripple = run_uniform(run, 0.0, 0.2);
    run->ripple_hz = run_uniform(run, 0.2, 6.0);
}

/* The noise and the lag of the targets; the rest at random. */
static void run_begin(struct run *run, uint64_t seed)
{
    static const double sample_s[RUN_SAMPLES] = { 0.001, 0.002, 0.005, 0.01 };
    memset(run, 0, sizeof *run);
    run->random = seed * 0x9e3779b97f4a7c15ULL + 12345ULL;
    run_uniform(run, 0.0, 1.0);
    run->speed_rps = run_uniform(run, 40.0, 400.0);
    run->set.idle_w[0] = run_uniform(run, 20.0, 120.0);
    run->set.idle_w[1] = run_uniform(run, 0.1, 1.0);
    run->set.idle_w[2] = run_uniform(run, 0.0, 0.002);
    run->set.factor_share = run_uniform(run, 0.6, 2.5);
    run->set.lag_s = 0.3;
    run->set.noise_share = 0.1;
    run->set.drift_per_h = run_uniform(run, 0.0, 1.0) < 0.5 ? -0.05 : 0.05;
    run->set.sample_s = sample_s[(int)run_uniform(run, 0.0, RUN_SAMPLES - 1e-6)];
    run->set.period_s = RUN_PERIOD_S;
    run->set.seed_number = (int)(seed % 1000000007ULL);
    run->set.inertia_kg_m2 = run_uniform(run, 0.0005, 0.003);
    run->set.torque_nm = run_uniform(run, 0.5, 3.0);
    run->twin_set = run->set;
    run->twin_set.noise_share = 0.0;
    run->missing = 1.0;
    run->mismatch = 0.03;
    run->least = 1.0;
    run->most = 6.0;
    run->takes_first_factor = 1;
    run->in.is_known = 1;
    run->in.moves = 1;
    run->in.period_s = RUN_PERIOD_S;
    run->in.tool_number = 1;
    run->in.specific_force_n_mm2 = 800.0;
    run->left_s = run_uniform(run, 1.5, 4.0); /* air after the spindle is at speed */
}

/* Power that is predicted now, W. */
static double run_power(struct run *run)
{
    double power;
    if (!run->cutting) return 0.0;
    if ((run->step_left_s -= RUN_PERIOD_S) < 0.0) { /* the stock changes */
        run->step_left_s = run_uniform(run, 0.5, 8.0);
        run->step = run_uniform(run, 0.7, 1.4);
    }
    if (run->dip_left_s < 0.0 && run_uniform(run, 0.0, 1.0) < 0.3 * RUN_PERIOD_S)
        run->dip_left_s = run_uniform(run, 0.05, 0.4);
    run->dip_left_s -= RUN_PERIOD_S; /* a corner */
    power = run->level_w * run->step * (run->age_s < run->entry_s ? run->age_s / run->entry_s : 1.0);
    power *= 1.0 + run->ripple * sin(2.0 * 3.14159265358979 * run->ripple_hz * run->age_s);
    return run->dip_left_s > 0.0 ? 0.3 * power : power;
}

/* One period; returns the chip_load_alarm. */
static int run_step(struct run *run, int break_now)
{
    double power, true_w, error;
    int at_speed = run->shown.is_at_speed && run->clock_s > 0.0, alarm;
    if (at_speed && (run->left_s -= RUN_PERIOD_S) < 0.0)
        run_next(run); /* LinuxCNC waits for the spindle before a feed */
    power = run_power(run);
    error = run->mismatch * sin(0.7 * run->clock_s + (double)run->cut_number);
    true_w = power * run->missing * (1.0 + error) + (run->cutting ? 0.0 : run->in_air_w);
    run->shown = chip_spindle_sim_step(&run->sim, &run->set, run->speed_rps, true_w, break_now, 0);
    run->whole = chip_spindle_sim_step(&run->twin, &run->twin_set, run->speed_rps, true_w, 0, 0);
    run->in.spindle_load_w = run->spoil ? run->spoil(run) : run->shown.load_w;
    run->in.power_w = power;
    run->in.section_area_mm2 = power > 0.0 ? 1.0 : 0.0;
    run->in.spindle_speed_rps = run->speed_rps;
    run->in.feeds = at_speed;
    alarm = chip_spindle_load_step(&run->judge, &run->in);
    if (run->takes_first_factor && run->judge.cuts && !(run->in.load_factor_share > 0.0))
        run->in.load_factor_share = run->judge.cut_factor;
    run->clock_s += RUN_PERIOD_S;
    run->age_s += RUN_PERIOD_S;
    return alarm;
}

/* Load of the cut as the sensor shows it, without noise, over that with a whole tool. */
static double run_shows(const struct run *run)
{
    double gain = 1.0 + run->set.drift_per_h * run->clock_s / 3600.0, idle = run_idle(run) * gain,
           whole = run->whole.quiet_w - idle;
    return whole > 1e-6 ? (run->shown.quiet_w - idle) / whole : 1.0;
}

/* Runs until the cut gives a factor; returns it over the simulated spindle's, 0 if there is none in `most_s`. */
static double run_teach(struct run *run, double most_s)
{
    while (!run->judge.cuts && run->clock_s < most_s) run_step(run, 0);
    return run->judge.cuts ? run->judge.cut_factor / run->set.factor_share : 0.0;
}

#endif
