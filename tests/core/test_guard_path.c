/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Traverses that go over into one another (components/core/guard.h, [5]): stock behind an arc and behind a parabolic blend stops the tool
 * before it, and a traverse that ends before the stock is never stopped. */
#include <math.h>

#include "one_tracker.h"

#define PERIOD 0.001
#define ACCEL 500.0 /* mm/s2, of which a blend has half */
#define RADIUS 3.0
#define CELL 0.25
#define Y 10.0 /* mm, of the traverse toward the box */

static struct chip_segment segments[3];

/* The traverses' box, a corner at X0 Y0 Z0; the tool stands at `at`. */
static void begin(const double at[3])
{
    static const double size[3] = { 20.0, 20.0, 10.0 };
    int i;
    define(CELL, size, 2.0 * RADIUS, at);
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = ACCEL;
    in.acceleration_mu_s2 = ACCEL;
    in.motion = 1;
    chip_path_reset(&tracker.path);
}

/* Along +Y, by an arc of 90 degrees, then along +X from x to `end`, at a constant speed. -> mm left to the stock where the guard stops
 * the tool, -1: nowhere; *on_arc: it was stopped before the last line. */
static double by_an_arc(double x, double end, double speed, int *on_arc)
{
    const double turn = 2.0, centre[2] = { x, Y - turn }, first[3] = { x - turn, -30.0, -5.0 },
                 corner[3] = { x - turn, Y - turn, -5.0 }, last[3] = { x, Y, -5.0 }, there[3] = { end, Y, -5.0 };
    double s, before = 0.0;
    int n = 0, i;
    begin(first);
    expect(chip_segment_line(&segments[0], first, corner)
               && chip_segment_arc(&segments[1], centre, corner, -0.5 * M_PI, 0.0)
               && chip_segment_line(&segments[2], last, there),
           "segments");
    for (i = 0; i < 3; i++) {
        segments[i].rapid = 1;
        segments[i].accel = ACCEL;
        segments[i].join = i < 2 ? CHIP_JOIN_TANGENT : CHIP_JOIN_STOP;
    }
    tracker.path.known = 1;
    for (s = speed * PERIOD;; s += speed * PERIOD) {
        double tip[3], dir[3];
        while (n < 2 && s - before > segments[n].length) before += segments[n++].length;
        if (s - before >= segments[n].length) return -1.0;
        chip_path_follow(&tracker.path, n + 1, segments[n].length, s - before);
        for (i = n + tracker.path.count; i < 3; i++) chip_path_append(&tracker.path, i + 1, &segments[i]);
        chip_segment_at(&segments[n], s - before, tip, dir);
        for (i = 0; i < 3; i++) in.pos_mu[i] = tip[i];
        in.distance_to_go_mu = segments[n].length - (s - before);
        periods(1);
        if (out.has_rapid_contact) {
            *on_arc = n < 2;
            return -RADIUS - x + (n < 2 ? hypot(tip[0] - x, tip[1] - Y) : x - tip[0]);
        }
    }
}

/* Along +Y and, blended by a parabola, along +X from the corner at x to `end`. As by_an_arc(); *on_arc: it was stopped in the blend. */
static double by_a_parabola(double x, double end, double speed, int *on_arc)
{
    const double time = speed / (0.5 * ACCEL), first[3] = { x, -30.0, -5.0 };
    struct chip_blend *blend = &tracker.path.blend;
    double t = PERIOD, straight = Y + 30.0 - 0.5 * speed * time;
    begin(first);
    for (;; t += PERIOD) {
        double gone = t * speed, into = t - straight / speed;
        blend->active = into > 0.0 && into < time;
        if (into <= 0.0) {
            in.pos_mu[1] = first[1] + gone;
            in.distance_to_go_mu = Y - in.pos_mu[1];
        } else {
            double left = fmax(1.0 - into / time, 0.0), faster = fmin(into, time);
            blend->start[0] = x;
            blend->start[1] = Y;
            blend->start[2] = first[2];
            blend->dir[0] = 1.0;
            blend->dir[1] = blend->dir[2] = 0.0;
            blend->length = end - x;
            blend->speed = 0.5 * ACCEL * faster;
            blend->end_speed = speed;
            blend->first_left = 0.5 * speed * time * left * left;
            blend->first_speed = speed * left;
            blend->travelled = 0.25 * ACCEL * faster * faster + speed * fmax(into - time, 0.0);
            in.pos_mu[0] = x + blend->travelled;
            in.pos_mu[1] = Y - blend->first_left;
            in.distance_to_go_mu = blend->active ? blend->first_left : blend->length - blend->travelled;
            if (blend->travelled >= blend->length) return -1.0;
        }
        tracker.path.known = 1;
        periods(1);
        if (out.has_rapid_contact) {
            *on_arc = blend->active;
            return -RADIUS - in.pos_mu[0];
        }
    }
}

/* Stock close behind the corner, far behind it, and none before the end. */
static void check(const char *what, double (*path)(double, double, double, int *))
{
    static const double speeds[] = { 20.0, 60.0, 100.0 };
    char text[100];
    int i, early = 0, on_arc;
    for (i = 0; i < 3; i++) {
        double speed = speeds[i], brakes = 0.5 * speed * speed / ACCEL, left;
        snprintf(text, sizeof text, "%s at %g mm/s", what, speed);
        left = path(-RADIUS - 1.2 * brakes - 1.0, 15.0, speed, &on_arc);
        expect(left > 0.0, text);
        early += on_arc;
        left = path(-60.0, 15.0, speed, &on_arc);
        expect(left > brakes && left < 2.0 * brakes + 4.0 * speed * PERIOD + 2.0 && !on_arc, text);
        /* it ends where the planner, which brakes with all of its acceleration, may still begin to */
        expect(path(-60.0, -RADIUS - 1.2 * brakes - 6.0 * speed * PERIOD - 0.5, speed, &on_arc) < 0.0, text);
    }
    expect(early > 0, "stock close behind the corner is seen in it");
}

int main(void)
{
    check("an arc", by_an_arc);
    check("a parabola", by_a_parabola);
    printf("%d failures\n", failures);
    return failures != 0;
}
