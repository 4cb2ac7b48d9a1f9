# SPDX-License-Identifier: GPL-2.0-or-later
"""Passes of every tool above and beside earlier ones: section area and volume against the area between two outlines."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support import stock_profiles as profiles

CASES = {case.name: case for case in profiles.cases()}
MEAN = 0.01  # allowed mean error, share of the truth
SPREAD = {"deeper": 0.02}  # allowed standard deviation; else, cuts with a side:
SPREAD_ELSE = 0.04
# What is not met at cells of 0.25 mm: tools of four cells, and cuts a cell or two wide: (mean, deviation). Smaller
# cells cure it:  test_with_smaller_cells.
KNOWN = {
    "flat D1, 15 % beside": (0.01, 0.10),
    "vee 30, 15 % beside": (0.016, 0.04),
    "vee 30, 40 % beside": (0.012, 0.04),
    "vee 60, 15 % beside": (0.012, 0.04),
    "ball D3.175, steps 0.25, 17 deep": (0.01, 0.07),
    "ball D3.175, steps 0.37, 17 deep": (0.01, 0.05),
    "flat D6, steps 0.25, 3 deep": (0.015, 0.04),
    "taper D6, steps 0.25, 3 deep": (0.015, 0.045),
}


def check(name, angle, cell, through, allowed):
    mean, spread = profiles.measured(CASES[name], angle, cell, through)
    assert abs(mean) <= allowed[0] and spread <= allowed[1], (
        f"{name}, {angle:g} degrees, {cell:g} mm cells, through {through}: mean error {100 * mean:.2f} %, deviation "
        f"{100 * spread:.2f} %"
    )


def allowed(name):
    return KNOWN.get(name, (MEAN, SPREAD.get(CASES[name].kind, SPREAD_ELSE)))


@pytest.mark.parametrize("name", CASES)
def test_area(name):
    for angle in profiles.DIRECTIONS:
        check(name, angle, 0.25, "section", allowed(name))


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.kind in ("deeper", "beside")])
def test_through_the_look_ahead(name):
    check(name, 31.0, 0.25, "ahead", allowed(name))


@pytest.mark.parametrize("name", KNOWN)
def test_with_smaller_cells(name):
    """Cells of 0.1 mm: all but the tool of 1 mm at its narrowest meet the bounds."""
    case = CASES[name]
    check(name, 31.0, 0.1, "section", (0.02, 0.05) if "D1" in name else (MEAN, SPREAD.get(case.kind, SPREAD_ELSE)))


def test_a_wrong_tool_is_seen():
    """Sabotage: the truth of a tool 2 % larger is not met."""
    for name in ("flat D6, depth 2", "ball D6, 40 % beside", "vee 90, depth 3", "taper D8, 70 % beside"):
        case = CASES[name]
        diameter, corner, tip = case.now.tool
        larger = profiles.Case(
            name,
            case.kind,
            case.before,
            profiles.Pass((1.03 * diameter, 1.03 * corner, tip), case.now.offset, case.now.depth * 1.02),
        )
        mean, _ = profiles.measured(case, 31.0)
        wrong = (mean + 1.0) * profiles.truth(case) / profiles.truth(larger) - 1.0
        assert abs(wrong) > MEAN, name


LIMIT = {0.1: 0.001, 0.25: 0.003}


@pytest.mark.parametrize(
    "name", ["vee 30", "vee 60", "vee 90", "vee 120", "taper D6", "taper D8", "ball D6", "ball D3.175", "bull D10"]
)
def test_volume_in_servo_steps(name):
    """A groove in steps of 0.05 mm, as the realtime component cuts it: section x length + the end's volume of
    revolution."""
    tool, depth = profiles.TOOLS[name], profiles.DEPTH.get(name, 2.0)
    r = np.linspace(0.0, tool[0] / 2.0, 100001)
    gap = np.maximum(0.0, depth - profiles.reference_tool(tool).surface(r))
    gap = 0.5 * (gap[1:] + gap[:-1])
    volume = float(2.0 * np.sum(gap * np.diff(r)) * 14.0 + math.pi * np.sum(gap * np.diff(r**2)))
    for cell, limit in LIMIT.items():
        for angle in (0.0, 17.0, 45.0, 73.0):
            stock = core.Stock((-20.03, -20.02, -8.0), (20.02, 20.11, 0.0), cell)
            points = [(*profiles.along(angle, 0.0, at), -depth) for at in np.arange(-7.0, 7.001, 0.05)]
            cutter = core.Cutter(stock, core.Tool(*tool), points[0])
            for point in points:
                cutter.to(point)
            assert stock.head.removed == pytest.approx(volume, rel=limit), (angle, cell)


def needle_volume(tool, joints, half_width):
    """Volume above the lowest surface of a tool whose tip goes along the joints (x, z), in a block with its top at 0:
    needles on a grid, each cut by a tip every 0.02 mm."""
    reference = profiles.reference_tool(tool)
    x_of, z_of = np.array(joints).T
    length, rows = x_of[-1] - x_of[0], math.ceil(half_width / 0.06)
    step = half_width / rows  # a row ends at the tool's side
    at = np.linspace(x_of[0], x_of[-1], round(length / 0.02) + 1)
    tips = np.interp(at, x_of, z_of)
    x = np.arange(x_of[0] - half_width + 0.5 * step, x_of[-1] + half_width, step)
    total = 0.0
    for y in step * (np.arange(rows) + 0.5):  # the other half is the same
        r = np.hypot(x[:, None] - at[None, :], y)
        surface = np.where(r <= reference.radius, reference.surface(np.minimum(r, reference.radius)) + tips, 0.0)
        total += float(np.maximum(0.0, -surface.min(axis=1)).sum())
    return 2.0 * total * step * step


def volume_cut(tool, joints, angle, cell):
    """What the core removes along the joints in servo steps of 0.05 mm."""
    stock = core.Stock((-12.03, -12.02, -8.0), (12.02, 12.11, 0.0), cell)
    cutter = core.Cutter(stock, core.Tool(*tool), (*profiles.along(angle, 0.0, joints[0][0]), joints[0][1]))
    for (x0, z0), (x1, z1) in zip(joints, joints[1:]):
        steps = max(1, round(abs(x1 - x0) / 0.05))
        for n in range(1, steps + 1):
            cutter.to((*profiles.along(angle, 0.0, x0 + (x1 - x0) * n / steps), z0 + (z1 - z0) * n / steps))
    return stock.head.removed


def check_volumes(tool, joints, angles=(0.0, 17.0, 73.0)):
    """Within LIMIT of the needles, whichever end it begins at."""
    volume = needle_volume(tool, joints, tool[0] / 2.0)
    off = {
        (cell, angle, path[0]): volume_cut(tool, path, angle, cell) / volume - 1.0
        for cell in LIMIT
        for angle in angles
        for path in (joints, joints[::-1])
    }
    print({case: f"{100.0 * error:.3f} %" for case, error in off.items()})
    bad = {case: f"{100.0 * error:.3f} %" for case, error in off.items() if abs(error) > LIMIT[case[0]]}
    assert not bad, bad


RAMPS = {
    "vee 60": (2.0, 2.2),
    "vee 120": (1.5, 0.5),
    "taper D6": (0.4, 2.0),
    "ball D6": (0.2, 2.4),
    "bull D10": (2.0, 1.0),
    "ball D3.175": (0.3, 1.6),
}


@pytest.mark.parametrize("name", RAMPS)
def test_volume_on_a_ramp(name):
    """A sloping groove in servo steps, up or down, in odd directions: the needles' volume."""
    check_volumes(profiles.TOOLS[name], [(-4.5, -RAMPS[name][0]), (4.5, -RAMPS[name][1])])


@pytest.mark.parametrize("name", ["vee 60", "ball D3.175"])
def test_a_bend_ends_the_line(name):
    """Short chords that tilt at each joint, as in a relief: the tool is not taken to have come along the new chord."""
    joints = [(-4.2 + 0.4 * n, -2.0 + 0.05 * (n % 2)) for n in range(22)]
    check_volumes(profiles.TOOLS[name], joints, angles=(17.0,))
