# SPDX-License-Identifier: GPL-2.0-or-later
"""Arcs of a cycle that LinuxCNC refuses, or makes whole turns of, are written as straight moves."""

import math

import pytest

from support.canon import run_preview

from chipwise.gcode_lines import LEAST_RADIUS, chunks
from chipwise.moves import Arc, Line

UNITS = {"G21": 1.0, "G20": 25.4}


def found(moves, start, unit):
    """The Trace of moves after a place, as written in a unit."""
    lines = "\n".join(text for chunk in chunks(moves, start, UNITS[unit]) for _feed, text, *_ in chunk)
    at = " ".join(f"{axis}{value / UNITS[unit]:.6f}" for axis, value in zip("XYZ", start))
    return run_preview(f"{unit} G90 G91.1\nF100\nG0 {at}\n(begin)\n{lines}\n(end)\nM2\n")


@pytest.mark.parametrize("unit", sorted(UNITS))
@pytest.mark.parametrize("radius", [1e-7, 6.8e-5, 0.99 * LEAST_RADIUS])
@pytest.mark.parametrize("turn", [30, -190, 360])
def test_an_arc_of_too_small_a_radius(unit, radius, turn):
    """The tool stays within what a chord of a quarter turn strays, and rounding, of the arc, ends at its end, and at
    its depth."""
    centre, first = (87.9874, -25.8476), math.radians(17)
    a, b = (
        (centre[0] + radius * math.cos(t), centre[1] + radius * math.sin(t))
        for t in (first, first + math.radians(turn % 360 if turn > 0 else turn))
    )
    moves = [Arc(*b, *centre, turn > 0, 0.5, 100.0), Line(90.0, -20.0, None, 100.0)]
    trace = found(moves, (*a, 1.0), unit)
    assert trace.error == ""
    *pieces, last = trace.between("begin", "end")
    rounding = 1e-6 * UNITS[unit]
    assert {e.kind for e in pieces} <= {"feed"} and 1 <= len(pieces) <= 4
    assert math.dist(pieces[-1].b[:2], b) <= 2 * rounding and pieces[-1].b[2] == pytest.approx(0.5, abs=rounding)
    assert max(math.dist(e.b[:2], centre) for e in pieces) <= radius + 2 * rounding
    assert last.kind == "feed" and math.dist(last.b[:2], (90.0, -20.0)) <= 2 * rounding


@pytest.mark.parametrize("unit", sorted(UNITS))
def test_an_arc_whose_ends_are_written_as_one_place_is_no_whole_turn(unit):
    """A whole turn stays one."""
    short = 0.3e-6 * UNITS[unit]
    start, centre = (10.0 * UNITS[unit], 5.0 * UNITS[unit], 1.0), (0.0, 5.0 * UNITS[unit])
    for moves, length in (
        ([Arc(start[0], start[1] + short, *centre, True, None, 100.0)], 0.0),
        ([Arc(*start[:2], *centre, True, None, 100.0)], 2.0 * math.pi * start[0]),
    ):
        trace = found([*moves, Line(None, None, 0.5, 100.0)], start, unit)
        assert trace.error == ""
        arcs = [e for e in trace.between("begin", "end") if e.kind == "arc"]
        assert sum(e.radius * abs(e.sweep[1]) for e in arcs) == pytest.approx(length, rel=1e-6)
        assert trace.elements[-1].b[2] == pytest.approx(0.5, abs=1e-5)
