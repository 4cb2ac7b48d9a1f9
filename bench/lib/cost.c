/* cost.c - what a servo period of tracker and feed law costs, over a logged way.
 *
 * Who calls it: bench/bench_cost.py.  The core is compiled as the components compile it: one unit,
 * realtime flags.
 *
 *     cost WAY TIMES diameter corner tip cell x0 y0 z0 x1 y1 z1 accel replays first last
 *
 * WAY: doubles x y z per period (mm); a row of NaN: a new stock here.  The way is gone through
 * `replays` times; TIMES gets three uint32 per period: ns of the first time, ns of the fastest, and
 * the volume removed in 1/1000 mm3.  first, last: the periods
 * to go through marked_period() and not plain_period(), for callgrind's --toggle-collect.
 */
#define _GNU_SOURCE
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include "core/stock_tracker_core.h"
#include "core/volumetric_feed_core.h"

struct machine {
    struct cw_tracker tracker;
    struct cw_tracker_in in;
    struct cw_tracker_out out;
    struct cw_stock *stock;
    double scale;
};

/* One servo period of both components. */
static inline __attribute__((always_inline)) void period(struct machine *m)
{
    struct cw_feed_in feed;
    struct cw_feed_out result;
    int i;
    cw_tracker_step(&m->tracker, m->stock, &m->in, &m->out);
    memset(&feed, 0, sizeof feed);
    feed.kind = CW_FEED_CONSTANT;
    feed.target = 500.0;
    feed.programmed = 20.0;
    feed.requested = 100.0;
    feed.motion = m->in.motion;
    feed.accel = m->in.accel;
    feed.dt = m->in.period;
    feed.trusted = m->out.is_ready;
    feed.area = m->out.here;
    for (i = 0; i < CW_FEED_LEVELS; i++) {
        feed.next_distance[i] = i < m->out.view.levels ? m->out.view.level[i].distance : 0.0;
        feed.next_area[i] = i < m->out.view.levels ? m->out.view.level[i].area : 0.0;
    }
    result = cw_feed(&feed, m->scale);
    m->scale = result.scale;
}

__attribute__((noinline)) void plain_period(struct machine *m) { period(m); }
__attribute__((noinline)) void marked_period(struct machine *m) { period(m); __asm__ volatile(""); }

static uint32_t now_ns(const struct timespec *begin)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((now.tv_sec - begin->tv_sec) * 1000000000LL + now.tv_nsec - begin->tv_nsec);
}

/* A new stock, filled at once: the filling is no part of the way. */
static void new_stock(struct machine *m)
{
    cw_stock_define(m->stock, m->in.box_min, m->in.box_max);
    while (!cw_stock_fill(m->stock, 1 << 30)) { }
    cw_tracker_init(&m->tracker);
}

int main(int argc, char **argv)
{
    double number[16];
    struct machine *m = calloc(1, sizeof *m);
    struct sched_param priority = { .sched_priority = 50 };
    struct timespec begin;
    uint32_t (*took)[3];
    double (*way)[3];
    long count, i, first, last;
    int replay, replays, k;
    FILE *file;

    if (argc != 17) return 2;
    for (k = 3; k < 17; k++) number[k - 3] = atof(argv[k]);
    file = fopen(argv[1], "rb");
    if (!file) return 2;
    fseek(file, 0, SEEK_END);
    count = ftell(file) / (long)sizeof *way;
    rewind(file);
    way = malloc(count * sizeof *way);
    if (fread(way, sizeof *way, count, file) != (size_t)count) return 2;
    fclose(file);
    took = calloc(count, sizeof *took);
    mlockall(MCL_CURRENT | MCL_FUTURE);
    if (getenv("COST_FIFO")) sched_setscheduler(0, SCHED_FIFO, &priority);

    m->in.unit = 1.0;
    m->in.motion = 2;
    m->in.cutting = 1;
    for (k = 0; k < 3; k++) {
        m->in.tool_size[k] = number[k];
        m->in.box_min[k] = number[4 + k];
        m->in.box_max[k] = number[7 + k];
    }
    m->in.accel = number[10];
    m->in.window = 0.02;
    m->in.period = 0.001;
    replays = (int)number[11];
    first = (long)number[12];
    last = (long)number[13];
    {
        uint32_t cells = cw_stock_cells(number[3], number[7] - number[4], number[8] - number[5]);
        m->stock = malloc(cw_stock_bytes(cells));
        memset(m->stock, 0, cw_stock_bytes(cells));
        cw_stock_init(m->stock, number[3], cells);
        printf("%.0f %u\n", (double)cw_stock_bytes(cells), cells);
    }
    for (replay = 0; replay < replays; replay++) {
        new_stock(m);
        for (i = 0; i < count; i++) {
            double before = m->stock->removed;
            uint32_t ns;
            if (way[i][0] != way[i][0]) {
                new_stock(m);
                continue;
            }
            for (k = 0; k < 3; k++) m->in.axis[k] = way[i][k];
            clock_gettime(CLOCK_MONOTONIC, &begin);
            if (i >= first && i <= last) marked_period(m);
            else plain_period(m);
            ns = now_ns(&begin);
            if (replay == 0) took[i][0] = ns;
            if (replay == 0 || ns < took[i][1]) took[i][1] = ns;
            took[i][2] = (uint32_t)(1000.0 * (m->stock->removed - before) + 0.5);
        }
    }
    file = fopen(argv[2], "wb");
    if (!file || fwrite(took, sizeof *took, count, file) != (size_t)count) return 2;
    fclose(file);
    return 0;
}
