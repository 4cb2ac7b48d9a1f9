/* A map that lags behind the tool (components/core/tracker.c, [4] and [6]): what waits is cut, whatever comes next.
 *
 * A large tool on fine cells falls along a ramp faster than a period's bound lets it be cut; then cutting is switched off and the
 * tool is jogged away. The stock must be the same as where the tool just stood until all was cut.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/tracker.h"

static struct cw_tracker tracker;
static struct cw_stock *stock;
static struct cw_tracker_in in;
static struct cw_tracker_out out;
static int failures;

static void expect(int good, const char *what)
{
    if (good) return;
    printf("%s: waiting %d, fault %d, removed %.4f mm3\n", what, tracker.sweep.waiting, out.code, out.removed_mm3);
    failures++;
}

static void periods(int count)
{
    while (count-- > 0) cw_tracker_step(&tracker, stock, &in, &out);
}

static void go(double x, double z, int count)
{
    double x0 = in.axis[0], z0 = in.axis[2];
    int i;
    for (i = 1; i <= count; i++) {
        in.axis[0] = x0 + (x - x0) * i / count;
        in.axis[2] = z0 + (z - z0) * i / count;
        periods(1);
    }
}

/* The ramp in a box of 80 x 40 x 10 mm; the tool stands at its end. */
static void ramp(void)
{
    uint32_t cells = cw_stock_cells(0.1, 80, 40);
    free(stock);
    stock = malloc(cw_stock_bytes(cells));
    memset(stock, 0, cw_stock_bytes(cells));
    cw_stock_init(stock, 0.1, cells);
    cw_tracker_init(&tracker);
    memset(&in, 0, sizeof in);
    in.unit = 1.0;
    in.period = 0.001;
    in.window = 0.02;
    in.accel = 500.0;
    in.tool_size[0] = 25.0;
    in.cutting = 1;
    in.motion = 2;
    in.axis[0] = 20.0;
    in.axis[1] = 20.0;
    in.axis[2] = 1.0;
    in.box_max[0] = 80.0;
    in.box_max[1] = 40.0;
    in.box_min[2] = -10.0;
    in.request = 1;
    periods(200);
    in.request = 0;
    expect(out.is_ready, "the stock is defined");
    go(50.0, -4.0, 300);
    expect(tracker.sweep.waiting > 0, "the map lags behind a falling tool of 25 mm");
    expect(tracker.sweep.waiting < CW_SWEEP_QUEUE, "and the queue is not full");
}

int main(void)
{
    double all;

    ramp();
    periods(100);
    expect(tracker.sweep.waiting == 0, "caught up");
    all = out.removed_mm3;

    ramp();
    in.cutting = 0;                     /* jogged away, through the stock */
    go(50.0, 5.0, 40);
    go(20.0, 5.0, 40);
    expect(tracker.sweep.waiting == 0 && fabs(out.removed_mm3 - all) < 1e-9 * all, "cutting off while legs wait");

    ramp();
    in.cutting = 0;                     /* off for one period, and on again elsewhere: no way between */
    in.axis[0] = 20.5;
    in.axis[2] = 5.0;
    periods(1);
    in.cutting = 1;
    periods(60);
    expect(tracker.sweep.waiting == 0 && fabs(out.removed_mm3 - all) < 1e-9 * all, "off for one period");

    if (!failures) printf("lag: every case as it must be\n");
    free(stock);
    return failures != 0;
}
