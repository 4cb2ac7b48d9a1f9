/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A map that lags behind the tool (components/core/tracker.c, [4] and [6]): what waits is cut, whatever comes next.
 *
 * A large tool on fine cells falls along a ramp faster than a period's bound lets it be cut; then cutting is switched off and the
 * tool is jogged away. The stock must be the same as where the tool just stood until all was cut.
 */
#include <math.h>

#include "one_tracker.h"

/* The ramp in a box of 80 x 40 x 10 mm; the tool stands at its end. */
static void ramp(void)
{
    static const double size[3] = { 80.0, 40.0, 10.0 }, at[3] = { 20.0, 20.0, 1.0 };
    define(0.1, size, 25.0, at);
    go(50.0, -4.0, 300);
    expect(tracker.sweep.waiting > 0, "the map lags behind a falling tool of 25 mm");
    expect(tracker.sweep.waiting < CHIP_SWEEP_QUEUE, "and the queue is not full");
}

/* A flat tool with as many cells across as it may have goes down a ramp, turns and goes on down over it, comes up, and traverses
 * back over what is cut at once. */
static void many_cells_across(double diameter, double cell, double slope, double step)
{
    static const double size[3] = { 120.0, 60.0, 20.0 }, at[3] = { 20.3, 30.1, 0.7 };
    const double length = 57.1 / sqrt(1.0 + slope * slope);
    double speed = 0.0, left = length;
    int i, half, count = (int)(57.1 / step), most = 0;
    define(cell, size, diameter, at);
    for (i = 0; i < 3; i++) in.axis_acceleration_mu_s2[i] = 500.0;
    for (half = 0; half < 2; half++)
        for (i = 1; i <= count; i++) {
            in.pos_mu[0] = at[0] + length * (half ? count - i : i) / count;
            in.pos_mu[2] = at[2] - 0.5 * slope * length * (half + (double)i / count);
            periods(1);
            most = tracker.sweep.waiting > most ? tracker.sweep.waiting : most;
        }
    expect(most > 0 && most <= 3, "a ramp lags by three periods at most");
    in.motion = 1;
    go(at[0], 2.0, 40);
    while (left > 1e-6 && !out.has_rapid_contact) {
        speed = fmin(fmin(speed + 0.5, 120.0), sqrt(1000.0 * left));
        left -= fmin(left, speed * 0.001);
        in.pos_mu[0] = at[0] + length - left;
        in.distance_to_go_mu = left;
        periods(1);
    }
    expect(!out.has_rapid_contact, "a traverse over what is cut");
}

int main(void)
{
    static const double slopes[] = { 0.02, 0.1, 0.36, 0.8 };
    unsigned i;
    double all;

    ramp();
    periods(100);
    expect(tracker.sweep.waiting == 0, "caught up");
    all = out.removed_volume_mm3;

    ramp();
    in.is_enabled = 0; /* jogged away, through the stock */
    go(50.0, 5.0, 40);
    go(20.0, 5.0, 40);
    expect(tracker.sweep.waiting == 0 && fabs(out.removed_volume_mm3 - all) < 1e-9 * all,
           "cutting off while moves wait");

    ramp();
    in.is_enabled = 0; /* off for one period, and on again elsewhere: no way between */
    in.pos_mu[0] = 20.5;
    in.pos_mu[2] = 5.0;
    periods(1);
    in.is_enabled = 1;
    periods(60);
    expect(tracker.sweep.waiting == 0 && fabs(out.removed_volume_mm3 - all) < 1e-9 * all, "off for one period");

    for (i = 0; i < sizeof slopes / sizeof *slopes; i++) {
        many_cells_across(12.0, 0.125, slopes[i], 0.1);
        many_cells_across(23.7, 0.25, slopes[i], 0.173);
        many_cells_across(9.6, 0.1, slopes[i], 0.03);
    }

    if (!failures) printf("lag: every case as it must be\n");
    free(stock);
    return failures != 0;
}
