# SPDX-License-Identifier: GPL-2.0-or-later
"""tests/support/judge.py against closed forms at odd angles, and what it says when the trace, the tool or the blank is
not the true one.

The runs are made here: samples of 1 ms along a path, rounded like a log's.
"""

import numpy as np
import pytest

from support import judge as judging
from support.judge import Blank, Run, Tool, ball

BOX = Blank.corners((0.0, 0.0, -10.0), (60.0, 40.0, 0.0))
TURNED = Blank(30.0, 20.0, 50.0, 30.0, -10.0, 0.0, 0.37)
ROUND = Blank.cylinder(30.0, 20.0, 41.3, -10.0, 0.0)
SPEED = 20.0  # mm/s
AREA_WITHIN, VOLUME_WITHIN = 0.0008, 0.002


def log(points, speed=SPEED, period=0.001, motion=2):
    """A log of a straight run through the points (mm), at a constant speed."""
    rows = [np.array(points[0], dtype=float)]
    for a, b in zip(points[:-1], points[1:]):
        a, b = np.array(a, dtype=float), np.array(b, dtype=float)
        count = max(1, int(round(np.linalg.norm(b - a) / (speed * period))))
        rows += [a + (b - a) * n / count for n in range(1, count + 1)]
    at = np.round(np.array(rows), 6)
    count = len(at)
    return {
        "sample": np.arange(count),
        "x": at[:, 0],
        "y": at[:, 1],
        "z": at[:, 2],
        "tool_offset_z": np.zeros(count),
        "motion_type": np.full(count, motion),
        "line": np.ones(count, int),
        "period": period,
        "units_per_mm": 1.0,
    }


def turned(angle, origin=(5.0, 8.0)):
    """(along, beside, z) -> x, y, z of a path at an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return lambda along, beside, z: (origin[0] + along * c - beside * s, origin[1] + along * s + beside * c, z)


def ring(radius, z, centre=(30.0, 20.0), count=2000):
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    return [(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a), z) for a in angle]


def segment(radius, depth):
    """Area of a circle's segment of that depth."""
    return radius**2 * np.arccos((radius - depth) / radius) - (radius - depth) * np.sqrt(2 * radius * depth - depth**2)


def groove(tool, depth):
    """Closed form of the section of a groove."""
    R, r = 0.5 * tool.diameter, tool.corner
    if tool.angle and not tool.corner:
        return depth**2 * np.tan(np.radians(0.5 * tool.angle))
    if tool.angle:  # taper: segment up to the tangent, then a trapezium
        half = np.radians(0.5 * tool.angle)
        touch = r * (1.0 - np.sin(half))
        low, top = r * np.cos(half), r * np.cos(half) + (depth - touch) * np.tan(half)
        return segment(r, touch) + (low + top) * (depth - touch)
    if not r:
        return 2.0 * R * depth
    if depth <= r:
        return segment(r, depth) + 2.0 * (R - r) * depth
    return 0.5 * np.pi * r**2 + 2.0 * (R - r) * r + 2.0 * R * (depth - r)


TOOLS = [
    (Tool(6.0), 4.0),
    (Tool(25.0), 3.3),
    (Tool(1.0), 0.7),
    (ball(6.0), 2.0),
    (ball(6.0), 5.1),
    (ball(3.175), 1.1),
    (Tool(10.0, 2.0), 1.3),
    (Tool(10.0, 2.0), 4.0),
    (Tool(12.7, 0.0, 60.0), 4.4),
    (Tool(8.0, 0.0, 118.0), 1.7),
    (Tool(6.0, 0.5, 20.0), 3.0),
]


def swept(points, tool, blank=BOX, **options):
    run = Run(log(points))
    return run, judging.sweep(run, blank, [tool], **options)


@pytest.mark.parametrize("angle", [0.3, 1.1])
@pytest.mark.parametrize("tool, depth", TOOLS)
def test_grooves(tool, depth, angle):
    """Every cell of a groove, not the mean, has the closed form's area."""
    at = turned(angle, (20.0, 14.0))
    _run, found = swept([at(0.0, 0.0, 2.0), at(0.0, 0.0, -depth), at(13.0, 0.0, -depth)], tool)
    area = found.area[(found.path > found.path[-1] - 5.0) & (found.path < found.path[-1] - 0.1)]
    assert area == pytest.approx(groove(tool, depth), rel=AREA_WITHIN)
    assert found.own_error < 0.005


@pytest.mark.parametrize("tool, depth", TOOLS[::2])
def test_a_second_depth_in_the_tools_own_slot(tool, depth):
    """The walls of the first pass are not met again."""
    at, shallow = turned(0.3, (20.0, 14.0)), 0.5 * depth
    _run, found = swept(
        [
            at(-40.0, 0.0, 2.0),
            at(-40.0, 0.0, -shallow),
            at(26.0, 0.0, -shallow),
            at(26.0, 0.0, 2.0),
            at(-40.0, 0.0, 2.0),
            at(-40.0, 0.0, -depth),
            at(13.0, 0.0, -depth),
        ],
        tool,
    )
    area = found.area[(found.path > found.path[-1] - 8.0) & (found.path < found.path[-1] - 1.0)]
    assert area == pytest.approx(groove(tool, depth) - groove(tool, shallow), rel=0.002, abs=0.001)


@pytest.mark.parametrize("engaged", [0.03, 0.37, 2.9, 5.93])
def test_side_cuts(engaged):
    at = turned(0.3, (20.0, 6.0))
    _run, found = swept(
        [
            at(-20.0, 0.0, -4.0),
            at(30.0, 0.0, -4.0),
            at(30.0, 0.0, 5.0),
            at(-20.0, engaged, 5.0),
            at(-20.0, engaged, -4.0),
            at(16.0, engaged, -4.0),
        ],
        Tool(6.0),
    )
    area = found.area[(found.path > found.path[-1] - 8.0) & (found.path < found.path[-1] - 1.0)]
    assert area == pytest.approx(4.0 * engaged, rel=0.002, abs=0.0004)


@pytest.mark.parametrize("blank, length", [(BOX, None), (TURNED, None), (ROUND, None)])
def test_volumes_of_whole_blanks(blank, length):
    """A pass wider than the blank takes all of its top, whatever its shape."""
    lanes = []
    for n, y in enumerate(np.arange(-6.0, 47.0, 9.0)):
        lanes += [(-8.0, y, -2.0), (68.0, y, -2.0)] if n % 2 == 0 else [(68.0, y, -2.0), (-8.0, y, -2.0)]
    run = Run(log(lanes, speed=200.0))
    found = judging.sweep(run, blank, [Tool(10.0)])
    floor = np.pi * 0.25 * 41.3**2 if blank.round else blank.size_x * blank.size_y
    assert found.volume[-1] == pytest.approx(2.0 * floor, rel=VOLUME_WITHIN)
    assert found.needle_volume == pytest.approx(2.0 * floor, rel=VOLUME_WITHIN)


def test_a_ramp_and_a_plunge():
    at = turned(0.3, (12.0, 8.0))
    fall = np.tan(np.radians(4.0))
    _run, found = swept([at(0.0, 0.0, 1.0), at(30.0, 0.0, 1.0 - 30.0 * fall)], Tool(6.0))
    start = 1.0 / fall  # where the tip meets the top
    length, depth = 30.0 - start, (30.0 - start) * fall
    wedge = 0.5 * 6.0 * length * depth + 9.0 * np.pi * depth  # every lane is left where the disc leaves it
    assert found.volume[-1] == pytest.approx(wedge, rel=VOLUME_WITHIN)
    assert found.own_error < 0.003
    _run, found = swept([at(10.0, 5.0, 1.0), at(10.0, 5.0, -5.0)], ball(6.0))
    assert found.area[found.path > 4.5] == pytest.approx(9.0 * np.pi, rel=AREA_WITHIN)
    depth = found.path - 1.0
    cap = (depth > 0.5) & (depth < 2.8)  # a ball going down meets its own circle; cells of 0.04 mm
    assert found.area[cap] == pytest.approx(np.pi * (6.0 * depth - depth**2)[cap], rel=0.05)
    assert found.volume[-1] == pytest.approx(np.pi * (9.0 * 2.0 + 2.0 / 3.0 * 27.0), rel=VOLUME_WITHIN)


def test_a_ring_beside_a_ring():
    _run, found = swept([(38.0, 20.0, 3.0)] + ring(8.0, -3.0) + [(40.3, 20.0, -3.0)] + ring(10.3, -3.0), Tool(6.0))
    area = found.area[(found.path > found.path[-1] - 50.0) & (found.path < found.path[-1] - 12.0)]
    assert area.mean() == pytest.approx(3.0 * (13.3**2 - 11.0**2) / (2.0 * 10.3), rel=AREA_WITHIN)
    assert np.abs(area / area.mean() - 1.0).max() < 0.004  # a chord's heading turns by half its angle


def test_the_two_ways_to_the_volume_share_an_error_bound():
    """A random walk of a tapered ball over itself, sloped everywhere."""
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(5, 55, 60), rng.uniform(5, 35, 60), rng.uniform(-4.0, -0.5, 60)])
    points[0, 2] = 1.0
    for tool in (Tool(6.0, 0.5, 20.0), Tool(10.0, 2.0), ball(6.0), Tool(6.0)):
        run = Run(log(points.tolist(), speed=300.0))
        found = judging.sweep(run, BOX, [tool], cell=0.15)
        assert found.own_error < 0.004, tool


# --- the verdict ----------------------------------------------------------------------------------

SLOT = [turned(0.3)(-10.0, 0.0, -4.0), turned(0.3)(50.0, 0.0, -4.0)]
TARGET = 24.0 * SPEED


def verdict(data, tool=Tool(6.0), blank=BOX, target=TARGET):
    return judging.judge(Run(data), blank, [tool], target)


def test_a_held_rate_is_seen_as_held():
    """Noise of a window of 10 ms: none to speak of.  At 0.001 of rounding of the log it stays below 0.1 %."""
    found = verdict(log(SLOT))
    assert found.peak_10ms == pytest.approx(1.0, abs=0.001)
    assert found.peak_1ms == pytest.approx(1.0, abs=0.002)
    assert found.over_share == 0.0 and found.places == []
    assert found.mean == pytest.approx(1.0, abs=0.001)


@pytest.mark.parametrize(
    "spoil, peak", [("3 % faster", 1.03), ("a jerk of 20 ms", 1.5), ("tool 3 % wider", 1.03), ("0.2 mm deeper", 1.05)]
)
def test_a_spoiled_run_is_seen(spoil, peak):
    data, tool = log(SLOT), Tool(6.0)
    if spoil == "3 % faster":
        data = log(SLOT, speed=1.03 * SPEED)
    elif spoil == "a jerk of 20 ms":
        half = turned(0.3)(20.0, 0.0, -4.0)
        later = turned(0.3)(20.6, 0.0, -4.0)
        first, fast, rest = log([SLOT[0], half]), log([half, later], speed=1.5 * SPEED), log([later, SLOT[1]])
        for key in "xyz":
            data[key] = np.concatenate([first[key], fast[key][1:], rest[key][1:]])
        count = len(data["x"])
        data.update(
            sample=np.arange(count),
            tool_offset_z=np.zeros(count),
            motion_type=np.full(count, 2),
            line=np.ones(count, int),
        )
    elif spoil == "tool 3 % wider":
        tool = Tool(6.18)
    else:
        data["z"] = data["z"] - 0.2
    found = verdict(data, tool)
    assert found.peak_10ms == pytest.approx(peak, abs=0.004)
    assert found.over_share > 0.005 and found.places


def test_lost_periods_and_tool_lengths():
    """A gap is counted; a change of the offset sweeps nothing; a traverse's volume is counted apart."""
    data = log(SLOT)
    keep = np.ones(len(data["x"]), bool)
    keep[1000:1007] = False
    gone = {key: value[keep] if isinstance(value, np.ndarray) else value for key, value in data.items()}
    assert Run(gone).lost == 7 and Run(data).lost == 0
    there = log([(20.0, 20.0, 20.0), (21.0, 20.0, 20.0)])
    half = len(there["x"]) // 2
    there["tool_offset_z"][half:] = 25.0  # from 20 mm above the blank to 5 mm deep in no time
    found = judging.sweep(Run(there), BOX, [Tool(6.0)])
    assert found.volume[-1] == pytest.approx(0.5 * 6.0 * 5.0, rel=0.07)  # half a millimetre; no plunge of 141 mm3
    assert verdict(log(SLOT, motion=1)).rapid_volume == pytest.approx(verdict(log(SLOT)).volume, rel=0.002)


def test_too_coarse_a_judge_says_so():
    """Its own error shows a step that misses what is there."""
    at = turned(0.3, (12.0, 8.0))
    points = [at(0.0, 0.0, 1.0)] + [at(float(n), 2.5 * (n % 2), -3.0) for n in range(1, 30)]
    fine, coarse = (judging.sweep(Run(log(points)), BOX, [Tool(6.0)], cell=cell) for cell in (0.04, 3.0))
    assert fine.own_error < 0.003 < coarse.own_error
