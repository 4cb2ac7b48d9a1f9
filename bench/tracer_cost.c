/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_cost.c - what a servo period of profiling control costs.
 *
 * Called by bench/run.py (prints JSON rows). A head traces a ball in lines to and fro; what it met is recorded and played
 * REPLAYS times; the time of a period is the fastest of those (as bench_cost.py has it).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/slave.h"
#include "core/stylus.h"
#include "core/tracer.h"
#include "lib/clock.h"

#define REPLAYS 5
#define PERIODS 60000

static struct chip_tracer_in in[PERIODS];
static double best[PERIODS];

static void row(const char *what, double us, double target)
{
    printf("{\"name\": \"%s\", \"value\": %.3f, \"unit\": \"us\", \"note\": \"%s %g; %d "
           "periods\"}\n",
           what, us, us <= target ? "meets" : "MISSES", target, PERIODS);
}

/* Mean of a period of master, slave and 40 parts for its pulses, us. */
static double slave_us(void)
{
    struct chip_slave_settings s = { .scale_numerator = { 1, -3, 254 },
                                     .scale_divisor = { 1, 7, 100 },
                                     .most_counts = 15,
                                     .catch_up_counts = 3,
                                     .max_behind_counts = 1000,
                                     .silence_periods = 10,
                                     .tick_count = 40 };
    static struct chip_slave slave;
    static struct chip_master master;
    double counts_per_mm[3] = { 1000.0, 1000.0, 1000.0 }, position[3], begin;
    int i, k, pulse[3];
    chip_slave_step(&slave, &s, &master.packet, 0);
    begin = now_us();
    for (k = 0; k < PERIODS; k++) {
        for (i = 0; i < 3; i++) position[i] = 0.01 * k;
        chip_master_step(&master, position, counts_per_mm);
        chip_slave_step(&slave, &s, &master.packet, 1);
        for (i = 0; i < 40; i++) chip_slave_pulse(&slave, pulse);
    }
    return (now_us() - begin) / PERIODS;
}

static const struct chip_tracer_settings settings = { .mode_number = CHIP_TRACER_BOTH_WAYS,
                                                      .direction_sign = 1,
                                                      .feed_mm_s = 30.0,
                                                      .approach_vel_mm_s = 10.0,
                                                      .return_vel_mm_s = 50.0,
                                                      .max_vel_mm_s = 100.0,
                                                      .acceleration_mm_s2 = 2000.0,
                                                      .gain_hz = 300.0,
                                                      .deflection_mm = 0.3,
                                                      .range_mm = 1.5,
                                                      .dead_time_s = 0.002,
                                                      .max_jump_mm = 0.5,
                                                      .pick_mm = 0.1,
                                                      .search_mm = 100.0,
                                                      .lost_mm = 10.0,
                                                      .approach_dir = { 0.0, 0.0, -1.0 },
                                                      .window_min_mm = { -10.0, -10.0, -100.0 },
                                                      .window_max_mm = { 10.0, 10.0, 100.0 },
                                                      .soft_min_mm = { -100.0, -100.0, -100.0 },
                                                      .soft_max_mm = { 100.0, 100.0, 100.0 } };
static const struct chip_stylus_settings model = { .surface_number = CHIP_STYLUS_BALL,
                                                   .size_mm = 20.0,
                                                   .ball_mm = 2.0,
                                                   .friction_share = 0.15,
                                                   .noise_mm = 0.0005,
                                                   .delay_periods = 2 };
static struct chip_tracer tracer;

/* Traces the ball and records what is met; -> how many periods the head traced. */
static int record(void)
{
    static struct chip_stylus stylus;
    struct chip_tracer_out out;
    double p[3] = { -10.0, -10.0, 25.0 }, now[3];
    int i, k, traced = 0;
    chip_tracer_init(&tracer);
    for (k = 0; k < PERIODS; k++) {
        chip_stylus_step(&stylus, &model, p, in[k].deflection_mm, now);
        for (i = 0; i < 3; i++) in[k].position_mm[i] = p[i];
        in[k].is_enabled = 1;
        in[k].feed_share = 1.0;
        in[k].period_s = 0.001;
        best[k] = 1e9;
        chip_tracer_step(&tracer, &settings, &in[k], &out);
        traced += out.state_number == CHIP_TRACER_TRACE;
        for (i = 0; i < 3; i++) p[i] += 0.001 * out.velocity_mm_s[i];
    }
    return traced;
}

/* Plays the record REPLAYS times. */
static void play(void)
{
    struct chip_tracer_out out;
    int k, replay;
    for (replay = 0; replay < REPLAYS; replay++) {
        chip_tracer_init(&tracer);
        for (k = 0; k < PERIODS; k++) {
            double begin = now_us(), took;
            chip_tracer_step(&tracer, &settings, &in[k], &out);
            took = now_us() - begin;
            if (took < best[k]) best[k] = took;
        }
    }
}

int main(void)
{
    double sum = 0.0;
    int k, traced = record();
    play();
    for (k = 0; k < PERIODS; k++) sum += best[k];
    qsort(best, PERIODS, sizeof *best, rising);
    row("tracer, lines over a ball: mean", sum / PERIODS, 2.0);
    row("tracer, lines over a ball: p99.99", best[(int)(0.9999 * PERIODS)], 2.0);
    row("tracer, lines over a ball: worst", best[PERIODS - 1], 2.0);
    row("master, slave and 40 parts of pulses: mean", slave_us(), 2.0);
    return traced < PERIODS / 2;
}
