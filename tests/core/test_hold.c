/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The map in another program's hands: what the tracker makes of it afterwards (components/core/tracker.c, [2]).
 *
 * A block is written, killed in the middle, or left alone while the tool stands or goes on; no cut may be missing from a stock
 * that is said to be known.
 */
#include "one_tracker.h"

/* A slot of 6 mm is begun in a box of 40 x 20 x 10 mm. */
static void begin(void)
{
    static const double size[3] = { 40.0, 20.0, 10.0 }, at[3] = { -10.0, 10.0, 5.0 };
    define(0.25, size, 6.0, at);
    go(-10.0, -2.0, 100);
    go(10.0, -2.0, 100);
    expect(out.is_ready && out.removed_volume_mm3 > 100.0, "the slot is begun");
}

static void hold(int on)
{
    in.external_writer = on;
    periods(3);
    if (on) expect(out.is_held && !out.is_ready, "held");
}

/* Nobody writes: the machine stands, goes on, is jogged, or has moves that still wait. */
static void nobody_writes(void)
{
    double before;

    begin(); /* nobody writes, nothing moves: the stock is what it was */
    before = out.removed_volume_mm3;
    hold(1);
    hold(0);
    expect(out.is_ready && out.fault_number == 0 && out.removed_volume_mm3 == before, "left alone");

    begin(); /* the machine goes on: the cut is missing, the stock not known */
    hold(1);
    go(20.0, -2.0, 100);
    hold(0);
    expect(!out.has_stock && out.fault_number == CHIP_FAULT_MAP, "gone on under hold");
    in.define_request = 1;
    periods(20);
    expect(out.is_ready && out.fault_number == 0, "defined again");

    begin(); /* jogging cuts nothing */
    hold(1);
    in.is_enabled = 0;
    go(20.0, -2.0, 100);
    go(10.0, -2.0, 100);
    in.is_enabled = 1;
    hold(0);
    expect(out.is_ready && out.fault_number == 0, "jogged under hold");

    begin(); /* moves that still waited are missing where nobody writes */
    tracker.sweep.waiting = 1;
    hold(1);
    hold(0);
    expect(!out.has_stock && out.fault_number == CHIP_FAULT_MAP, "moves waiting");
}

/* A writer is killed before its end, or finishes. */
static void somebody_writes(void)
{
    begin(); /* killed while writing: the generation is odd */
    hold(1);
    stock->generation++;
    stock->nx = 0;
    hold(0);
    expect(!out.has_stock && out.fault_number == CHIP_FAULT_MAP && stock->generation % 2 == 0, "killed while writing");

    begin(); /* the same, after the head was written */
    hold(1);
    stock->generation++;
    hold(0);
    expect(!out.has_stock && out.fault_number == CHIP_FAULT_MAP, "killed before the end");

    begin(); /* written to the end */
    hold(1);
    stock->generation++;
    stock->removed = 1.0;
    stock->generation++;
    hold(0);
    expect(out.is_ready && out.fault_number == 0 && out.removed_volume_mm3 == 1.0, "written to the end");
}

int main(void)
{
    nobody_writes();
    somebody_writes();
    if (!failures) printf("hold: every case as it must be\n");
    return failures != 0;
}
