# SPDX-License-Identifier: GPL-2.0-or-later
"""How the tool gets onto the path again: straight down where it has been, a little before the place, then along the
path itself.  Called by run.py.

 1. The place to come down at is a point of the path before the stop: the space above it is cut (a height map has no
    undercut), and from there the tool enters the cut along its own path.  Vertices of arcs are taken as they are.
 2. The approach is a traverse as far as no stock is within the tool's radius and the clearance, and a feed from there.
 3. Both are tried in the stock: the traverse with a tool that is larger by the clearance, the feed with the tool.

Lengths mm, machine coordinates of the tool's tip.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.program.records import ARC, RAPID
from chipwise.program.reader import Unreadable
from chipwise.resume.place import Place
from chipwise.clib.core import Cutter, Tool

BACK_MM = (1.5, 0.75, 0.0, 3.0, 6.0, 12.0, 24.0, 48.0)  # before the stop, in the order they are tried
GAP_MM = 1.0  # above stock, where a traverse down ends
MET_SHARE = 2e-3  # of the column that a feed down may meet: walls of the map's cells
SKIN_MM = 0.05  # by which the tool is smaller that looks whether it is free


@dataclass
class Approach:
    """place (3,), where the tool comes down; free: Z down to which it is a traverse; feed (mm/min) below; at:
    place.Place of the path there."""

    place: np.ndarray
    free: float
    feed: float
    at: Place


def feed_at(path, program, segment):
    """mm/min: F of the first feed move from a segment on."""
    moves = path.move[segment:]
    cutting = np.flatnonzero(program.kind[moves] != RAPID)
    if not len(cutting):
        return 0.0
    return float(program.feed[moves[cutting[0]]])


def point(path, place):
    """(3,): where a Place is."""
    if place.segment >= len(path.move):
        return path.end[-1]
    start = path.start(place.segment)
    return start + (path.end[place.segment] - start) * place.share


def before(path, program, place, length):
    """The Place `length` mm before another one along feed moves of one tool, or where they begin; on arcs the vertex
    before it: a chord may be of several segments."""
    k, share = place.segment, place.share
    if k >= len(path.move):
        k, share = len(path.move) - 1, 1.0
    while program.kind[path.move[k]] != RAPID:
        size = float(np.linalg.norm(path.end[k] - path.start(k)))
        if size * share >= length > 0 or length == 0:
            if program.kind[path.move[k]] == ARC:
                return Place(int(np.searchsorted(path.move, path.move[k])), 0.0)
            return Place(k, share - length / size if size else 0.0)
        length -= size * share
        if k == 0 or program.kind[path.move[k - 1]] == RAPID or path.tool[k - 1] != path.tool[k]:
            return Place(k, 0.0)
        k, share = k - 1, 1.0
    return Place(k, 0.0)


def find(path, program, place, stock, clearance, backs=BACK_MM):
    """The Approach to a Place in a Stock.  Raises Unreadable where no approach is free."""
    tried = []
    for length in backs:
        at = before(path, program, place, length)
        if at in tried:
            continue
        tried.append(at)
        found = approach(path, program, at, stock, clearance)
        if found:
            return found
    line = int(program.line[path.move[min(place.segment, len(path.move) - 1)]])
    raise Unreadable("no approach to the path is free of stock there", "say where to go on with --line N", line)


def highest(stock, x, y, reach):
    """mm: highest stock within a distance of a place; the bottom without any."""
    head, cells = stock.head, stock.cells
    columns = slice(
        max(0, int((x - reach - head.x0) / head.cell) - 1), max(0, int((x + reach - head.x0) / head.cell) + 2)
    )
    rows = slice(max(0, int((y - reach - head.y0) / head.cell) - 1), max(0, int((y + reach - head.y0) / head.cell) + 2))
    part = cells["top"][rows, columns]
    return float(part.max()) if part.size else head.z_min


def approach(path, program, at, stock, clearance):
    """The Approach to one Place; None where it is not free [3]."""
    segment = min(at.segment, len(path.move) - 1)
    (_number, _diameter, tool, shape), where = path.tools[int(path.tool[segment])], point(path, at)
    if tool is None:
        return None
    beside = highest(stock, where[0], where[1], tool.radius + clearance + stock.head.cell)
    beside = -1e9 if beside <= stock.head.z_min else beside
    free = max(beside, where[2]) + GAP_MM
    above = max(stock.head.z_max, free) + GAP_MM
    generation = np.array(stock.cells_and_ring)
    try:
        slim = _slim(shape)
        met = Cutter(stock, slim, (*where[:2], above)).to((*where[:2], where[2] + SKIN_MM))
        column = np.pi * slim.radius**2 * max(min(above, stock.head.z_max) - where[2], 0.1)
        if met > MET_SHARE * column:
            return None
    finally:
        stock.cells_and_ring[:] = generation
    return Approach(where, free, feed_at(path, program, segment), at)


def _slim(shape):
    """The tool of a Shape, smaller by SKIN_MM in radius; a pointed one is the same."""
    less = 0.0 if shape.tip_angle else min(SKIN_MM, shape.diameter / 8)
    return Tool(
        shape.diameter - 2 * less, max(min(shape.corner_radius, shape.diameter / 2) - less, 0.0), shape.tip_angle
    )
