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

int main(void)
{
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

    if (!failures) printf("lag: every case as it must be\n");
    free(stock);
    return failures != 0;
}
