/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A stock that nobody has confirmed (components/core/tracker.c, [2] [3]): it is cut and read like any other, and nothing acts on it;
 * a certain stock is never replaced by it, and takes its place at once.
 */
#include "one_tracker.h"

static const double SIZE[3] = { 40.0, 20.0, 10.0 }, BEFORE[3] = { -10.0, 10.0, 5.0 };

/* The block that the map is in is given away and comes back as it was; is_assumed: as an assumption. */
static void written(int is_assumed)
{
    in.is_assumed = is_assumed;
    in.external_writer = 1;
    periods(3);
    in.external_writer = 0;
    periods(3);
    in.is_assumed = 0;
    periods(3);
}

/* A whole box, assumed, and the tool before it. */
static void assume(void)
{
    define(0.25, SIZE, 6.0, BEFORE);
    expect(out.is_certain, "M250 is certain");
    written(0);
    expect(out.is_ready && out.is_certain, "M254 is certain");
    tracker.is_uncertain = 1;
    written(1);
    expect(out.is_ready && out.has_stock && !out.is_certain && !out.fault_number, "assumed");
}

/* A traverse into the box, with the tool `is_assumed` or not; -> whether the guard has seen it. */
static int traverse(void)
{
    int i, seen = 0;
    in.motion = 1;
    in.axis_acceleration_mu_s2[0] = in.axis_acceleration_mu_s2[2] = 500.0;
    for (i = 0; i < 400; i++) {
        in.pos_mu[0] = -10.0 + 0.05 * i;
        in.pos_mu[2] = -2.0;
        periods(1);
        seen |= out.has_rapid_contact;
    }
    in.motion = 2;
    return seen;
}

static void nothing_acts(void)
{
    assume();
    in.pos_mu[2] = -2.0;
    expect(!traverse() && out.removed_volume_mm3 > 100.0,
           "a traverse through an assumed stock is cut, without a contact");
    assume();
    in.tool_flute_length_mu = 1.0;
    go(-10.0, -5.0, 100);
    go(10.0, -5.0, 400);
    expect(!out.has_flute_excess && out.section_area_mm2 > 1.0,
           "the shank in an assumed stock does not stop, and the load is read");
    in.tool_offset_mu[2] = 3.0;
    periods(3);
    expect(out.is_ready && out.buried_depth_mm == 0.0, "nor is it said that a tip is in it");
    in.tool_offset_mu[2] = 0.0;
    in.is_turned = 1;
    periods(1);
    expect(!out.fault_number && !out.is_ready, "an assumed stock that has turned raises no fault");

    assume(); /* the same in a certain one, to see that the guards look */
    in.define_request = 1;
    periods(100);
    expect(out.is_ready && out.is_certain, "M250 takes its place");
    in.pos_mu[2] = -2.0;
    expect(traverse(), "a traverse through a certain stock is a contact");
}

static void certain_stays(void)
{
    define(0.25, SIZE, 6.0, BEFORE);
    in.is_assumed = in.external_writer = 1;
    periods(5);
    expect(!out.is_held && out.is_ready && out.is_certain, "a certain stock is not given away for an assumption");
    in.is_assumed = in.external_writer = 0;
    periods(5);
    expect(out.is_ready && out.is_certain, "and stays certain");

    assume(); /* M250 while an assumption is written: it counts, as soon as the map is back */
    in.is_assumed = in.external_writer = 1;
    periods(3);
    expect(out.is_held && !out.is_certain, "held");
    in.define_request = 1;
    periods(3);
    in.external_writer = in.is_assumed = 0;
    periods(100);
    expect(out.is_ready && out.is_certain, "M250 meanwhile");

    assume(); /* M254 */
    written(0);
    expect(out.is_ready && out.is_certain, "M254 over an assumed stock is certain");

    assume(); /* what is assumed is as it was when the map was taken */
    in.is_assumed = in.external_writer = 1;
    periods(3);
    in.is_assumed = 0;
    periods(3);
    in.external_writer = 0;
    periods(3);
    expect(out.has_stock && !out.is_certain, "assumed to its end");
}

/* An assumption that is not written to its end, or under which the machine moves, leaves no stock and no fault. */
static void given_up_in_silence(void)
{
    assume();
    in.is_assumed = in.external_writer = 1;
    periods(3);
    stock->generation++;
    stock->nx = 0;
    in.external_writer = 0;
    periods(3);
    expect(!out.has_stock && !out.fault_number, "not written to its end");

    assume();
    in.is_assumed = in.external_writer = 1;
    periods(3);
    go(20.0, -2.0, 100);
    in.external_writer = 0;
    periods(3);
    expect(!out.has_stock && !out.fault_number, "the machine has moved");
}

/* A tool that only a comment describes cuts an assumed stock, and is unknown in a certain one. */
static void assumed_tool(void)
{
    assume();
    in.tool_is_assumed = 1;
    periods(2);
    go(-10.0, -2.0, 100);
    go(10.0, -2.0, 100);
    expect(out.is_ready && out.removed_volume_mm3 > 100.0, "in an assumed stock");
    in.define_request = 1;
    periods(100);
    go(20.0, -2.0, 100);
    expect(out.has_stock && out.is_certain && !out.is_ready && out.removed_volume_mm3 == 0.0, "in a certain stock");
    in.motion = 1;
    go(10.0, -2.0, 20);
    expect(!out.has_rapid_contact, "and no guard looks");
}

int main(void)
{
    nothing_acts();
    certain_stays();
    given_up_in_silence();
    assumed_tool();
    if (!failures) printf("assumed: every case as it must be\n");
    return failures != 0;
}
