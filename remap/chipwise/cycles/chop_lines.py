"""Chop lines as moves: what holes (cycles/hole.py) and contours (cycles/contour_chop.py) have in common.  Pure; mm.

Each line is cut to full depth in its passes before the next one: JP H05-7134, fig. 5, has the lines first, then the
outline.  Rapids run on the clearance plane or straight up and down above it; below it every move is a feed.

A line is entered one tool radius inside its end (or at its middle, if shorter), run to that end and back across: no
plunge at the finished wall.
"""

import math

from chipwise.cycles.common_words import EQUAL
from chipwise.moves import Line, Rapid


def depths(clearance, bottom, depth_step):
    """Z of each pass, mm: equal steps counted from the clearance plane (as G83 counts its pecks), none above J."""
    total = clearance - bottom
    count = 1 if depth_step is None else max(1, math.ceil(total / depth_step - EQUAL))
    return [clearance - total * k / count for k in range(1, count)] + [bottom]


def enter(moves, request, point):
    """Over a point, on the clearance plane.  request: anything with .start (x, y, z) and .clearance, mm.

    Within the cycle: up, then across.  At its start: up only if below the plane, across, then down to the plane.
    """
    if moves or request.start[2] < request.clearance - EQUAL:
        moves.append(Rapid(z=request.clearance))
    moves.append(Rapid(x=point[0], y=point[1]))
    if len(moves) == 1 and request.start[2] > request.clearance + EQUAL:
        moves.append(Rapid(z=request.clearance))


def last_xy(moves, start):
    """Where the tool stands after moves."""
    for move in reversed(moves):
        if move.x is not None:
            return move.x, move.y
    return start[0], start[1]


def line_entry(segment, tool_radius):
    """Where a directed line is entered: one tool radius inside its start, or its middle where it is short."""
    (ax, ay), (bx, by) = segment
    length = math.hypot(bx - ax, by - ay)
    inset = min(tool_radius, length / 2) / length
    return ax + (bx - ax) * inset, ay + (by - ay) * inset


def ends(tool_radius, pass_count):
    """Where a directed line is entered and left, as chop.order_lines asks: two functions of a segment."""
    return lambda s: line_entry(s, tool_radius), lambda s: s[pass_count % 2]


def cut_line(moves, request, segment, passes):
    """One line to full depth: plunge inside an end, out to that end, across to the other, and back for the next pass.

    request: anything with .tool_radius, .feed, .plunge_feed and what enter() needs; passes: Z of each, mm.
    Starts with the rapids over its entry; ends where the last pass ends, still at depth.
    """
    start, end = segment
    entry = line_entry(segment, request.tool_radius)
    enter(moves, request, entry)
    for number, z in enumerate(passes):
        if number:
            entry = line_entry((start, end), request.tool_radius)
            moves.append(Line(x=entry[0], y=entry[1], feed=request.feed))
        moves.append(Line(z=z, feed=request.plunge_feed))
        moves.append(Line(x=start[0], y=start[1], feed=request.feed))
        moves.append(Line(x=end[0], y=end[1], feed=request.feed))
        start, end = end, start
