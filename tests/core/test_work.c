/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A slow computer does a part of a period's work (components/core/tracker.h, 6): the map lags more and nothing is left uncut; a traverse
 * is checked as with all of it. */
#include <math.h>

#include "one_tracker.h"

static const double SIZE[3] = { 90.0, 40.0, 12.0 };
static int late; /* periods at rest until all is cut */

/* A ramp of 25 mm down, with so much of the work; returns mm3 at rest after it. */
static double ramp(double corner, int percent)
{
    static const double at[3] = { 20.0, 20.0, 1.0 };
    int i;
    define(0.1, SIZE, 25.0, at);
    chip_tracker_set_work(&tracker, percent);
    in.tool_corner_radius_mu = corner;
    late = 0;
    for (i = 1; i <= 300; i++) {
        in.pos_mu[0] = 20.0 + 0.1 * i;
        in.pos_mu[2] = 1.0 - 5.0 * i / 300.0;
        periods(1);
    }
    while (tracker.sweep.waiting > 0 && late++ < 3000) periods(1);
    expect(tracker.sweep.waiting == 0, "all is cut at rest");
    return out.removed_volume_mm3;
}

static void nothing_is_left(double corner, int percent)
{
    double all = ramp(corner, 100), part;
    int was_late = late;
    part = ramp(corner, percent);
    expect(late > 3 * was_late / 2, "with less work it is later");
    expect(fabs(part - all) < 1e-3 * all, "and the same is cut");
}

/* Periods until a new stock is there. */
static int filling(int percent)
{
    int count = 0;
    in.define_request = 0;
    periods(1);
    chip_tracker_set_work(&tracker, percent);
    in.define_request = 1;
    do {
        periods(1);
        count++;
    } while (!out.is_ready && count < 10000);
    return count;
}

/* A traverse into a wall 30 mm away, at 400 mm/s at most, braked when the guard says so; returns where it stops before the wall, mm. */
static double traverse(int percent)
{
    static const double at[3] = { -15.0, 20.0, -3.0 };
    double speed = 0.0, x = -15.0;
    int hit = 0, i;
    define(0.1, SIZE, 20.0, at);
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = 5000.0;
    in.acceleration_mu_s2 = 5000.0;
    go(-60.0, -3.0, 200);
    chip_tracker_set_work(&tracker, percent);
    in.motion = 1;
    x = -60.0;
    for (i = 0; i < 2000 && (!hit || speed > 0.0); i++) {
        if (out.has_rapid_contact) hit = 1;
        speed = hit ? fmax(0.0, speed - 5.0) : fmin(400.0, speed + 5.0);
        x += 0.001 * speed;
        in.pos_mu[0] = x;
        in.distance_to_go_mu = 80.0 - x;
        periods(1);
    }
    expect(hit, "the traverse is stopped");
    return -10.0 - x;
}

int main(void)
{
    double all = traverse(100);
    expect(all > 0.0, "before the wall");
    expect(traverse(CHIP_WORK_MIN_PERCENT) == all, "at the same place with less work");
    nothing_is_left(0.0, 25);
    nothing_is_left(12.5, 50);
    expect(filling(100) * 3 < filling(25), "filling is work, too");
    chip_tracker_set_work(&tracker, 0);
    expect(tracker.work_percent == CHIP_WORK_MIN_PERCENT, "no less than that");
    chip_tracker_set_work(&tracker, 1000);
    expect(tracker.work_percent == 100, "nor more than all");
    printf(failures ? "%d FAILED\n" : "ok\n", failures);
    return failures != 0;
}
