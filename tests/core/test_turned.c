/* SPDX-License-Identifier: GPL-2.0-or-later */
/* An axis beside X Y Z moves while a stock is defined: the map is not where the stock is any more. */
#include "one_tracker.h"

int main(void)
{
    static const double size[3] = { 40.0, 20.0, 10.0 }, at[3] = { -10.0, 10.0, 5.0 };
    double before;

    define(0.25, size, 6.0, at);
    go(-10.0, -2.0, 100);
    go(10.0, -2.0, 100);
    before = out.removed_volume_mm3;
    expect(out.is_ready && before > 100.0, "the slot is begun");

    in.is_turned = 1; /* the table turns, and the tool goes on */
    periods(3);
    expect(out.fault_number == CHIP_FAULT_TURNED && out.has_fault && !out.is_ready && !out.has_stock, "said");
    go(20.0, -2.0, 100);
    expect(out.removed_volume_mm3 == before, "nothing is cut out of a map that is not there");
    expect(out.section_area_mm2 == 0.0 && !out.has_rapid_contact && !out.has_flute_excess, "no load, no guard");

    in.define_request = 1; /* defined anew at this angle */
    periods(2);
    in.is_turned = 0;
    periods(200);
    in.define_request = 0;
    expect(out.is_ready && out.fault_number == 0, "defined again");
    go(30.0, -2.0, 100);
    expect(out.removed_volume_mm3 > 100.0, "and cut");
    return failures != 0;
}
