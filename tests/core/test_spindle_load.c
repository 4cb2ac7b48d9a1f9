/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The load that is measured (spindle_load.h) in simulated runs: the factor after one cut, a broken tool, missing stock, a load in air, a
 * wrong factor; sensors that are frozen, negative, not finite or spike; a spindle that stands. bench/spindle_load.c has far more runs. */
#include <math.h>
#include <stddef.h>

#include "counted_checks.h"
#include "spindle_runs.h"

#define RUNS 12

static struct run run;

/* Until a cut after the one that taught has lasted `age_s`; no alarm until then. */
static void to_cut(uint64_t seed, double age_s)
{
    int number, alarm = 0;
    run_begin(&run, seed);
    CHECK(run_teach(&run, 300.0) > 0.0);
    for (number = run.cut_number + 1; !alarm && (run.cut_number < number || !run.cutting || run.age_s < age_s);)
        alarm = run_step(&run, 0);
    CHECK(!alarm);
}

/* The first alarm within `most_s`, 0: none. */
static int alarm_in(double most_s)
{
    double end_s = run.clock_s + most_s;
    int alarm = 0;
    while (!alarm && run.clock_s < end_s) alarm = run_step(&run, 0);
    return alarm;
}

static void the_factor_after_one_cut(void)
{
    static const double lags[] = { 0.0, 0.05, 0.1, 0.3, 0.6 };
    int i;
    for (i = 0; i < RUNS; i++) {
        run_begin(&run, 300u + (unsigned)i);
        run.set.lag_s = run.twin_set.lag_s = lags[i % 5];
        NEAR(run_teach(&run, 300.0), 1.0, 0.05);
        CHECK(run.judge.lag_s <= lags[i % 5] * 1.7 + 0.05);
    }
}

/* 0.1 s after the sensor has lost half of the load. */
static void a_broken_tool(void)
{
    int i;
    for (i = 0; i < RUNS; i++) {
        double fall_s = 1e9;
        int alarm = 0;
        to_cut(400u + (unsigned)i, 1.5);
        run_step(&run, 1);
        while (!alarm && run.clock_s < fall_s + 1.0) {
            alarm = run_step(&run, 0);
            if (fall_s > 1e8 && run_shows(&run) < 0.5) fall_s = run.clock_s;
        }
        CHECK(alarm == CHIP_LOAD_BROKEN);
        CHECK(run.clock_s <= fall_s + 0.1);
        CHECK(alarm_in(1e-3) == CHIP_LOAD_BROKEN); /* it stays */
        run.in.is_decided = 1;
        CHECK(run_step(&run, 0) == CHIP_LOAD_SOUND);
    }
}

static void missing_stock(void)
{
    to_cut(500, 3.0);
    while (run.cutting) run_step(&run, 0);
    while (!run.cutting) run_step(&run, 0);
    run.missing = 0.0;
    CHECK(alarm_in(3.0) == CHIP_LOAD_MISSING);
}

static void a_load_in_air(void)
{
    to_cut(501, 3.0);
    run.in_air_w = run.level_w;
    CHECK(alarm_in(60.0) == CHIP_LOAD_IN_AIR);
}

/* A factor of another tool: half, and a little more than half of it is wear, which no alarm is for. */
static void another_tool(void)
{
    static const double times[] = { 0.5, 2.1, 0.75, 1.4 };
    static const int wanted[] = { CHIP_LOAD_HIGH, CHIP_LOAD_LOW, CHIP_LOAD_SOUND, CHIP_LOAD_SOUND };
    int i;
    for (i = 0; i < 4; i++) {
        run_begin(&run, 510);
        run_teach(&run, 300.0);
        run.in.load_factor_share = times[i] * run.judge.cut_factor;
        CHECK(alarm_in(60.0) == wanted[i]);
    }
}

static void half_an_hour_without_alarm(void)
{
    run_begin(&run, 520);
    run.least = 0.2;
    CHECK(alarm_in(1800.0) == 0);
    CHECK(run.judge.cuts > 20);
}

/* Nothing is measured where the pin is not connected, and nothing is judged where the factor is not known. */
static void no_sensor(void)
{
    struct chip_spindle_load untouched;
    long i;
    memset(&untouched, 0, sizeof untouched);
    run_begin(&run, 530);
    for (i = 0; i < 1000; i++) {
        run.in.spindle_load_w = i % 2 ? 0.0 : NAN;
        run.in.power_w = 100.0;
        CHECK(chip_spindle_load_step(&run.judge, &run.in) == 0);
    }
    CHECK(!memcmp(&run.judge, &untouched, sizeof untouched));
    run_begin(&run, 531);
    run.takes_first_factor = 0;
    while (run.cut_number < 3) CHECK(run_step(&run, 0) == 0);
    run.missing = 0.0;
    CHECK(alarm_in(20.0) == 0);
}

static double kept_w;

static double frozen(const struct run *sensor) { return sensor ? kept_w : 0.0; }
static double negative(const struct run *sensor) { return -sensor->shown.load_w; }
static double not_finite(const struct run *sensor) { return lround(sensor->clock_s * 1000.0) % 3 ? NAN : INFINITY; }
static double now_and_then(const struct run *sensor)
{
    return lround(sensor->clock_s * 1000.0) % 50 ? sensor->shown.load_w : NAN;
}
static double spikes(const struct run *sensor)
{
    return lround(sensor->clock_s * 1000.0) % 97 ? sensor->shown.load_w : 20.0 * sensor->shown.load_w;
}
static double drops(const struct run *sensor)
{
    return lround(sensor->clock_s * 1000.0) % 97 ? sensor->shown.load_w : 0.0;
}

/* From a moment in a cut, or in air, on the sensor is spoilt: no alarm that holds the machine. */
static void bad_sensors(void)
{
    static double (*const spoil[])(const struct run *) = { frozen,       frozen, negative, not_finite,
                                                           now_and_then, spikes, drops };
    static const int is_seen[] = { 1, 1, 1, 1, 1, 0, 0 };
    int i;
    for (i = 0; i < 7; i++) {
        int alarm = 0, seen = 0;
        double end_s;
        to_cut(540u + (unsigned)i, 2.0);
        while (i == 1 && run.cutting) run_step(&run, 0);
        if (i == 1) CHECK(alarm_in(1.0) == 0);
        kept_w = run.shown.load_w;
        run.spoil = spoil[i];
        for (end_s = run.clock_s + 60.0; run.clock_s < end_s;) {
            alarm = run_step(&run, 0);
            if (alarm == CHIP_LOAD_UNUSABLE) seen = 1;
            CHECK(alarm == 0 || alarm == CHIP_LOAD_UNUSABLE);
            CHECK(chip_finite(run.judge.ratio) && chip_finite(run.judge.idle_w) && chip_finite(run.judge.expected_w));
        }
        CHECK(seen == is_seen[i]);
        run.spoil = 0;
        for (end_s = run.clock_s + 3.0; run.clock_s < end_s;) alarm = run_step(&run, 0);
        CHECK(alarm == 0); /* and well again */
    }
}

/* The spindle stops in stock: nothing is judged. */
static void a_spindle_that_stands(void)
{
    to_cut(560, 2.0);
    run.speed_rps = 0.0;
    CHECK(alarm_in(20.0) == 0);
    CHECK(!run.judge.is_trusted);
}

/* After two minutes at rest it turns and cuts again: its load is there at once. */
static void a_spindle_that_has_stood(void)
{
    int i;
    for (i = 0; i < RUNS; i++) {
        double speed_rps;
        to_cut(570u + (unsigned)i, 2.0);
        speed_rps = run.speed_rps;
        run.speed_rps = 0.0;
        CHECK(alarm_in(120.0) == 0);
        while (run.cutting) run_step(&run, 0);
        run.speed_rps = speed_rps;
        run.shown.is_at_speed = 0; /* no feed before */
        CHECK(alarm_in(30.0) == 0);
    }
}

/* Hostile numbers on every input: finite, in bounds, and well again with sound ones. */
static void hostile_numbers(void)
{
    const double odd[] = { NAN, INFINITY, -INFINITY, -1.0, 0.0, 1e300, -1e300, 5e-324, 1e9, 0.5, 300.0 };
    unsigned state = 5;
    long i;
    run_begin(&run, 550);
    for (i = 0; i < 200000; i++) {
        struct chip_load_in in = run.in;
        double *number = (double *)&in;
        int k;
        for (k = 0; k < (int)(offsetof(struct chip_load_in, is_known) / sizeof(double)); k++) {
            state = state * 1103515245u + 12345u;
            number[k] = state >> 28 < 4 ? odd[state / 65536u % 11u]
                      : k == 0          ? 300.0
                      : k == 1          ? 200.0
                      : k == 5          ? 0.001
                                        : 100.0;
        }
        CHECK(chip_spindle_load_step(&run.judge, &in) >= 0);
        CHECK(chip_finite(run.judge.ratio) && chip_finite(run.judge.idle_w) && chip_finite(run.judge.expected_w));
        CHECK(chip_finite(run.judge.trim) && chip_finite(run.judge.noise_w2) && chip_finite(run.judge.fast_w)
              && chip_finite(run.judge.cut_factor));
    }
}

int main(void)
{
    the_factor_after_one_cut();
    a_broken_tool();
    missing_stock();
    a_load_in_air();
    another_tool();
    half_an_hour_without_alarm();
    no_sensor();
    bad_sensors();
    a_spindle_that_stands();
    a_spindle_that_has_stood();
    hostile_numbers();
    return report();
}
