# SPDX-License-Identifier: GPL-2.0-or-later
"""Random programs of the simulated robot, and whether it can run them: Newton's method on a chain of rotations
(puma_oracle.py).

Used by tests/cycles/test_pattern_reach.py and bench/bench_pattern.py.  Nothing of LinuxCNC's kinematics and of
chipwise's sampling is in it.
"""

import math
import random

import numpy as np

from chipwise.cycles.pattern import PatternRequest, pattern_plan
from chipwise.errors import CycleError
from chipwise.pattern.recorded import ARC, FEED, RAPID, Recorded, Step
from chipwise.stations.pose import in_station, matrix_of
from support import puma_oracle

PINS = (
    ("pumakins.A2", 300.0),
    ("pumakins.A3", 50.0),
    ("pumakins.D3", 70.0),
    ("pumakins.D4", 400.0),
    ("pumakins.D6", 70.0),
)
LIMITS = ((-170, 170, 180), (-160, 60, 180), (-80, 80, 180), (-250, 250, 180), (-160, 160, 180), (-250, 250, 180))
HOME, DOWN, SPEEDS = (0.0, -70.0, 10.0, 0.0, 60.0, 0.0), (180.0, 0.0, 0.0), (100.0, 60.0)
OPEN = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NEAR_DEGREES, NEAR_SPEED = 0.6, 1.6  # cases so near to a limit prove nothing


def random_sub(r, start):
    """Lines and an arc in 40 mm, from a safe height and back to it."""
    steps = [
        Step(RAPID, 2, (r.uniform(0, 40), r.uniform(0, 40), 30.0), source=2),
        Step(FEED, 3, (20.0, 20.0, -2.0), 900.0, source=3),
    ]
    for line in range(4, 4 + r.randint(1, 4)):
        steps.append(
            Step(FEED, line, (r.uniform(0, 40), r.uniform(0, 40), r.uniform(-3, 0)), r.uniform(300, 1500), source=line)
        )
    x, y, z = steps[-1].end
    steps += [
        Step(ARC, 9, (x, y, z), 900.0, (x + r.uniform(3, 9), y, z), 2, r.choice((1, -1)), source=9),
        Step(RAPID, 10, (x, y, 30.0), source=10),
    ]
    return Recorded(tuple(steps), (), start)


def random_station(r, wild):
    """(matrix, origin)."""
    lean = r.uniform(0, 170 if wild else 25)
    matrix = (
        matrix_of((0, 0, r.uniform(-180, 180) if wild else r.uniform(-60, 60)))
        @ matrix_of((0, 0, 0))
        @ _leaning(lean, r.uniform(0, 2 * math.pi))
    )
    origin = (
        (r.uniform(150, 700), r.uniform(-350, 350), r.uniform(-500, 450))
        if wild
        else (r.uniform(380, 450), r.uniform(-120, 120), r.uniform(-150, 60))
    )
    return matrix, np.array(origin)


def _leaning(degrees, about):
    turn = matrix_of((0, 0, math.degrees(about)))
    return turn @ matrix_of((degrees, 0, 0)) @ turn.T


def oracle(recorded, matrix, origin, first, abc):
    """(worst lack of limits in degrees, below 0: beyond one; largest speed over the fastest; whether it was followed)
    along the path."""
    q, room, fast, here, now = np.array(HOME), math.inf, 0.0, np.array(first, float), np.array(DOWN)
    for step in recorded.steps:
        ends = [np.array(step.end)]
        if step.kind == ARC:
            centre = np.array(step.centre)
            begin = np.array(ends[0]) - centre
            angles = np.linspace(0, 2 * math.pi, 25)[1:] * (1 if step.turns > 0 else -1)
            ends = [
                centre
                + (begin[0] * math.cos(a) - begin[1] * math.sin(a), begin[0] * math.sin(a) + begin[1] * math.cos(a), 0)
                for a in angles
            ]
        for end in ends:
            to, pose = matrix @ end + origin, np.array(abc)
            seconds = max(
                np.linalg.norm(to - here) / (SPEEDS[0] if step.kind == RAPID else step.feed / 60),
                np.abs(pose - now).max() / SPEEDS[1],
                1e-9,
            )
            count = max(2, math.ceil(np.linalg.norm(to - here) / 2), math.ceil(np.abs(pose - now).max() / 1.0))
            for share in np.arange(1, count + 1) / count:
                solved = _newton(q, here + (to - here) * share, matrix_of(now + (pose - now) * share))
                if solved is None:
                    return room, fast, False
                fast = max(fast, *(abs(a - b) * count / seconds / limit[2] for a, b, limit in zip(solved, q, LIMITS)))
                room = min(
                    room,
                    *(min(v - low, high - v) for v, (low, high, _s) in zip(solved, LIMITS)),
                    *(180 - abs(solved[k]) for k in (0, 3, 5)),
                )
                q = solved
                if fast > 50:
                    return room, fast, False
            here, now = to, pose
    return room, fast, True


def _newton(q, place, tool):
    """Joints near q of a pose; None if there are none."""
    for _ in range(8):
        at, turn = puma_oracle.tip(q)
        error = np.concatenate([place - at, _vector(tool @ turn.T) * 100])
        if np.abs(error).max() < 1e-7:
            return q
        jacobian = np.empty((6, 6))
        for k in range(6):
            other = q.copy()
            other[k] += 1e-4
            moved, turned = puma_oracle.tip(other)
            jacobian[:, k] = np.concatenate([moved - at, _vector(turned @ turn.T) * 100]) / 1e-4
        try:
            q = q + np.clip(np.linalg.solve(jacobian, error), -15, 15)
        except np.linalg.LinAlgError:
            return None
    return None


def _vector(rotation):
    """Rotation vector of a small rotation."""
    return (
        np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
        / 2
    )


def judged(seed, wild):
    """("good", "bad" or "near", what G75 says or "")."""
    r = random.Random(f"reach {seed}")
    (matrix, origin), first = random_station(r, wild), puma_oracle.tip(HOME)[0]
    abc = in_station(matrix, DOWN, DOWN)
    recorded = random_sub(r, tuple(matrix.T @ (first - origin)))
    travel = dict(
        matrix=OPEN, shift=(0.0, 0.0, 0.0), limits=tuple((f"axis {letter}", -2000.0, 2000.0) for letter in "XYZ")
    )
    reach = dict(module="pumakins", pins=PINS, joints=HOME, limits=LIMITS, per_mm=1.0, speeds=SPEEDS, abc=DOWN)
    request = PatternRequest(
        shift=(0, 0, 0),
        start=tuple(first),
        chord=0.002,
        most_moves=100_000,
        station=1,
        pose=abc,
        travel=travel,
        reach=reach,
        place=(tuple(map(tuple, matrix.tolist())), tuple(origin.tolist())),
    )
    try:
        pattern_plan(request, lambda start, abc, mirrored: recorded)
        said = ""
    except CycleError as error:
        said = str(error)
    room, fast, followed = oracle(recorded, matrix, origin, first, abc)
    if followed and room > NEAR_DEGREES and fast < 1 / NEAR_SPEED:
        return "good", said
    return ("bad" if not followed or room < -NEAR_DEGREES or fast > NEAR_SPEED else "near"), said
