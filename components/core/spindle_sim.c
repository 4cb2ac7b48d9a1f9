/* SPDX-License-Identifier: GPL-2.0-or-later */
/* spindle_sim.c - see spindle_sim.h; the numbers in brackets are those of its principle. */
#include "chip_math.h"
#include "spindle_sim.h"

#define CHIP_SIM_MOST_W 1e9    /* W */
#define CHIP_SIM_MOST_RPS 1e5  /* 1/s */
#define CHIP_SIM_AT_SPEED 0.02 /* of the commanded speed */
#define CHIP_SIM_STANDS 1e-6   /* 1/s */
#define CHIP_SIM_CUTS 1e-9     /* W, with less it cuts air */
#define CHIP_SIM_UNIFORMS 12   /* whose sum has the variance 1 */
#define CHIP_SIM_S_PER_H 3600.0

/* A number from 0 to 1; xorshift64 (G. Marsaglia, J. Stat. Software 8, 2003). */
static double uniform(struct chip_spindle_sim *sim)
{
    sim->random ^= sim->random << 13;
    sim->random ^= sim->random >> 7;
    sim->random ^= sim->random << 17;
    return (double)(sim->random >> 11) * (1.0 / 9007199254740992.0);
}

/* [4] The noise of this period, in standard deviations. */
static double noise(struct chip_spindle_sim *sim, const struct chip_spindle_settings *set, double period)
{
    int i;
    if (!sim->is_begun || sim->seeded != set->seed_number) {
        sim->random = 0x9e3779b97f4a7c15ULL * (2ULL * (unsigned)set->seed_number + 1ULL);
        sim->seeded = set->seed_number;
        sim->sample_left_s = 0.0;
    }
    sim->sample_left_s -= period;
    if (sim->sample_left_s <= 0.0) {
        sim->sample_left_s = chip_min(chip_setting(set->sample_s), CHIP_SIM_S_PER_H);
        for (sim->noise = -0.5 * CHIP_SIM_UNIFORMS, i = 0; i < CHIP_SIM_UNIFORMS; i++) sim->noise += uniform(sim);
    }
    return sim->noise;
}

/* [1] Turns the body; returns the power that turning it up costs, W. */
static double turn(struct chip_spindle_sim *sim, const struct chip_spindle_settings *set, double command, double period)
{
    double torque = chip_setting(set->torque_nm), inertia = chip_setting(set->inertia_kg_m2);
    double most = torque > 0.0 && inertia > 0.0 ? torque / inertia * period / (2.0 * CHIP_PI) : CHIP_SIM_MOST_RPS * 2.0;
    double before = fabs(sim->speed_rps), change = chip_clamp(command - sim->speed_rps, -most, most);
    sim->speed_rps += change;
    if (!(inertia > 0.0) || !(torque > 0.0) || !(period > 0.0) || fabs(sim->speed_rps) <= before) return 0.0;
    return chip_min(inertia * 4.0 * CHIP_PI * CHIP_PI * fabs(change) / period * fabs(sim->speed_rps), CHIP_SIM_MOST_W);
}

/* [3] What the cut takes, W. */
static double cut(struct chip_spindle_sim *sim, const struct chip_spindle_settings *set, double power, double period)
{
    double last = chip_setting(set->break_time_s), wear = chip_finite(set->wear_per_h) ? set->wear_per_h : 0.0;
    if (power > CHIP_SIM_CUTS && sim->speed_rps != 0.0) sim->cut_s += period;
    if (last > 0.0 && sim->cut_s >= last) sim->is_broken = 1;
    if (sim->is_broken || sim->speed_rps == 0.0) return 0.0;
    return power * chip_setting(set->factor_share) * chip_max(0.0, 1.0 + wear * sim->cut_s / CHIP_SIM_S_PER_H);
}

/* [2] What it takes without a cut, W. */
static double idle(const struct chip_spindle_sim *sim, const struct chip_spindle_settings *set)
{
    double n = fabs(sim->speed_rps);
    if (n < CHIP_SIM_STANDS) return 0.0;
    return chip_setting(set->idle_w[0]) + n * (chip_setting(set->idle_w[1]) + n * chip_setting(set->idle_w[2]));
}

/* [5] */
static double shown(double load) { return chip_finite(load) ? chip_clamp(load, 0.0, CHIP_SIM_MOST_W) : 0.0; }

struct chip_spindle_shown chip_spindle_sim_step(struct chip_spindle_sim *sim, const struct chip_spindle_settings *set,
                                                double speed_cmd_rps, double cut_power_w, int break_now, int mend)
{
    double period = chip_finite(set->period_s) ? chip_clamp(set->period_s, 0.0, 1.0) : 0.0;
    double command =
        chip_finite(speed_cmd_rps) ? chip_clamp(speed_cmd_rps, -CHIP_SIM_MOST_RPS, CHIP_SIM_MOST_RPS) : 0.0;
    double power = chip_min(chip_setting(cut_power_w), CHIP_SIM_MOST_W), lag = chip_setting(set->lag_s), gain,
           deviation;
    double drift = chip_finite(set->drift_per_h) ? set->drift_per_h : 0.0;
    struct chip_spindle_shown out;

    if (mend) {
        sim->cut_s = 0.0;
        sim->is_broken = 0;
    }
    if (break_now) sim->is_broken = 1;
    deviation = noise(sim, set, period) * chip_setting(set->noise_share);
    out.true_w = turn(sim, set, command, period);
    out.true_w = shown(out.true_w + idle(sim, set) + cut(sim, set, power, period));
    sim->lagged_w += (out.true_w - sim->lagged_w) * (lag > 0.0 && sim->is_begun ? 1.0 - exp(-period / lag) : 1.0);
    sim->hours += period / CHIP_SIM_S_PER_H;
    sim->is_begun = 1;
    gain = 1.0 + drift * sim->hours;
    out.quiet_w = shown(sim->lagged_w * gain);
    out.load_w = shown(out.quiet_w * (1.0 + deviation));
    out.speed_rps = sim->speed_rps;
    out.is_at_speed = fabs(command - sim->speed_rps) <= CHIP_SIM_AT_SPEED * fabs(command);
    return out;
}
