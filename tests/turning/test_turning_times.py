# SPDX-License-Identifier: GPL-2.0-or-later
"""The time of a plan: closed forms of moves from rest to rest, and what is named apart.  tests/machine compares plans
with the simulated lathe."""

import math

import pytest

from chipwise.turning.times import Motion
from support.lathe_preview import machine, preview
from support.turning_bench import Bench

LATHE = Motion((100.0, 100.0), (500.0, 500.0), 100.0, 500.0)


@pytest.mark.parametrize(
    "dz, dx, s",
    [
        (100.0, 0.0, 1.0 + 0.2),
        (0.0, -20.0, 0.2 + 0.2),
        (-5.0, 0.0, 2 * math.sqrt(5 / 500)),
        (0.0, 0.0, 0.0),
        (30.0, 40.0, 50 / 100 + 0.2),
    ],
)
def test_a_rapid_begins_and_ends_at_rest(dz, dx, s):
    assert LATHE.rapid(dz, dx) == pytest.approx(s)


def test_the_slower_axis_counts():
    """X half as fast as Z: along the diagonal it is the one that limits, by its share."""
    motion = Motion((100.0, 50.0), (500.0, 100.0), 1e9, 1e9)
    assert motion.rapid(0.0, 100.0) == pytest.approx(100 / 50 + 50 / 100)
    length, share = math.hypot(100.0, 100.0), math.sqrt(0.5)
    assert motion.rapid(100.0, 100.0) == pytest.approx(length / (50 / share) + (50 / share) / (100 / share))


def test_what_the_time_does_not_have_is_named(tmp_path, capsys):
    """Without a machine nobody knows where tools are changed; G26 does."""
    bench = Bench(tmp_path, capsys)
    part = "G0 X8 Z0\nG1 X10 Z-2\nG1 Z-20\nG1 X14\nG1 Z-30\n"
    status, plan, said = bench.turn(part, "ROUGH=1,FINISH=2")
    assert (
        "without 2 tool changes and the travel to them" in said
        and plan["tool_changes"] == 2
        and plan["travel_s"] is None
    )
    assert (
        plan["time_s"] == pytest.approx(sum(s["time_s"] for s in plan["steps"])) and f"{plan['time_s']:.1f} s;" in said
    )
    text = (
        (tmp_path / "part.ngc")
        .read_text()
        .replace("M3\n", "M3\nG0 X60 Z40\n")
        .replace("G26", "(begin)\nG26")
        .replace("M2", "(end)\nM2")
    )
    seen = preview(tmp_path, machine(tmp_path), text)
    assert not seen.error and "s; without 2 tool changes;" in seen.messages[0] + ";", seen.messages
    total = float(seen.messages[0].split(" s; without")[0].split()[-1])
    assert (
        plan["time_s"] + 2 * 2 * 0.4 < total < plan["time_s"] + 2 * 2 * 1.5
    )  # two rapids there and two back, for each tool
