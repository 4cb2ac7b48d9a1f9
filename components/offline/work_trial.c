/* SPDX-License-Identifier: GPL-2.0-or-later */
/* work_trial.c - see work_trial.h; the numbers in brackets are those of its list. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/tracker.h"
#include "work_trial.h"

#define CELL 0.1      /* mm */
#define SIDE 70.0     /* mm, of the stock */
#define SPEED 60.0    /* mm/s */
#define BEGINNING 20  /* periods, until there is more to do than fits */
#define PERIODS 60    /* that count */
#define FILLING 10000 /* periods at most until the stock is filled */

/* [1] Diameter, corner radius (mm) and angle of the tip (degrees) of a tool, and how steeply it goes down. */
static const double TOOLS[][4] = { { 25.0, 12.5, 0.0, 0.3 },
                                   { 25.0, 12.5, 0.0, 0.0 },
                                   { 20.0, 0.0, 0.0, 0.3 },
                                   { 20.0, 0.0, 90.0, 0.3 },
                                   { 16.0, 3.0, 0.0, 0.3 } };
#define KINDS ((int)(sizeof TOOLS / sizeof TOOLS[0]))

struct trial {
    struct chip_tracker tracker;
    struct chip_tracker_in in;
    struct chip_tracker_out out;
    struct chip_stock *stock;
};

static double now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* A new stock, and the tool beside it. */
static void begin(struct trial *t, const double tool[4], int percent)
{
    int i;
    chip_tracker_init(&t->tracker);
    chip_tracker_set_work(&t->tracker, percent);
    memset(&t->in, 0, sizeof t->in);
    t->in.mu_per_mm = 1.0;
    t->in.period_s = 0.001;
    t->in.mrr_window_s = 0.02;
    t->in.acceleration_mu_s2 = 500.0;
    t->in.motion = 2;
    t->in.is_enabled = 1;
    t->in.tool_diameter_mu = tool[0];
    t->in.tool_corner_radius_mu = tool[1];
    t->in.tool_tip_angle_deg = tool[2];
    t->in.box_max_mu[0] = t->in.box_max_mu[1] = SIDE;
    t->in.box_min_mu[2] = -30.0;
    t->in.pos_mu[0] = 15.0;
    t->in.pos_mu[1] = 0.5 * SIDE;
    t->in.pos_mu[2] = -5.0;
    t->in.define_request = 1;
    for (i = 0; i < FILLING && !t->out.is_ready; i++) chip_tracker_step(&t->tracker, t->stock, &t->in, &t->out);
    t->in.define_request = 0;
}

/* One path with one tool; keeps the fastest time of each period [2]. */
static void run(struct trial *t, const double tool[4], int percent, double fastest[PERIODS])
{
    int i;
    t->out.is_ready = 0;
    begin(t, tool, percent);
    for (i = 0; i < BEGINNING + PERIODS; i++) {
        double start, took;
        t->in.pos_mu[0] += 0.001 * SPEED;
        t->in.pos_mu[1] += 0.001 * SPEED * sin(0.05 * i);
        t->in.pos_mu[2] -= 0.001 * SPEED * tool[3];
        start = now_ns();
        chip_tracker_step(&t->tracker, t->stock, &t->in, &t->out);
        took = now_ns() - start;
        if (i >= BEGINNING && !(took >= fastest[i - BEGINNING])) fastest[i - BEGINNING] = took;
    }
}

double chip_work_trial(int percent, int repeats)
{
    uint32_t cells = chip_stock_cells(CELL, SIDE, SIDE);
    struct trial *t = calloc(1, sizeof *t);
    double most = -1.0;
    int kind, i;
    if (t) t->stock = calloc(1, chip_stock_bytes(cells));
    if (t && t->stock) {
        chip_stock_init(t->stock, CELL, cells);
        for (kind = 0; kind < KINDS; kind++) {
            double fastest[PERIODS], worst = 0.0;
            for (i = 0; i < PERIODS; i++) fastest[i] = 1e12;
            for (i = 0; i < repeats; i++) run(t, TOOLS[kind], percent, fastest);
            for (i = 0; i < PERIODS; i++) worst = fmax(worst, fastest[i]);
            most = fmax(most, worst);
        }
    }
    if (t) free(t->stock);
    free(t);
    return most;
}
