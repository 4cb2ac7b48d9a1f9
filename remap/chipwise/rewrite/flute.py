# SPDX-License-Identifier: GPL-2.0-or-later
"""Shifts the parts of a program's path for which the flutes are too short, and adds the path for what is left.

Called by run.py.  Source: CN105492980 [0060]..[0093] and figure 7.

 1. Judge (S103): every move in the stock as the moves before have left it.  Long enough everywhere: nothing changes.
 2. Otherwise a *body* at a time: feed moves across the tool's axis, one after the other, with the moves along the axis
    that lead to them, at most MOST_MOVES.  Its points that are too deep are found (S104) and shifted along the axis
    until the flutes are long enough
    (S105): R3, which takes the body's place.  Both ends of a segment are shifted, so that the whole of it is.  Shifting
    leaves stock for the points behind it, so this is repeated until nothing changes.
 3. Corners of R3 become arcs, and points where it turns back are bridged (trials.py, shift.py; figure 20).
 4. The segments of the first path that still meet material (R4, figure 13), or the whole body (`whole`), are travelled
    again and judged in the same way, until the first path itself has been cut (levels.py).

Departs from the source: a body is finished before the next is begun, so every later move finds the stock that the first
path would have left it.

Between any two bodies the following holds, and each step below keeps it: the map of the stock is as the first path
leaves it up to there; `edits` has all that the new program does otherwise up to there; `proof` knows every move of the
new program up to there.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Callable, Optional

import numpy as np

from chipwise.check.simulate import SEGMENT_MM
from chipwise.program.reader import Unreadable
from chipwise.program.records import ARC, FEED, RAPID
from chipwise.rewrite import depth_proof, path_moves, read_back, sections
from chipwise.rewrite.edits import Edits, Move, Table
from chipwise.rewrite.levels import Levels, length_of
from chipwise.rewrite.links import ACROSS_MM, OVER_MM, Links
from chipwise.rewrite.trial_proof import Sought
from chipwise.rewrite.trials import Trials

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints, Records
    from chipwise.clib.height_map import HeightMap
    from chipwise.rewrite.program import Program
    from chipwise.tool_data.geometry import ToolGeometry

PIECES_ACROSS = 12  # of a tool's diameter: how finely a move is divided where it is shifted
MOST_MOVES = 20_000  # of one body: longer ones are divided, so that the memory is limited
MOST_WRITTEN = 20_000_000  # moves of the new program


@dataclass(frozen=True)
class Order:
    """What is asked for.

    cell: mm, of the map; whole: travel the whole body again, not only where material is left; diameter: of the arcs at
    corners of the shifted path
    (mm, None: the tool's); reserve: mm of the flutes that shifted paths leave unused; anywhere: also what cannot be
    rewritten
    (Program.check_shiftable()); needles: as in sections.in_stock(); clearance: mm that new traverses keep from stock.
    """

    cell: float
    whole: bool = False
    diameter: Optional[float] = None
    reserve: float = 0.0
    anywhere: bool = False
    needles: Optional[dict[int, Floats]] = None
    clearance: float = 0.0


@dataclass
class Ground:
    """What a section is cut in: the HeightMap, which is cut as the work goes on; the number of its stock in the
    program, from 0; the tool; the proof of depths (Sought) of the moves in this stock; links over it; what the whole
    program leaves of it."""

    stock: HeightMap
    number: int
    tool: sections.Tool
    proof: Sought
    links: Links
    final: Callable[[], sections.Final]

    @property
    def radius(self) -> float:
        return self.tool.shape.diameter / 2

    @property
    def piece(self) -> float:
        """How finely a move is divided where it is shifted, mm."""
        return min(SEGMENT_MM, max(self.tool.shape.diameter / PIECES_ACROSS, 0.5 * self.stock.cell))

    def window(self, points: Floats) -> sections.Window:
        """The sections.Window of the stock under a path."""
        return sections.Window(self.stock, points, self.radius)

    def cut(self, start: Floats, ends: Floats) -> Records:
        """Cut; -> MET records of the moves."""
        return self.stock.cut(self.tool.shape, start, ends)


@dataclass
class Figures:
    """What was done; mm."""

    bodies: int = 0  # shifted
    segments: int = 0  # of R4
    first_feed: float = 0.0  # length of the first path's feed moves
    added_feed: float = 0.0
    bridged: int = 0  # points dropped
    lines: list[tuple[int, int, int]] = field(default_factory=list)  # (first, last, levels) of each body
    written: int = 0  # moves of the new program
    shifted: list[tuple[int, int]] = field(default_factory=list)  # (first move, end) of each body


class Shifter:
    """One program.  ground: of the section at work; more: mm, as in Trials, since a path was found too deep."""

    ground: Ground

    def __init__(self, program: Program, geometry: dict[int, ToolGeometry], order: Order) -> None:
        self.program, self.geometry, self.order = program, geometry, order
        self.edits, self.figures = Edits(), Figures(written=len(program.kind))
        self.links, self.more = Links(program, order.clearance), 0.0

    def run(self, progress: Callable[[float], object] | None = None) -> Edits:
        """-> Edits.  progress: called with the share that is done."""
        found = sections.sections(self.program, self.geometry)
        before = None
        for section, stock in sections.in_stock(self.program, found, self.order.cell, progress, self.order.needles):
            before = self.ground = self._ground(section, stock, found, before)
            self._section(section)
        return self.edits

    def _ground(
        self, section: sections.Cut, stock: HeightMap, found: list[sections.Section], before: Ground | None
    ) -> Ground:
        """The Ground of a section; the one before goes on with another tool if the stock is the same."""
        links = self.links
        links.stock, links.tool = stock, section.tool
        if before is not None and stock is before.stock:
            return replace(before, tool=section.tool)
        number = 0 if before is None else before.number + 1
        tools = [s.tool for s in found if s.tool]
        proof = Sought(stock, tools, functools.partial(depth_proof.path_of, self.program, found, tools))
        return Ground(
            stock, number, section.tool, proof, links, functools.cache(functools.partial(self._final, number))
        )

    def _final(self, number: int) -> sections.Final:
        """The sections.Final of a stock, as read_back.same_stock() will have it."""
        return sections.Final(read_back.simulated(self.program, self.geometry, self.order.cell)[number][0])

    # ---- a section --------------------------------------------------------------------------------------------

    def _section(self, section: sections.Cut) -> None:
        """The moves of a section; when it returns, what the head of this file says of the begin of a body holds of the
        next section."""
        program, first, end = self.program, section.first, section.end
        kinds = program.kind[first:end]
        start = program.start(first)
        steps = np.diff(program.end[first:end], axis=0, prepend=start[None])
        self.figures.first_feed += float(np.sqrt((steps[kinds != RAPID] ** 2).sum(axis=1)).sum())
        # [1] judge the first path in a copy of the map: where the flutes reach everywhere, that is all
        before = sections.Window(self.ground.stock, np.array([[-math.inf] * 3, [math.inf] * 3]), 0.0)
        if self._long_enough(start, program.end[first:end], kinds):
            self.ground.proof.follow(self.ground.tool, start, program.end[first:end])
            return
        # [2] else from the begin again, body by body
        before.restore()
        del before  # a copy of the map
        self._bodies(first, end, np.hypot(steps[:, 0], steps[:, 1]) > ACROSS_MM)

    def _long_enough(self, start: Floats, ends: Floats, kinds: Ints) -> bool:
        """[1]: cuts the first path; whether the flutes reach."""
        ground = self.ground
        limit = ground.tool.flutes
        return not any(
            ((met["depth"] > limit + OVER_MM) & (kinds[owner] != RAPID)).any()
            for owner, met in sections.cut_along(ground.stock, ground.tool.shape, start, ends, SEGMENT_MM)
        )

    def _bodies(self, first: int, end: int, across: Bools) -> None:
        """[2]: the steps of a section whose flutes are too short somewhere; across (end - first,) bool: moves across
        the tool's axis.

        A step that feeds across begins a body, which goes on to the next step that does not, or is divided at
        MOST_MOVES.  `lead` gathers the moves along the axis since the last move across: they belong to the body behind
        them, or are a hole.
        """
        program = self.program
        begins = program.first[program.step[first] : program.step[end - 1] + 1].clip(
            first, end
        )  # the first move of each step
        goes = np.logical_or.reduceat(across, begins - first)
        begins, feeds = np.append(begins, end), program.kind[begins] != RAPID
        stops = np.append(np.flatnonzero(~(goes & feeds)), len(feeds))  # steps outside of bodies
        lead: list[int] = []
        k = 0
        while k < len(feeds):
            at, behind = begins[k : k + 2].tolist()
            if not goes[k]:  # along the axis only
                lead += range(at, behind)
                k += 1
            elif feeds[k]:  # a body, up to the next step outside of one
                divided = int(begins.searchsorted(at + MOST_MOVES, side="right")) - 1
                k = max(k + 1, min(int(stops[stops.searchsorted(k)]), divided))
                self._body(lead, at, int(begins[k]), end)
                lead = []
            else:  # a rapid across: what came down before it was a hole
                self._drill(lead)
                self._traverse(at, behind)
                lead = []
                k += 1
        self._drill(lead)

    def _traverse(self, first: int, end: int) -> None:
        """Rapids across the tool's axis."""
        start, ends = self.program.start(first), self.program.end[first:end]
        self.ground.cut(start, ends)
        self.ground.proof.follow(self.ground.tool, start, ends)
        self.links.travel = float(ends[-1][2])

    def _drill(self, lead: list[int]) -> None:
        """Vertical moves that lead to no path."""
        if lead:
            self._cut_lead(lead, -math.inf)
            self.ground.proof.follow(self.ground.tool, self.program.start(lead[0]), self.program.end[lead])

    def _cut_lead(self, lead: list[int], lowest: float) -> None:
        """Vertical moves, none below `lowest`."""
        if lead:
            ends = self.program.end[lead].copy()
            ends[:, 2] = np.maximum(ends[:, 2], lowest)
            self.ground.cut(self.program.start(lead[0]).copy(), ends)

    # ---- a body -----------------------------------------------------------------------------------------------

    def _body(self, lead: list[int], first: int, end: int, section_end: int) -> None:
        """One body: the feed moves first .. end - 1 across the tool's axis, with the moves `lead` that lead to them."""
        program, ground = self.program, self.ground
        # [S103] cut the body as the first path has it, and look how deep it was
        points, owner = sections.pieces(
            np.concatenate((program.start(first)[None], program.end[first:end])), ground.piece
        )
        body = path_moves.Body(points, owner + first, lead)
        window = ground.window(points)
        self._lead_in(body, points)
        depth = ground.cut(points[0], points[1:])["depth"]
        if (depth <= ground.tool.flutes + OVER_MM).all():
            # too deep nowhere: the first path stays, and the map is as it leaves it already
            ground.proof.follow(ground.tool, program.start(first), program.end[first:end])
            return
        # keep what the first path leaves of the stock, and put the stock back to before the body
        target = ground.window(points)  # what the first path leaves
        window.restore()
        wall = self.links.wall(points[0])
        if not self.order.anywhere:
            program.check_shiftable(first, end)
        # [S105] cut R3 in its place, and write it
        moved = self._shifted(body, target, depth)
        self._replace(body, moved, wall)
        # R4: what is left is travelled again, until the map is as the first path leaves it
        self._note(first, end, bool(lead), self._rest(body, moved, end, section_end))

    def _note(self, first: int, end: int, has_lead: bool, levels: int) -> None:
        """A body was shifted.  The parts of a long body are one range of lines."""
        figures, line = self.figures, self.program.line
        figures.bodies += 1
        begin = int(line[first])
        if figures.lines and figures.shifted[-1][1] == first and not has_lead:
            begin, _last, before = figures.lines.pop()
            levels = max(levels, before)
        figures.shifted.append((first, end))
        figures.lines.append((begin, int(line[end - 1]), levels))

    def _lead_in(self, body: path_moves.Body, path: Floats) -> None:
        """Cut the moves that lead to a path (n, 3)."""
        self._cut_lead(body.lead, path[0, 2])
        if body.entered:
            self.ground.cut(path[0], path[:1])  # straight down: what is left is that of the lowest place

    def _shifted(
        self, body: path_moves.Body, target: sections.Window | None = None, depth: Floats | None = None
    ) -> Floats:
        """R3 of a path in the stock as it is, which is cut: (n, 3) points, NaN where they are left out.

        depth, target: as in Trials.shifted().
        """
        ground = self.ground
        trials = Trials(
            self.program,
            body,
            ground,
            lambda path: self._lead_in(body, path),
            ground.tool.flutes - self.order.reserve,
            self.more,
        )
        moved = trials.shifted(ground.radius if self.order.diameter is None else self.order.diameter / 2, target, depth)
        self.more = trials.more
        self.figures.bridged += trials.bridged
        return moved

    def _rest(self, body: path_moves.Body, moved: Floats, end: int, section_end: int) -> int:
        """[4]: what is left, in `edits` behind the body; -> levels in all."""
        levels = Levels(self.program, self.ground, body, moved)
        levels.run(self._shifted, self.order.whole)
        self.figures.segments += levels.segments
        self.figures.added_feed += levels.feed
        written, at, place = levels.written, levels.at, body.points[-1]
        if written or math.dist(at, place) > 1e-9:
            written.append(Table.of(self.links.back(at, place, end, section_end, body)))
        if any(map(len, written)):
            table = Table.joined(written)
            self._check_length(len(table), int(self.program.line[body.move[0]]))
            self.edits.after.put([int(self.program.step[end - 1])], [0, len(table)], table)
        return levels.count

    def _check_length(self, more: int, line: int) -> None:
        """Unreadable as soon as the new program has more moves than are read back."""
        self.figures.written += more
        if self.figures.written > MOST_WRITTEN:
            raise Unreadable(
                f"the new program would have more than {MOST_WRITTEN} moves",
                "take a tool with longer flutes, or rewrite it in parts",
                line,
            )

    # ---- what is written --------------------------------------------------------------------------------------

    def _replace(self, body: path_moves.Body, moved: Floats, wall: float) -> None:
        """R3 in the place of the body's steps that it changes.  wall: as in Links.wall() where it begins, before."""
        program, edits = self.program, self.edits
        # the moves that lead to the body end where R3 begins
        z0 = moved[0, 2]
        if z0 > body.points[0, 2] + 1e-9:
            for move in body.lead:
                if program.end[move, 2] < z0 - 1e-9:
                    edits.instead[int(program.step[move])] = self._lead(body, move, z0, wall)
        # the steps with a point that is left out or shifted ..
        changed = np.isnan(moved[:, 2]) | (moved[:, 2] > body.points[:, 2] + 1e-9)
        steps = program.step[body.move]
        moves, spans = path_moves.moves_along(program, body, moved)
        if z0 > body.points[0, 2] + 1e-9 and not body.lead:  # the tool is at the first path's height before
            down = Move(FEED, tuple(moved[0].tolist()), float(program.feed[body.move[0]]))
            moves, spans = Table.joined([Table.of([down]), moves]), np.concatenate((np.array([[0, 0]]), spans))
        # .. get the moves of R3 that come from them
        instead, owner = np.unique(steps[changed[:-1] | changed[1:]]), steps[spans[:, 0]]
        own = np.flatnonzero(np.isin(owner, instead))
        edits.instead.put(
            instead,
            np.append(np.searchsorted(owner[own], instead), len(own)),
            moves.take(own),
            "shifted along the axis",
        )
        self.figures.added_feed += length_of(moved[~np.isnan(moved[:, 2])]) - length_of(body.points)

    def _lead(self, body: path_moves.Body, move: int, z0: float, wall: float) -> list[Move]:
        """Moves in place of one that leads to a body, which begins at z0."""
        program, place = self.program, self.program.end[move, :2].tolist()
        if program.kind[move] == ARC:
            raise Unreadable(
                "the flutes are too short where an arc from an unknown place ends",
                "name X, Y and Z in a straight move before it",
                int(program.line[move]),
            )
        if program.kind[move] != RAPID:
            return [Move(FEED, (*place, z0), float(program.feed[move]))]
        return self.links.lead_down(place, float(program.start(move)[2]), z0, wall, float(program.feed[body.move[0]]))


def rewrite(
    program: Program, geometry: dict[int, ToolGeometry], order: Order, progress: Callable[[float], object] | None = None
) -> tuple[Edits, Figures]:
    """(Edits, Figures) of a program: CN105492980.  geometry: {number: ToolGeometry}; progress: called with the share
    that is done.

    Raises Unreadable.
    """
    shifter = Shifter(program, geometry, order)
    return shifter.run(progress), shifter.figures
