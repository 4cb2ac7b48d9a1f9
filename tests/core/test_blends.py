# SPDX-License-Identifier: GPL-2.0-or-later
"""The load profile where LinuxCNC blends two segments by a parabola (lookahead.h, 8)."""

import pytest

from chipwise.clib import core, layout

PERIOD, CELL = 0.001, 0.25


def profile_at_a_blend(before, behind, join=layout.Join.PARABOLIC, speed=10.0, from_corner=0.5):
    """Load steps `from_corner` mm before a parabolic blend of two lines in a full slot, with these accelerations of the
    planner; and the full area."""
    tool, box = core.Tool(6), core.Stock((-20, -20, -6), (20, 20, 0), CELL)
    lookahead = core.Lookahead(box, tool)
    for key, (x, accel) in enumerate(((-12.0, before), (0.0, behind)), 1):
        segment = core.line((x, 0, -2), (x + 12.0, 0, -2))
        segment.accel, segment.join = accel, join if key == 1 else layout.Join.STOP
        lookahead.path.follow(1, 12.0, 0.0) if key == 1 else None
        lookahead.path.append(key, segment)
    cutter, step = core.Cutter(box, tool, (-12, 0, -2)), speed * PERIOD
    for n in range(int((12.0 - from_corner) / step)):
        at, tip = (-12 + n * step, 0, -2), (-12 + (n + 1) * step, 0, -2)
        cutter.to(tip)
        lookahead.path.follow(1, 12.0, (n + 1) * step)
        lookahead.step(at, tip, PERIOD, 8.0)
    profile = lookahead.profile(8.0)
    return [(profile.step[i].distance, profile.step[i].area) for i in range(profile.steps)], 12.0


@pytest.mark.parametrize("before, behind, most", [(250, 500, 1.5), (250, 260, 1.04), (250, 250, 1.0), (500, 250, 1.0)])
def test_a_parabolic_blend_adds_the_velocities_of_both_segments(before, behind, most):
    """From v^2 / 2a before the corner the load counts as 2 - a / b times as high, and as b T / v more: no override acts
    in a blend."""
    steps, full = profile_at_a_blend(before, behind)
    begin = 0.5 - 10.0**2 / (2 * before) - 2 * 10.0 * PERIOD
    assert steps[-1][0] == pytest.approx(begin, abs=0.02)
    assert steps[-1][1] == pytest.approx(full * (most + behind * PERIOD / 10.0), rel=0.03)
    assert all(area < 1.03 * full for distance, area in steps if distance < begin - 0.02)


def test_where_there_is_no_parabolic_blend_nothing_is_added():
    for join in (layout.Join.TANGENT, layout.Join.STOP):
        steps, full = profile_at_a_blend(250, 500, join)
        assert max(area for _distance, area in steps) < 1.03 * full
    steps, full = profile_at_a_blend(250, 500, from_corner=0.01)  # in it: at once
    assert steps[-1][0] == 0.0 and steps[-1][1] > 1.45 * full
    steps, full = profile_at_a_blend(250, 5e5, speed=0.5, from_corner=0.02)
    assert steps[-1][1] == pytest.approx(2.0 * full, rel=0.03)  # never more than twice


def test_an_added_velocity_counts_until_the_first_segment_has_ended():
    """An arc of weak braking into a line (a < b): it ends v^2 / a - v^2 / 2b behind the corner, not v^2 / 2b."""
    speed, before, behind = 10.0, 125.0, 500.0
    ends = speed**2 / before - speed**2 / (2 * behind)
    for beyond, most in ((0.2, 1.75), (ends - 0.05, 1.75), (ends + CELL, 1.0)):  # samples are up to a cell apart
        steps, full = profile_at_a_blend(before, behind, speed=speed, from_corner=-beyond)
        added = behind * PERIOD / speed if most > 1.0 else 0.0
        assert max(area for _distance, area in steps) == pytest.approx(full * (most + added), rel=0.03), beyond
