# SPDX-License-Identifier: GPL-2.0-or-later
"""The verdict on G79 P4: that it sees slots, and tells corners and necks from the rest."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support import engagement_verdict as verdicts
from support.engagement_shapes import polygon
from support.glyph_shapes import Font, fonts
from support.pocket_judge import case_of
from support.pocket_random import rectangle
from support.pocket_requests import request


def asked(loop, **fields):
    return request((loop,), **{"strategy": 4, "step": 2.4, "tool_radius": 3.0, **fields})


def test_contour_parallel_paths_are_at_fault_and_constant_engagement_is_not():
    one = asked(rectangle(0, 0, 24, 20))
    assert verdicts.verdict(one).faults == []
    found = verdicts.verdict(replace(asked(rectangle(0, 0, 40, 24)), strategy=0))
    assert found.full > 0.2 and found.other > 30.0 and any("degrees at X" in fault for fault in found.faults)


def test_a_corner_has_the_turn_of_the_centres_border():
    case = case_of(asked(polygon([(0, 0), (40, 0), (0, 30)])))
    places, turns = verdicts.corners(case)
    assert np.allclose(
        sorted(turns), [90.0, 90.0 + math.degrees(math.atan2(3, 4)), 180.0 - math.degrees(math.atan2(3, 4))], atol=0.01
    )
    assert np.allclose(places[int(np.argmin(turns))], (3.0, 3.0), atol=1e-6)


def test_what_is_narrow():
    slot = case_of(asked(polygon([(0, 0), (30, 0), (30, 16), (50, 16), (50, 24), (30, 24), (30, 40), (0, 40)])))
    assert verdicts.narrow(slot, np.array([[42.0, 20.0], [15.0, 20.0], [3.0, 3.0]])).tolist() == [True, False, False]
    wider = case_of(
        asked(polygon([(0, 0), (30, 0), (30, 15.4), (50, 15.4), (50, 24.6), (30, 24.6), (30, 40), (0, 40)]))
    )
    assert not verdicts.narrow(wider, np.array([[42.0, 20.0]])).any()


def test_what_stands_at_the_rim_by_nothing_is_no_rest():
    """The oracle of pockets asks at the very rim of the tool; a rest is wider than its tolerance."""
    one = asked(rectangle(0, 0, 24, 20))
    case, moves = case_of(one), verdicts.hole_oracle.walk(verdicts.cycle.pocket_plan(one).moves, one.start)
    assert not len(verdicts.wide_rest(case, moves, 0, 600))
    assert len(verdicts.wide_rest(case, [e for e in moves if e.kind == "rapid" or e.b[0] < 18.0], 0, 600))


def test_letters_are_closed_loops():
    pytest.importorskip("fontTools")
    found = {name: path for name, path in fonts().items() if name.startswith("DejaVuSans")}
    if not found:
        pytest.skip("no fonts on this computer")
    font = Font(next(iter(sorted(found.values()))))
    loops = font.loops(ord("B"), 40.0)
    assert len(loops) == 3
    for parts in loops:
        assert all(math.dist(a.end, b.start) < 1e-9 for a, b in zip(parts, parts[1:] + parts[:1]))
