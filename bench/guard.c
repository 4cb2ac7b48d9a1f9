/* SPDX-License-Identifier: GPL-2.0-or-later */
/* guard.c - what the guard's probe costs in a servo period of a traverse.
 *
 * Called by bench/run.py (prints JSON rows). A slot is cut, then gone back through as a traverse: the most expensive case, as the probe
 * has to look at every cell the tool would cover. Each path is gone through REPLAYS times; the time of a period is the fastest
 * of those (as bench_cost.py has it).
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/tracker.h"
#include "lib/clock.h"

#define REPLAYS 5
#define MOST 20000

struct job {
    const char *name;
    double diameter, cell, speed, accel;
};

/* One traverse through the slot, 17 degrees to the cells, at its speed all the way; us a period into `best`. */
static int traverse(const struct job *job, const struct chip_stock *stock, const struct chip_tool *tool, double *best,
                    int first)
{
    struct chip_guard guard;
    struct chip_guard_in in;
    double c = cos(0.3), s = sin(0.3), step = job->speed * 0.001, length = 180.0;
    int i, n = (int)(length / step), alarms = 0;
    memset(&guard, 0, sizeof guard);
    memset(&in, 0, sizeof in);
    chip_guard_reset(&guard);
    in.period_s = 0.001;
    in.acceleration_mm_s2 = in.axis_acceleration_mm_s2[0] = in.axis_acceleration_mm_s2[1] =
        in.axis_acceleration_mm_s2[2] = job->accel;
    in.start_is_cut = 1;
    for (i = 0; i < n && i < MOST; i++) {
        double begin, took;
        long work = 0;
        in.from[0] = 40.0 + c * i * step;
        in.from[1] = 40.0 + s * i * step;
        in.to[0] = in.from[0] + c * step;
        in.to[1] = in.from[1] + s * step;
        in.from[2] = in.to[2] = -5.0;
        in.distance_to_go_mm = length - (i + 1) * step;
        begin = now_us();
        alarms += chip_guard_traverse(&guard, stock, tool, &in, CHIP_WORK_PER_PERIOD, &work);
        took = now_us() - begin;
        if (first || took < best[i]) best[i] = took;
    }
    if (alarms) printf("%s: %d false alarms\n", job->name, alarms);
    return i;
}

static void measure(const struct job *job)
{
    static double best[MOST];
    uint32_t cells = chip_stock_cells(job->cell, 300, 200);
    struct chip_stock *stock = malloc(chip_stock_bytes(cells));
    double low[3] = { 0, 0, -10 }, high[3] = { 300, 200, 0 }, at[3] = { 30, 40 - 10 * tan(0.3), -5 };
    double end[3] = { 40 + 240 * cos(0.3), 40 + 240 * sin(0.3), -5 }, mean = 0.0;
    static struct chip_sweep sweep;
    struct chip_tool tool;
    int i, n = 0;
    chip_stock_init(stock, job->cell, cells);
    chip_stock_define(stock, low, high);
    while (!chip_stock_fill(stock, 1 << 20)) {}
    chip_tool_init(&tool, job->diameter, 0, 0, 0);
    memset(&sweep, 0, sizeof sweep);
    chip_sweep_start(&sweep, at);
    chip_sweep_to(&sweep, end);
    while (sweep.waiting) chip_sweep_run(&sweep, stock, &tool, 1 << 28, 0);
    for (i = 0; i < REPLAYS; i++) n = traverse(job, stock, &tool, best, i == 0);
    for (i = 0; i < n; i++) mean += best[i] / n;
    qsort(best, n, sizeof *best, rising);
    printf("{\"name\": \"guard's probe, %s: mean\", \"value\": %.3f, \"unit\": \"us\", \"note\": \"%d periods\"}\n",
           job->name, mean, n);
    printf("{\"name\": \"guard's probe, %s: worst\", \"value\": %.3f, \"unit\": \"us\", \"note\": \"p99 %.2f us\"}\n",
           job->name, best[n - 1], best[(int)(0.99 * n)]);
    free(stock);
}

int main(void)
{
    static const struct job jobs[] = { { "D6 flat, 0.25 mm cells, 100 mm/s", 6, 0.25, 100, 500 },
                                       { "D10 flat, 0.25 mm cells, 100 mm/s", 10, 0.25, 100, 500 },
                                       { "D25 flat, 0.1 mm cells, 500 mm/s", 25, 0.1, 500, 5000 } };
    unsigned i;
    for (i = 0; i < sizeof jobs / sizeof *jobs; i++) measure(&jobs[i]);
    return 0;
}
