# SPDX-License-Identifier: GPL-2.0-or-later
"""A program's path in segments, walked through two stocks: the blank, and the one that is kept.  Called by run.py.

 1. A segment is at most SEGMENT_MM of a straight move, or a chord of an arc.  Its place is the number of its move and
    the share of the move behind it.
 2. What a segment removes from the blank as the path leaves it, is what it has to remove (`wanted`).  What it removes
    from the kept stock, is what is not done of that (`undone`).  Neither is evidence where nothing is to be removed.
 3. Times are those of F and of the axes, without acceleration and override.

Lengths mm, machine coordinates of the tool's tip; times s; volumes mm3.
"""

import functools
import math
from dataclasses import dataclass, replace

import numpy as np

from chipwise.program import records
from chipwise.program.reader import Unreadable
from chipwise.clib.height_map import Shape
from chipwise.check.times import DEFAULT_SPEED
from chipwise.resume import stocks
from chipwise.clib.core import CoreError, Cutter, Tool
from chipwise.tool_data.geometry import ToolGeometry

SEGMENT_MM = 0.5


@dataclass
class Path:
    """k segments of moves first .. end - 1: move (k,) int; share (k,): of the move, at the segment's end; end (k, 3);
    seconds (k,); tool (k,): index in tools; tools: [(number, diameter mm, core Tool or None, sweep.Shape or None)];
    begin (3,): where the first one begins."""

    move: np.ndarray
    share: np.ndarray
    end: np.ndarray
    seconds: np.ndarray
    tool: np.ndarray
    tools: list
    begin: np.ndarray

    @functools.cached_property
    def at(self):
        """(k + 1,) s at which each segment begins, and at which the last one ends."""
        return np.concatenate(([0.0], np.cumsum(self.seconds)))

    def start(self, k):
        """(3,): where a segment begins."""
        return self.end[k - 1] if k else self.begin

    def share_before(self, k):
        """Share of its move at which a segment begins."""
        return float(self.share[k - 1]) if k and self.move[k - 1] == self.move[k] else 0.0


def tools_by_move(program, geometry):
    """((n,) int: index of each move's tool, tools of Path); number 0, None: no tool, or one without a diameter."""
    tools, index = [(0, 0.0, None, None)], np.zeros(len(program.kind), int)
    for event in program.events:
        if event.kind != records.TOOL:
            continue
        number, diameter = int(event.values[0]), event.values[1]
        made = shape = None
        if number > 0 and diameter > 0:
            shape = Shape.of_tool(diameter, geometry.get(number) or ToolGeometry())
            try:
                made = Tool(diameter, shape.corner_radius, shape.tip_angle)
            except CoreError as error:
                raise Unreadable(str(error), "correct the tool table or TOOL_GEOMETRY", event.line) from error
        tools.append((number, diameter, made, shape))
        index[event.at :] = len(tools) - 1
    return index, tools


def path_of(program, machine, geometry, first):
    """The Path of a rewrite.program.Program from its move `first` on."""
    lead = max(program.known_from, program.lead.named_from)
    first = max(first, lead)
    moves = np.arange(first, len(program.kind))
    if not len(moves):
        raise Unreadable("it cuts nothing in this stock", "name the program that ran")
    index, tools = tools_by_move(program, geometry)
    kinds, ends = program.kind[moves], program.end[moves]
    begin = program.start(first)
    starts = np.concatenate((begin[None], ends[:-1]))
    steps = ends - starts
    length = np.sqrt((steps * steps).sum(axis=1))
    count = np.where(kinds == records.RAPID, 1, np.maximum(np.ceil(length / SEGMENT_MM), 1)).astype(int)
    owner = np.repeat(np.arange(len(moves)), count)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + 1) / count[owner]
    places = np.where((share < 1)[:, None], starts[owner] + steps[owner] * share[:, None], ends[owner])
    speeds = np.array([v or DEFAULT_SPEED for v in machine.speeds])
    with np.errstate(divide="ignore", invalid="ignore"):
        slowest = np.nanmax(np.abs(steps) / speeds, axis=1)
        feed = np.where(kinds == records.RAPID, 0.0, length / (program.feed[moves] / 60.0))
    seconds = np.fmax(slowest, np.nan_to_num(feed, nan=0.0, posinf=0.0))
    return Path(moves[owner], share, places, seconds[owner] / count[owner], index[moves][owner], tools, begin)


def removed(path, stock, program, first=0, end=None):
    """(end - first,): mm3 that each of some segments removes from a Stock, which they cut.  Raises Unreadable where no
    tool is known."""
    end = len(path.move) if end is None else end
    result = np.zeros(end - first)
    cutter, had = None, None
    for k in range(first, end):
        number = int(path.tool[k])
        if number != had:
            had, tool = number, path.tools[number]
            cutter = Cutter(stock, tool[2], path.start(k)) if tool[2] else None
        if cutter is not None:
            result[k - first] = cutter.to(path.end[k])
        elif program.kind[path.move[k]] != records.RAPID:
            number, line = path.tools[number][0], int(program.line[path.move[k]])
            raise Unreadable(
                f"tool {number} has no diameter in the tool table" if number else "no tool is in the spindle (tool 0)",
                "give it a D there" if number else "call one with T.. M6 before",
                line,
            )
    return result


def cut_to(path, stock, program, segment, share):
    """Cut a Stock by the path up to a share of a segment; -> mm3."""
    return float(removed(path, stock, program, 0, segment).sum()) + cut_part(path, stock, segment, share)


def cut_part(path, stock, segment, share):
    """Cut a Stock by a share of a segment; -> mm3."""
    tool = path.tools[int(path.tool[segment])][2] if segment < len(path.move) else None
    if tool is None or share <= 0:
        return 0.0
    start = path.start(segment)
    return Cutter(stock, tool, start).to(start + (path.end[segment] - start) * share)


def with_tools(path, by):
    """A Path with tools that are larger in radius by so many mm; pointed ones are the same."""
    tools = []
    for number, diameter, tool, shape in path.tools:
        if tool and not shape.tip_angle:
            radius = max(diameter / 2 + by, diameter / 4)
            tool = Tool(
                2 * radius,
                max(min(shape.corner_radius + (by if 2 * shape.corner_radius >= diameter else 0.0), radius), 0.0),
            )
        tools.append((number, diameter, tool, shape))
    return replace(path, tools=tools)


def evidence(path, program, found):
    """(wanted (k,), undone (k,)) of a stocks.Kept [2]."""
    wanted = removed(path, stocks.blank(found.head), program)
    undone = removed(path, stocks.stock_of(found), program)
    return wanted, undone


def nearest(path, point, most):
    """[(segment, share of it, distance)] of the places of a path that are at most `most` mm from a point, each the
    nearest of those around it."""
    starts = np.concatenate((path.begin[None], path.end[:-1]))
    steps = path.end - starts
    square = (steps * steps).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(square > 0, ((point - starts) * steps).sum(axis=1) / square, 0.0)
    along = np.clip(along, 0.0, 1.0)
    off = np.sqrt((((starts + steps * along[:, None]) - point) ** 2).sum(axis=1))
    near = np.flatnonzero(off <= most)
    if not len(near):
        return []
    found = []
    for part in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1):
        value = off[part]
        inner = np.concatenate(([math.inf], value, [math.inf]))
        best = part[(value <= inner[:-2]) & (value <= inner[2:])]
        found += [(int(k), float(along[k]), float(off[k])) for k in best]
    return found
