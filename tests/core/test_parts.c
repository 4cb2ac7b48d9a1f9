/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A round end's level steps, done in parts (components/core/tracker_cut.c, work_to_cut): the map lags by a few periods and no more, nothing is
 * left uncut, and a traverse behind the feed is checked. */
#include <math.h>

#include "one_tracker.h"

#define ACCEL 500.0 /* mm/s2 */

static const double SIZE[3] = { 90.0, 40.0, 12.0 };
static double lag; /* periods, the largest */

/* A level feed in Y, too, at so many mm a period. */
static void feed(double x, double y, double step)
{
    double x0 = in.pos_mu[0], y0 = in.pos_mu[1], length = hypot(x - x0, y - y0);
    int i, count = (int)ceil(length / step);
    in.motion = 2;
    for (i = 1; i <= count; i++) {
        in.pos_mu[0] = x0 + (x - x0) * i / count;
        in.pos_mu[1] = y0 + (y - y0) * i / count;
        periods(1);
        lag = fmax(lag, hypot(in.pos_mu[0] - tracker.sweep.at[0], in.pos_mu[1] - tracker.sweep.at[1]) / step);
    }
}

static void begin(double diameter, double corner, double angle, double z)
{
    const double at[3] = { -15.3, 11.7, 5.0 };
    int i;
    define(0.25, SIZE, diameter, at);
    in.tool_corner_radius_mu = corner;
    in.tool_tip_angle_deg = angle;
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = ACCEL;
    go(-15.3, z, 60);
    lag = 0.0;
}

/* A bend of chords, and back beside it. */
static double bent_cut(double diameter, double corner, double angle, double step, int whole)
{
    int i;
    begin(diameter, corner, angle, -3.17);
    for (i = 0; i <= 60; i++) {
        double turn = 0.013 * i;
        if (whole) feed(-10.0 + 1.3 * i, 11.7 + 9.0 * sin(turn), 1000.0); /* a step of a chord, and then it rests */
        if (whole) periods(400);
        if (!whole) feed(-10.0 + 1.3 * i, 11.7 + 9.0 * sin(turn), step);
    }
    periods(50);
    expect(tracker.sweep.waiting == 0, "all is cut at rest");
    return out.removed_volume_mm3;
}

/* A traverse from rest to x, level; returns mm from the place where the guard stops it to `wall`, less its braking distance. */
static double room_before(double wall, double x)
{
    double speed = 0.0, left = x - in.pos_mu[0], met = -1e9;
    in.motion = 1;
    while (left > 1e-6 && met < -1e8) {
        speed = fmin(fmin(speed + ACCEL * 0.001, 120.0), sqrt(2.0 * ACCEL * left));
        left -= fmin(left, speed * 0.001);
        in.pos_mu[0] = x - left;
        in.distance_to_go_mu = left;
        periods(1);
        if (out.has_rapid_contact) met = wall - in.pos_mu[0] - 0.5 * speed * speed / ACCEL;
    }
    return met;
}

/* A slot into the box and back out of it again, then a traverse into what is left beside its end. */
static void traverse_behind_a_feed(double diameter, double corner, double pause)
{
    double room;
    begin(diameter, corner, 0.0, -3.17);
    feed(30.0, 11.7, 0.1);
    feed(20.0, 11.7, 0.1);
    periods((int)pause);
    room = room_before(30.0, 80.0);
    expect(room > 0.0 && room < 12.0, "a traverse into the end of its slot");
    begin(diameter, corner, 0.0, -3.17);
    feed(30.0, 11.7, 0.1);
    feed(-10.0, 11.7, 0.1);
    expect(room_before(0.0, 30.0 - 0.3) < -1e8, "a traverse within its slot");
}

int main(void)
{
    static const double tools[][3] = {
        { 6.0, 3.0, 0.0 }, { 12.7, 6.35, 0.0 }, { 10.0, 2.0, 0.0 }, { 8.0, 0.0, 90.0 }, { 6.0, 0.5, 20.0 }
    };
    static const double steps[] = { 0.011, 0.05, 0.1, 0.173 };
    unsigned i, k;
    for (i = 0; i < sizeof tools / sizeof *tools; i++) {
        double whole = bent_cut(tools[i][0], tools[i][1], tools[i][2], 0.0, 1);
        for (k = 0; k < sizeof steps / sizeof *steps; k++) {
            double cut = bent_cut(tools[i][0], tools[i][1], tools[i][2], steps[k], 0);
            printf("D%g corner %g, %g mm a period: lag %.1f periods, volume %.6f\n", tools[i][0], tools[i][1], steps[k],
                   lag, cut / whole);
            expect(lag < 3.0 * CHIP_WORK_PARTS + 1.0, "lags by a few periods");
            expect(fabs(cut / whole - 1.0) < 3e-4, "nothing is left");
        }
    }
    traverse_behind_a_feed(6.0, 3.0, 0.0);
    traverse_behind_a_feed(10.0, 2.0, 0.0);
    traverse_behind_a_feed(12.7, 6.35, 1.0);
    if (!failures) printf("parts: every case as it must be\n");
    free(stock);
    return failures != 0;
}
