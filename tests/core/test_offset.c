/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Tools measured with lengths (G43, G43.1, G43.2, G49, M6; components/core/tracker.h, [1]): another tool offset places the tool
 * anew. Whatever its size, it does not count as a jump of the machine, it cuts nothing, and no cut before or after it is lost.
 */
#include <math.h>

#include "one_tracker.h"

#define DIAMETER 6.0
#define PI 3.14159265358979323846

/* Tips and offsets go together: the axes do not move. */
static void offset(double x, double y, double z)
{
    in.tool_offset_mu[0] = x;
    in.tool_offset_mu[1] = y;
    in.tool_offset_mu[2] = z;
}

/* A box of 60 x 40 x 10 mm, a tool of 6 mm with its tip 5 mm over the place X5 Y20. */
static void begin(void)
{
    static const double size[3] = { 60.0, 40.0, 10.0 }, at[3] = { 5.0, 20.0, 5.0 };
    define(0.25, size, DIAMETER, at);
}

static double slot(double length, double depth)
{
    return depth * (DIAMETER * length + 0.25 * PI * DIAMETER * DIAMETER);
}

static void near(double value, double wanted, const char *what)
{
    if (fabs(value - wanted) <= 0.003 * wanted + 1e-9) return;
    printf("%s: %.4f mm3, wanted %.4f\n", what, value, wanted);
    failures++;
}

/* A slot 20 mm long and 2 mm deep, up, another offset, then one beside it 3 mm deep. */
static void change_between_cuts(double x, double y, double z)
{
    double before;
    begin();
    go(5.0, -2.0, 50);
    go(25.0, -2.0, 200);
    go(25.0, 5.0, 50);
    before = out.removed_volume_mm3;
    near(before, slot(20.0, 2.0), "first slot");
    offset(x, y, z);
    periods(1);
    expect(!out.has_fault && out.is_ready, "an offset does not count as a jump");
    periods(3);
    expect(out.removed_volume_mm3 == before, "an offset cuts nothing");
    go(25.0 + x, 5.0 + z, 1000);
    in.pos_mu[1] += 12.0 + y;
    expect(!out.has_fault, "the path to the next slot");
    in.is_enabled = 0; /* across in one step, as if jogged */
    periods(2);
    in.is_enabled = 1;
    periods(2);
    before = out.removed_volume_mm3;
    go(25.0 + x, -3.0 + z, 50);
    go(45.0 + x, -3.0 + z, 200);
    near(out.removed_volume_mm3 - before, slot(20.0, 3.0), "slot after another offset");
    expect(!out.has_fault && out.is_ready, "no fault afterwards");
}

/* The tip is in the stock; an offset moves it within the stock by less than a machine can go in a period. */
static void change_in_the_stock(void)
{
    double before;
    begin();
    go(5.0, -2.0, 50);
    before = out.removed_volume_mm3;
    offset(0.0, 0.0, 3.0); /* a longer tool: its tip would stand 3 mm deeper */
    periods(5);
    offset(4.0, 0.0, 3.0);
    periods(5);
    expect(out.removed_volume_mm3 == before && !out.has_fault, "a small offset sweeps nothing");
    in.motion = 1;
    go(5.0, 10.0, 100);
    expect(out.removed_volume_mm3 == before && !out.has_rapid_contact, "nor does the way up from there");
}

/* As M6 and G43 do it: first the length, and some periods later the numbers of the tool. */
static void length_before_numbers(void)
{
    double before;
    int periods_late;
    for (periods_late = 0; periods_late < 40; periods_late += 13) {
        begin();
        go(5.0, -2.0, 50);
        go(5.0, 1.0, 50);
        before = out.removed_volume_mm3;
        offset(0.0, 0.0, 8.0);
        periods(periods_late);
        in.tool_diameter_mu = 10.0;
        in.tool_flute_length_mu = 30.0;
        periods(5);
        in.motion = 1;
        go(5.0, 13.0, 100);
        expect(out.removed_volume_mm3 == before && !out.has_fault && !out.has_rapid_contact,
               "another tool cuts nothing where it appears");
        in.motion = 2;
        go(5.0, 2.0, 100);
        near(out.removed_volume_mm3, 6.0 * PI * 25.0, "and all below it when it falls");
    }
}

/* The length, the numbers and the word that the tool is the described one come in any order, as on a busy computer; the new tip
 * is in the stock. */
static void unknown_meanwhile(void)
{
    int length_at, numbers_at, known_at, i;
    for (i = 0; i < 27; i++) {
        double before;
        int period;
        length_at = 3 + 4 * (i % 3), numbers_at = 3 + 4 * (i / 3 % 3), known_at = 4 + 4 * (i / 9);
        begin();
        go(5.0, -2.0, 50);
        go(5.0, 1.0, 50);
        before = out.removed_volume_mm3;
        for (period = 0; period < 20; period++) {
            in.tool_unknown = period >= 2 && period < known_at;
            if (period == length_at) offset(0.0, 0.0, 8.0);
            if (period == numbers_at) in.tool_diameter_mu = 10.0;
            periods(1);
        }
        expect(out.removed_volume_mm3 == before && out.is_ready, "nothing is cut by a tool at rest");
        expect(out.buried_depth_mm == 7.0, "it says how deep the tip is there");
        in.motion = 1;
        go(5.0, 13.0, 100);
        expect(out.removed_volume_mm3 == before && !out.has_rapid_contact, "nor as it goes up");
    }
}

/* How deep a tip is in the stock by its length, for ends of several shapes: above it, on it, in a slot of its own, beside it. */
static void buried(void)
{
    static const double corners[] = { 0.0, 1.0, 3.0 };
    int i;
    for (i = 0; i < 3; i++) {
        begin();
        in.tool_corner_radius_mu = corners[i];
        go(5.0, -2.0, 50);
        go(25.0, -2.0, 200);
        go(25.0, 5.0, 50);
        expect(out.buried_depth_mm == 0.0, "it has cut where it went");
        offset(0.0, 0.0, 5.0);
        periods(3);
        expect(out.buried_depth_mm == 0.0, "on the top of the stock, over its own slot");
        offset(0.0, 0.0, 7.0);
        periods(3);
        expect(out.buried_depth_mm == 0.0, "at the end of its own slot, to its floor");
        offset(0.0, 0.0, 7.3);
        periods(3);
        expect(fabs(out.buried_depth_mm - 0.3) < 0.02, "below that floor");
        offset(-5.9, 0.0, 7.0);
        periods(3);
        expect(fabs(out.buried_depth_mm - 2.0) < 0.02, "beside the slot");
        offset(0.0, 0.0, -20.0);
        periods(3);
        expect(out.buried_depth_mm == 0.0, "above the stock");
    }
}

/* A tip that its length has placed in the stock, and what the operator does then: the machine in manual mode, jogged or not, the tool
 * unknown for a while, the stock defined anew or restored. None of it cuts; out of the stock all is as ever. */
static void buried_and_jogged(void)
{
    static const double places[][2] = { { 25.0, 7.0 }, { 25.0, 4.0 }, { 28.0, 7.0 } }; /* X and Z of the axes */
    unsigned i;
    for (i = 0; i < 2 * sizeof places / sizeof *places; i++) {
        const double *place = places[i / 2];
        begin();
        go(25.0, 7.0, 100);
        offset(0.0, 0.0, 12.0);
        periods(3);
        expect(out.buried_depth_mm == 5.0, "5 mm deep");
        in.motion = 0;
        in.is_enabled = 0;
        go(place[0], place[1], 100);
        in.is_enabled = 1;
        periods(3);
        expect(out.removed_volume_mm3 == 0.0 && out.buried_depth_mm == 12.0 - place[1], "where it is jogged to");
        in.tool_unknown = 1;
        periods(3);
        in.tool_unknown = 0;
        periods(3);
        in.define_request = i % 2;
        in.external_writer = !in.define_request;
        periods(3);
        in.external_writer = 0;
        periods(200);
        expect(out.is_ready && out.removed_volume_mm3 == 0.0 && out.buried_depth_mm == 12.0 - place[1],
               "nor afterwards");
        in.motion = 1;
        go(place[0], 20.0, 100);
        expect(out.removed_volume_mm3 == 0.0 && !out.has_rapid_contact, "nor as it goes up");
        in.motion = 2;
        go(place[0], 9.0, 100);
        expect(out.buried_depth_mm == 0.0, "a feed is known to be there");
        near(out.removed_volume_mm3, 3.0 * 0.25 * PI * DIAMETER * DIAMETER, "and it cuts");
        in.is_enabled = 0;
        go(place[0] + 10.0, 9.0, 100);
        in.is_enabled = 1;
        periods(3);
        near(out.removed_volume_mm3, 6.0 * 0.25 * PI * DIAMETER * DIAMETER, "where a tool that cuts is jogged to");
    }
}

/* A tool without a description, as a probe is, appears, travels over the stock, and the next tool is put in at another place: what
 * is between the two places was not cut by either. */
static void undescribed_between(void)
{
    static const double never[] = { 0.0, -1.0 };
    unsigned i;
    for (i = 0; i < sizeof never / sizeof *never; i++) {
        begin();
        go(5.0, 25.0, 50);
        in.tool_diameter_mu = never[i];
        periods(5);
        offset(0.0, 0.0, 30.0); /* its length: the tip is 5 mm under the top of the stock */
        periods(5);
        go(5.0, 45.0, 100);
        go(55.0, 45.0, 200);
        go(55.0, 25.0, 100);
        expect(!out.is_ready && out.removed_volume_mm3 == 0.0, "a tool without a diameter cuts nothing");
        in.tool_diameter_mu = DIAMETER;
        periods(5);
        expect(out.removed_volume_mm3 == 0.0, "nor does the next one cut on the way between them");
    }
}

/* The offset changes while the axes move: the path before belongs to the old one, the path after to the new one. */
static void change_on_the_path(void)
{
    double all;
    begin();
    go(5.0, -2.0, 50);
    go(15.0, -2.0, 100);
    offset(0.0, 12.0, 0.0);
    go(25.0, -2.0, 100);
    /* where the new tip appears in the stock its disc is not cut, but for cells on its outline */
    all = slot(10.1, 2.0) + slot(9.9, 2.0) - slot(0.0, 2.0);
    expect(out.removed_volume_mm3 > 0.997 * all && out.removed_volume_mm3 < 1.015 * all, "offset changed in a move");
    expect(!out.has_fault, "no fault in a move");
}

/* Legs that wait are cut, and what comes after the change is not lost meanwhile. */
static void change_while_the_map_lags(void)
{
    static const double size[3] = { 80.0, 60.0, 10.0 }, at[3] = { 20.0, 20.0, 1.0 };
    double all, lagged = 0.0;
    int late;
    for (late = 1; late >= 0; late--) {
        define(0.1, size, 25.0, at);
        go(50.0, -4.0, 300);
        expect(tracker.sweep.waiting > 0, "the map lags");
        if (late) periods(100);
        offset(0.0, 0.0, -5.0);
        go(60.0, -9.0, 50);
        periods(100);
        expect(tracker.sweep.waiting == 0 && !out.has_fault, "caught up");
        all = out.removed_volume_mm3;
        if (late) lagged = all;
    }
    near(all, lagged, "moves that waited for the tool before");
}

static void jumps_are_still_faults(void)
{
    begin();
    in.pos_mu[0] += 40.0;
    periods(1);
    expect(out.fault_number == CHIP_FAULT_JUMP, "a jump of the axes is a fault");
    begin();
    in.pos_mu[0] += 40.0;
    offset(40.0, 0.0, 0.0); /* hidden behind an offset */
    periods(1);
    expect(out.fault_number == CHIP_FAULT_JUMP, "also with an offset that makes up for it");
    begin();
    offset(0.0, 0.0, NAN);
    periods(1);
    expect(out.fault_number == CHIP_FAULT_POSITION && !out.is_ready, "an offset that is not finite");
}

int main(void)
{
    static const double lengths[] = { 3.0, -3.0, 10.0, 47.3, -47.3, 150.0, -150.0, 400.0 };
    unsigned i;
    for (i = 0; i < sizeof lengths / sizeof *lengths; i++) change_between_cuts(0.0, 0.0, lengths[i]);
    change_between_cuts(7.0, -3.0, 60.0);
    change_between_cuts(-30.0, 80.0, 0.0);
    change_in_the_stock();
    change_on_the_path();
    length_before_numbers();
    unknown_meanwhile();
    buried();
    buried_and_jogged();
    undescribed_between();
    change_while_the_map_lags();
    jumps_are_still_faults();
    if (!failures) printf("offset: every case as it must be\n");
    free(stock);
    return failures != 0;
}
