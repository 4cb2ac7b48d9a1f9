# SPDX-License-Identifier: GPL-2.0-or-later
"""A length that places the tip in the stock: said once, in the machine's own unit, and again where the operator has
done something and it is still there; E-stop, a jog, M250 and M254 cut nothing out of the model meanwhile."""

import pytest

from support import buried_tip
from support.operate import Shared

pytestmark = pytest.mark.machine

MILL, INCH = Shared("a buried tip"), Shared("a buried tip in inch", ini="mill_inch.ini")


@pytest.mark.scene(MILL, buried_tip.steps())
def test_on_a_mill(answers):
    assert buried_tip.verdict(answers, 1.0, ("5.00 mm", "4.00 mm", "6.00 mm")) == ""


@pytest.mark.scene(INCH, buried_tip.steps(25.4))
def test_on_an_inch_machine(answers):
    assert buried_tip.verdict(answers, 1 / 25.4, ("0.1969 in", "0.1575 in", "0.2362 in")) == ""
