/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A tracker with a map of its own, driven by hand; the C tests of the tracker share it. */
#ifndef CHIPWISE_TESTS_ONE_TRACKER_H
#define CHIPWISE_TESTS_ONE_TRACKER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/tracker.h"

static struct chip_tracker tracker;
static struct chip_stock *stock;
static struct chip_tracker_in in;
static struct chip_tracker_out out;
static int failures;

static void expect(int good, const char *what)
{
    if (good) return;
    printf("%s: stock %d, ready %d, waiting %d, fault %d, removed %.4f mm3\n", what, out.has_stock, out.is_ready,
           tracker.sweep.waiting, out.fault_number, out.removed_volume_mm3);
    failures++;
}

static void periods(int count)
{
    while (count-- > 0) chip_tracker_step(&tracker, stock, &in, &out);
}

/* To a place in X and Z, evenly in `count` periods. */
static inline void go(double x, double z, int count)
{
    double x0 = in.pos_mu[0], z0 = in.pos_mu[2];
    int i;
    for (i = 1; i <= count; i++) {
        in.pos_mu[0] = x0 + (x - x0) * i / count;
        in.pos_mu[2] = z0 + (z - z0) * i / count;
        periods(1);
    }
}

/* A box of size[0] x size[1] x size[2] mm with its top at Z0 and a corner at X0 Y0, defined while a flat tool stands at `at`; mm. */
static void define(double cell, const double size[3], double diameter, const double at[3])
{
    uint32_t cells = chip_stock_cells(cell, size[0] + 10.0, size[1] + 10.0);
    int i;
    free(stock);
    stock = calloc(1, chip_stock_bytes(cells));
    chip_stock_init(stock, cell, cells);
    chip_tracker_init(&tracker);
    memset(&in, 0, sizeof in);
    in.mu_per_mm = 1.0;
    in.period_s = 0.001;
    in.mrr_window_s = 0.02;
    in.acceleration_mu_s2 = 500.0;
    in.tool_diameter_mu = diameter;
    in.is_enabled = 1;
    in.motion = 2;
    for (i = 0; i < 3; i++) in.pos_mu[i] = at[i];
    in.box_max_mu[0] = size[0];
    in.box_max_mu[1] = size[1];
    in.box_min_mu[2] = -size[2];
    in.define_request = 1;
    periods(200);
    in.define_request = 0;
    expect(out.is_ready, "the stock is defined");
}

#endif
