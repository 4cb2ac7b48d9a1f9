/* A tracker with a map of its own, driven by hand: what test_hold.c and test_lag.c share. */
#ifndef CHIPWISE_TESTS_ONE_TRACKER_H
#define CHIPWISE_TESTS_ONE_TRACKER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/tracker.h"

static struct cw_tracker tracker;
static struct cw_stock *stock;
static struct cw_tracker_in in;
static struct cw_tracker_out out;
static int failures;

static void expect(int good, const char *what)
{
    if (good) return;
    printf("%s: stock %d, ready %d, waiting %d, fault %d, removed %.4f mm3\n", what, out.has_stock, out.is_ready,
           tracker.sweep.waiting, out.code, out.removed_mm3);
    failures++;
}

static void periods(int count)
{
    while (count-- > 0) cw_tracker_step(&tracker, stock, &in, &out);
}

/* To a place in X and Z, evenly in `count` periods. */
static void go(double x, double z, int count)
{
    double x0 = in.axis[0], z0 = in.axis[2];
    int i;
    for (i = 1; i <= count; i++) {
        in.axis[0] = x0 + (x - x0) * i / count;
        in.axis[2] = z0 + (z - z0) * i / count;
        periods(1);
    }
}

/* A box of size[0] x size[1] x 10 mm with its top at Z0 and a corner at X0 Y0, defined while a flat tool stands at `at`; mm. */
static void define(double cell, const double size[2], double diameter, const double at[3])
{
    uint32_t cells = cw_stock_cells(cell, size[0] + 10.0, size[1] + 10.0);
    int i;
    free(stock);
    stock = calloc(1, cw_stock_bytes(cells));
    cw_stock_init(stock, cell, cells);
    cw_tracker_init(&tracker);
    memset(&in, 0, sizeof in);
    in.unit = 1.0;
    in.period = 0.001;
    in.window = 0.02;
    in.accel = 500.0;
    in.tool_size[0] = diameter;
    in.cutting = 1;
    in.motion = 2;
    for (i = 0; i < 3; i++) in.axis[i] = at[i];
    in.box_max[0] = size[0];
    in.box_max[1] = size[1];
    in.box_min[2] = -10.0;
    in.request = 1;
    periods(200);
    in.request = 0;
    expect(out.is_ready, "the stock is defined");
}

#endif
