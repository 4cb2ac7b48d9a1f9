/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Clamps and the tracker (components/core/tracker_clamps.c): they count with or without a stock, on every move but a probe's, in manual mode never;
 * without any the tracker does what it did, bit for bit.
 */
#include "one_tracker.h"

static const double SIZE[3] = { 40.0, 20.0, 10.0 }, BEFORE[3] = { -60.0, 10.0, -5.0 };
static struct chip_clamp_table table;
static int clamp_then, part_then; /* when the contact was seen first */

/* A block round X20 Y10, 40 mm wide, up to Z0. */
static void put_block(void)
{
    memset(&table, 0, sizeof table);
    table.generation = 2;
    table.count = 1;
    table.clearance = 1.0;
    table.clamp[0].x = 20.0;
    table.clamp[0].y = 10.0;
    table.clamp[0].half_x = 20.0;
    table.clamp[0].half_y = 10.0;
    table.clamp[0].cosine = 1.0;
    in.clamps = &table;
}

/* From X-60 to X0 at Z, mm; -> X at which the contact is seen first, 1000: it is not. */
static double stopped_at(int motion, int is_enabled)
{
    double seen = 1000.0;
    int i;
    in.motion = 0;
    in.is_enabled = 1;
    in.pos_mu[0] = -60.0;
    periods(3);
    in.pos_mu[2] = -5.0;
    periods(3);
    in.motion = motion;
    in.is_enabled = is_enabled;
    for (i = 0; i < 1200; i++) {
        in.pos_mu[0] = -60.0 + 0.05 * i;
        periods(1);
        if (!out.has_clamp_contact || seen != 1000.0) continue;
        seen = in.pos_mu[0];
        clamp_then = out.met_clamp;
        part_then = out.met_part;
    }
    return seen;
}

static void every_move(void)
{
    double at;
    int motion;
    define(0.25, SIZE, 6.0, BEFORE);
    put_block();
    for (motion = 1; motion <= 6; motion++) {
        at = stopped_at(motion, 1);
        if (motion == 5)
            expect(at == 1000.0, "a probe may touch a clamp");
        else
            expect(at < -4.0 && at > -12.0, "a move is stopped before a clamp");
        expect(motion == 5 || (clamp_then == 1 && part_then == 0), "by the tool, before clamp 1");
    }
    expect(stopped_at(2, 0) == 1000.0, "nothing is stopped in manual mode");
    expect(out.clamps_in_force == 1 && out.tables_taken == 1, "the table is taken over");
    in.tool_diameter_mu = 0.0;
    at = stopped_at(2, 1);
    expect(at < -1.0 && at > -9.0, "of a tool without a diameter the axis counts");
    in.tool_diameter_mu = 6.0;
    in.tool_holder_diameter_mu = 30.0;
    in.tool_stick_out_mu = 4.0;
    at = stopped_at(2, 1);
    expect(at < -16.0 && part_then == 1, "the holder is stopped before the tool is");
}

static void without_a_stock(void)
{
    define(0.25, SIZE, 6.0, BEFORE);
    chip_tracker_init(&tracker);
    chip_stock_init(stock, 0.25, stock->capacity);
    put_block();
    expect(stopped_at(1, 1) < -4.0 && !out.has_stock, "a clamp counts without a stock");
}

static void tables(void)
{
    define(0.25, SIZE, 6.0, BEFORE);
    put_block();
    periods(1);
    table.generation = 4;
    table.clamp[0].top = 0.0 / table.clamp[0].top;
    periods(1);
    expect(out.tables_taken == -1 && out.clamps_in_force == 1, "a table with NaN is refused");
    expect(stopped_at(2, 1) < -4.0, "and the one before stays in force");
    table.generation = 5;
    table.count = 0;
    periods(1);
    expect(out.clamps_in_force == 1, "one that is being written is not looked at");
    table.generation = 6;
    periods(1);
    expect(out.clamps_in_force == 0 && out.tables_taken == 3 && stopped_at(2, 1) == 1000.0, "none are in force");
}

/* The same cut with no table, and with an empty one. */
static void none_is_nothing(void)
{
    struct chip_tracker_out first;
    double removed;
    define(0.25, SIZE, 6.0, BEFORE);
    in.motion = 2;
    go(50.0, -3.0, 900);
    first = out;
    removed = out.removed_volume_mm3;
    define(0.25, SIZE, 6.0, BEFORE);
    memset(&table, 0, sizeof table);
    table.generation = 2;
    in.clamps = &table;
    in.motion = 2;
    go(50.0, -3.0, 900);
    first.tables_taken = out.tables_taken;
    expect(removed > 100.0 && !memcmp(&first, &out, sizeof out), "without clamps the same, bit for bit");
}

int main(void)
{
    every_move();
    without_a_stock();
    tables();
    none_is_nothing();
    free(stock);
    if (!failures) printf("clamps: every case as it must be\n");
    return failures != 0;
}
