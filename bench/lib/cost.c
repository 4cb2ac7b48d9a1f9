/* SPDX-License-Identifier: GPL-2.0-or-later */
/* cost.c - what a servo period of tracker and feed law costs, over a logged path.
 *
 * Who calls it: bench/bench_cost.py.  The core is compiled as the components compile it: one unit,
 * realtime flags.
 *
 *     cost PATH TIMES diameter corner tip cell x0 y0 z0 x1 y1 z1 accel replays first last
 *
 * PATH: doubles x y z per period (mm); a row of NaN: a new stock here.  The path is gone through
 * `replays` times; TIMES gets three uint32 per period: ns of the first time, ns of the fastest, and
 * the volume removed in 1/1000 mm3.  first, last: the periods
 * to run through marked_period() and not plain_period(), for callgrind's --toggle-collect.
 * COST_LIMITS in the environment: chip, power or both of them limit the feed.
 * COST_CLAMPS: so many clamps round the path, boxes and cylinders, which a tool with a holder passes COST_BESIDE mm beside; COST_REACH: mm from the middle to
 * the edge of the path.
 */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include "core/stock_tracker_core.h"
#include "core/volumetric_feed_core.h"

typedef double place[3];   /* x y z, mm */
typedef uint32_t times[3]; /* a period's row of TIMES */

struct machine {
    struct chip_tracker tracker;
    struct chip_tracker_in in;
    struct chip_tracker_out out;
    struct chip_stock *stock;
    struct chip_path_thinner thinner;
    struct chip_path_done *done;
    struct chip_feed_in limits; /* of the tooth; all 0: none */
    double scale;
};

/* One servo period of both components. */
static inline __attribute__((always_inline)) void period(struct machine *m)
{
    struct chip_feed_in feed;
    struct chip_feed_out result;
    struct chip_tooth_out weights;
    int i;
    chip_tracker_step(&m->tracker, m->stock, &m->in, &m->out);
    if (m->tracker.tip_known) chip_path_done_step(&m->thinner, m->done, m->tracker.tip);
    memset(&feed, 0, sizeof feed);
    if (m->limits.flutes > 0.0) feed = m->limits;
    feed.feed_mode = CHIP_FEED_CONSTANT;
    feed.mrr_target_mm3_s = 500.0;
    feed.programmed_vel_mm_s = 20.0;
    feed.requested_vel_mm_s = 100.0;
    feed.motion = m->in.motion;
    feed.acceleration_mm_s2 = m->in.acceleration_mu_s2;
    feed.period_s = m->in.period_s;
    feed.is_trusted = m->out.is_ready;
    feed.section_area_mm2 = m->out.section_area_mm2;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS; i++) {
        feed.load_distance_mm[i] = i < m->out.load.steps ? m->out.load.step[i].distance : 0.0;
        feed.load_area_mm2[i] = i < m->out.load.steps ? m->out.load.step[i].area : 0.0;
    }
    for (i = 0; i < m->out.load.tooth_steps; i++) {
        feed.tooth_distance_mm[i] = m->out.load.tooth_step[i].distance;
        feed.tooth_load_per_mm[i] = m->out.load.tooth_step[i].area;
    }
    feed.chip_share_now = m->out.load.chip;
    feed.power_root_now = m->out.load.power;
    feed.force_root_now = m->out.load.force;
    result = chip_feed(&feed, m->scale);
    weights = chip_tooth_law(&feed);
    m->in.chip_weight_per_mm = weights.chip_weight_per_mm;
    m->in.power_weight_per_mm = weights.power_weight_per_mm;
    m->in.force_weight_per_mm = weights.force_weight_per_mm;
    m->scale = result.scale;
}

__attribute__((noinline)) void plain_period(struct machine *m) { period(m); }
__attribute__((noinline)) void marked_period(struct machine *m)
{
    period(m);
    __asm__ volatile("");
}

static uint32_t now_ns(const struct timespec *begin)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((now.tv_sec - begin->tv_sec) * 1000000000LL + now.tv_nsec - begin->tv_nsec);
}

/* A new stock, filled at once, before the path begins. */
static void new_stock(struct machine *m)
{
    chip_stock_define(m->stock, m->in.box_min_mu, m->in.box_max_mu);
    while (!chip_stock_fill(m->stock, 1 << 30)) {}
    chip_tracker_init(&m->tracker);
}

/* The path of a file, and how many periods it has; NULL for one that cannot be read. */
static place *read_path(const char *name, long *count)
{
    place *path;
    FILE *file = fopen(name, "rb");
    if (!file) return 0;
    fseek(file, 0, SEEK_END);
    *count = ftell(file) / (long)sizeof *path;
    rewind(file);
    path = malloc(*count * sizeof *path);
    if (fread(path, sizeof *path, *count, file) != (size_t)*count) return 0;
    fclose(file);
    return path;
}

/* The machine of the command line's numbers: tool, cell, box, acceleration. */
static void set_up(struct machine *m, const double number[11])
{
    uint32_t cells = chip_stock_cells(number[3], number[7] - number[4], number[8] - number[5]);
    int k;
    m->in.mu_per_mm = 1.0;
    m->in.motion = 2;
    m->in.is_enabled = 1;
    m->in.tool_diameter_mu = number[0];
    m->in.tool_corner_radius_mu = number[1];
    m->in.tool_tip_angle_deg = number[2];
    for (k = 0; k < 3; k++) {
        m->in.box_min_mu[k] = number[4 + k];
        m->in.box_max_mu[k] = number[7 + k];
    }
    m->in.acceleration_mu_s2 = number[10];
    m->in.mrr_window_s = 0.02;
    m->in.period_s = 0.001;
    m->stock = malloc(chip_stock_bytes(cells));
    memset(m->stock, 0, chip_stock_bytes(cells));
    m->done = calloc(1, sizeof *m->done);
    chip_stock_init(m->stock, number[3], cells);
    printf("%.0f %u\n", (double)chip_stock_bytes(cells), cells);
}

/* A spindle at 24,000 1/min with three edges in aluminium; chip and power, as the environment asks for. */
static void set_limits(struct machine *m)
{
    const char *asked = getenv("COST_LIMITS");
    if (!asked) return;
    m->limits.flutes = 3.0;
    m->limits.spindle_speed_rps = 400.0;
    m->limits.specific_force_n_mm2 = 800.0;
    m->limits.force_exponent_mc = m->in.force_exponent_mc = 0.25;
    m->limits.current_vel_mm_s = 30.0;
    if (strstr(asked, "chip")) m->limits.max_chip_mm = 0.04;
    if (strstr(asked, "power")) m->limits.max_power_w = 300.0;
    if (strstr(asked, "force")) m->limits.max_force_n = 100.0;
    m->in.flutes = m->limits.flutes;
}

/* Clamps along the four sides of a square, none of which is met. */
static void set_clamps(struct machine *m)
{
    const char *asked = getenv("COST_CLAMPS");
    double aside = asked ? atof(getenv("COST_REACH")) + atof(getenv("COST_BESIDE")) : 0.0;
    int count = asked ? atoi(asked) : 0, i;
    struct chip_clamp_table *table = calloc(1, sizeof *table);
    for (i = 0; i < count && i < CHIP_CLAMPS; i++) {
        struct chip_clamp *clamp = &table->clamp[i];
        double along = aside * (2.0 * (i / 4 + 1) / (count / 4 + 1) - 1.0), half = 5.0;
        clamp->half_x = clamp->half_y = half;
        clamp->x = i % 2 ? along : (i % 4 ? 1.0 : -1.0) * (aside + half);
        clamp->y = i % 2 ? (i % 4 == 1 ? 1.0 : -1.0) * (aside + half) : along;
        clamp->cosine = 1.0;
        clamp->top = 60.0;
        clamp->is_round = (uint64_t)(i / 4 % 2);
    }
    table->count = (uint64_t)i;
    table->clearance = 1.0;
    table->generation = 2;
    m->in.clamps = count ? table : 0;
    m->in.tool_stick_out_mu = 30.0;
    m->in.tool_holder_diameter_mu = 30.0;
}

/* Goes through the path once, the first time if not `again`. */
static void play(struct machine *m, const place *path, long count, long first, long last, int again, times *took)
{
    struct timespec begin;
    long i;
    int k;
    new_stock(m);
    for (i = 0; i < count; i++) {
        double before = m->stock->removed;
        uint32_t ns;
        if (path[i][0] != path[i][0]) {
            new_stock(m);
            continue;
        }
        for (k = 0; k < 3; k++) m->in.pos_mu[k] = path[i][k];
        clock_gettime(CLOCK_MONOTONIC, &begin);
        if (i >= first && i <= last)
            marked_period(m);
        else
            plain_period(m);
        ns = now_ns(&begin);
        if (!again) took[i][0] = ns;
        if (!again || ns < took[i][1]) took[i][1] = ns;
        took[i][2] = (uint32_t)(1000.0 * (m->stock->removed - before) + 0.5);
    }
}

int main(int argc, char **argv)
{
    double number[14];
    place *path;
    struct machine *m = calloc(1, sizeof *m);
    struct sched_param priority = { .sched_priority = 50 };
    times *took;
    long count;
    int replay, k;
    FILE *file;

    if (argc != 17) return 2;
    for (k = 3; k < 17; k++) number[k - 3] = atof(argv[k]);
    path = read_path(argv[1], &count);
    if (!path) return 2;
    took = calloc(count, sizeof *took);
    mlockall(MCL_CURRENT | MCL_FUTURE);
    if (getenv("COST_FIFO")) sched_setscheduler(0, SCHED_FIFO, &priority);
    set_up(m, number);
    set_limits(m);
    set_clamps(m);
    for (replay = 0; replay < (int)number[11]; replay++)
        play(m, path, count, (long)number[12], (long)number[13], replay > 0, took);
    file = fopen(argv[2], "wb");
    if (!file || fwrite(took, sizeof *took, count, file) != (size_t)count) return 2;
    fclose(file);
    return 0;
}
