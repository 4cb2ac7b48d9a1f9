/* SPDX-License-Identifier: GPL-2.0-or-later */
/* closed_loop.c - tracker and feed law drive a simulated planner through random cuts; the true removal rate is measured beside.
 *
 * Called through support/closed_loop.py.  closed_loop FIRST COUNT [CELL]: one line of output per scene: seed, peak of the true rate in 10 ms
 * over the target, share of the cutting time above 102 % of it, time in s, volume of the map over the true one.
 *
 * CELL in mm; without it as `chipwise load` chooses it for the tool.
 *
 * The truth is a field of needles on a grid turned against the cells, cut at every period's tip: it shares the tool's numbers with the
 * core and nothing else. The planner follows lines and arcs that join smoothly, brakes with the acceleration that the tracker knows of,
 * and uses an override one period after it was given.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/feed.h"
#include "core/samples.h"
#include "core/tracker.h"

#include "closed_loop_field.h"
#include "closed_loop_route.h"

#define PERIOD 0.001 /* s */
#define WINDOW 10    /* periods, 10 ms */

static struct chip_tracker tracker;
static struct chip_tracker_in in;
static struct chip_tracker_out out;

struct result {
    double peak, over, seconds, volume;
};

static double feed_scale(double target, double requested, double accel, double velocity, double last_velocity,
                         double last_scale)
{
    struct chip_feed_in law;
    int i;
    memset(&law, 0, sizeof law);
    law.feed_mode = CHIP_FEED_CONSTANT;
    law.mrr_target_mm3_s = target;
    law.programmed_vel_mm_s = law.requested_vel_mm_s = requested;
    law.motion = CHIP_MOTION_FEED;
    law.acceleration_mm_s2 = accel;
    law.min_vel_mm_s = 0.1;
    law.period_s = PERIOD;
    law.is_trusted = out.is_ready && !out.has_fault;
    law.section_area_mm2 = out.section_area_mm2;
    for (i = 0; i < CHIP_FEED_LOAD_STEPS && i < out.load.steps; i++) {
        law.load_distance_mm[i] = out.load.step[i].distance;
        law.load_area_mm2[i] = out.load.step[i].area;
        law.load_accel_mm_s2[i] = out.load.step[i].accel;
    }
    law.dir_z = out.dir_z;
    law.depth_mm = out.depth_mm;
    law.current_vel_mm_s = velocity;
    law.current_accel_mm_s2 = (velocity - last_velocity) / PERIOD;
    return chip_feed(&law, last_scale).scale;
}

/* The segments that the planner would have queued, from the one the tool is on. */
static void tell_path(const struct route *route, int now, double s)
{
    struct chip_path *path = &tracker.path;
    int i;
    chip_path_follow(path, now + 1, route->segment[now].length, s - route->begin[now]);
    for (i = now + path->count; i < route->count; i++) chip_path_append(path, i + 1, &route->segment[i]);
}

/* The intervals that the look-ahead has kept are those that it would compute now. */
static void check_intervals(const struct chip_stock *stock)
{
    static struct chip_lookahead fresh;
    int i, slot;
    fresh = tracker.lookahead;
    memset(fresh.completed, 0, sizeof fresh.completed);
    chip_load_complete(&fresh, stock);
    for (i = fresh.first; i < fresh.first + fresh.count; i++) {
        const struct chip_load_interval *a, *b;
        slot = slot_of(i);
        a = &fresh.interval[slot];
        b = &tracker.lookahead.interval[slot];
        if (a->from == b->from && a->to == b->to && a->a == b->a && a->b == b->b && a->bound == b->bound
            && a->jump == b->jump)
            continue;
        fprintf(stderr, "the interval of sample %d of %d to %d is out of date\n", i, fresh.first,
                fresh.first + fresh.count - 1);
        exit(2);
    }
}

static void step(struct chip_stock *stock, const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) in.pos_mu[i] = tip[i];
    chip_tracker_step(&tracker, stock, &in, &out);
    check_intervals(stock);
}

static void lead(struct chip_stock *stock, double from[3], const double to[3], struct field *field,
                 const struct cutter *tool)
{
    double length = sqrt(pow(to[0] - from[0], 2) + pow(to[1] - from[1], 2) + pow(to[2] - from[2], 2)), tip[3];
    int i, j, count = (int)ceil(length / 0.03);
    for (j = 1; j <= count; j++) {
        for (i = 0; i < 3; i++) tip[i] = from[i] + (to[i] - from[i]) * j / count;
        step(stock, tip);
        if (field) cut_field(field, tool, tip);
    }
    for (i = 0; i < 3; i++) from[i] = to[i];
}

/* Slots and passes of the same tool before. */
static void cut_before(struct chip_stock *stock, struct field *field, const struct cutter *tool, double depth,
                       double at[3])
{
    int passes = one_of(4);
    while (passes-- > 0) {
        double angle = uniform(-1.5, 1.5), x = uniform(-20.0, 20.0), y = uniform(-15.0, 15.0),
               z = -depth * uniform(0.4, 1.2);
        double far = SIZE[0], begin[3] = { x - far * cos(angle), y - far * sin(angle), z }, end[3];
        double above[3] = { at[0], at[1], 5.0 }, over[3] = { begin[0], begin[1], 5.0 };
        end[0] = x + far * cos(angle);
        end[1] = y + far * sin(angle);
        end[2] = z;
        lead(stock, at, above, 0, 0);
        lead(stock, at, over, 0, 0);
        lead(stock, at, begin, 0, 0);
        lead(stock, at, end, field, tool);
    }
}

static struct cutter a_tool(double *angle)
{
    static const double diameters[] = { 3.175, 6.0, 8.37, 12.0 };
    struct cutter tool = { 0.5 * diameters[one_of(4)], 0.0, 0.0 };
    int kind = one_of(6);
    *angle = 0.0;
    if (kind == 0) tool.corner = tool.radius;
    if (kind == 1) tool.corner = 0.3 * tool.radius;
    if (kind == 2) {
        *angle = uniform(40.0, 110.0);
        tool.slope = 1.0 / tan(*angle * 3.14159265358979 / 360.0);
    }
    return tool;
}

static struct chip_stock *begin(double cell, const struct cutter *tool, double angle, double accel, const double at[3])
{
    uint32_t cells = chip_stock_cells(cell, SIZE[0] + 2.0, SIZE[1] + 2.0);
    struct chip_stock *stock = calloc(1, chip_stock_bytes(cells));
    int i;
    chip_stock_init(stock, cell, cells);
    chip_tracker_init(&tracker);
    memset(&in, 0, sizeof in);
    in.mu_per_mm = 1.0;
    in.period_s = PERIOD;
    in.mrr_window_s = 0.01;
    in.acceleration_mu_s2 = accel;
    in.tool_diameter_mu = 2.0 * tool->radius;
    in.tool_corner_radius_mu = tool->corner;
    in.tool_tip_angle_deg = angle;
    in.is_enabled = 1;
    in.motion = CHIP_MOTION_FEED;
    for (i = 0; i < 3; i++) {
        in.pos_mu[i] = at[i];
        in.axis_acceleration_mu_s2[i] = accel;
        in.box_min_mu[i] = i < 2 ? -0.5 * SIZE[i] : -SIZE[2];
        in.box_max_mu[i] = i < 2 ? 0.5 * SIZE[i] : 0.0;
    }
    in.define_request = 1;
    for (i = 0; i < 60; i++) step(stock, at);
    in.define_request = 0;
    if (!out.is_ready) fprintf(stderr, "the tracker is not ready: fault %d\n", out.fault_number), exit(2);
    return stock;
}

static struct result drive(struct chip_stock *stock, struct field *field, const struct cutter *tool,
                           const struct route *route, double target, double accel)
{
    double s = 0.0, velocity = 0.0, last = 0.0, scale = 0.0, recent[WINDOW] = { 0.0 }, window = 0.0, truth = 0.0;
    double before = out.removed_volume_mm3;
    struct result result = { 0.0, 0.0, 0.0, 0.0 };
    int now = 0, n = 0, cutting = 0, over = 0;
    while (now < route->count && n < 200000) {
        double tip[3], dir[3], wanted, removed, change = route->segment[now].accel * PERIOD;
        wanted = fmin(CEILING * scale, planner_limit(route, now, s + velocity * PERIOD));
        last = velocity;
        velocity = fmin(fmax(wanted, velocity - change), velocity + change);
        if (velocity < 1e-4) velocity = 1e-4;
        s += velocity * PERIOD;
        while (now < route->count && s >= route->begin[now + 1]) now++;
        if (now >= route->count) break;
        chip_segment_at(&route->segment[now], s - route->begin[now], tip, dir);
        removed = cut_along(field, tool, in.pos_mu, tip);
        window += removed - recent[n % WINDOW];
        recent[n % WINDOW] = removed;
        truth += removed;
        cutting += window > 0.05 * target * WINDOW * PERIOD;
        over += window > 1.02 * target * WINDOW * PERIOD;
        result.peak = fmax(result.peak, window / (target * WINDOW * PERIOD));
        tell_path(route, now, s);
        step(stock, tip);
        scale = feed_scale(target, CEILING, accel, velocity, last, scale);
        n++;
    }
    for (now = 0; now < 50; now++) step(stock, in.pos_mu);
    result.over = cutting ? (double)over / cutting : 0.0;
    result.seconds = n * PERIOD;
    result.volume = truth > 0.0 ? (out.removed_volume_mm3 - before) / truth : 1.0;
    return result;
}

static struct result scene(uint64_t seed, double cell, struct field *field)
{
    static const double accels[] = { 150.0, 500.0, 1270.0 };
    struct cutter tool;
    struct chip_stock *stock;
    struct route route;
    struct result result;
    int i;
    double angle, depth, accel, target, at[3] = { -50.0, -40.0, 5.0 }, tip[3], dir[3];
    state = seed * 0x2545f4914f6cdd1du + 77;
    tool = a_tool(&angle);
    for (i = 0; i < 3; i++) SIZE[i] = WHOLE[i] * tool.radius / 6.0;
    HALF = 0.52 * hypot(SIZE[0], SIZE[1]);
    depth = tool.radius * uniform(0.4, 1.6);
    accel = accels[one_of(3)];
    target = tool.radius * depth * uniform(15.0, 45.0);
    new_field(field, &tool);
    if (cell <= 0.0) cell = fmin(0.25, fmax(0.1, 2.0 * tool.radius / 48.0));
    stock = begin(cell, &tool, angle, accel, at);
    cut_before(stock, field, &tool, depth, at);
    make_route(&route, depth, one_of(3) ? 0.0 : uniform(0.0, 0.04), accel, 5);
    chip_segment_at(&route.segment[0], 0.0, tip, dir);
    {
        double above[3] = { at[0], at[1], 5.0 }, over[3] = { tip[0], tip[1], 5.0 };
        lead(stock, at, above, 0, 0);
        lead(stock, at, over, 0, 0);
        lead(stock, at, tip, 0, 0);
    }
    result = drive(stock, field, &tool, &route, target, accel);
    free(stock);
    return result;
}

int main(int argc, char **argv)
{
    uint64_t first = argc > 1 ? strtoull(argv[1], 0, 10) : 1, count = argc > 2 ? strtoull(argv[2], 0, 10) : 1, seed;
    double cell = argc > 3 ? atof(argv[3]) : 0.0;
    struct field field = { 0 };
    for (seed = first; seed < first + count; seed++) {
        struct result result = scene(seed, cell, &field);
        printf("%llu %.4f %.5f %.3f %.5f\n", (unsigned long long)seed, result.peak, result.over, result.seconds,
               result.volume);
        fflush(stdout);
    }
    free(field.top);
    return 0;
}
