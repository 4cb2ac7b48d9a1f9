# SPDX-License-Identifier: GPL-2.0-or-later
"""Depths proved (components/offline/depth_proof.c) against needles in tiny steps and against the height at each witness, by brute force."""
from types import SimpleNamespace

import numpy as np
import pytest

from chipwise.check.reader import Unreadable
from chipwise.check.records import FEED, RAPID, STOCK, TOOL
from chipwise.check.sweep import HeightMap, Shape
from chipwise.rewrite import depths
from chipwise.stock import layout
from chipwise.tools import ToolGeometry
from support.check_oracle import Needles, profile
from support.random_cases import random_count, random_seed

LOW, HIGH = (0.0, 0.0, -12.0), (14.0, 12.0, 0.0)
SPACING = 0.05              # mm, of the oracle's needles
STEP = 0.03                 # mm in Z and along the move that the oracle's steps may be beside the true contact


def program_of(places, tool, kinds=None, low=LOW, high=HIGH):
    """What depths.py reads of a Program: moves from the first of the places (n, 3) to the others with one tool (diameter, corner, tip)."""
    places = np.array(places, float)
    events = [SimpleNamespace(kind=STOCK, at=0, line=1, values=(0, 0.0, *low, *high)),
              SimpleNamespace(kind=TOOL, at=0, line=2, values=(1, tool[0]))]
    end = places[1:]
    return SimpleNamespace(end=end, start=lambda k: places[k], kind=np.full(len(end), FEED) if kinds is None else np.array(kinds),
                           line=np.arange(len(end)) + 3, events=events, height_known_from=0)


def geometry_of(tool, flute):
    diameter, corner, tip = tool
    shape = "vee" if tip else "ball" if corner == diameter / 2 else "bull" if corner else "flat"
    return {1: ToolGeometry(shape=shape, corner_radius=corner if shape == "bull" else None, tip_angle=tip or None, flute_length=flute)}


def witnesses(places, tool, flute, **more):
    return depths.too_deep(program_of(places, tool, **more), geometry_of(tool, flute), 0.25, 0.0)


def left_at(x, y, places, tool, low=LOW, high=HIGH):
    """Height of the stock at a place after moves along the places: thousands of positions of the tool."""
    height = high[2] if low[0] <= x <= high[0] and low[1] <= y <= high[1] else low[2]
    for a, b in zip(places[:-1], places[1:]):
        along = a + (b - a) * np.linspace(0, 1, 4001)[:, None]
        r = np.hypot(along[:, 0] - x, along[:, 1] - y)
        inside = r <= tool[0] / 2
        if inside.any():
            height = min(height, float((along[inside, 2] + profile(tool, r[inside])).min()))
    return height


def random_case(seed):
    """(tool, places, depth of each move by the needles)."""
    rng = np.random.default_rng([random_seed(), seed])
    diameter = rng.choice([3.0, 4.0, 6.0])
    tool = [(diameter, 0.0, 0.0), (diameter, diameter / 2, 0.0), (diameter, 0.5, 0.0), (diameter, 0.0, 90.0)][seed % 4]
    needles, places, found = Needles(LOW, HIGH, SPACING), [np.array([-4.0, rng.uniform(0, 12), 2.0])], []
    for _ in range(10):
        there = np.array([rng.uniform(-3, 17), rng.uniform(-3, 15), rng.uniform(-9, 1)])
        kind = rng.integers(5)
        if kind == 0:
            there[2] = places[-1][2]
        elif kind == 1:
            there[:2] = places[-1][:2]
        elif kind == 2 and len(places) > 1:
            there = places[-2].copy()
        elif kind == 3:
            there[1:] = places[-1][1:]
        found.append(needles.move(tool, places[-1], there, (0.005,))[0])
        places.append(there)
    return tool, places, found


def test_never_less_than_the_needles_and_never_more_than_there_is():
    """Flutes a little shorter than the needles' deepest contact: the proof finds it.  Each of its witnesses is as high as it says."""
    seen = 0
    for case in range(random_count(8)):
        tool, places, found = random_case(case)
        for move, depth in enumerate(found):
            shoulder = profile(tool, np.array(tool[0] / 2))
            if depth < 0.5 or np.allclose(places[move][:2], places[move + 1][:2]):
                continue
            kinds = [RAPID] * len(found)
            kinds[move] = FEED
            flute = depth - 2 * STEP
            if flute <= shoulder:
                continue
            met = witnesses(places, tool, flute, kinds=kinds)
            assert met and {w.line for w in met} == {move + 3}, (case, move, depth)
            seen += 1
            for w in met[::max(1, len(met) // 5)]:
                height = left_at(w.x, w.y, places[:move + 1], tool)
                assert height == pytest.approx(w.depth + w.place[2], abs=0.005), (case, move, w)
                assert np.hypot(w.x - w.place[0], w.y - w.place[1]) <= tool[0] / 2 - 0.004 + 1e-6 and w.depth > flute
    assert seen >= random_count(8)


@pytest.mark.parametrize("angle", [0, 7, 30, 45, 61, 90])
def test_a_wall_in_levels_is_not_met_again(angle):
    """Levels as deep as the flutes are long, there and back: no contact; with flutes a hundredth shorter each is one."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    places = [(-50 * c, -50 * s, 5.0)]
    for level in range(1, 4):
        places += [(t * 50 * c, t * 50 * s, -4.0 * level) for t in (-1, 1, -1)]
    box = {"low": (-30, -30, -20), "high": (30, 30, 0)}
    assert not witnesses(places, (6.0, 0.0, 0.0), 4.0, **box)
    assert {w.line for w in witnesses(places, (6.0, 0.0, 0.0), 3.99, **box)} == {4, 7, 10}


@pytest.mark.parametrize("beside, is_met", ((0.001, False), (0.02, True), (0.3, True)))
def test_a_strip_at_a_wall(beside, is_met):
    """What is thinner than the skin does not count; a strip of a fiftieth of a millimetre counts with its whole height."""
    places = [(-5, 6, 5), (-5, 6, -4), (20, 6, -4), (20, 6, 5), (-5, 6 + beside, 5), (-5, 6 + beside, -8), (20, 6 + beside, -8)]
    met = witnesses(places, (6.0, 0.0, 0.0), 7.9)
    assert bool(met) == is_met
    assert all(w.depth == pytest.approx(8.0) and w.y > 9 for w in met)


def test_short_moves_along_a_wall():
    """An arc in chords of a tenth of a millimetre, in levels: the crescents that each chord enters have been cut."""
    turn = np.arange(0, 3.0, 0.0125)
    places = [(30.0, 6.0, 5.0)]
    for level in (-4.0, -8.0, -12.0):
        places += [(7 + 8 * np.cos(t), 6 + 8 * np.sin(t), level) for t in turn] + [(7.0, 40.0, level), (30.0, 40.0, 5.0), (30.0, 6.0, 5.0)]
    assert not witnesses(places, (6.0, 0.0, 0.0), 4.0)
    assert witnesses(places, (6.0, 0.0, 0.0), 3.9)


def test_a_contact_that_no_needle_meets():
    """0.005 mm into the side of the stock beyond the skin: a lens 0.35 mm long."""
    places = [(7.03, -10, 5), (7.03, -10, -10), (7.03, -3 + 0.009, -10), (7.03, -10, -10)]
    met = witnesses(places, (6.0, 0.0, 0.0), 9.0)
    assert met and all(w.depth == pytest.approx(10.0) and abs(w.x - 7.03) < 0.2 and w.y < 0.006 for w in met)
    stock = HeightMap(LOW, HIGH, 0.25)
    assert stock.cut(Shape(6.0), places[0], np.array(places[1:]))["depth"].max() == 0.0
    stock = HeightMap(LOW, HIGH, 0.25)
    stock.add_needles(np.array([(w.x, w.y) for w in met]))
    assert stock.cut(Shape(6.0), places[0], np.array(places[1:]))["depth"].max() == pytest.approx(10.0)


def test_no_answer_without_time(monkeypatch):
    monkeypatch.setattr(depths, "SQUARES", 1)
    with pytest.raises(Unreadable, match="too many walls"):
        witnesses([(-5, 6, 5), (-5, 6, -4), (20, 6, -4), (20, 6, 5), (-5, 7, 5), (-5, 7, -8), (20, 7, -8)], (6.0, 0.0, 0.0), 7.0)


def test_of_too_many_witnesses_the_deepest_count(monkeypatch):
    """A ramp that is too deep all along: the witnesses that count are not those at its shallow beginning, and the last move has been looked at."""
    ramp = [(-5, 6, -4)] + [(x, 6, -4 - 0.2 * (x + 5)) for x in range(-4, 20)]
    every = witnesses(ramp, (6.0, 0.0, 0.0), 4.5)
    monkeypatch.setattr(depths, "MOST", len(every) // 4)
    few = witnesses(ramp, (6.0, 0.0, 0.0), 4.5)
    assert len(few) == len(every) // 4 and few[-1].line == every[-1].line
    assert sorted(w.depth for w in few) == sorted(w.depth for w in every)[-len(few):]


@pytest.mark.parametrize("moves", [1, 7, 400])
def test_a_segment_of_the_path_has_one_witness_on_each_side(moves):
    """However its moves are long, a slot that is too deep has some along all of its length, each the deepest of its segment."""
    x = np.linspace(-4.0, 18.0, moves + 1)
    found = witnesses(np.column_stack((x, np.full(len(x), 6.03), -6 - x / 10)), (4.0, 0.0, 0.0), 3.0)
    assert len(found) <= 2 * 22 / layout.PROOF_SEGMENT + 2
    own = sorted(w.place[0] for w in found)
    assert own[0] < -1.0 and own[-1] > 10.0 and np.diff(own).max() <= 2.5 * layout.PROOF_SEGMENT, own


@pytest.mark.parametrize("tool", ((6.0, 0.0, 0.0), (6.0, 1.0, 0.0)))
def test_a_slope_in_a_slot_that_is_just_not_too_deep(tool):
    """What is met is as high as the slot's floor, not as the stock was: cells that the slot has cut whole have no moves to ask."""
    slot = [(-8, 6, -4), (22, 6, -4), (22, 6, 5), (-8, 6, 5)]
    edge = -3.0 if not tool[1] else -3.0 + 1e-3
    deepest = (edge, -4.0 - 6.2)                                # the axis' place, and Z there: 6.2 mm below the floor
    slope = [(edge - 3, 6, deepest[1] - 3), (edge + 12, 6, deepest[1] + 12)]
    kinds = [RAPID] * (len(slot)) + [FEED]
    box = {"low": (0.0, 0.0, -14.0), "high": (14.0, 12.0, 0.0), "kinds": kinds}
    found = witnesses([*slot, *slope], tool, 6.3, **box)
    assert not [w for w in found if abs(w.y - 6) < 2.5], found[:3]
    low = [w for w in witnesses([*slot, *slope], tool, 6.0, **box) if abs(w.y - 6) < 2.5]
    assert low and all(w.depth == pytest.approx(6.1, abs=0.15) for w in low)
