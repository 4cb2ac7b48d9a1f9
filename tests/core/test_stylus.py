# SPDX-License-Identifier: GPL-2.0-or-later
"""The model of a stylus (stylus.h) against what its geometry and Coulomb's law say in closed form."""

import ctypes as C
import math

import numpy as np
import pytest

from chipwise.clib import core, layout
from support.random_cases import random_count, random_seed
from support.tracer_rig import MODEL, SURFACE, filled


class Stylus:
    def __init__(self, **model):
        self.settings, self.state = filled(layout.StylusSettings, {**MODEL, **model}), layout.Stylus()
        self.heights = np.ascontiguousarray(model.get("height_mm", np.zeros((2, 2))), np.float32)
        self.settings.height_mm, (self.settings.ny, self.settings.nx) = self.heights.ctypes.data, self.heights.shape

    def at(self, p):
        """-> (measured, now), mm"""
        measured, now = (C.c_double * 3)(), (C.c_double * 3)()
        core.library().chip_stylus_step(
            C.byref(self.state), C.byref(self.settings), (C.c_double * 3)(*p), measured, now
        )
        return np.array(measured), np.array(now)

    def distance(self, c):
        distance, normal = core.library().chip_stylus_distance, (C.c_double * 3)()
        distance.restype = C.c_double
        return distance(C.byref(self.settings), (C.c_double * 3)(*c), normal), np.array(normal)


def test_plane_with_friction():
    """Sliding: e is off the normal by atan(friction), against the motion; turned back it sticks and then slides."""
    stylus = Stylus(friction_share=0.2)
    for x in np.arange(0, 2, 0.01):
        _, e = stylus.at((x, 0, 1 - 0.3))
    assert e == pytest.approx([-0.2 * 0.3, 0, 0.3], abs=1e-9)
    _, e = stylus.at((x - 0.05, 0, 1 - 0.3))
    assert e == pytest.approx([-0.2 * 0.3 + 0.05, 0, 0.3], abs=1e-9)
    for back in np.arange(0, 0.3, 0.01):
        _, e = stylus.at((x - back, 0, 1 - 0.3))
    assert e == pytest.approx([0.2 * 0.3, 0, 0.3], abs=1e-9)


def test_free_and_on_a_ball():
    stylus = Stylus(surface_number=SURFACE.BALL, size_mm=9.0, friction_share=0.0)
    assert stylus.at((0, 0, 10.001))[1] == pytest.approx([0, 0, 0])
    assert stylus.at((6 * 0.97, 0, 8 * 0.97))[1] == pytest.approx([0.18, 0, 0.24], abs=1e-6)


def test_inside_corner_holds_the_ball():
    stylus = Stylus(surface_number=SURFACE.CORNER, friction_share=0.15)
    for x in np.arange(-3, -0.7, 0.01):
        _, e = stylus.at((x, 0, 0.7))
    assert e == pytest.approx([-1 - x, 0, 0.3], abs=1e-6)


@pytest.mark.parametrize("surface", list(SURFACE))
def test_ball_is_on_the_model_and_force_in_the_cone(surface):
    """At random, in small steps: f(c) = 0, and the angle of e to the normal at c is at most that of friction."""
    random = np.random.default_rng(random_seed())
    y, x = np.mgrid[0:41, 0:41] * 0.5
    stylus = Stylus(
        surface_number=surface,
        size_mm=8.0,
        height_mm=np.sin(x / 3) * np.cos(y / 4),
        cell_mm=0.5,
        at_mm=(-10, -10, 0) if surface == SURFACE.GRID else (0, 0, 0),
        friction_share=0.15,
        angle_deg=70.0,
    )
    touched, p = 0, None
    for _ in range(random_count(400)):
        if p is None or random.random() < 0.05:
            p = random.uniform(-8, 8, 3)
            f, normal = stylus.distance(p)
            p = p - (f + 0.2) * normal
        p = p + random.normal(0, 0.02, 3)
        _, e = stylus.at(p)
        f, normal = stylus.distance(p + e)
        size = np.linalg.norm(e)
        if size == 0.0:
            p = None
            continue
        touched += 1
        assert abs(f) < 1e-4, (p, e)
        corner = surface in (SURFACE.CORNER, SURFACE.STEP)  # in a corner two walls hold the ball
        if not corner and size > 0.01:
            assert math.acos(min(1.0, e @ normal / size)) < math.atan(0.15) + 0.02, (p, e)
    assert touched > 50


def test_delay_and_noise():
    stylus = Stylus(delay_periods=3, noise_mm=0.01, friction_share=0.0)
    for _ in range(5):
        stylus.at((0, 0, 0.7))
    seen = np.array([stylus.at((0, 0, 0.5))[0][2] for _ in range(3)])
    assert np.abs(seen - 0.3).max() < 0.06
    later = np.array([stylus.at((0, 0, 0.5))[0] for _ in range(4000)])
    assert later[:, 2].mean() == pytest.approx(0.5, abs=0.001) and later[:, 0].std() == pytest.approx(0.01, rel=0.05)
