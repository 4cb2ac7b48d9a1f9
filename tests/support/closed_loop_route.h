/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Random routes of closed_loop.c: lines and arcs that join smoothly, from outside the box into it and about. */
#ifndef CHIPWISE_TESTS_CLOSED_LOOP_ROUTE_H
#define CHIPWISE_TESTS_CLOSED_LOOP_ROUTE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "closed_loop_field.h"
#include "core/path.h"

#define CEILING 83.0 /* mm/s */
#define MOST_SEGMENTS 40

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

#endif
