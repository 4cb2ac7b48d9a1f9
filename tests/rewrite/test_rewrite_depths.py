# SPDX-License-Identifier: GPL-2.0-or-later
"""Depths proved (components/offline/depth_proof.c) against needles in tiny steps and against the height at each
witness, by brute force."""

import ctypes as C

import numpy as np
import pytest

from chipwise.program.reader import Unreadable
from chipwise.program.records import FEED, RAPID
from chipwise.clib.height_map import HeightMap, Shape
from chipwise.rewrite import depth_proof
from chipwise.clib import layout
from chipwise.clib.library import library
from support.check_oracle import profile
from support.depth_cases import HIGH, LOW, left_at, random_case, witnesses
from support.random_cases import random_count, random_seed

STEP = 0.03  # mm in Z and along the move that the oracle's steps may be beside the true contact


def test_never_less_than_the_needles_and_never_more_than_there_is():
    """Flutes a little shorter than the needles' deepest contact: the proof finds it.  Each of its witnesses is as high
    as it says."""
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
            for w in met[:: max(1, len(met) // 5)]:
                height = left_at(w.x, w.y, places[: move + 1], tool)
                assert height == pytest.approx(w.depth + w.place[2], abs=0.005), (case, move, w)
                assert np.hypot(w.x - w.place[0], w.y - w.place[1]) <= tool[0] / 2 - 0.004 + 1e-6 and w.depth > flute
    assert seen >= random_count(8)


@pytest.mark.parametrize("angle", [0, 7, 30, 45, 61, 90])
def test_a_wall_in_levels_is_not_met_again(angle):
    """Levels as deep as the flutes are long, there and back: no contact; with flutes a hundredth shorter each is
    one."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    places = [(-50 * c, -50 * s, 5.0)]
    for level in range(1, 4):
        places += [(t * 50 * c, t * 50 * s, -4.0 * level) for t in (-1, 1, -1)]
    box = {"low": (-30, -30, -20), "high": (30, 30, 0)}
    assert not witnesses(places, (6.0, 0.0, 0.0), 4.0, **box)
    assert {w.line for w in witnesses(places, (6.0, 0.0, 0.0), 3.99, **box)} == {4, 7, 10}


@pytest.mark.parametrize("beside, is_met", ((0.001, False), (0.02, True), (0.3, True)))
def test_a_strip_at_a_wall(beside, is_met):
    """What is thinner than the skin does not count; a strip of a fiftieth of a millimetre counts with its whole
    height."""
    places = [
        (-5, 6, 5),
        (-5, 6, -4),
        (20, 6, -4),
        (20, 6, 5),
        (-5, 6 + beside, 5),
        (-5, 6 + beside, -8),
        (20, 6 + beside, -8),
    ]
    met = witnesses(places, (6.0, 0.0, 0.0), 7.9)
    assert bool(met) == is_met
    assert all(w.depth == pytest.approx(8.0) and w.y > 9 for w in met)


def test_short_moves_along_a_wall():
    """An arc in chords of a tenth of a millimetre, in levels: the crescents that each chord enters have been cut."""
    turn = np.arange(0, 3.0, 0.0125)
    places = [(30.0, 6.0, 5.0)]
    for level in (-4.0, -8.0, -12.0):
        places += [(7 + 8 * np.cos(t), 6 + 8 * np.sin(t), level) for t in turn] + [
            (7.0, 40.0, level),
            (30.0, 40.0, 5.0),
            (30.0, 6.0, 5.0),
        ]
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
    stock.add_needles(np.array([(w.x, w.y) for w in met]), layout.NEEDLE_SKIN)
    assert stock.cut(Shape(6.0), places[0], np.array(places[1:]))["depth"].max() == pytest.approx(10.0)


def test_no_answer_without_time(monkeypatch):
    monkeypatch.setattr(depth_proof, "SQUARES", 1)
    with pytest.raises(Unreadable, match="too many walls"):
        witnesses(
            [(-5, 6, 5), (-5, 6, -4), (20, 6, -4), (20, 6, 5), (-5, 7, 5), (-5, 7, -8), (20, 7, -8)],
            (6.0, 0.0, 0.0),
            7.0,
        )


def test_of_too_many_witnesses_the_deepest_count(monkeypatch):
    """A ramp that is too deep all along: the witnesses that count are not those at its shallow beginning, and the last
    move has been looked at."""
    ramp = [(-5, 6, -4)] + [(x, 6, -4 - 0.2 * (x + 5)) for x in range(-4, 20)]
    every = witnesses(ramp, (6.0, 0.0, 0.0), 4.5)
    monkeypatch.setattr(depth_proof, "MOST", len(every) // 4)
    few = witnesses(ramp, (6.0, 0.0, 0.0), 4.5)
    assert len(few) == len(every) // 4 and few[-1].line == every[-1].line
    assert sorted(w.depth for w in few) == sorted(w.depth for w in every)[-len(few) :]


@pytest.mark.parametrize("moves", [1, 7, 400])
def test_a_segment_of_the_path_has_one_witness_on_each_side(moves):
    """However its moves are long, a slot that is too deep has some along all of its length, each the deepest of its
    segment."""
    x = np.linspace(-4.0, 18.0, moves + 1)
    found = witnesses(np.column_stack((x, np.full(len(x), 6.03), -6 - x / 10)), (4.0, 0.0, 0.0), 3.0)
    assert len(found) <= 2 * 22 / layout.PROOF_SEGMENT + 2
    own = sorted(w.place[0] for w in found)
    assert own[0] < -1.0 and own[-1] > 10.0 and np.diff(own).max() <= 2.5 * layout.PROOF_SEGMENT, own


@pytest.mark.parametrize("begin, end", ((1.0, 11.0), (11.0, 1.0)))
def test_the_deepest_of_the_first_witnesses_counts(begin, end):
    """A ramp at 45 degrees: of the first few in a segment the deepest is on average a fifth of it before its end, the
    first alone half."""
    places = np.array([(begin, 6.03, -4.0), (end, 6.03, -14.0)])
    found = witnesses(places, (4.0, 0.0, 0.0), 3.0, low=(0.0, 0.0, -20.0))
    along = np.array([np.linalg.norm(w.place - places[0]) for w in found])
    assert len(found) > 100
    assert (
        np.mean((np.floor(along / layout.PROOF_SEGMENT) + 1) * layout.PROOF_SEGMENT - along)
        < 0.3 * layout.PROOF_SEGMENT
    )


@pytest.mark.parametrize("tool", ((6.0, 0.0, 0.0), (6.0, 1.0, 0.0)))
def test_a_slope_in_a_slot_that_is_just_not_too_deep(tool):
    """What is met is as high as the slot's floor, not as the stock was: cells that the slot has cut whole have no moves
    to ask."""
    slot = [(-8, 6, -4), (22, 6, -4), (22, 6, 5), (-8, 6, 5)]
    edge = -3.0 if not tool[1] else -3.0 + 1e-3
    deepest = (edge, -4.0 - 6.2)  # the axis' place, and Z there: 6.2 mm below the floor
    slope = [(edge - 3, 6, deepest[1] - 3), (edge + 12, 6, deepest[1] + 12)]
    kinds = [RAPID] * (len(slot)) + [FEED]
    box = {"low": (0.0, 0.0, -14.0), "high": (14.0, 12.0, 0.0), "kinds": kinds}
    found = witnesses([*slot, *slope], tool, 6.3, **box)
    assert not [w for w in found if abs(w.y - 6) < 2.5], found[:3]
    low = [w for w in witnesses([*slot, *slope], tool, 6.0, **box) if abs(w.y - 6) < 2.5]
    assert low and all(w.depth == pytest.approx(6.1, abs=0.15) for w in low)


def lowest_by_search(move, tool, x, y):
    """Height that a move from (3,) to (3,) leaves at a place, from ever more positions round the lowest; None out of
    its reach."""
    (begin, end), low, high = move, 0.0, 1.0
    for _ in range(8):
        share = np.linspace(low, high, 2001)
        place = begin + (end - begin) * share[:, None]
        r = np.hypot(place[:, 0] - x, place[:, 1] - y)
        inside = np.flatnonzero(r <= tool[0] / 2)
        if not len(inside):
            return None
        at = inside[(place[inside, 2] + profile(tool, r[inside])).argmin()]
        low, high = share[max(at - 1, 0)], share[min(at + 1, 2000)]
    return float(place[at, 2] + profile(tool, r[at : at + 1])[0])


def test_what_a_move_leaves_is_exact():
    """chip_swept_height() on ramps of all kinds of tools, against a search: to 1e-6 mm."""
    height = library().chip_swept_height
    height.restype, height.argtypes = C.c_double, [C.c_void_p, C.POINTER(layout.Tool), C.c_double, C.c_double]
    rng, seen = np.random.default_rng([random_seed(), 77]), 0
    for case in range(random_count(600)):
        diameter = float(rng.uniform(0.7, 21))
        tool = [
            (diameter, 0.0, 0.0),
            (diameter, diameter / 2, 0.0),
            (diameter, diameter * float(rng.uniform(0.01, 0.49)), 0.0),
            (diameter, 0.0, float(rng.uniform(8, 170))),
        ][case % 4]
        own = layout.Tool()
        library().chip_tool_init(C.byref(own), tool[0], tool[1], tool[2], 0.0)
        begin = rng.uniform(-9, 9, 3)
        end = begin + rng.uniform(-1, 1, 3) * 10 ** rng.uniform(-1.5, 1.3) * (1, 1, 10 ** rng.uniform(-2, 1))
        move = np.array([*begin, *(end - begin), np.sum((end - begin)[:2] ** 2)])
        x, y = begin[:2] + (end - begin)[:2] * rng.uniform(0, 1) + rng.uniform(-0.6, 0.6, 2) * diameter
        expected, found = lowest_by_search((begin, end), tool, x, y), height(move.ctypes.data, C.byref(own), x, y)
        if expected is not None:
            assert found == pytest.approx(expected, abs=1e-6), (case, tool, begin, end, x, y)
            seen += 1
    assert seen > random_count(600) / 3


def test_the_height_of_a_witness_counts_cuts_that_are_not_deep_enough():
    """A slot that leaves half a millimetre too much: the path has to be raised by that, not by the slot's depth,
    too."""
    slot = [(-8, 6.1, -4), (22, 6.1, -4), (22, 6.1, 5), (-8, 6.1, 5), (-8, 6.1, -10.5), (22, 6.1, -10.5)]
    met = [w for w in witnesses(slot, (6.0, 0.0, 0.0), 6.0) if w.line == 7]
    assert met and all(w.depth == pytest.approx(6.5) for w in met)


def test_a_cylinder_has_no_corners():
    """A slot at the corner of its box, and one through its middle."""
    cylinder = {"low": (0.0, 0.0, -12.0), "high": (14.0, 14.0, 0.0), "shape": 1}
    corner, middle = ([(-5, y, 5), (-5, y, -8), (1.0, y, -8)] for y in (-1.5, 7.0))
    assert not witnesses(corner, (6.0, 0.0, 0.0), 4.0, **cylinder)
    assert witnesses(corner, (6.0, 0.0, 0.0), 4.0, **{**cylinder, "shape": 0})
    met = witnesses(middle, (6.0, 0.0, 0.0), 4.0, **cylinder)
    assert met and all(np.hypot(w.x - 7, w.y - 7) <= 7 for w in met)


def test_flutes_shorter_than_the_nose():
    """A ball of 6 mm with flutes of 2 mm: stock below its shoulder counts, but only above the flutes."""
    slot = [(-5, 6, 5), (-5, 6, -2.5), (20, 6, -2.5)]
    met = witnesses(slot, (6.0, 3.0, 0.0), 2.0)
    assert met and all(2.0 < w.depth <= 2.5 + 1e-6 for w in met)
    assert not witnesses(slot, (6.0, 3.0, 0.0), 2.51)


def test_more_cut_cells_than_there_was_room_for():
    """Hundreds of ramps, each of which cuts parts of a thousand cells: what a slot meets behind them is as high as they
    have left it."""
    rng = np.random.default_rng([random_seed(), 31])
    ramps = np.column_stack((rng.uniform(0, 28, 400), rng.uniform(0, 24, 400), rng.uniform(-1.5, 0.2, 400)))
    places = np.vstack((ramps, [(-5, 12, 5), (-5, 12, -4), (33, 12, -4)]))
    kinds = [RAPID] * (len(places) - 2) + [FEED]
    met = witnesses(places, (6.0, 0.5, 0.0), 1.5, kinds=kinds, low=(0.0, 0.0, -12.0), high=(28.0, 24.0, 0.0))
    assert met
    for w in met[:: max(1, len(met) // 4)]:
        assert left_at(w.x, w.y, places[:-1], (6.0, 0.5, 0.0), high=(28.0, 24.0, 0.0)) == pytest.approx(
            w.depth + w.place[2], abs=0.005
        )
