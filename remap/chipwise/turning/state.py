# SPDX-License-Identifier: GPL-2.0-or-later
"""Part, stock and barriers on both sides while the steps go on; what a step is.  Called by steps.py and plan.py."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from chipwise.turning import passes, reach
from chipwise.turning.profile_function import (
    Box,
    Graph,
    Interval,
    Piece,
    Place,
    View,
    above,
    clip,
    flat,
    highest,
    mirrored,
    negative,
    upper,
    value,
)
from chipwise.errors import CycleError
from chipwise.turning.path import BESIDE_MM, Move, NoRoom, Path, Work
from chipwise.turning.profile import Profile
from chipwise.turning.tool import LatheTool

CLEARANCE_MM = 0.5
FACED_MM = 0.05  # a blank that ends so near to the face of the part has been faced
OVERRUN_MM = 1.0  # of a tool and of a drill's full diameter behind a bore through the part
FAR_MM = 5.0  # from the largest blank to where steps begin and end

ORDER = (
    "face",
    "drill",
    "rough outside",
    "rough inside",
    "rest outside",
    "rest inside",
    "finish outside",
    "finish inside",
    "groove",
    "undercut",
    "thread outside",
    "thread inside",
    "part off",
)


@dataclass(frozen=True)
class Drive:
    """What a thread needs of spindle and Z axis.  direction: 3 or 4 as M3, M4, 0 unknown; velocity, acceleration: mm/s,
    mm/s2, of Z; override:  the largest of the spindle, 1 = 100 %."""

    direction: int = 0
    velocity: float = math.inf
    acceleration: float = math.inf
    override: float = 1.0


@dataclass(frozen=True)
class Order:
    """What is to be made.  part, blank: Profile; tools: {role: (LatheTool, ..)}; barriers: ((z0, z1, x0, x1), ..);
    allowance, depth: mm; order: names of the steps; drive: Drive; diameter: X
    is a diameter in messages (G7); clearance: mm that tools keep from barriers; beside: mm that rapids keep from
    stock."""

    part: Profile
    blank: Profile
    tools: dict[str, tuple[LatheTool, ...]]
    barriers: tuple[Box, ...] = ()
    allowance: float = 0.0
    depth: float = 1.0
    order: tuple[str, ...] = ORDER
    drive: Drive = Drive()
    diameter: bool = False
    clearance: float = 0.0
    beside: float = BESIDE_MM

    @property
    def approach(self) -> float:
        """mm before stock at which a rapid ends."""
        return max(CLEARANCE_MM, self.beside)


@dataclass
class Step:
    """One step of the plan.  needed: bool; why: text; z0, z1: range; moves in the tool's own frame; removed: mm2;
    speed: 1/min of the spindle, 0: the program's; cuts: (number of moves that have been made, stock of the tool's side
    then) after each cut; after: {inside: stock} after the step; transverse: ((z0, z1), ..) of what a step of roughing
    cuts in columns."""

    name: str
    needed: bool
    why: str
    tool: LatheTool | None = None
    direction: str = ""
    z0: float = 0.0
    z1: float = 0.0
    moves: list[Move] = field(default_factory=list)
    start: Place = (0.0, 0.0)
    removed: float = 0.0
    speed: float = 0.0
    cuts: list[tuple[int, list[Piece]]] = field(default_factory=list)
    after: dict[bool, list[Piece]] = field(default_factory=dict)
    transverse: tuple[Interval, ...] = ()

    @property
    def used_tool(self) -> LatheTool:
        """The tool of a step that is needed."""
        if self.tool is None:
            raise ValueError(f"{self.name} has no tool")
        return self.tool


class Frame(NamedTuple):
    """How a tool sees its side: Z is mirrored for one that cuts towards +Z.

    own, tool   the tool itself, and as it is there; view: what makes a graph of it; domain: (z0, z1) mm
    """

    own: LatheTool
    tool: LatheTool
    view: View
    domain: Interval


class State:
    """Stock outside and in the bore (mirrored) as the steps go on.  given: as it was before an insert has cut
    it.  standing: with what the relief of the edges leaves on slopes; no step cuts that, and rapids have to keep clear
    of it."""

    def __init__(self, order: Order) -> None:
        self.order, part, blank = order, order.part, order.blank
        holders = [t for tools in order.tools.values() for t in tools]
        more = 50.0 + max(
            [abs(v) for t in holders for v in (t.holder_left, t.holder_right)] + [4 * t.nose + t.flat for t in holders],
            default=0.0,
        )
        self.domain = (min(part.z0, blank.z0) - more, max(part.z1, blank.z1) + more)
        radius = max(
            highest(blank.outside, *self.domain),
            highest(part.outside, *self.domain),
            *(b[3] for b in order.barriers),
            0.0,
        )
        self.safe_x = radius + max(FAR_MM, order.clearance, order.beside)
        self.safe_z = max(part.z1, blank.z1) + max(FAR_MM, order.beside)
        self.stock = {False: blank.outside, True: blank.bore or [flat(blank.z0, blank.z1, 0.0)]}
        self.given, self.standing = dict(self.stock), dict(self.stock)
        self.made: set[tuple[str, int]] = set()  # (name of a step, tool number): each tool makes a step once
        self.lids: dict[int, list[Piece]] = {}  # {tool number: pieces of what it leaves to a grooving tool}
        self.failed: list[
            tuple[str, LatheTool, CycleError]
        ] = []  # (name of a step, LatheTool, CycleError): a tool that could not make it
        self.faced = part.z1 + order.allowance if blank.z1 <= part.z1 + order.allowance + FACED_MM else math.inf
        self.through = bool(part.bore) and part.bore[0].z0 < part.z0 + passes.ROUNDING_MM
        self.part = {
            False: upper(part.outside, [flat(self.domain[0], part.z0, radius + 1.0)]),
            True: self._bore(part.bore),
        }
        self.barrier = {
            False: _boxes(order.barriers, 3, 1, order.clearance),
            True: _boxes(order.barriers, 2, -1, order.clearance),
        }

    def _bore(self, bore: Graph) -> list[Piece]:
        """The bore with its end: solid, a little behind it if it goes through the part."""
        if not bore:
            return []
        end = bore[0].z0 - (OVERRUN_MM if self.through else 0.0)
        more = [flat(end, bore[0].z0, value(bore[0], bore[0].z0))] if self.through else []
        return [flat(self.domain[0], end, 0.0), *more, *bore]

    def work(
        self, tool: LatheTool, allowance: float, levels: bool = False, keep: Graph = (), standing: Graph | None = None
    ) -> tuple[Work, Frame]:
        """(Work, Frame) of a tool on its side.

        levels: the tool works in levels, else through all at once; keep: stock
        that the step does not touch; standing: all that the holder has to be clear of, None for the whole stock."""
        lowest, frame = self.lowest(tool, allowance, levels, keep, standing)
        _own, tool, view, domain = frame
        side = tool.inside
        stock, barrier = view(self.stock[side]), view(self.barrier[side])
        contact = reach.dilated(stock, tool, 0.0, domain)
        block = upper(clip(reach.holder_height(stock, tool), *domain), reach.dilated(barrier, tool, 0.0, domain))
        block = upper(block, clip(reach.holder_height(barrier, tool), *domain)) if barrier else block
        start_z = self.safe_z if tool.towards < 0 else -self.safe_z
        start = (start_z + tool.nose, self.safe_x + tool.nose if not side else self._floor(side))
        bare = tool.bare()
        touch = reach.dilated(view(clip(self.standing[side], *_ends(self.stock[side]))), bare, 0.0, domain)
        return (
            Work(
                lowest,
                contact,
                block,
                start,
                clearance=self.order.approach,
                near=max(BESIDE_MM, self.order.beside),
                beside=self.order.beside,
                faced=self.faced if tool.towards < 0 else math.inf,
                stock=tuple(stock),
                nose=tool.nose,
                lean=tool.lean,
                given=tuple(reach.dilated(view(self.given[side]), tool, 0.0, domain)),
                touch=tuple(touch),
                tool=tool if levels else None,
            ),
            frame,
        )

    def lowest(
        self, tool: LatheTool, allowance: float, levels: bool = False, keep: Graph = (), standing: Graph | None = None
    ) -> tuple[list[Piece], Frame]:
        """(lowest positions allowed, Frame) of a tool on its side, arguments as work()'s."""
        side, own = tool.inside, tool
        view: View = list
        if tool.towards > 0:
            view = mirrored
            tool = replace(
                tool, left=tool.right, right=tool.left, holder_left=-tool.holder_right, holder_right=-tool.holder_left
            )
        domain = self.domain if tool.towards < 0 else (-self.domain[1], -self.domain[0])
        find = reach.reachable_in_levels if levels else reach.reachable
        kept = upper(upper(view(self.part[side]), view(self.barrier[side])), view(keep))
        found = find(
            kept,
            view(self.stock[side]) if standing is None else view(standing),
            tool,
            allowance,
            self._floor(side),
            domain,
        )
        if found is None:
            raise NoRoom("the holder finds no place beside the work", "correct the holder in the tool geometry file")
        return found, Frame(own, tool, view, domain)

    def _floor(self, inside: bool) -> float:
        """The lowest position of a nose: at the axis or the hole in front of the face; inside, below all of the
        bore."""
        if inside:
            return min(min(value(p, p.z0), value(p, p.z1)) - (p.r if p.r else 0.0) for p in self.part[True])
        face = self.order.part.z1
        return (
            max(-highest(self.stock[True], face - CLEARANCE_MM, math.inf) - CLEARANCE_MM, 0.0)
            if self.stock[True]
            else 0.0
        )

    def cut(self, step: Step, path: Path, frame: Frame) -> None:
        """Take a path's cuts from the stock, and add its moves to the step."""
        _own, tool, view, domain = frame
        side, done = tool.inside, len(step.moves)
        before = self.stock[side]
        left, real, bare = view(before), view(clip(self.standing[side], *_ends(before))), tool.bare()
        for part, count in zip(path.cut, path.cut_at):
            left = reach.after(left, part, tool, domain)
            real = reach.after(real, part, bare, domain)
            step.cuts.append((done + count, view(left)))
        path.home()
        self.stock[side], self.standing[side] = view(left), view(real)
        step.removed += sum(a[2] for a in above(before, self.stock[side])) + _gone(before, self.stock[side])
        if not side:  # faced down to the hole: nothing of the bore is left there
            standing = above(self.stock[False], negative(self.stock[True]), passes.ROUNDING_MM)
            self.stock[True] = clip(self.stock[True], -math.inf, standing[-1][1] if standing else -math.inf)
        step.start, moves = oriented(path, view is mirrored)
        step.moves = step.moves + moves
        flip = -1.0 if view is mirrored else 1.0
        cut = [flip * z for part in path.cut for z in (part[0].z0, part[-1].z1)] + [step.z0, step.z1] * bool(done)
        step.z0, step.z1 = min(cut), max(cut)
        step.transverse = tuple((min(flip * a, flip * b), max(flip * a, flip * b)) for a, b in path.transverse)
        step.needed = True


def tools_of_role(state: State, role: str, inside: bool, flat_bottom: bool = False) -> list[LatheTool]:
    """The tools of a role that work on a side, in the order of the program."""
    return [
        t
        for t in state.order.tools.get(role, ())
        if t.inside == inside and not t.point_angle and bool(t.flat) == flat_bottom
    ]


def without_tool(name: str, role: str, inside: bool) -> Step:
    """The step, not needed for want of a tool."""
    side = "inside" if inside else "outside"
    return Step(name, False, f"no tool for it: none of role {role.upper()} works {side}")


def roof(state: State, tool: LatheTool, deepest: float) -> float:
    """The highest position in the bore at which the far side of a boring bar is clear, for cuts down to Z deepest,
    mm."""
    return -highest(state.stock[True], deepest + tool.holder_left, math.inf) + tool.nose - tool.bar


def oriented(path: Path, mirror: bool) -> tuple[Place, list[Move]]:
    """(start, moves) of a path; mirror: it was made in the mirror of Z."""
    flip = -1.0 if mirror else 1.0
    moves = [
        Move(m.kind, flip * m.z, m.x, (flip * m.centre[0], m.centre[1]) if m.centre else (), m.ccw != mirror, m.pitch)
        for m in path.moves
    ]
    return (flip * path.work.start[0], path.work.start[1]), moves


def _boxes(barriers: Iterable[Box], column: int, sign: int, clearance: float) -> list[Piece]:
    """Barriers as a graph, larger by the clearance on all sides: filled from their side of the work to the axis and
    beyond."""
    graph: list[Piece] = []
    for box in barriers:
        graph = upper(graph, [flat(box[0] - clearance, box[1] + clearance, sign * box[column] + clearance)])
    return graph


def _ends(stock: Graph) -> Interval:
    """(z0, z1) of a graph."""
    return (stock[0].z0, stock[-1].z1) if stock else (0.0, 0.0)


def _gone(before: Graph, after: Graph) -> float:
    """Area (mm2) above the axis of what has no stock left at all."""
    kept, total, z = sorted((p.z0, p.z1) for p in after), 0.0, -math.inf
    for z0, z1 in [*kept, (math.inf, math.inf)]:
        total += sum((p.z1 - p.z0) * max(value(p, 0.5 * (p.z0 + p.z1)), 0.0) for p in clip(before, z, z0))
        z = z1
    return total
