/* The map in another program's hands: what the tracker makes of it afterwards (components/core/tracker.c, [2]).
 *
 * A block is written, killed in the middle, or left alone while the tool stands or goes on; no cut may be missing from a stock
 * that is said to be known.
 */
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
    if (!good) {
        printf("%s: stock %d, ready %d, fault %d, removed %.3f mm3\n", what, out.has_stock, out.is_ready, out.code, out.removed_mm3);
        failures++;
    }
}

static void periods(int count)
{
    while (count-- > 0) cw_tracker_step(&tracker, stock, &in, &out);
}

static void go(double x, double z)
{
    int i;
    double x0 = in.axis[0], z0 = in.axis[2];
    for (i = 1; i <= 100; i++) {
        in.axis[0] = x0 + (x - x0) * i / 100;
        in.axis[2] = z0 + (z - z0) * i / 100;
        periods(1);
    }
}

/* A slot of 6 mm is begun in a box of 40 x 20 x 10 mm. */
static void begin(void)
{
    uint32_t cells = cw_stock_cells(0.25, 50, 30);
    free(stock);
    stock = malloc(cw_stock_bytes(cells));
    memset(stock, 0, cw_stock_bytes(cells));
    cw_stock_init(stock, 0.25, cells);
    cw_tracker_init(&tracker);
    memset(&in, 0, sizeof in);
    in.unit = 1.0;
    in.period = 0.001;
    in.window = 0.02;
    in.accel = 500.0;
    in.tool_size[0] = 6.0;
    in.cutting = 1;
    in.motion = 2;
    in.axis[0] = -10.0;
    in.axis[1] = 10.0;
    in.axis[2] = 5.0;
    in.box_max[0] = 40.0;
    in.box_max[1] = 20.0;
    in.box_min[2] = -10.0;
    in.request = 1;
    periods(20);
    in.request = 0;
    go(-10.0, -2.0);
    go(10.0, -2.0);
    expect(out.is_ready && out.removed_mm3 > 100.0, "the stock is defined and cut");
}

static void hold(int on)
{
    in.foreign = on;
    periods(3);
    if (on) expect(out.is_held && !out.is_ready, "held");
}

int main(void)
{
    double before;

    begin();                                    /* nobody writes, nothing moves: the stock is what it was */
    before = out.removed_mm3;
    hold(1);
    hold(0);
    expect(out.is_ready && out.code == 0 && out.removed_mm3 == before, "left alone");

    begin();                                    /* the machine goes on: the cut is missing, the stock not known */
    hold(1);
    go(20.0, -2.0);
    hold(0);
    expect(!out.has_stock && out.code == CW_FAULT_MAP, "gone on under hold");
    in.request = 1;
    periods(20);
    expect(out.is_ready && out.code == 0, "defined again");

    begin();                                    /* jogging cuts nothing */
    hold(1);
    in.cutting = 0;
    go(20.0, -2.0);
    go(10.0, -2.0);
    in.cutting = 1;
    hold(0);
    expect(out.is_ready && out.code == 0, "jogged under hold");

    begin();                                    /* killed while writing: the generation is odd */
    hold(1);
    stock->generation++;
    stock->nx = 0;
    hold(0);
    expect(!out.has_stock && out.code == CW_FAULT_MAP && stock->generation % 2 == 0, "killed while writing");

    begin();                                    /* the same, after the head was written */
    hold(1);
    stock->generation++;
    hold(0);
    expect(!out.has_stock && out.code == CW_FAULT_MAP, "killed before the end");

    begin();                                    /* written to the end */
    hold(1);
    stock->generation++;
    stock->removed = 1.0;
    stock->generation++;
    hold(0);
    expect(out.is_ready && out.code == 0 && out.removed_mm3 == 1.0, "written to the end");

    begin();                                    /* legs that still waited are missing where nobody writes */
    tracker.sweep.waiting = 1;
    hold(1);
    hold(0);
    expect(!out.has_stock && out.code == CW_FAULT_MAP, "legs waiting");

    if (!failures) printf("hold: every case as it must be\n");
    return failures != 0;
}
