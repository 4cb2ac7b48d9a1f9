# SPDX-License-Identifier: GPL-2.0-or-later
"""How near straight moves of a tool come to clamps.  Called by check/clamps.py.

Source: none.  A tool is at least as wide above any of its heights as there, and a clamp is as wide at its top as below.
So at a place of the tip they are as near to each other as at the height of the clamp's top, and a clamp is a height:
what is below it does not count.

The distance is the least d for which the clamp, larger by d at its sides and at its top, touches the tool.  For a body
of the tool (its cutter with the shank, its holder) that lies above a height `from` of the tip and within the lines r =
a + b h of its outline, that is

    d = max(from + z - top, (across - a - b (top - z)) / (1 + b) of each line)

where z is the height of the tip and `across` the distance of its axis from the clamp's outline.  Each term is convex
along a straight move, so d is, and its least value is found by thirds.
"""

import math
from dataclasses import dataclass

import numpy as np

TANGENTS = (
    64  # of the arc of a corner: they lie outside of it by at most (pi / 4 / TANGENTS)^2 / 2 = 7.5e-5 of its radius
)
THIRDS = 64  # steps that find the nearest place: 5e-12 of the move


@dataclass(frozen=True)
class Body:
    """A part of a tool: mm above the tip where it begins, lines (a, b) of its outline, radius in mm."""

    name: str
    begins: float
    lines: tuple
    radius: float


def bodies(shape):
    """[Body] of a check.sweep.Shape; of a diameter of 0 the axis."""
    radius, corner = shape.diameter / 2, min(shape.corner_radius, shape.diameter / 2)
    half = math.radians(shape.tip_angle / 2) if shape.tip_angle else 0.0  # a cone is as wide as tan(half) h
    flat = 0.0 if half else radius - corner
    lines = [(radius, 0.0)]
    for k in range(1, TANGENTS + 1) if corner else ():
        angle = half + (math.pi / 2 - half) * k / (TANGENTS + 1)  # of a tangent from the axis
        slope = math.tan(angle)
        lines.append((flat + corner * (math.cos(angle) + math.sin(angle) * slope) - slope * corner, slope))
    if half:
        slope = math.tan(half)
        lines.append((corner * (math.cos(half) + math.sin(half) * slope) - slope * corner, slope))
    found = [Body("tool", 0.0, tuple(lines), radius)]
    if shape.holder_diameter:
        found.append(Body("holder", shape.stick_out, ((shape.holder_diameter / 2, 0.0),), shape.holder_diameter / 2))
    return found


def near(clamp, body, start, end, within):
    """Moves start to end, (n, 3) mm, that come nearer to a clamp than `within` (mm) -> (index (k,), distance (k,),
    share of the move (k,) of the place)."""
    reach = clamp.reach + body.radius + within
    middle = np.array(clamp.middle)
    low, high = np.minimum(start, end), np.maximum(start, end)
    may = (low[:, 2] + body.begins < clamp.top + within) & (
        (low[:, :2] < middle + reach) & (high[:, :2] > middle - reach)
    ).all(axis=1)
    index = np.flatnonzero(may)
    first, step = start[index], end[index] - start[index]

    def distance(share):
        place = first + share[:, None] * step
        across, over = clamp.across(place[:, 0], place[:, 1]), clamp.top - place[:, 2]
        found = body.begins - over
        for a, b in body.lines:
            found = np.maximum(found, (across - a - b * over) / (1.0 + b))
        return found

    begin, finish = np.zeros(len(index)), np.ones(len(index))
    for _ in range(THIRDS if len(index) else 0):
        third = (finish - begin) / 3
        left = distance(begin + third) <= distance(finish - third)
        begin, finish = np.where(left, begin, begin + third), np.where(left, finish - third, finish)
    share = (begin + finish) / 2
    shares = [np.zeros(len(index)), share, np.ones(len(index))]
    ends = np.stack([distance(s) for s in shares])
    best = ends.argmin(axis=0)
    found, share = ends.min(axis=0), np.choose(best, shares)
    touching = found < within
    return index[touching], found[touching], share[touching]
