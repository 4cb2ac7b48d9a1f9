/* SPDX-License-Identifier: GPL-2.0-or-later */
/* How high a segment leaves a point (components/core/sweep_lowest.c), against the lowest of many places on it, for tools of all shapes,
 * segments that rise and fall, and points everywhere below them. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/sweep_segment.h"
#include "random_numbers.h"

#define PLACES 400
#define TOO_HIGH 2.1e-5 /* mm; 2e-5 in the core, and what doubles lose where a profile is next to vertical */
#define TOO_LOW 1e-9
#define NO_SEARCH 18 /* work of a point whose lowest place is at an end */

static long work, failures;

static double uniform(double low, double high) { return low + (high - low) * chance(); }

/* Height of the tool's surface over a point, written apart from profile(). */
static double height(const struct chip_tool *tool, double r)
{
    double d;
    if (r <= tool->r_flat) return 0.0;
    if (r > tool->r_arc) return tool->arc_top + (r - tool->r_arc) * tool->slope;
    d = r - tool->r_flat;
    return tool->corner - sqrt(fmax(0.0, tool->corner * tool->corner - d * d));
}

static double over(const struct chip_sweep_segment *s, const struct chip_tool *tool, double px, double py, double t)
{
    double r = hypot(px - t * s->dx, py - t * s->dy);
    return r <= tool->radius ? s->z + t * s->dz + height(tool, r) : 1e9;
}

/* The lowest of many places, and of many between those next to it, again and again. */
static double lowest(const struct chip_sweep_segment *s, const struct chip_tool *tool, double px, double py)
{
    double lo = s->earliest, hi = 1.0, best = 1e9, at = lo;
    int i, round;
    for (round = 0; round < 6; round++) {
        double step = (hi - lo) / PLACES;
        for (i = 0; i <= PLACES; i++) {
            double z = over(s, tool, px, py, lo + i * step);
            if (z < best) {
                best = z;
                at = lo + i * step;
            }
        }
        lo = fmax(s->earliest, at - step);
        hi = fmin(1.0, at + step);
    }
    return best;
}

static void random_tool(struct chip_tool *tool)
{
    double diameter = exp(uniform(log(0.4), log(50.0)));
    double kind = uniform(0, 4), corner = 0.5 * diameter, angle = 0.0;
    if (kind < 1) corner *= uniform(0.02, 0.98);
    if (kind > 2) angle = uniform(20.0, 150.0);
    if (kind > 2) corner = kind > 3 ? 0.0 : 0.5 * diameter * uniform(0.05, 0.9);
    if (chip_tool_init(tool, diameter, corner, angle, 0.0) != CHIP_TOOL_OK) printf("no tool: %ld\n", ++failures);
}

static struct chip_sweep_segment random_segment(const struct chip_tool *tool)
{
    struct chip_sweep_segment s;
    double turn = uniform(0, 2 * CHIP_PI), rise = exp(uniform(log(1e-5), log(20.0)));
    memset(&s, 0, sizeof s);
    s.length = exp(uniform(log(1e-3), log(4.0)));
    s.z = -3.0;
    s.dx = s.length * cos(turn);
    s.dy = s.length * sin(turn);
    s.dz = s.length * (uniform(0, 1) < 0.5 ? rise : -rise);
    s.length2 = s.dx * s.dx + s.dy * s.dy;
    s.per_length2 = 1.0 / s.length2;
    s.earliest = uniform(0, 1) < 0.5 ? 0.0 : -uniform(0, 0.4) / s.length;
    s.reach = tool->radius;
    s.work = &work;
    return s;
}

/* A point below a place of the segment, and the place. */
static void random_point(const struct chip_sweep_segment *s, double radius, double *px, double *py)
{
    double r = radius * sqrt(chance()), turn = uniform(0, 2 * CHIP_PI), t = uniform(s->earliest, 1.0);
    *px = t * s->dx + r * cos(turn);
    *py = t * s->dy + r * sin(turn);
}

int main(void)
{
    long i, count = random_begin(20000), searched = 0, most_work = 0;
    double worst = 0.0;
    for (i = 0; i < count; i++) {
        struct chip_tool tool;
        struct chip_sweep_segment s;
        double px, py, found, true_height;
        random_tool(&tool);
        s = random_segment(&tool);
        random_point(&s, tool.radius, &px, &py);
        work = 0;
        found = chip_sweep_lowest(&s, &tool, px, py, nearest_on(&s, px, py));
        true_height = lowest(&s, &tool, px, py);
        searched += work > NO_SEARCH;
        most_work = work > most_work ? work : most_work;
        worst = fmax(worst, found - true_height);
        if (found >= true_height - TOO_LOW && found <= true_height + TOO_HIGH) continue;
        if (failures++ > 10) continue;
        printf(
            "CHIPWISE_SEED=%lu case %ld: %.9f, the lowest is %.9f\n  tool: radius %.17g corner %.17g flat %.17g slope "
            "%.17g\n  segment: %.17g %.17g %.17g, earliest %.17g; point %.17g %.17g\n",
            start_seed, i, found, true_height, tool.radius, tool.corner, tool.r_flat, tool.slope, s.dx, s.dy, s.dz,
            s.earliest, px, py);
    }
    if (searched < count / 10) printf("%ld points searched: %ld\n", searched, ++failures);
    printf("%ld points, %ld searched, at most %.3g mm too high, most work %ld, %ld failures\n", count, searched, worst,
           most_work, failures);
    return failures != 0;
}
