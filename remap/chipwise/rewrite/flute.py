# SPDX-License-Identifier: GPL-2.0-or-later
"""Shifts the parts of a program's path for which the flutes are too short, and adds the path for what is left.

Called by run.py.  Source: CN105492980 [0060]..[0093] and figure 7.

 1. Judge (S103): every move in the stock as the moves before have left it.  Long enough everywhere: nothing changes.
 2. Otherwise a *body* at a time: feed moves across the tool's axis, one after the other, with the moves along the axis that
    lead to them, at most MOST_MOVES.  Its points that are too deep are found (S104) and shifted along the axis until the flutes are long enough
    (S105): R3, which takes the body's place.  Both ends of a segment are shifted, so that the whole of it is.  Shifting leaves
    stock for the points behind it, so this is repeated until nothing changes.
 3. Corners of R3 become arcs, and points where it turns back are bridged (trials.py, shift.py; figure 20).
 4. The segments of the first path that still meet material (R4, figure 13), or the whole body (`whole`), are travelled again
    and judged in the same way, until the first path itself has been cut.  Between them the tool goes up to where the program
    last travelled, across, and down to a gap above what it has cut.

Departs from the source: a body is finished before the next is begun, so every later move finds the stock that the first path
would have left it.
"""

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from chipwise.program.records import ARC, FEED, RAPID
from chipwise.program.reader import Unreadable
from chipwise.check.simulate import SEGMENT_MM
from chipwise.clib.height_map import MET
from chipwise.rewrite import depth_proof, path_moves, read_back, sections
from chipwise.rewrite import shift
from chipwise.rewrite.edits import Edits, Move, Table
from chipwise.rewrite.links import ACROSS_MM, OVER_MM, Links
from chipwise.rewrite.segments import segments, with_links
from chipwise.rewrite.trial_proof import OVER_STOCK_MM, Sought
from chipwise.rewrite.trials import Trials

LEFT_DEPTH = 0.15           # cells of depth, or of a cell's height, less than read_back.py's HEIGHT_CELLS, and
LEFT_SHARE = 0.005          # cells of mean height across the tool, below which nothing is left to travel again for
PIECES_ACROSS = 12          # of a tool's diameter: how finely a move is divided where it is shifted
MOST_LEVELS = 1000          # of one body
MOST_MOVES = 20_000         # of one body: longer ones are divided, so that the memory is limited
MOST_WRITTEN = 20_000_000   # moves of the new program


@dataclass
class Figures:
    """What was done; mm."""

    bodies: int = 0             # shifted
    segments: int = 0          # of R4
    first_feed: float = 0.0     # length of the first path's feed moves
    added_feed: float = 0.0
    bridged: int = 0            # points dropped
    lines: list = field(default_factory=list)       # (first, last, levels) of each body
    shifted: list = field(default_factory=list)     # (first move, end) of each body


class Shifter:
    """One program."""

    def __init__(self, program, geometry, cell, whole=False, diameter=None, reserve=0.0, anywhere=False, needles=None, clearance=0.0):
        self.program, self.whole, self.diameter, self.reserve, self.anywhere = program, whole, diameter, reserve, anywhere
        self.sections = sections.sections(program, geometry)
        self.cell, self.needles = cell, needles
        self.edits, self.figures, self.written = Edits(), Figures(), len(program.kind)
        self.stock, self.tool, self.links = None, None, Links(program, clearance)
        self.geometry, self.number, self.final = geometry, -1, None         # number of the stock
        self.sought, self.more = None, 0.0              # more: as of Trials, since a path was found too deep

    def run(self, progress=None):
        """-> Edits."""
        for section, stock in sections.in_stock(self.program, self.sections, self.cell, progress, self.needles):
            if stock is not self.stock:
                self.number, self.final = self.number + 1, None
                tools = [s.tool for s in self.sections if s.tool and s.tool.shape]
                self.sought = Sought(stock, tools, functools.partial(depth_proof.path_of, self.program, self.sections, tools))
            self.stock, self.tool = self.links.stock, self.links.tool = stock, section.tool
            self._section(section)
        return self.edits

    # ---- a section --------------------------------------------------------------------------------------------

    def _section(self, section):
        program, first, end = self.program, section.first, section.end
        kinds = program.kind[first:end]
        start = program.start(first)
        steps = np.diff(program.end[first:end], axis=0, prepend=start[None])
        self.figures.first_feed += float(np.sqrt((steps[kinds != RAPID] ** 2).sum(axis=1)).sum())
        before = sections.Window(self.stock, np.array([[-math.inf] * 3, [math.inf] * 3]), 0.0)
        if self._long_enough(start, program.end[first:end], kinds):
            self.sought.follow(self.tool, start, program.end[first:end])
            return
        before.restore()
        del before
        self._bodies(first, end, np.hypot(steps[:, 0], steps[:, 1]) > ACROSS_MM)

    def _long_enough(self, start, ends, kinds):
        """[1]: cuts the first path; whether the flutes reach."""
        limit = sections.finite_room(self.tool.flute_length)
        return not any(((met["depth"] > limit + OVER_MM) & (kinds[owner] != RAPID)).any()
                       for owner, met in sections.cut_along(self.stock, self.tool.shape, start, ends, SEGMENT_MM))

    def _piece(self):
        return min(SEGMENT_MM, max(self.tool.shape.diameter / PIECES_ACROSS, 0.5 * self.stock.cell))

    def _bodies(self, first, end, across):
        """[2]: a section whose flutes are too short somewhere."""
        program = self.program
        begins = program.first[program.step[first]:program.step[end - 1] + 1].clip(first, end)         # of the steps
        goes = np.logical_or.reduceat(across, begins - first)
        begins, feeds = np.append(begins, end), program.kind[begins] != RAPID
        ends = np.append(np.flatnonzero(~(goes & feeds)), len(feeds))
        lead, k = [], 0
        while k < len(feeds):
            at, step_end = begins[k:k + 2].tolist()
            if goes[k] and feeds[k]:
                k = max(k + 1, min(int(ends[ends.searchsorted(k)]), int(begins.searchsorted(at + MOST_MOVES, side="right")) - 1))
                self._body(lead, at, int(begins[k]), end)
                lead = []
                continue
            if goes[k]:                                             # a traverse
                self._drill(lead)
                lead = []
                self.stock.cut(self.tool.shape, program.start(at), program.end[at:step_end])
                self.sought.follow(self.tool, program.start(at), program.end[at:step_end])
                self.links.travel = float(program.end[step_end - 1][2])
            else:
                lead += range(at, step_end)
            k += 1
        self._drill(lead)

    def _drill(self, lead):
        """Vertical moves that lead to no path."""
        if self._cut_lead(lead, -math.inf) is not None:
            self.sought.follow(self.tool, self.program.start(lead[0]), self.program.end[lead])

    def _cut_lead(self, lead, lowest):
        """Vertical moves, none below `lowest`; -> where they end, None without any."""
        if not lead:
            return None
        ends = self.program.end[lead].copy()
        start = self.program.start(lead[0]).copy()
        ends[:, 2] = np.maximum(ends[:, 2], lowest)
        self.stock.cut(self.tool.shape, start, ends)
        return ends[-1]

    # ---- a body -----------------------------------------------------------------------------------------------

    def _body(self, lead, first, end, section_end):
        program = self.program
        points, owner = sections.pieces(np.concatenate((program.start(first)[None], program.end[first:end])), self._piece())
        body = path_moves.Body(points, owner + first, lead)
        window = sections.Window(self.stock, points, self.tool.shape.diameter / 2)
        self._lead_in(body, points)
        depth = self.stock.cut(self.tool.shape, points[0], points[1:])["depth"]
        if (depth <= self.tool.flute_length + OVER_MM).all():
            self.sought.follow(self.tool, program.start(first), program.end[first:end])
            return
        target = sections.Window(self.stock, points, self.tool.shape.diameter / 2)      # what the first path leaves
        window.restore()
        wall = self.links.wall(points[0])
        self.figures.shifted.append((first, end))
        if not self.anywhere:
            program.check_shiftable(first, end)
        moved = self._shifted(body, target, depth)
        self._replace(body, moved, wall)
        levels = self._rest(body, moved, end, section_end)
        self.figures.bodies += 1
        lines = self.figures.lines
        if lines and self.figures.shifted[-2:-1] and self.figures.shifted[-2][1] == first and not lead:      # a long body's next part
            levels, begin = max(levels, lines[-1][2]), lines.pop()[0]
        else:
            begin = int(program.line[first])
        lines.append((begin, int(program.line[end - 1]), levels))

    def _lead_in(self, body, path):
        """Cut the moves that lead to a path (n, 3)."""
        self._cut_lead(body.lead, path[0, 2])
        if body.entered:
            self.stock.cut(self.tool.shape, path[0], path[:1])          # straight down: what is left is that of the lowest place

    def _shifted(self, body, target=None, depth=None):
        """R3 of a path in the stock as it is, which is cut: (n, 3) points, NaN where they are left out.

        depth, target: as of Trials.shifted().
        """
        trials = Trials(self.program, body, self.stock, self.tool, lambda path: self._lead_in(body, path), self.sought,
                        self.tool.flute_length - self.reserve, self.more)
        moved = trials.shifted(self._radius(), target, depth)
        self.more = trials.more
        self.figures.bridged += trials.bridged
        return moved

    def _radius(self):
        return (self.tool.shape.diameter if self.diameter is None else self.diameter) / 2

    # ---- what is left -----------------------------------------------------------------------------------------

    def _rest(self, body, moved, end, section_end):
        """[4]: R4; -> levels in all."""
        points, levels, written, at, had = body.points, 1, [], moved[-1], (math.inf, math.inf)
        done, s = _unshifted(points, moved), shift.along(points)
        window = sections.Window(self.stock, points, self.tool.shape.diameter / 2)
        while not done.all():
            window.keep()
            met, left, deepest = self._first_path(points, done)
            if not left.any():
                left = self._left_bit_by_bit(points, met, window) & ~done
            window.restore()
            now = float(met["volume"].sum(dtype=np.float64)), deepest
            helped = now[0] < had[0] or now[1] < had[1]
            if not left.any() or not (helped or deepest > self.tool.flute_length + OVER_MM):
                break
            for a, b in self._segments(points, left, s):
                part = path_moves.Body(points[a:b + 1], body.move[a:b], [], entered=True)
                link = self.links.to_segment(at, part, body)
                path = self._shifted(part)
                done[a:b] |= _unshifted(part.points, path)
                written += [Table.of(link(path[0, 2])), path_moves.moves_along(self.program, part, path)[0]]
                at = path[-1]
                self.figures.segments += 1
                self.figures.added_feed += _length(path[~np.isnan(path[:, 2])])
            levels += 1
            if levels > MOST_LEVELS or not helped:
                raise Unreadable(f"the flutes of tool {self.tool.number} are too short, and shifting the path does not help",
                                 "take a tool with longer flutes", int(self.program.line[body.move[0]]))
            had = now
        if written or math.dist(at, points[-1]) > 1e-9:
            written.append(Table.of(self.links.back(at, points[-1], end, section_end, body)))
        if any(map(len, written)):
            table = Table.joined(written)
            self._check_length(len(table), int(self.program.line[body.move[0]]))
            self.edits.after.put([int(self.program.step[end - 1])], [0, len(table)], table)
        return levels

    def _segments(self, points, left, s):
        """[(first, last)]: points of the segments that are travelled again; left (n - 1,) bool: where something is left."""
        if self.whole:
            return [(0, len(left))]
        diameter = self.tool.shape.diameter
        return with_links(segments(left, s, self.stock.cell, diameter / 2), points, s, diameter, self.links)

    def _check_length(self, more, line):
        """Unreadable as soon as the new program has more moves than are read back."""
        self.written += more
        if self.written > MOST_WRITTEN:
            raise Unreadable(f"the new program would have more than {MOST_WRITTEN} moves", "take a tool with longer flutes, or rewrite it in parts",
                             line)

    def _first_path(self, points, done):
        """Cuts what has not been done (n - 1,) bool of the first path; -> (MET records (n - 1,), (n - 1,) bool: where something is left, how deep it
        is)."""
        places, segment = path_moves.without(points, done, self.stock.z_max + OVER_STOCK_MM)
        own, met = segment >= 0, np.zeros(len(done), MET)
        met[segment[own]] = self.stock.cut(self.tool.shape, places[0], places[1:])[own]
        left, deepest = self._left(points, met), float(met["depth"].max())
        found = self.sought.too_deep(self.tool, places, own & ~(left | done)[segment])
        if len(found):
            move = segment[found["move"]]
            left[move] = True
            deepest = max(deepest, float((found["height"] - points[move, 2]).max()))
        return met, left & ~done, deepest

    def _left(self, points, met):
        """(n - 1,) bool: pieces that still meet material, more than the ridges between the model's steps."""
        cell, length = self.stock.cell, np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
        share = met["volume"] / (cell * self.tool.shape.diameter * np.maximum(length, 1e-9))
        return (met["depth"] > cell) | ((met["depth"] > LEFT_DEPTH * cell) & (share > LEFT_SHARE))

    def _left_bit_by_bit(self, points, met, window):
        """(n - 1,) bool: pieces that lower a cell, though each of them by little, which the proof would find too high without them."""
        left, reach = np.zeros(len(points) - 1, bool), self.tool.shape.diameter / 2 + self._piece()
        for place in window.left(LEFT_DEPTH * self.stock.cell, self._final()):
            left |= np.hypot(*(points[:-1, :2] - place).T) < reach
        return left & (met["volume"] > 0.0)

    def _final(self):
        """The cutting.Final of the stock, as proof.same_stock will have it."""
        if self.final is None:
            self.final = sections.Final(read_back.simulated(self.program, self.geometry, self.cell)[self.number][0])
        return self.final

    # ---- what is written --------------------------------------------------------------------------------------

    def _replace(self, body, moved, wall):
        """R3 in the place of the body's steps that it changes.  wall: as of Links.wall() where it begins, before."""
        program, edits = self.program, self.edits
        z0 = moved[0, 2]
        if z0 > body.points[0, 2] + 1e-9:
            for move in body.lead:
                if program.end[move, 2] < z0 - 1e-9:
                    edits.instead[int(program.step[move])] = self._lead(body, move, z0, wall)
        changed = np.isnan(moved[:, 2]) | (moved[:, 2] > body.points[:, 2] + 1e-9)
        steps = program.step[body.move]
        moves, spans = path_moves.moves_along(program, body, moved)
        if z0 > body.points[0, 2] + 1e-9 and not body.lead:         # the tool is at the first path's height before
            down = Move(FEED, tuple(moved[0].tolist()), float(program.feed[body.move[0]]))
            moves, spans = Table.joined([Table.of([down]), moves]), np.concatenate(([[0, 0]], spans))
        instead, owner = np.unique(steps[changed[:-1] | changed[1:]]), steps[spans[:, 0]]
        own = np.flatnonzero(np.isin(owner, instead))
        edits.instead.put(instead, np.append(np.searchsorted(owner[own], instead), len(own)), moves.take(own), "shifted along the axis")
        self.figures.added_feed += _length(moved[~np.isnan(moved[:, 2])]) - _length(body.points)

    def _lead(self, body, move, z0, wall):
        """Moves in place of one that leads to a body, which begins at z0."""
        program, place = self.program, self.program.end[move, :2].tolist()
        if program.kind[move] == ARC:
            raise Unreadable("the flutes are too short where an arc from an unknown place ends", "name X, Y and Z in a straight move before it", int(program.line[move]))
        if program.kind[move] != RAPID:
            return [Move(FEED, (*place, z0), float(program.feed[move]))]
        return self.links.lead_down(place, float(program.start(move)[2]), z0, wall, float(program.feed[body.move[0]]))


def _length(points):
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def _unshifted(points, path):
    """(n - 1,) bool: segments of points (n, 3) that a path (n, 3) travels where they are: nothing is left of them."""
    here = path[:, 2] <= points[:, 2] + 1e-9                    # a bridged point is NaN
    return here[:-1] & here[1:]


def rewrite(program, geometry, cell, whole=False, diameter=None, progress=None, reserve=0.0, anywhere=False, needles=None, clearance=0.0):
    """(Edits, Figures) of a program: CN105492980.

    geometry: {number: ToolGeometry}; cell: mm; whole: travel the whole body again, not only where material is left;
    diameter: of the arcs at corners of the shifted path (mm, default the tool's); reserve: mm of the flutes that shifted
    paths leave unused; anywhere: also what cannot be rewritten (Program.check_shiftable()); needles: as of cutting.in_stock(); clearance: mm that new traverses keep from stock.
    Raises Unreadable.
    """
    shifter = Shifter(program, geometry, cell, whole, diameter, reserve, anywhere, needles, clearance)
    return shifter.run(progress), shifter.figures
