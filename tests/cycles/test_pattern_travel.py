# SPDX-License-Identifier: GPL-2.0-or-later
"""G75 and the soft limits: found before anything moves, and only then.  The oracle samples every move with complex
numbers."""

import cmath
import math
import random
import re

import numpy as np
import pytest

from chipwise.cycles.pattern import PatternRequest, pattern_plan
from chipwise.errors import CycleError
from chipwise.machine import limits
from chipwise.pattern.recorded import ARC, FEED, RAPID, Recorded, Step
from support.random_cases import random_count, random_seed

SURE = 1e-3  # mm; cases nearer to a limit than this prove nothing


def random_recorded(r):
    """A sub of lines and arcs of G17, from (0, 0, 10)."""
    steps, at = [Step(RAPID, 1, (r.uniform(-9, 9), r.uniform(-9, 9), 10.0), source=1)], None
    for line in range(2, r.randint(4, 12)):
        at = steps[-1].end
        if r.random() < 0.5:
            centre = complex(at[0] + r.uniform(-9, 9), at[1] + r.uniform(-9, 9))
            end = centre + (complex(*at[:2]) - centre) * cmath.exp(1j * r.uniform(0, 2 * math.pi))
            rise = r.choice((0.0, r.uniform(-3, 3)))
            steps.append(
                Step(
                    ARC,
                    line,
                    (end.real, end.imag, at[2] + rise),
                    100.0,
                    (centre.real, centre.imag, at[2]),
                    2,
                    r.choice((-2, -1, 1, 2)),
                    source=line,
                )
            )
        else:
            steps.append(
                Step(r.choice((RAPID, FEED)), line, tuple(r.uniform(-12, 12) for _ in range(3)), 100.0, source=line)
            )
    return Recorded(tuple(steps), (), (0.0, 0.0, 10.0))


def sampled(recorded):
    """[(line, points (n, 3))] of a Recorded."""
    here = np.array(recorded.start)
    for step in recorded.steps:
        if step.kind == ARC:
            centre = complex(*step.centre[:2])
            first, last = complex(*here[:2]) - centre, complex(*step.end[:2]) - centre
            sweep = cmath.phase(last / first) % (2 * math.pi)
            sweep = sweep - 2 * math.pi if step.turns < 0 else sweep
            sweep += math.copysign(2 * math.pi * (abs(step.turns) - 1), step.turns)
            share = np.linspace(0, 1, 4001)
            circle = centre + first * np.exp(1j * sweep * share)
            yield step.source, np.column_stack([circle.real, circle.imag, here[2] + (step.end[2] - here[2]) * share])
        else:
            yield step.source, np.array([step.end])
        here = np.array(step.end)


def turned(tilt, turn):
    t, z = math.radians(tilt), math.radians(turn)
    return np.array([[1, 0, 0], [0, math.cos(t), -math.sin(t)], [0, math.sin(t), math.cos(t)]]) @ np.array(
        [[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]]
    )


@pytest.mark.parametrize(
    "mirror, offset, says",
    [
        (0, 0.0, ""),
        (2, 0.0, "line 3 of the sub, copy 1: axis A would be at -100 degrees, beyond its limit of -90"),
        (0, 20.0, ""),
        (0, 30.5, "line 3 of the sub, copy 1: axis A would be at 130.5 degrees, beyond its limit of 130"),
        (1, 0.0, ""),
    ],
)
def test_a_rotary_axis(mirror, offset, says):
    """Sense and work offset of A count."""
    steps = (
        Step(RAPID, 2, (0, 0, 9), source=2, abc=(20.0, 0.0, 0.0)),
        Step(FEED, 3, (5, 0, 9), 100.0, source=3, abc=(100.0, 0.0, 0.0)),
    )
    open_ended = ("axis B", -math.inf, math.inf, 0.0)
    travel = dict(
        matrix=np.eye(3).tolist(),
        shift=(0, 0, 0),
        limits=[(f"axis {letter}", -99, 99) for letter in "XYZ"],
        rotary=(("axis A", -90.0, 130.0, offset), open_ended, open_ended),
    )
    request = PatternRequest(
        shift=(0, 0, 0), start=(0, 0, 10), chord=0.002, most_moves=1000, mirror=mirror, travel=travel
    )
    try:
        pattern_plan(request, lambda start, abc, mirrored: Recorded(steps, (), start, abc))
        said = ""
    except CycleError as error:
        said = str(error)
    assert (says in said) if says else not said, said


def judge_refusal(error, beyond, clearly, low, high, seed):
    """beyond, clearly: lines with a point beyond a limit, and with one that is so by more than SURE."""
    said = re.search(
        r"line (\d+) of the sub, copy 1: axis ([XYZ]) would be at (\S+) mm, beyond its limit of (\S+) mm", str(error)
    )
    assert said, error
    k, value = "XYZ".index(said[2]), float(said[3])
    assert beyond and int(said[1]) in beyond[: beyond.index(clearly[0]) + 1 if clearly else None], (
        f"CHIPWISE_SEED={seed}: {error}"
    )
    assert (
        float(said[4]) == pytest.approx((low if value < low[k] else high)[k], abs=1e-4)
        and not low[k] <= value <= high[k]
    )


@pytest.mark.parametrize("case", range(random_count(200)))
def test_random_patterns(case):
    """Refused if and only if a point is beyond a limit; the line is the first one's, axis, value and limit are
    right."""
    seed = random_seed() + case
    r = random.Random(f"travel {seed}")
    recorded, work, shift = (
        random_recorded(r),
        turned(0, r.uniform(-180, 180)),
        np.array([r.uniform(-20, 20) for _ in range(3)]),
    )
    place, where = (
        turned(r.choice((0, 0, r.uniform(-60, 60))), r.uniform(-180, 180)),
        np.array([r.uniform(-20, 20) for _ in range(3)]),
    )
    found = [(line, (points @ place.T + where) @ work.T + shift) for line, points in sampled(recorded)]
    every = np.vstack([points for _line, points in found])
    low, high = every.min(axis=0) - 2, every.max(axis=0) + 2
    if case % 2:
        k = r.randrange(3)
        if r.random() < 0.5:
            low[k] += 2 + r.uniform(0.005, 3)
        else:
            high[k] -= 2 + r.uniform(0.005, 3)
    words = dict(
        matrix=tuple(map(tuple, work.tolist())),
        shift=tuple(shift.tolist()),
        limits=tuple((f"axis {letter}", a, b) for letter, a, b in zip("XYZ", low.tolist(), high.tolist())),
    )
    request = PatternRequest(
        shift=(0, 0, 0),
        start=(0, 0, 10.0),
        chord=0.002,
        most_moves=100_000,
        travel=words,
        station=1,
        place=(tuple(map(tuple, place.tolist())), tuple(where.tolist())),
    )
    out = [(line, points[(np.maximum(points - high, low - points)).max(axis=1) > 0]) for line, points in found]
    clearly = [line for line, points in out if len(points) and np.maximum(points - high, low - points).max() > SURE]
    try:
        pattern_plan(request, lambda start, abc, mirrored: recorded)
    except CycleError as error:
        judge_refusal(error, [line for line, points in out if len(points)], clearly, low, high, seed)
    else:
        assert not clearly, f"CHIPWISE_SEED={seed}: line {clearly[0]} was not found"


def test_most_bad_ones_are_bad():
    """The random cases have what they are for: arcs that only bulge beyond a limit, too."""
    bulges = 0
    for case in range(200):
        recorded = random_recorded(random.Random(f"travel {case}"))
        every = np.vstack([points for _line, points in sampled(recorded)])
        ends = np.array([step.end for step in recorded.steps])
        bulges += bool((every.max(axis=0) > ends.max(axis=0) + 0.1).any())
    assert bulges > 100


INI = (
    "[TRAJ]\nLINEAR_UNITS = {unit}\n[KINS]\nKINEMATICS = {kins}\n[AXIS_X]\nMIN_LIMIT = -5\nMAX_LIMIT = 10 # mm\n"
    "[AXIS_Y]\nMAX_LIMIT = 1e3\n"
    "[JOINT_0]\nMIN_LIMIT = -4\nMAX_LIMIT = 12\n[JOINT_1]\nMIN_LIMIT = -7\nMAX_LIMIT = nonsense\n[JOINT_2]\n"
    "MIN_LIMIT = -8\n"
)


@pytest.mark.parametrize(
    "unit, kins, expected",
    [
        ("mm", "trivkins coordinates=XYZ", [(-4, 10), (-7, 1000), (-8, math.inf)]),
        ("mm", "trivkins", [(-4, 10), (-7, 1000), (-8, math.inf)]),
        ("inch", "trivkins coordinates=xyz kinstype=both", [(-101.6, 254), (-177.8, 25400), (-203.2, math.inf)]),
        ("mm", "trivkins coordinates=XYYZ", [(-4, 10), (-7, 1000), (-math.inf, math.inf)]),
        ("mm", "trivkins coordinates=XZ", [(-4, 10), (-math.inf, 1000), (-7, math.inf)]),
        ("mm", "pumakins", [(-5, 10), (-math.inf, 1000), (-math.inf, math.inf)]),
    ],
)
def test_limits_of_an_ini_file(tmp_path, unit, kins, expected):
    (tmp_path / "m.ini").write_text(INI.format(unit=unit, kins=kins))
    found = limits.axis_limits(str(tmp_path / "m.ini"))
    assert [name for name, *_ in found] == ["axis X", "axis Y", "axis Z"]
    assert [tuple(pair) for _name, *pair in found] == [pytest.approx(pair) for pair in expected]
