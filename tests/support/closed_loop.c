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
#include "core/tracker.h"

#define PERIOD 0.001 /* s */
#define CEILING 83.0 /* mm/s */
#define WINDOW 10    /* periods, 10 ms */
#define NEEDLE 0.025 /* mm between needles; half of it for an end with a flat part, which cuts a needle at once */
#define STEP 0.02    /* mm */
#define MOST_SEGMENTS 40
#define TURNED 0.4371 /* rad, the needles against the cells */

/* mm of the box and its half diagonal, for a tool of D12; a smaller tool has all of it smaller */
static const double WHOLE[3] = { 61.37, 47.83, 12.0 };
static double SIZE[3], HALF;

/* ---- random numbers: splitmix64 ---- */

static uint64_t state;

static double uniform(double low, double high)
{
    uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) / 9007199254740992.0;
}

static int one_of(int count) { return (int)uniform(0.0, count * 0.999999); }

/* ---- the truth ---- */

struct field {
    double pitch;   /* mm between needles */
    int side;       /* needles along u and v */
    float *top;     /* mm */
    double last[3]; /* u, v, z of the last cut, mm */
};

struct cutter {
    double radius, corner, slope;
};

static int is_flat(const struct cutter *tool) { return tool->corner == 0.0 && tool->slope == 0.0; }

static double profile(const struct cutter *tool, double r)
{
    if (tool->slope > 0.0) return tool->slope * r;
    r -= tool->radius - tool->corner;
    return r <= 0.0 ? 0.0 : tool->corner - sqrt(fmax(0.0, tool->corner * tool->corner - r * r));
}

static void new_field(struct field *field, const struct cutter *tool)
{
    int i, j;
    field->pitch = tool->slope == 0.0 && tool->corner < tool->radius ? 0.5 * NEEDLE : NEEDLE;
    field->side = (int)(2.0 * HALF / field->pitch);
    field->last[2] = 1e9;
    field->top = realloc(field->top, sizeof *field->top * field->side * field->side);
    if (!field->top) exit(2);
    for (j = 0; j < field->side; j++)
        for (i = 0; i < field->side; i++) {
            double u = (i + 0.5) * field->pitch - HALF, v = (j + 0.5) * field->pitch - HALF;
            double x = cos(TURNED) * u - sin(TURNED) * v, y = sin(TURNED) * u + cos(TURNED) * v;
            field->top[j * field->side + i] = fabs(x) <= SIZE[0] / 2 && fabs(y) <= SIZE[1] / 2 ? 0.0F : -1e9F;
        }
}

/* First needle of a row at or behind u, mm. */
static int column(const struct field *field, double u)
{
    return (int)fmin(fmax(ceil((u + HALF) / field->pitch - 0.5), 0.0), field->side);
}

/* Half the width, mm, of a disc at the distance v from its centre; negative: none. */
static double half_width(const struct cutter *tool, double v)
{
    double half2 = tool->radius * tool->radius - v * v;
    return half2 > 0.0 ? sqrt(half2) : -1.0;
}

/* Cuts the needles from..to - 1 of row j with the tool at u, y from that row, and z, mm; returns the sum of what they lose. */
static double cut_row(const struct field *field, const struct cutter *tool, int j, int from, int to, double u, double y,
                      double z)
{
    double sum = 0.0;
    float *top = &field->top[(long)j * field->side];
    int i;
    for (i = from; i < to; i++) {
        double x = (i + 0.5) * field->pitch - HALF - u, height;
        if (top[i] <= z) continue;
        height = fmax(-SIZE[2], z + profile(tool, sqrt(x * x + y * y)));
        if (top[i] <= height) continue;
        sum += top[i] - height;
        top[i] = (float)height;
    }
    return sum;
}

/* Cuts with the tool at `tip`; mm3. The box is round X0 Y0 here. What a flat end that does not fall has cut at the tip before is not
 * looked at again. */
static double cut_field(struct field *field, const struct cutter *tool, const double tip[3])
{
    double u = cos(TURNED) * tip[0] + sin(TURNED) * tip[1], v = cos(TURNED) * tip[1] - sin(TURNED) * tip[0], sum = 0.0;
    int j, last = column(field, v + tool->radius), skips = is_flat(tool) && tip[2] >= field->last[2];
    for (j = column(field, v - tool->radius); j < last; j++) {
        double y = (j + 0.5) * field->pitch - HALF, half = half_width(tool, y - v),
               before = half_width(tool, y - field->last[1]);
        int from, to, gone_from, gone_to;
        if (half < 0.0) continue;
        from = column(field, u - half);
        to = column(field, u + half);
        gone_from = skips && before > 0.0 ? column(field, field->last[0] - before) : to;
        gone_to = skips && before > 0.0 ? column(field, field->last[0] + before) : to;
        sum += cut_row(field, tool, j, from, gone_from < to ? gone_from : to, u, y - v, tip[2]);
        if (gone_to > from) from = gone_to;
        sum += cut_row(field, tool, j, from, to, u, y - v, tip[2]);
    }
    field->last[0] = u;
    field->last[1] = v;
    field->last[2] = tip[2];
    return sum * field->pitch * field->pitch;
}

/* Cuts along a straight step in parts of STEP: an end that is not flat would leave ridges between the periods' tips. */
static double cut_along(struct field *field, const struct cutter *tool, const double from[3], const double to[3])
{
    double length = sqrt(pow(to[0] - from[0], 2) + pow(to[1] - from[1], 2) + pow(to[2] - from[2], 2)), sum = 0.0,
           tip[3];
    int i, j, count = (int)ceil(length / STEP);
    for (j = 1; j <= count; j++) {
        for (i = 0; i < 3; i++) tip[i] = from[i] + (to[i] - from[i]) * j / count;
        sum += cut_field(field, tool, tip);
    }
    return sum;
}

/* ---- a path of lines and arcs that join smoothly ---- */

struct route {
    struct chip_segment segment[MOST_SEGMENTS];
    double begin[MOST_SEGMENTS + 1], most[MOST_SEGMENTS]; /* mm; mm/s */
    int count;
};

static void append(struct route *route, const struct chip_segment *segment, double most, double accel)
{
    route->segment[route->count] = *segment;
    route->segment[route->count].accel = accel;
    route->segment[route->count].join = CHIP_JOIN_TANGENT;
    route->most[route->count] = most;
    route->begin[route->count + 1] = route->begin[route->count] + segment->length;
    route->count++;
}

/* From outside the box at `depth` into it and about; `slope`: mm per mm that its lines fall by. */
static void make_route(struct route *route, double depth, double slope, double accel, int corners)
{
    double at[3] = { -SIZE[0] / 2 - 0.2 * SIZE[0], uniform(-0.25, 0.25) * SIZE[0], -depth },
           heading = uniform(-0.3, 0.3), dir[3], end[3];
    struct chip_segment segment;
    int i;
    memset(route, 0, sizeof *route);
    for (i = 0; i <= corners; i++) {
        static const double radii[] = { 0.07, 0.31, 1.3, 4.7 };
        double length = i ? uniform(0.03, 0.36) * SIZE[0] : uniform(0.26, 0.65) * SIZE[0], radius = radii[one_of(4)],
               turn = uniform(0.3, 2.6);
        end[0] = at[0] + length * cos(heading);
        end[1] = at[1] + length * sin(heading);
        end[2] = fmax(at[2] - (i ? slope * length : 0.0), -SIZE[2] + 0.5);
        chip_segment_line(&segment, at, end);
        append(route, &segment, CEILING, accel);
        if (i == corners) break;
        /* towards the middle of the box */
        if (sin(atan2(-end[1], -end[0]) - heading) < 0.0) turn = -turn;
        {
            double centre[2] = { end[0] - copysign(radius, turn) * sin(heading),
                                 end[1] + copysign(radius, turn) * cos(heading) };
            chip_segment_arc(&segment, centre, end, turn, 0.0);
        }
        append(route, &segment, sqrt(0.5 * accel * radius), 0.5 * accel);
        chip_segment_at(&segment, segment.length, at, dir);
        heading += turn;
    }
}

/* Largest velocity at s so that every later limit can be kept. */
static double planner_limit(const struct route *route, int now, double s)
{
    double most = route->most[now], room = 0.0, from = s;
    int i;
    for (i = now; i < route->count; i++) {
        double limit = i + 1 < route->count ? route->most[i + 1] : 0.0;
        room += 2.0 * route->segment[i].accel * (route->begin[i + 1] - from);
        from = route->begin[i + 1];
        most = fmin(most, sqrt(limit * limit + room));
        if (room > CEILING * CEILING) break;
    }
    return most;
}

/* ---- one scene ---- */

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

static void step(struct chip_stock *stock, const double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) in.pos_mu[i] = tip[i];
    chip_tracker_step(&tracker, stock, &in, &out);
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
