# SPDX-License-Identifier: GPL-2.0-or-later
"""components/core/clamp*.c: no traverse and no feed comes nearer to a clamp than the clearance, and none is stopped
that does not.

Judged by support/clamp_oracle.py, which knows neither the lines of an outline nor the golden section.
"""

import ctypes as C
import math
import random

import numpy as np
import pytest

from chipwise.clib import layout
from chipwise.clib.library import library
from support.clamp_machine import PARABOLIC, PERIOD, STOP, TANGENT, Guard, both, measured, point, run
from support.clamp_oracle import grown
from support.random_cases import random_count, random_seed, write_replay

OFF_MM = 0.02  # the core's own: chords of arcs (0.005), nearest place of a line (0.01)
ROUND_OFF = 0.004  # of the corner radius, that tangents lie outside of an arc
CASES = 1000


def random_tool(random):
    shape = random.choice(("flat", "ball", "bull", "vee", "tapered-ball"))
    diameter = random.choice((1.0, 6.0, 12.0, 50.0))
    return {
        "shape": shape,
        "diameter": diameter,
        "corner_radius": diameter * random.uniform(0.05, 0.3),
        "tip_angle": random.choice((20.0, 60.0, 90.0)),
        "stick_out": random.uniform(5.0, 40.0),
        "holder_diameter": random.choice((0.0, 30.0, 63.0)),
    }


def random_clamp(random):
    middle, top = (random.uniform(-40, 40), random.uniform(-40, 40)), random.uniform(-15, 5)
    if random.random() < 0.4:
        radius = random.uniform(1, 15)
        return {"middle": middle, "half": (radius, radius), "diameter": 2 * radius, "top": top, "turn": 0.0}
    half, turn = (random.uniform(1, 20), random.uniform(1, 20)), random.choice((0.0, random.uniform(-math.pi, math.pi)))
    c, s = math.cos(turn), math.sin(turn)
    corners = [
        (middle[0] + x * half[0] * c - y * half[1] * s, middle[1] + x * half[0] * s + y * half[1] * c)
        for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return {"middle": middle, "half": half, "corners": corners, "top": top, "turn": turn}


def random_path(random, joins):
    """1 to 4 pieces, lines and arcs; `joins`: how corners may be left."""

    def place():
        return random.uniform(-60, 60), random.uniform(-60, 60), random.uniform(-12, 8)

    at, pieces = place(), []
    for _ in range(random.randint(1, 4)):
        if pieces and pieces[-1]["kind"] == "arc" and random.random() < 0.5:  # goes on as the arc ends
            last = pieces[-1]
            x, y = at[0] - last["centre"][0], at[1] - last["centre"][1]
            turn = math.copysign(1.0, last["angle"])
            far = random.uniform(5, 60) / math.hypot(x, y)
            last["join"] = TANGENT
            pieces.append(
                {
                    "kind": "line",
                    "start": at,
                    "end": (at[0] - turn * y * far, at[1] + turn * x * far, at[2]),
                    "join": STOP,
                }
            )
            at = pieces[-1]["end"]
        elif random.random() < 0.3 and PARABOLIC not in joins:
            centre = at[0] + random.uniform(-30, 30), at[1] + random.uniform(2, 30)
            angle, rise = random.choice((-1, 1)) * random.uniform(0.3, 6.0), 0.0
            pieces.append({"kind": "arc", "start": at, "centre": centre, "angle": angle, "rise": rise, "join": STOP})
            x, y = at[0] - centre[0], at[1] - centre[1]
            c, s = math.cos(angle), math.sin(angle)
            at = centre[0] + x * c - y * s, centre[1] + x * s + y * c, at[2] + rise
        else:
            to = place()
            pieces.append({"kind": "line", "start": at, "end": to, "join": STOP})
            at = to
    for piece in pieces[:-1]:
        if piece["join"] == STOP:
            piece["join"] = random.choice(joins)
    return [measured(piece) for piece in pieces]


def near(tool, clamps, places):
    """(n,) of the nearest clamp, cutter or holder."""
    parts = ["tool", *(["holder"] if tool["holder_diameter"] else [])]
    return np.min([grown(tool, part, clamp, places) for clamp in clamps for part in parts], axis=0)


def judge(case, tool, clamps, clearance, pieces, velocity, accel, blends=False):
    """What is wrong, or None; "" of a case that shows nothing: it begins within the clearance."""
    if near(tool, clamps, np.array([point(pieces[0], 0.0)]))[0] < clearance + 0.05:
        return ""
    guard = Guard(clamps, clearance, tool, pieces, accel)
    assert guard.taken
    free, places, stop = both(pieces, velocity, accel, guard)
    rounded = ROUND_OFF * (
        tool["diameter"] / 2
        if tool["shape"] == "ball"
        else tool["corner_radius"]
        if tool["shape"] in ("bull", "tapered-ball")
        else 0.0
    )
    least = near(tool, clamps, places).min()
    if least < clearance - OFF_MM:
        return f"late: {least:.3f} of {clearance} mm, stopped at {stop} of {len(places)}"
    of_path = near(tool, clamps, free)
    step = velocity * PERIOD / 2  # between two places
    bent = velocity**2 / (2 * accel) if blends else 0.0
    if stop is not None and of_path.min() > clearance + OFF_MM + rounded + step + bent / 4:
        return f"false: {of_path.min():.3f} of {clearance} mm"
    if stop is not None and not blends and of_path.min() < clearance - OFF_MM:
        meets = int(np.argmax(of_path < clearance + OFF_MM + rounded))
        left = (
            np.linalg.norm(np.diff(free[len(places) - 1 : meets + 1], axis=0), axis=1).sum()
            if meets >= len(places)
            else 0.0
        )
        travels = np.linalg.norm(np.diff(free[stop:], axis=0), axis=1)
        v = (travels[0] if len(travels) else 0.0) / PERIOD
        if (
            np.linalg.norm(np.diff(free[stop : meets + 1], axis=0), axis=1).sum()
            > 0.7 * v * v / accel + 8 * (v + accel * PERIOD * 4) * PERIOD + 0.5 + 2 * rounded
        ):
            return f"early: {left:.3f} mm before, v {v:.1f}"
    if stop is None and of_path.min() < clearance - OFF_MM:
        return f"missed: {of_path.min():.3f} of {clearance} mm"
    return None


def many(name, joins, cases, seed):
    shown = 0
    for case in range(cases):
        chance = random.Random(f"{seed}/{name}/{case}")
        tool, clearance = random_tool(chance), chance.choice((0.0, 0.5, 1.0, 2.5))
        clamps = [random_clamp(chance) for _ in range(chance.choice((1, 3, 12)))]
        pieces, velocity, accel = (
            random_path(chance, joins),
            chance.choice((8.0, 25.0, 80.0, 200.0)),
            chance.choice((300.0, 1000.0, 3000.0)),
        )
        if PARABOLIC in joins:  # a blend ends before the middle of the next piece
            velocity = min(velocity, math.sqrt(accel * min(piece["length"] for piece in pieces)))
        wrong = judge(case, tool, clamps, clearance, pieces, velocity, accel, PARABOLIC in joins)
        if wrong:
            pytest.fail(f"case {case} of seed {seed}: {wrong}; {write_replay('clamps', {'seed': seed, 'case': case})}")
        shown += wrong is None
    return shown


def test_random_moves():
    cases = random_count(CASES, 100)
    shown = many("stops", [STOP], cases, random_seed())
    assert shown > cases / 4


def test_random_blends():
    """Corners that are left by a parabola, as with G64."""
    cases = random_count(150, 30)
    assert many("blends", [PARABOLIC, STOP], cases, random_seed()) > cases / 4


FLAT = {
    "shape": "flat",
    "diameter": 6.0,
    "corner_radius": 0.0,
    "tip_angle": 0.0,
    "stick_out": 20.0,
    "holder_diameter": 40.0,
}
BLOCK = {
    "middle": (0.0, 0.0),
    "half": (10.0, 5.0),
    "corners": [(-10.0, -5.0), (10.0, -5.0), (10.0, 5.0), (-10.0, 5.0)],
    "top": 0.0,
    "turn": 0.0,
}


def line(start, end, join=STOP):
    return measured({"kind": "line", "start": start, "end": end, "join": join})


@pytest.mark.parametrize("velocity", [1.0, 5.0, 200.0])
@pytest.mark.parametrize("knows_path", [True, False])
@pytest.mark.parametrize(
    "start, end, met",
    [
        ((-17.0, 0.0, -5.0), (0.0, 0.0, -5.0), True),
        ((0.0, 9.3, -5.0), (9.0, 8.7, -5.0), True),
        ((-14.2, 9.5, -5.0), (-20.0, 12.0, -5.0), False),
    ],
    ids=("at", "slope", "away"),
)
def test_a_feed_is_stopped_before_the_clearance(velocity, knows_path, start, end, met):
    """Straight at it, slowly along a slope (which must not creep in), and away."""
    pieces = [line(start, end)]
    places, stop = run(pieces, velocity, 1000.0, Guard([BLOCK], 1.0, FLAT, pieces, 1000.0, knows_path), 40000)
    assert (stop is not None) == met
    assert near(FLAT, [BLOCK], places).min() > 1.0 - OFF_MM
    if met:
        assert near(FLAT, [BLOCK], places[-1:])[0] < 1.0 + 0.1 + velocity**2 / 2000 * 0.6 + 8 * velocity * PERIOD


def test_holder_and_shank():
    """The holder touches first over a low clamp beside a deep cut; above its top nothing does."""
    low = {**BLOCK, "top": 10.5}
    for depth, part in ((-10.0, 1), (-5.0, None)):
        pieces = [line((-40.0, 0.0, depth), (-21.0, 0.0, depth))]
        guard = Guard([low], 1.0, FLAT, pieces, 1000.0)
        _, stop = run(pieces, 50.0, 1000.0, guard)
        assert (stop is not None) == (part is not None)
        assert part is None or (guard.clamps.number, guard.clamps.part) == (1, part)


@pytest.mark.parametrize(
    "end, stops",
    [
        ((-40.0, 0.0, -5.0), False),
        ((-13.3, 30.0, -5.0), False),
        ((-12.0, 0.0, -5.0), True),
        ((-13.3, 0.0, 30.0), False),
    ],
)
def test_from_within_the_clearance(end, stops):
    """Away from it and along it, but not nearer."""
    pieces = [line((-13.3, 0.0, -5.0), end)]
    places, stop = run(pieces, 30.0, 1000.0, Guard([BLOCK], 1.0, FLAT, pieces, 1000.0))
    assert (stop is not None) == stops
    assert near(FLAT, [BLOCK], places).min() > 0.3 - OFF_MM


def test_a_pin_inside_of_a_corner():
    """Both lines keep the clearance, the parabola between them does not."""
    pin = {"middle": (-9.0, 9.0), "half": (1.0, 1.0), "diameter": 2.0, "top": 0.0, "turn": 0.0}
    pieces = [line((-60.0, 0.0, -5.0), (0.0, 0.0, -5.0), PARABOLIC), line((0.0, 0.0, -5.0), (0.0, 60.0, -5.0))]
    assert run(pieces, 20.0, 500.0, Guard([pin], 4.0, FLAT, pieces, 500.0))[1] is None
    assert run(pieces, 120.0, 500.0, Guard([pin], 4.0, FLAT, pieces, 500.0))[1] is not None


def test_the_work_is_bounded_and_too_much_of_it_stops():
    """A hundred clamps that are grazed all at once."""
    clamps = [{**BLOCK, "top": -1.0 - 1e-5 * k} for k in range(layout.CLAMPS)]
    ball = {**FLAT, "shape": "ball", "diameter": 50.0}
    pieces = [line((-60.0 + k * 0.5, 0.0, 0.2), (-59.5 + k * 0.5, 0.0, 0.2), TANGENT) for k in range(150)]
    guard = Guard(clamps, 1.0, ball, pieces, 300.0)
    run(pieces, 200.0, 300.0, guard)
    assert guard.most_work <= layout.CLAMP_WORK + layout.CLAMPS * layout.CLAMP_BODIES


def test_distance():
    """In closed form: a corner of a box, a plane, a cone against a wall, a cylinder."""
    vee = {**FLAT, "shape": "vee", "diameter": 20.0, "tip_angle": 90.0}
    for tool, place, known in (
        (FLAT, (13.0, 9.0, -2.0), math.hypot(3, 4) - 3),
        (FLAT, (0.0, 0.0, 2.5), 2.5),
        (vee, (12.0, 0.0, -1.0), 0.5),
    ):
        guard = Guard([BLOCK], 0.0, tool, [line(place, (99.0, 0.0, 0.0))], 1.0)
        assert library().chip_clamp_distance(
            guard.clamps.table.clamp[0], guard.clamps.body[0], (C.c_double * 3)(*place)
        ) == pytest.approx(known, abs=1e-9)
        assert grown(tool, "tool", BLOCK, np.array([place]))[0] == pytest.approx(known, abs=1e-6)


BAD = {
    "count": [101, 2**63],
    "clearance": [math.nan, -1.0, math.inf, 1e9],
    "x": [math.nan, 1e7],
    "top": [math.inf],
    "half_x": [0.0, -1.0, math.nan],
    "cosine": [0.5, math.nan],
    "is_round": [2],
}


@pytest.mark.parametrize("name, value", [(name, value) for name, values in BAD.items() for value in values])
def test_a_table_that_cannot_be(name, value):
    """It is refused, and the clamps before stay in force; so does one that is being written."""
    guard = Guard([BLOCK], 1.0, FLAT, [line((-60.0, 0.0, -5.0), (0.0, 0.0, -5.0))], 1.0)
    table = layout.ClampTable()
    C.memmove(C.byref(table), C.byref(guard.clamps.table), C.sizeof(table))
    table.clamp[0].top, table.generation = -3.0, 5
    assert library().chip_clamps_take(guard.clamps, C.byref(table)) == 1 and guard.clamps.seen == 2
    table.generation = 6
    setattr(table if name in ("count", "clearance") else table.clamp[0], name, value)
    assert library().chip_clamps_take(guard.clamps, C.byref(table)) == 1
    assert guard.clamps.refused and guard.clamps.table.clamp[0].top == 0.0 and guard.clamps.table.count == 1
