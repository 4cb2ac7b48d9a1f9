# SPDX-License-Identifier: GPL-2.0-or-later
"""tests/support/judge_force.py against integrals that have no stock and no path, for all shapes of tool; and what it
says of another cutter or a wrong limit."""

import numpy as np
import pytest

from support import judge_force
from support.judge import Blank, Run, Tool, ball

BOX = Blank.corners((0.0, 0.0, -10.0), (60.0, 40.0, 0.0))
SPEED, RPS, KC11, MC = 20.0, 150.0, 800.0, 0.25  # mm/s, 1/s, N/mm2
RADIAL, APART = 0.3, 2.0  # mm, between places
COUNT = 400  # elements of a corner or a cone
WITHIN = 0.01  # of the force


def log(points):
    """A log of a straight run through the points (mm), rounded as LinuxCNC's."""
    rows = [np.array(points[0], dtype=float)]
    for a, b in zip(points[:-1], points[1:]):
        a, b = np.array(a, dtype=float), np.array(b, dtype=float)
        count = max(1, int(round(np.linalg.norm(b - a) / (SPEED * 0.001))))
        rows += [a + (b - a) * n / count for n in range(1, count + 1)]
    at, count = np.round(np.array(rows), 6), len(rows)
    return {
        "sample": np.arange(count),
        "x": at[:, 0],
        "y": at[:, 1],
        "z": at[:, 2],
        "tool_offset_z": np.zeros(count),
        "motion_type": np.full(count, 2),
        "line": np.ones(count, int),
        "period": 0.001,
        "units_per_mm": 1.0,
    }


def on_the_path(tool, depth, beside, fall=0.0):
    """(run, force (n,)) of a slot, or of a pass that is so far beside one, along X; fall: of the slot, mm per mm."""
    points = [(-8.0, 20.0, -depth + 8.0 * fall), (30.0, 20.0, -depth - 30.0 * fall)]
    if beside:
        points = [
            (-8.0, 20.0, -depth),
            (70.0, 20.0, -depth),
            (70.0, 20.0, 5.0),
            (-8.0, 20.0 + beside, 5.0),
            (-8.0, 20.0 + beside, -depth),
            (30.0, 20.0 + beside, -depth),
        ]
    run = Run(log(points))
    return run, lambda edges: judge_force.side_force(
        run, BOX, [tool], [edges], np.full(len(run.tips), RPS), KC11, MC, APART
    )


def profile(tool, depth):
    """(radius (n,), length (n,), lean (n,)) of fine elements of an edge, up to the depth."""
    corner, half = tool.corner, np.radians(0.5 * tool.angle)
    turn = 0.5 * np.pi - half if tool.angle else 0.5 * np.pi
    flat = 0.0 if tool.angle else 0.5 * tool.diameter - corner
    pieces = []
    if corner:
        p = (np.arange(COUNT) + 0.5) * turn / COUNT
        height = corner * (1.0 - np.cos(p))
        pieces.append(np.stack((flat + corner * np.sin(p), np.full(COUNT, corner * turn / COUNT), np.sin(p), height)))
    top, begin = corner * (1.0 - np.cos(turn)), flat + corner * np.sin(turn)
    z = top + (np.arange(COUNT) + 0.5) * (12.0 - top) / COUNT
    slope = np.tan(half) if tool.angle else 0.0
    radius = begin + slope * (z - top)
    pieces.append(
        np.stack((radius, np.full(COUNT, (12.0 - top) / COUNT * np.hypot(1.0, slope)), np.full(COUNT, np.cos(half)), z))
    )
    every = np.concatenate(pieces, axis=1)
    return every[:3, every[3] < depth]


def expected(tool, depth, beside, edges, step=0.25):
    """N: the largest vector sum of the edges of a turn, by integrals over angle and profile."""
    angle = np.radians(np.arange(-90.0, 90.0, step))
    radius, length, lean = profile(tool, depth)
    own = length * (SPEED / (RPS * edges) * lean) ** (1.0 - MC)
    met = np.ones((len(angle), len(radius)), bool)
    if beside:  # the slot beside it has the same profile: there is stock where a radius reaches past it
        y = beside + radius * np.sin(angle)[:, None]
        met = y > radius - 1e-9
        # stock over a lower element that the slot has left is the higher the farther it lies from the slot's axis
        met |= np.abs(y) > radius
    turned = np.exp(1j * angle)[:, None] * (1j - RADIAL * lean)
    one = np.sum(np.where(met, own * turned, 0.0), axis=1) * np.cos(angle) ** (1.0 - MC)
    whole = np.concatenate((one, np.zeros(int(360 / step) - len(one))))
    return KC11 * float(np.abs(whole.reshape(edges, -1).sum(axis=0)).max())


@pytest.mark.parametrize(
    "tool, depth, beside, edges",
    [
        (Tool(6.0), 3.0, 0.0, 3),
        (Tool(6.0), 3.0, 1.5, 2),
        (Tool(10.0), 2.0, 0.5, 4),
        (Tool(6.0), 3.0, 4.5, 4),
        (ball(6.0), 2.0, 0.0, 2),
        (ball(6.0), 2.0, 2.2, 3),
        (Tool(6.0, 1.0), 3.0, 0.0, 2),
        (Tool(6.0, 1.0), 2.5, 2.0, 4),
        (Tool(12.7, 0.0, 60.0), 3.0, 0.0, 2),
        (Tool(12.7, 0.0, 90.0), 2.0, 1.2, 3),
        (Tool(6.0, 0.5, 20.0), 3.0, 0.0, 2),
        (Tool(6.0, 0.5, 20.0), 2.0, 1.0, 2),
    ],
)
def test_slots_and_passes(tool, depth, beside, edges):
    force = on_the_path(tool, depth, beside)[1](edges)
    assert np.median(force[-700:-100]) == pytest.approx(expected(tool, depth, beside, edges), rel=WITHIN)


def test_plunges_and_ramps():
    """All edges of a drill that is in the middle of its hole push against each other; on a ramp the bottom of two edges
    does, and the wall counts."""
    run = Run(log([(30.0, 20.0, 1.0), (30.0, 20.0, -4.0)]))
    assert judge_force.side_force(run, BOX, [Tool(6.0)], [3], np.full(len(run.tips), RPS), KC11, MC).max() < 1.0
    _run, force = on_the_path(Tool(6.0), 2.0, 0.0, fall=0.02)
    last = force(2)[-1]
    assert last == pytest.approx(expected(Tool(6.0), 2.6, 0.0, 2), rel=0.03)


def test_a_wrong_limit_is_refused():
    """The verdict of the force itself is 100 %, and 107.5 % of a limit 7 % lower, all the time; where the limit is said
    to act counts for how much of it is used."""
    run, force = on_the_path(Tool(6.0), 3.0, 0.0)
    found, every = force(3), np.ones(len(run.tips), bool)
    limit = np.full(len(found), np.median(found[-700:-100]))
    right, wrong = (judge_force.judge(run, found, share * limit, every, every) for share in (1.0, 0.93))
    assert right.peak < 1.01 and right.over_share == 0.0 and right.used == pytest.approx(1.0, abs=0.01)
    assert wrong.peak > judge_force.PEAK and wrong.over_share > 0.7
    other = judge_force.judge(run, force(2), limit, every, every)
    assert other.peak > 1.3, "a cutter of two edges has chips half as thick again"
    assert judge_force.judge(run, found, limit, ~every, every).peak == 0.0


def test_the_beam():
    """F L^3 / 3 E I, I = pi D^4 / 64: the table of docs/user/materials.md has 267 N for 0.02 mm at 10 mm and 40 mm."""
    assert 0.02 * judge_force.stiffness(10.0, 40.0) == pytest.approx(267.0, abs=0.5)


@pytest.mark.parametrize(
    "tool, depth, beside",
    [
        (Tool(6.0), 3.0, 0.0),
        (Tool(10.0), 2.1, 0.5),
        (ball(6.0), 2.0, 0.0),
        (Tool(6.0, 1.0), 3.0, 0.0),
        (Tool(12.7, 0.0, 90.0), 2.1, 0.0),
        (Tool(6.0, 0.5, 20.0), 3.0, 0.0),
    ],
)
def test_chip_and_work(tool, depth, beside):
    """A_mc and the largest chip in slots of all shapes, and of a flat end in a thin pass; a cutter with fewer edges has
    the same."""
    run, _force = on_the_path(tool, depth, beside)
    met, other = (
        judge_force.met(run, BOX, [tool], [edges], np.full(len(run.tips), RPS), MC, APART) for edges in (4, 2)
    )
    angle, step = np.radians(np.arange(0.01, 90.0, 0.02)), np.radians(0.02)
    wall = 1.0 - 2.0 * beside / tool.diameter  # sine of the angle of the wall that the slot before has left
    radius, length, lean = profile(tool, depth)
    turn = np.cos(angle) ** (1.0 - MC) * (np.sin(angle) > wall if beside else 2.0)
    work = np.sum(radius * length * lean ** (1.0 - MC)) * np.sum(turn) * step
    last = slice(-700, -100)
    assert np.median(met.work[last]) == pytest.approx(work, rel=WITHIN)
    assert np.median(met.chip[last]) == pytest.approx(
        lean.max() * (np.sqrt(1.0 - wall**2) if beside else 1.0), rel=WITHIN
    )
    assert np.array_equal(met.work, other.work) and np.allclose(2.0 * met.fed[last], other.fed[last])
