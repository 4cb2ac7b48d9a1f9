# SPDX-License-Identifier: GPL-2.0-or-later
"""M250 that the stock tracker refuses while another stock is in force: the program ends there, and the old stock
stays."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine

PINS = ["pins", "stock-tracker.0.fault-code", "stock-tracker.0.stock-defined", "stock-tracker.0.removed-volume"]


def test_the_program_ends_where_the_stock_is_refused(tmp_path):
    """With another units-per-mm the tracker is asked for a box 1000 times as large, which M250 itself cannot know;
    twice, because the message of a fault comes once."""
    tried = [["start", "G21 G90\nF600\nM250 P0 Q0 R-10 I60 J40 K10\nG1 X5\nM2\n"], ["finish"], ["position"], PINS]
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "M250 P0 Q0 R-10 I50 J40 K10"],
            ["mdi", "G0 X-20"],
            ["hal", "setp", "stock-tracker.0.units-per-mm", "0.001"],
            *tried,
            *tried,
            ["hal", "setp", "stock-tracker.0.units-per-mm", "1"],
            ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"],
            PINS,
        ],
    )
    for said, position, pins in (answers[5:8], answers[9:12]):
        assert any("M250: the stock tracker has refused the stock (fault 3)" in text for text in said), said
        assert position[0] == pytest.approx(-20.0, abs=1e-6) and pins[:2] == ["3", "TRUE"], (position, pins)
    assert answers[-2:] == [[], ["0", "TRUE", "0"]]
