# SPDX-License-Identifier: GPL-2.0-or-later
"""G24 on a running LinuxCNC: the demo relief to the end, its stock against the model; MDI."""

import os

import numpy as np
import pytest
from support import drop_oracle, surface_cases
from support.demo_runs import GROUP, demo_run
from support.operate import NO_SHADOW, operate

from chipwise.clib.height_map import Shape
from chipwise.headless import runner
from chipwise.clib import drop_cutter
from chipwise.surface.model import Placing, read_model

pytestmark = pytest.mark.machine

PLACE = (20.0, 20.0, 0.0)
BALL = Shape(6, 3)
STEP, TOLERANCE, BLEND = 0.8, 0.01, 0.005  # mm: D, SURFACE_TOLERANCE, G64 P
SEEN = 0.005  # mm: between two positions of the log, 1 ms apart


@pytest.mark.together(GROUP)
def test_demo_relief():
    """No message; the tip is never below the lowest one, and the stock that is left is what the ball leaves on tracks
    0.8 mm apart."""
    summary, log = demo_run("relief")
    assert summary["finished"] is True and summary["errors"] == []
    assert summary["over_target_share"] < 0.02
    model = read_model(os.path.join(runner.ROOT, "nc_files", "relief.stl"), Placing(PLACE))
    triangles = surface_cases.triangles_of(model)
    tip = np.column_stack([log["x"], log["y"], log["z"] - log["tool_offset_z"]])[np.isin(log["motion_type"], (2, 3))]
    rng = np.random.default_rng(1)
    for x, y, z in tip[rng.integers(0, len(tip), 60)]:
        assert z >= drop_oracle.lowest(triangles, BALL, x, y, -3.0) - BLEND - 1e-3
    height, _radius = drop_oracle.profile(BALL)
    probe = drop_cutter.Probe(drop_cutter.Mesh(model, 3.0), BALL, floor=-3.0)
    x_axis, y_axis = np.meshgrid(np.arange(20, 60, 0.02), 20 + STEP * np.arange(51))
    axis = np.stack([x_axis, y_axis], axis=2).reshape(-1, 2)
    lowest = probe.heights(axis)
    for x, y in rng.uniform((24, 24), (56, 56), (200, 2)):
        stock, reached = (
            lowest_over(points, z, x, y, height) for points, z in ((tip[:, :2], tip[:, 2]), (axis, lowest))
        )
        model_z = drop_oracle.lowest(triangles, Shape(1e-3), x, y, -3.0)  # a needle
        assert model_z - BLEND - 1e-3 <= stock <= reached + TOLERANCE + BLEND + SEEN, (x, y)


def lowest_over(points, z, x, y, height):
    """What balls with their tips at points and heights z leave of a needle at (x, y)."""
    r = np.hypot(points[:, 0] - x, points[:, 1] - y)
    return (z + height(np.minimum(r, 3.0)))[r <= 3.0].min()


def test_mdi(tmp_path):
    """MDI has no program, so no comment: a refused line moves nothing."""
    steps = [["mdi", "T4 M6"], ["mdi", "F900"], ["mdi", "G0 X5 Y5 Z5"], ["mdi", "G24 D1 Z-1 R1"], ["position"]]
    answers = operate(tmp_path, steps)
    assert len(answers[3]) == 1 and "chipwise: G24: there is no SURFACE comment" in answers[3][0]
    assert answers[4] == pytest.approx([5, 5, 5], abs=1e-6)


def test_cuts_of_an_ended_program_are_not_known(tmp_path):
    """A rest pass knows the G24 lines before it in its own program only: behind an abort in a level, an abort in a
    pause, an E-stop and a program that has ended it finds the stock full, and goes down into it."""
    model = f"(SURFACE,FILE={runner.ROOT}/nc_files/relief.stl,X=20,Y=20)\n"
    head = "G21 G17 G40 G49 G54 G80 G90 G94\nT4 M6\nG43\nF3000\nG0 X20 Y20 Z10\n" + model
    levels = head + "#<_chipwise_surface_depth> = 0.7\nG24 Z-3 R2 D3 P1 E900\nM2\n"
    rest = head + "#<_chipwise_surface_rest> = 0.1\nG24 Z-3 R2 D3 P1 E900\nM2\n"
    low, up = ["until", "joint.2.pos-cmd", "<", -2.0], ["until", "joint.2.pos-cmd", ">", -0.5]
    in_level = ["until", "joint.2.pos-cmd", "<", -0.6]
    again = [["start", rest], low, ["abort"], ["errors"]]
    steps = [
        ["start", levels],
        in_level,
        ["abort"],
        *again,
        ["start", levels],
        in_level,
        ["pause"],
        ["abort"],
        *again,
        ["start", levels],
        in_level,
        ["estop"],
        ["home"],
        *again,
        ["start", rest],
        low,
        up,
        ["finish"],
        *again,
        ["messages"],
    ]
    answers = operate(tmp_path, steps, edit=NO_SHADOW)
    said = [text for (name, *_), answer in zip(steps, answers) if name in ("errors", "messages") for text in answer]
    assert not any("chipwise" in text or "nothing is cut" in text for text in said), said
