# SPDX-License-Identifier: GPL-2.0-or-later
"""Chop lines as moves: what holes (cycles/hole.py) and contours (cycles/contour_chop.py) have in common.  Pure; mm.

Each line is cut to full depth in its passes before the next one: JP H05-7134, fig. 5, has the lines first, then the
outline.

A line is entered one tool radius inside its end (or at its middle, if it is shorter), run to that end and back across:
no plunge at the finished wall.
"""

import math

from chipwise.cycles.mover import Mover
from chipwise.cycles.word_checks import EQUAL


def depth_levels(
    clearance: float, bottom: float, depth_step: float | None, stock_top: float | None = None
) -> list[float]:
    """Z of each pass, mm: equal steps counted from the clearance plane (as G83 counts its pecks), each at most J.

    stock_top: nothing is above it.  If that saves passes, the steps are counted from there; otherwise they stay as they
    are.
    """
    levels = _equal_steps(clearance, bottom, depth_step)
    if stock_top is None or stock_top >= clearance:
        return levels
    fewer = _equal_steps(max(stock_top, bottom), bottom, depth_step)
    return fewer if len(fewer) < len(levels) else levels


def _equal_steps(top, bottom, depth_step):
    """Z of the ends of equal steps from top to bottom, none longer than depth_step (None: one step)."""
    total = top - bottom
    count = 1 if depth_step is None else max(1, math.ceil(total / depth_step - EQUAL))
    return [top - total * k / count for k in range(1, count)] + [bottom]


def line_entry(segment, tool_radius):
    """Where a directed line is entered: one tool radius inside its start, or at its middle if it is short."""
    (ax, ay), (bx, by) = segment
    length = math.hypot(bx - ax, by - ay)
    inset = min(tool_radius, length / 2) / length
    return ax + (bx - ax) * inset, ay + (by - ay) * inset


def ends(tool_radius, pass_count):
    """Where a directed line is entered and left, as line_order.order_lines asks: two functions of a segment."""
    return lambda s: line_entry(s, tool_radius), lambda s: s[pass_count % 2]


def cut_line(mover: Mover, segment, tool_radius: float, levels: list[float]) -> None:
    """One line to full depth: plunge inside an end, out to that end, across to the other, and back for the next pass.

    segment: ((x, y), (x, y)); levels: Z of each pass, mm.  Starts with the rapids over its entry; ends where the last
    pass ends, still at depth.
    """
    start, end = segment
    mover.over(line_entry(segment, tool_radius))
    for number, z in enumerate(levels):
        if number:
            mover.line(line_entry((start, end), tool_radius))
        mover.plunge(z)
        mover.line(start)
        mover.line(end)
        start, end = end, start
