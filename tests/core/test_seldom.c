/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What seldom happens in the core: a queue that is full, a map that others have spoilt, a path that gets shorter, a probe at the end of
 * the path, a model without heights, a computer that was stopped, a tool whose shape comes late. */
#include <math.h>

#include "core_checks.h"
#include "one_tracker.h"

#include "../../components/core/path.h"
#include "../../components/core/stylus.h"
#include "../../components/core/tool_watch.h"

/* A box of 40 x 30 x 10 mm with its top at Z0, and a flat tool of 6 mm beside it. */
static void define_beside(void)
{
    const double size[3] = { 40.0, 30.0, 10.0 }, at[3] = { -10.0, 15.0, -5.0 };
    define(0.25, size, 6.0, at);
    CHECK(out.is_ready && !out.has_fault);
}

/* A zigzag of more corners than the queue has places, each by a tenth of a millimetre: those are left out that matter least. cut: cells
 * of work between two of them. */
static void queue_is_full(int cut)
{
    struct chip_tool tool = tool_of(6.0, 0.0, 0.0);
    struct chip_stock *stock = stock_of(0.25, 0.0, 0.0, -10.0, 60.0, 40.0, 0.0);
    struct chip_sweep sweep = placed(10.0, 20.0, -4.0);
    double volume = 0.0, last = 10.0;
    int i;
    for (i = 1; i <= 3 * CHIP_SWEEP_QUEUE; i++) {
        const double tip[3] = { 10.0 + 0.5 * i, 20.0 + (i % 2 ? 0.05 : -0.05) * (1 + i % 3), -4.0 };
        chip_sweep_to(&sweep, tip);
        CHECK(sweep.waiting <= CHIP_SWEEP_QUEUE);
        if (cut) volume += chip_sweep_run(&sweep, stock, &tool, cut, NULL);
        last = tip[0];
    }
    while (sweep.waiting) volume += chip_sweep_run(&sweep, stock, &tool, ALL, NULL);
    NEAR(sweep.at[0], last, 0.0);
    /* the slot of a straight path, half a tool longer at its ends, and no more wider than the zigzag is */
    CHECK(volume > 4.0 * (6.0 * (last - 10.0) + CHIP_PI * 9.0) - 0.5);
    CHECK(volume < 4.0 * (6.3 * (last - 10.0) + CHIP_PI * 9.0));
    free(stock);
}

static void sweep_that_is_nowhere(void)
{
    const double tip[3] = { 1.0, 2.0, 3.0 }, nowhere[3] = { 1.0, NAN, 3.0 };
    struct chip_tool tool = tool_of(6.0, 0.0, 0.0);
    struct chip_stock *stock = stock_of(0.25, 0.0, 0.0, -10.0, 10.0, 10.0, 0.0);
    struct chip_sweep sweep;
    long work = 0;
    memset(&sweep, 0, sizeof sweep);
    chip_sweep_to(&sweep, nowhere);
    CHECK(!sweep.known);
    chip_sweep_to(&sweep, tip);
    CHECK(sweep.known && sweep.at[1] == 2.0 && sweep.waiting == 0);
    NEAR(chip_sweep_meets(stock, &tool, nowhere, tip, 0, 0.0, &work), 0.0, 0.0);
    NEAR(chip_sweep_meets(stock, &tool, tip, nowhere, 0, 0.0, &work), 0.0, 0.0);
    CHECK(cut_to(&sweep, stock, &tool, 5.0, 5.0, -1.0) > 0.0);
    free(stock);
}

/* Another program writes into the map's head, or into a cell what cannot be: the stock is unknown, until it is defined again. */
static void map_is_spoilt(int head)
{
    uint64_t definitions;
    int i;
    define_beside();
    definitions = stock->definitions;
    if (head) {
        stock->nx += 1000;
    } else {
        for (i = 0; i < (stock->nx + 2) * (stock->ny + 2); i++) stock->cells[i].top = NAN;
        stock->removed = INFINITY;
        chip_tracker_own_map(&tracker, stock);
    }
    in.pos_mu[0] += 0.05;
    periods(1);
    CHECK(!out.has_stock && !out.is_ready && out.fault_number == CHIP_FAULT_MAP);
    CHECK(out.removed_volume_mm3 == 0.0 && stock->nx == 0 && stock->definitions > definitions);
    periods(3);
    CHECK(out.fault_number == CHIP_FAULT_MAP);
    in.define_request = 1;
    periods(100);
    CHECK(out.has_stock && out.is_ready && !out.has_fault);
}

/* Each number of the head that another program could have written otherwise. */
static void head_is_sound(void)
{
    struct chip_stock *stock = stock_of(0.25, 0.0, 0.0, -10.0, 20.0, 10.0, 0.0), *kept;
    size_t bytes = chip_stock_bytes(stock->capacity);
    const double odd[] = { NAN, INFINITY, -1.0, 1e12 };
    int i, k;
    CHECK(chip_stock_sound(stock, stock->coarsest, stock->finest, stock->capacity));
    CHECK(!chip_stock_sound(stock, 2.0 * stock->coarsest, stock->finest, stock->capacity));
    CHECK(!chip_stock_sound(stock, stock->coarsest, 0.5 * stock->finest, stock->capacity));
    CHECK(!chip_stock_sound(stock, stock->coarsest, stock->finest, stock->capacity + 1));
    kept = malloc(bytes);
    memcpy(kept, stock, bytes);
    for (i = 0; i < 4; i++) {
        double *const numbers[] = { &stock->cell,   &stock->x0,    &stock->y0,        &stock->z_min,
                                    &stock->z_max,  &stock->x_max, &stock->y_max,     &stock->half_x,
                                    &stock->half_y, &stock->turn,  &stock->drop_unit, &stock->removed };
        for (k = 0; k < (int)(sizeof numbers / sizeof *numbers); k++) {
            if (numbers[k] == &stock->removed && odd[i] > 0.0 && isfinite(odd[i])) continue; /* any volume may be cut */
            if (numbers[k] == &stock->turn && odd[i] == -1.0) continue; /* judged by the size of the map, below */
            *numbers[k] = odd[i];
            CHECK(!chip_stock_sound(stock, kept->coarsest, kept->finest, kept->capacity));
            memcpy(stock, kept, bytes);
        }
    }
    {
        int32_t *const whole[] = { &stock->nx, &stock->ny, &stock->filled };
        for (k = 0; k < 3; k++)
            for (i = -1; i < 2; i += 2) {
                *whole[k] = i * 100000;
                CHECK(!chip_stock_sound(stock, kept->coarsest, kept->finest, kept->capacity));
                memcpy(stock, kept, bytes);
            }
    }
    stock->magic ^= 1u;
    CHECK(!chip_stock_sound(stock, kept->coarsest, kept->finest, kept->capacity));
    memcpy(stock, kept, bytes);
    stock->version++;
    CHECK(!chip_stock_sound(stock, kept->coarsest, kept->finest, kept->capacity));
    free(kept);
    free(stock);
    CHECK(chip_stock_cells(NAN, 1.0, 1.0) == 0 && chip_stock_cells(0.25, INFINITY, 1.0) == 0);
    CHECK(chip_stock_cells(0.25, 1.0, NAN) == 0 && chip_stock_cells(1e-9, 1.0, 1.0) == 0);
    CHECK(chip_stock_cells(1e9, 1.0, 1.0) == 0 && chip_stock_cells(0.25, 0.0, 1.0) == 0
          && chip_stock_cells(0.25, 1.0, -1.0) == 0);
}

/* A segment to x at Z-5, on the path that the tracker looks along. */
static void append(double x0, double x, long key)
{
    const double from[3] = { x0, 15.0, -5.0 }, to[3] = { x, 15.0, -5.0 };
    struct chip_segment segment;
    CHECK(chip_segment_line(&segment, from, to));
    segment.accel = 500.0;
    segment.rapid = 0;
    segment.join = CHIP_JOIN_TANGENT;
    chip_path_append(&tracker.path, key, &segment);
}

/* The planner takes back what it had queued: the load of stock that the tool will not meet is forgotten. */
static void path_gets_shorter(void)
{
    int i, k;
    double most = 0.0;
    define_beside();
    chip_path_reset(&tracker.path);
    tracker.path.known = 1;
    for (i = 0; i < 60; i++) {
        in.pos_mu[0] = -7.0 + 0.05 * i;
        chip_path_follow(&tracker.path, 1, 3.5, 0.05 * i);
        if (!tracker.path.count) append(-7.0, -3.5, 1);
        if (tracker.path.count == 1 && i < 40) append(-3.5, 30.0, 2);
        if (i == 40) chip_path_retract(&tracker.path);
        periods(1);
        for (most = 0.0, k = 0; k < out.load.steps; k++) most = fmax(most, out.load.step[k].area);
        if (i == 39) CHECK(most > 20.0); /* a slot of 6 x 5 mm is ahead */
    }
    CHECK(tracker.path.count == 1);
    CHECK(most == 0.0);
}

static void path_that_is_too_short_to_stop(void)
{
    struct chip_path path;
    const double from[3] = { 0.0, 0.0, 0.0 }, to[3] = { 10.0, 0.0, 0.0 };
    struct chip_segment segment;
    CHECK(chip_segment_line(&segment, from, to));
    CHECK(!chip_segment_line(&segment, from, from));
    chip_segment_line(&segment, from, to);
    segment.accel = 0.0;
    segment.rapid = 0;
    segment.join = CHIP_JOIN_STOP;
    chip_path_reset(&path);
    chip_path_follow(&path, 1, 10.0, 0.0);
    chip_path_append(&path, 1, &segment);
    NEAR(chip_path_stop(&path, 100.0, 500.0), path.end_s, 0.0);  /* 10 mm of braking: all of it */
    NEAR(chip_path_stop(&path, 1000.0, 500.0), path.end_s, 0.0); /* a kilometre would be too short */
    NEAR(chip_path_stop(&path, 50.0, 500.0), path.begin_s + 2.5, 1e-9);
    CHECK(chip_path_stop(&path, 50.0, 0.0) > 1e29); /* nobody knows how it brakes */
    CHECK(chip_path_braking(&path, 5.0) == 0.0);
    NEAR(chip_path_braking(&path, path.s), 0.0, 0.0);
}

static void model_without_heights(void)
{
    const double above[3] = { 3.0, 4.0, 2.0 };
    double normal[3];
    struct chip_stylus_settings settings;
    memset(&settings, 0, sizeof settings);
    settings.surface_number = CHIP_STYLUS_GRID;
    settings.normal[2] = 1.0;
    settings.ball_mm = 0.5;
    NEAR(chip_stylus_distance(&settings, above, normal), 1.5, 0.0); /* a plane */
    CHECK(normal[2] == 1.0);
    settings.surface_number = 99;
    NEAR(chip_stylus_distance(&settings, above, normal), 1.5, 0.0);
}

/* Periods of 1 ms without a heartbeat; returns the code after the last. */
static int silent_for(struct chip_tool_watch *watch, int count, double since_first_s)
{
    struct chip_tool_watch_in in = { 1, 1, 7, 5.0, 0.001, since_first_s };
    while (count--) {
        chip_tool_watch_step(watch, &in);
        in.since_last_s = 0.00001;
    }
    return watch->code;
}

/* For 20 s; the periods missed are made up at once, in which the monitor cannot have beaten. */
static void computer_was_stopped(void)
{
    struct chip_tool_watch watch = { 0 };
    CHECK(silent_for(&watch, 2000, 0.001) == CHIP_TOOL_WATCHED);
    CHECK(silent_for(&watch, 20000, 20.0) == CHIP_TOOL_WATCHED);
    NEAR(watch.silent_s, 1.999, 1e-9); /* the first heartbeat is a change */
    CHECK(silent_for(&watch, 2900, 0.001) == CHIP_TOOL_WATCHED);
    CHECK(silent_for(&watch, 200, 0.001) == CHIP_TOOL_UNWATCHED); /* it is dead */
    CHECK(silent_for(&watch, 6000, NAN) == CHIP_TOOL_UNWATCHED);
}

/* Periods of 1 ms in which tool 2 is in the spindle, of a monitor that has followed `followed` and beats or not; returns in how many of them
 * its traverses wait. */
static int waits_for(struct chip_tool_watch *watch, int count, int followed, int beats, double timeout_s)
{
    struct chip_tool_watch_in in = { 2, followed, watch->last_heartbeat, timeout_s, 0.001, 0.001 };
    int waits = 0, before = 1;
    while (count--) {
        in.heartbeat_count += beats;
        chip_tool_watch_step(watch, &in);
        CHECK(before || !watch->is_awaited); /* a wait that is over does not begin again */
        waits += before = watch->is_awaited;
    }
    return waits;
}

/* Another tool, whose shape comes late, or never: traverses wait for it, as long as it may come, and not at all if it is known or nobody watches. */
static void tool_is_awaited(void)
{
    struct chip_tool_watch watch = { 0 };
    CHECK(waits_for(&watch, 100, 2, 1, 5.0) == 0);
    CHECK(waits_for(&watch, 20, 1, 1, 5.0) == 20); /* by a monitor that is late */
    CHECK(waits_for(&watch, 100, 2, 1, 5.0) == 0);
    NEAR(waits_for(&watch, 9000, 1, 1, 5.0), 5000, 1.0); /* that follows no tool any more */
    CHECK(waits_for(&watch, 100, 2, 1, 5.0) == 0);
    CHECK(waits_for(&watch, 2000, 2, 0, 5.0) == 0);
    NEAR(waits_for(&watch, 9000, 1, 0, 5.0), 3000, 1.0); /* that had died 2 s before */
    CHECK(waits_for(&watch, 100, 1, 0, 5.0) == 0);
    watch = (struct chip_tool_watch){ 0 };
    CHECK(waits_for(&watch, 1000, 1, 1, 0.0) == 0); /* nobody watches the monitor */
    CHECK(waits_for(&watch, 1000, 1, 1, NAN) == 0);
}

int main(void)
{
    queue_is_full(0);
    queue_is_full(120);
    sweep_that_is_nowhere();
    map_is_spoilt(1);
    map_is_spoilt(0);
    head_is_sound();
    path_gets_shorter();
    path_that_is_too_short_to_stop();
    model_without_heights();
    computer_was_stopped();
    tool_is_awaited();
    return report();
}
