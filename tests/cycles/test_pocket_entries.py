# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 as a pure cycle: levels, entries and rapids."""

import math

import numpy as np
import pytest

from chipwise.cycles import pocket as cycle
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket import entries, machinable
from chipwise.geometry.pocket.strategies import NAMES
from chipwise.geometry.pocket.tracks import make_track
from chipwise.moves import Arc, Rapid
from support.pocket_requests import request, walked, faults
from support.pocket_random import circle, rectangle


def test_levels_and_floor_allowance():
    asked = request(depth_step=2.0, floor_allowance=0.5)
    depths = {round(e.b[2], 6) for e in walked(asked) if e.kind != "rapid" and e.a[2] == e.b[2]}
    assert depths == {-0.5, -2.0, -3.5}  # from R1 in three equal steps, none above J
    assert faults(asked) == []


def test_helix_then_ramp_then_plunge():
    """What fits: a circle in a wide pocket, to and fro in a narrow one, straight down in a point contact; and the
    message."""
    wide = cycle.pocket_plan(request())
    first = [m for m in wide.moves if not isinstance(m, Rapid)][0]
    assert isinstance(first, Arc) and first.z is not None and wide.plunges == ()
    narrow = request((rectangle(0, 0, 6.5, 40),))
    first = [e for e in walked(narrow) if e.kind != "rapid"][0]
    assert first.b[2] < 1.0 and math.dist(first.a[:2], first.b[:2]) > 0.1 and cycle.pocket_plan(narrow).plunges == ()
    short = cycle.pocket_plan(request((rectangle(0, 0, 6.5, 6.8),)))
    assert len(short.plunges) == 1
    text, _ = short.notes[0]
    assert text == "no clearance for a helix or a ramp, so the tool plunges at E in 1 place, the first at X{x} Y{y}"


@pytest.mark.parametrize("angle", [1.0, 3.0, 20.0])
@pytest.mark.parametrize("wide", [6.5, 40.0])
def test_entries_keep_the_angle(angle, wide):
    asked = request((rectangle(0, 0, wide, 40),), ramp_angle=angle)
    assert faults(asked) == []
    falls = [
        math.degrees(
            math.atan2(e.a[2] - e.b[2], e.radius * abs(e.sweep[1]) if e.kind == "arc" else math.dist(e.a[:2], e.b[:2]))
        )
        for e in walked(asked)
        if e.kind != "rapid" and e.a[2] - e.b[2] > 1e-9 and math.dist(e.a, e.b) > 0.6 or e.kind == "arc"
    ]
    assert max(falls) == pytest.approx(angle, rel=0.35)  # and no flatter than whole turns need


def test_ninety_degrees_is_a_plunge():
    assert len(cycle.pocket_plan(request(ramp_angle=90.0)).plunges) == 1


def test_a_helix_never_leaves_the_field():
    (field,) = machinable.split(make_contour(rectangle(0, 0, 10, 10)), [], 3.0)
    track = make_track(elements.make_lines(np.array([[3.0, 5.0]]), np.array([[3.0, 7.0]])))
    how = entries.entry(field, track, 3.0, 4.0, math.radians(3))
    assert isinstance(how, entries.Helix) and how.centre[0] == pytest.approx(3.0 + how.radius) and how.radius <= 2.0
    assert 2 * math.pi * how.radius * how.turns * math.tan(math.radians(3)) >= 4.0


@pytest.mark.parametrize("z", [10.0, 1.0, -2.0])
def test_lead_in_and_out(z):
    """Up first where the tool stands below R; across; down; and on the clearance plane at the end."""
    found = walked(request(start=(100.0, 0.0, z)))
    assert found[-1].b[2] == 1.0
    across = next(e for e in found if e.a[:2] != e.b[:2])
    assert across.kind == "rapid" and across.a[2] == across.b[2] == max(z, 1.0)


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_rapids_across_are_on_the_clearance_plane_or_just_over_a_level(strategy):
    """Below the clearance plane at most 0.2 mm over the floor of a level."""
    asked = request((rectangle(0, 0, 80, 40), circle(6, (30, 20))), strategy=strategy, depth_step=2.5)
    found = walked(asked)
    levels = {round(e.a[2], 6) for e in found if e.kind == "arc" and e.a[2] == e.b[2]}
    across = [z for e in found[1:] if e.kind == "rapid" and e.a[:2] != e.b[:2] for z in (e.a[2], e.b[2])]
    assert len(levels) == 2 and 1.0 in across
    assert all(z == 1.0 or any(0.0 <= z - level <= 0.2 + 1e-9 for level in levels) for z in across)
