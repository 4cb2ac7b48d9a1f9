/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The simulated spindle (spindle_sim.h) against closed forms: turning up and down, the idle curve, lag, noise, drift, wear, a broken tool,
 * hostile numbers. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "counted_checks.h"

#include "../../components/core/spindle_sim.h"

#define PERIOD 0.001 /* s */

static struct chip_spindle_sim sim;
static struct chip_spindle_shown out;

/* A spindle as fast as commanded, without lag, noise, drift and wear: 40 W + 0.5 W s n + 0.002 W s2 n^2 and 1.5 times the cut. */
static struct chip_spindle_settings plain(void)
{
    const struct chip_spindle_settings set = {
        .idle_w = { 40.0, 0.5, 0.002 }, .factor_share = 1.5, .period_s = PERIOD, .seed_number = 7
    };
    memset(&sim, 0, sizeof sim);
    return set;
}

static void run(const struct chip_spindle_settings *set, double seconds, double speed, double power)
{
    long i, periods = lround(seconds / PERIOD);
    for (i = 0; i < periods; i++) out = chip_spindle_sim_step(&sim, set, speed, power, 0, 0);
}

static void load_of_a_cut(void)
{
    struct chip_spindle_settings set = plain();
    run(&set, 0.1, 0.0, 300.0);
    CHECK(out.load_w == 0.0 && out.true_w == 0.0 && out.is_at_speed && sim.cut_s == 0.0);
    run(&set, 0.1, 100.0, 0.0);
    NEAR(out.load_w, 40.0 + 50.0 + 20.0, 1e-9);
    run(&set, 0.1, -100.0, 300.0);
    NEAR(out.load_w, 110.0 + 450.0, 1e-9);
    NEAR(out.speed_rps, -100.0, 0.0);
    NEAR(sim.cut_s, 0.1, 1e-9);
}

/* 0.5 Nm on 0.002 kg m2 are 250 rad/s2: 100 1/s after 2.513 s, at 314 W at its end, and down again for nothing. */
static void it_turns_up_and_down(void)
{
    struct chip_spindle_settings set = plain();
    set.inertia_kg_m2 = 0.002;
    set.torque_nm = 0.5;
    run(&set, 1.0, 100.0, 0.0);
    NEAR(out.speed_rps, 250.0 / (2.0 * CHIP_PI), 0.05);
    NEAR(out.true_w, 0.5 * 250.0 + 40.0 + 0.5 * 39.79 + 0.002 * 39.79 * 39.79, 0.5);
    CHECK(!out.is_at_speed);
    run(&set, 1.6, 100.0, 0.0);
    CHECK(out.is_at_speed);
    NEAR(out.true_w, 110.0, 1e-6);
    run(&set, 1.0, 0.0, 0.0);
    NEAR(out.speed_rps, 100.0 - 250.0 / (2.0 * CHIP_PI), 0.1);
    CHECK(out.true_w < 110.0);
}

static void lag_is_of_first_order(void)
{
    struct chip_spindle_settings set = plain();
    set.lag_s = 0.3;
    run(&set, 3.0, 100.0, 0.0);
    run(&set, 0.3, 100.0, 200.0);
    NEAR(out.load_w, 110.0 + 300.0 * (1.0 - exp(-1.0)), 0.5);
    NEAR(out.true_w, 410.0, 1e-9);
}

/* Mean and standard deviation of noise over 200 s, held for 10 ms, the same for the same seed. */
static void noise_is_what_was_asked(void)
{
    struct chip_spindle_settings set = plain();
    double sum = 0.0, squares = 0.0, first[50], last = 0.0;
    long i, changes = 0, count = 200000;
    set.noise_share = 0.1;
    set.sample_s = 0.01;
    for (i = 0; i < count; i++) {
        run(&set, PERIOD, 100.0, 0.0);
        NEAR(out.quiet_w, 110.0, 1e-9);
        changes += out.load_w != last;
        last = out.load_w;
        sum += out.load_w / 110.0 - 1.0;
        squares += (out.load_w / 110.0 - 1.0) * (out.load_w / 110.0 - 1.0);
        if (i < 50) first[i] = out.load_w;
    }
    NEAR(sum / count, 0.0, 0.004); /* 20,000 samples: 6 times 0.1 / sqrt(20,000) */
    NEAR(sqrt(squares / count), 0.1, 0.003);
    NEAR(changes, 20000, 2500);
    memset(&sim, 0, sizeof sim);
    for (i = 0; i < 50; i++) {
        run(&set, PERIOD, 100.0, 0.0);
        CHECK(out.load_w == first[i]);
    }
    set.seed_number = 8;
    memset(&sim, 0, sizeof sim);
    run(&set, PERIOD, 100.0, 0.0);
    CHECK(out.load_w != first[0]);
}

/* An hour of 0.5 s periods: the gain 5 % more, the tool 40 % worse. */
static void drift_and_wear(void)
{
    struct chip_spindle_settings set = plain();
    long i;
    set.period_s = 0.5;
    set.drift_per_h = 0.05;
    for (i = 0; i < 7200; i++) out = chip_spindle_sim_step(&sim, &set, 100.0, 0.0, 0, 0);
    NEAR(out.load_w, 110.0 * 1.05, 0.01);
    set.drift_per_h = 0.0;
    set.wear_per_h = 0.4;
    for (i = 0; i < 7200; i++) out = chip_spindle_sim_step(&sim, &set, 100.0, 100.0, 0, 0);
    NEAR(out.load_w, 110.0 + 150.0 * 1.4, 0.02);
    out = chip_spindle_sim_step(&sim, &set, 100.0, 100.0, 0, 1);
    NEAR(out.load_w, 110.0 + 150.0, 0.02);
}

static void the_tool_breaks(void)
{
    struct chip_spindle_settings set = plain();
    set.break_time_s = 0.5;
    run(&set, 2.0, 100.0, 0.0);
    CHECK(!sim.is_broken);
    run(&set, 0.49, 100.0, 100.0);
    CHECK(!sim.is_broken && out.load_w > 250.0);
    run(&set, 0.02, 100.0, 100.0);
    CHECK(sim.is_broken);
    NEAR(out.load_w, 110.0, 1e-9);
    out = chip_spindle_sim_step(&sim, &set, 100.0, 100.0, 0, 1);
    CHECK(!sim.is_broken && out.load_w > 250.0);
    out = chip_spindle_sim_step(&sim, &set, 100.0, 100.0, 1, 0);
    CHECK(sim.is_broken);
}

static void hostile_numbers(void)
{
    const double odd[] = { NAN, INFINITY, -INFINITY, -1.0, 0.0, 1e300, -1e300, 5e-324, 1.7e308, 1e9, 0.5 };
    const int count = (int)(sizeof odd / sizeof *odd);
    unsigned state = 3;
    long i;
    struct chip_spindle_settings set = plain();
    for (i = 0; i < 20000; i++) {
        double *number = (double *)&set;
        int k;
        for (k = 0; k < (int)(offsetof(struct chip_spindle_settings, seed_number) / sizeof(double)); k++)
            number[k] = odd[(state = state * 1103515245u + 12345u) / 65536u % (unsigned)count];
        set.seed_number = (int)state;
        out = chip_spindle_sim_step(&sim, &set, odd[state / 7u % (unsigned)count], odd[state / 77u % (unsigned)count],
                                    i % 3 == 0, i % 5 == 0);
        CHECK(out.load_w >= 0.0 && out.load_w <= 1e9 && out.quiet_w >= 0.0 && out.quiet_w <= 1e9 && out.true_w >= 0.0
              && out.true_w <= 1e9);
        CHECK(chip_finite(out.speed_rps));
    }
    set = plain();
    run(&set, 0.1, 100.0, 300.0);
    NEAR(out.load_w, 560.0, 1e-9);
}

int main(void)
{
    load_of_a_cut();
    it_turns_up_and_down();
    lag_is_of_first_order();
    noise_is_what_was_asked();
    drift_and_wear();
    the_tool_breaks();
    hostile_numbers();
    return report();
}
