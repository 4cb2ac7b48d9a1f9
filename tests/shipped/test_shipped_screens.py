# SPDX-License-Identifier: GPL-2.0-or-later
"""The installed mill, started by an ordinary user, with its screens: from E-stop to the end line of a program, and
quit."""

import os
import re

import pytest

from support import samples

pytestmark = pytest.mark.machine

# A slot of tool 1, 6 mm with 2 edges, 4 mm deep in 6061 at S6000 F600: Kienzle's kc11 and mc, and the integral of
# sin^(1 - mc) over half a turn.
SLOT_W = 1e-3 * 800.0 * 200.0**0.25 * 10.0**0.75 * 3.0 * 4.0 * 2.173
TAUGHT = 1.25  # the default of spindle_sim
CUT_MM3 = 60 * 10 * 5  # a slot across the stock of PROGRAM, and nothing beside it


def check(found):
    assert re.fullmatch(
        r"chipwise: cut\.ngc: [0-9.]+ s, [0-9.]+ s (more|less) than at F; peak [0-9.]+, target 30 cm3/min",
        found["line"],
    ), found["line"]
    assert float(found["line"].split("peak ")[1].split(",")[0]) <= 30 * 1.02
    assert found["removed"] == pytest.approx(CUT_MM3, rel=0.003) and found["fault"] == "0"
    assert found["page"][0] == 200 and "<html" in found["page"][1] and "chipwise" in found["page"][1]
    assert found["left"] == {}, "these still run after LinuxCNC has ended"


def test_axis(scene):
    check(scene("scenes.axis"))


def test_gmoccapy(scene):
    if samples.missing(samples.named("gmoccapy")):
        pytest.skip(samples.missing(samples.named("gmoccapy")))
    check(scene("scenes.gmoccapy"))


def test_a_start_from_a_menu_that_fails(scene):
    """The window with the reason is there, above LinuxCNC's own."""
    windows = scene("machines.menu")["windows"]
    assert windows[-1] == "chipwise" and len(windows) > 1, windows


@pytest.mark.skipif("CHIPWISE_RANDOM_SHARE" in os.environ, reason="make test-long and tools/test run it: a minute")
def test_the_page_shows_the_load(scene):
    """The power of a slot as predicted, Kienzle's in closed form, and as measured; the largest chip, at its bound; at
    the end the factor that the cut has taught."""
    found = scene("scenes.load")
    watts = [one["power"] for one in found["seen"] if one["power"]]
    slot = [one["measured"] for one in watts if one["predicted"] == pytest.approx(SLOT_W, rel=0.02)]
    assert len(slot) > 10 and max(one["predicted"] for one in watts) < 1.02 * SLOT_W, watts
    assert max(one["loads"].get("chip", 0.0) for one in found["seen"]) == pytest.approx(1.0, abs=0.01)
    assert sum(slot[len(slot) // 2 :]) / len(slot[len(slot) // 2 :]) == pytest.approx(TAUGHT * SLOT_W, rel=0.1), slot
    assert max(one["factor"] for one in watts) == pytest.approx(TAUGHT, rel=0.05)
    assert found["errors"] == [] and found["left"] == {}, found
