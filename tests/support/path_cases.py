# SPDX-License-Identifier: GPL-2.0-or-later
"""Programmed paths of straight moves.  Called by tests/core/test_descent.py and test_pace.py."""

from itertools import repeat

from chipwise.clib import core, layout

ACCEL = 500.0  # mm/s2, of a move that is given none


def chain(points, feeds=repeat(0.0), accels=repeat(ACCEL), rapid=(), stops=()):
    """ProgrammedPath along points, with F (mm/s) and acceleration (mm/s2) of each move; `rapid`, `stops`: numbers of
    moves, from 1. The tool is at the first point."""
    path = core.ProgrammedPath()
    for n, (start, end, feed, accel) in enumerate(zip(points, points[1:], feeds, accels), 1):
        segment = core.line(start, end)
        segment.feed, segment.accel, segment.rapid = feed, accel, int(n in rapid)
        segment.join = int(layout.Join.STOP if n in stops else layout.Join.TANGENT)
        if n == 1:
            path.follow(1, segment.length, 0.0)
        path.append(n, segment)
    return path
