# SPDX-License-Identifier: GPL-2.0-or-later
"""What the operator reads of a stop by a guard."""

import pytest

from chipwise.monitor.messages import Stop, guard_text
from chipwise.clib.layout import GuardReason


@pytest.mark.parametrize(
    "distance, unit, said",
    [
        (
            3.1,
            "mm",
            "rapid stopped 3.10 mm before stock (line 57, tool 3, 6.00 mm); press Stop, jog away and retract higher",
        ),
        (0.01, "mm", "rapid stopped 0.01 mm before stock"),
        (
            0.0,
            "mm",
            "rapid stopped in contact with stock (line 57, tool 3, 6.00 mm); press Stop, jog away and leave the stock "
            "with G1 before G0",
        ),
        (-0.2, "mm", "rapid stopped in contact with stock"),
        (0.00004, "in", "rapid stopped in contact with stock"),
    ],
)
def test_a_traverse_that_begins_in_contact(distance, unit, said):
    """It does not help there to retract higher."""
    assert guard_text(Stop(GuardReason.RAPID_CONTACT, 57, distance, 1.0, 3, 6.0, 20.0), unit).startswith(said)
