# SPDX-License-Identifier: GPL-2.0-or-later
"""The control benchmark's own model of the stock (tests/support/fine_model.c) against closed forms."""

import ctypes as C
import math

import numpy as np
import pytest

from support.speed_log import Log

R, DEPTH = 3.0, 4.0
BOX = (-30.0, -30.0, -10.0), (30.0, 30.0, 0.0)


def areas(root, tips):
    """Area (mm2) of every step of a path (n, 3)."""
    library = C.CDLL(str(root / "build" / "tests" / "support" / "fine_model.so"))
    tips = np.ascontiguousarray(tips, float)
    wanted, area, vec = np.ones(len(tips), np.uint8), np.zeros(len(tips)), C.c_double * 3
    library.fine_areas(
        C.c_double(R),
        vec(*BOX[0]),
        vec(*BOX[1]),
        tips.ctypes.data_as(C.c_void_p),
        wanted.ctypes.data_as(C.c_void_p),
        C.c_long(len(tips)),
        area.ctypes.data_as(C.c_void_p),
    )
    return area[:-1]


def test_a_path_is_kept_to_where_it_turns_back():
    """Rows of a log 0.011 mm apart: to X0.984 and back; whole steps of 0.05 mm would lose the end."""
    log = Log.__new__(Log)
    out = np.append(np.arange(0.0, 0.985, 0.011), 0.984)
    x = np.concatenate([out, out[-1:], out[::-1]])
    log.tips = np.column_stack([x, 0 * x, 0 * x])
    log.toolpath, log.motion = np.zeros(len(x)), np.full(len(x), 2)
    assert log.tips[log.places(), 0].max() == 0.984


def line(start, end, step=0.05):
    start, end = np.array(start, float), np.array(end, float)
    return start + (end - start) * np.linspace(0, 1, int(np.linalg.norm(end - start) / step) + 1)[:, None]


@pytest.mark.parametrize("angle", (0, 17, 45))
def test_slot(root, angle):
    toolpath = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0.0])
    area = areas(root, line(-15 * toolpath + [0, 0, -DEPTH], 15 * toolpath + [0, 0, -DEPTH]))
    assert area[200:] == pytest.approx(2 * R * DEPTH, rel=1e-4)


@pytest.mark.parametrize("width", (0.3, 0.6, 2.0, 4.5))
def test_side_cut(root, width):
    first = line((-25, 0, -DEPTH), (25, 0, -DEPTH))
    area = areas(
        root,
        np.concatenate([first, line((25, 0, 5), (-25, width, 5)), line((-25, width, -DEPTH), (10, width, -DEPTH))]),
    )
    assert area[-300:] == pytest.approx(width * DEPTH, rel=2e-3)


@pytest.mark.parametrize("radius", (3.0, 5.0, 15.0))
def test_arc(root, radius):
    a = np.arange(0.0, 3.0, 0.05 / radius)
    area = areas(root, np.column_stack([radius * np.cos(a), radius * np.sin(a), np.full(a.shape, -DEPTH)]))
    assert area[int(7 / 0.05) :] == pytest.approx(2 * R * DEPTH, rel=2e-3)


def test_ramp_and_plunge(root):
    angle = math.radians(5.0)
    path = line((-15, 0, -0.5), (15, 0, -0.5 - 30 * math.tan(angle)))
    area = areas(root, path)
    depth = -0.5 * (path[1:, 2] + path[:-1, 2])
    want = 2 * R * depth * math.cos(angle) + math.pi * R * R * math.sin(angle)
    assert area[200:] == pytest.approx(want[200:], rel=5e-3)
    assert areas(root, line((0, 0, 0), (0, 0, -5)))[3:] == pytest.approx(math.pi * R * R, rel=1e-6)


def test_volume_of_a_path_through_the_bottom(root):
    """What goes below the box removes nothing there."""
    path = line((0, 0, 1), (0, 0, -12))
    assert (areas(root, path) * 0.05).sum() == pytest.approx(math.pi * R * R * 10, rel=2e-3)
