# SPDX-License-Identifier: GPL-2.0-or-later
"""The drill: which one, how deep, in pecks.  Called by steps.py.

The largest drill that leaves the allowance in the bore; the largest that stays inside of it, if none does or if no tool
finishes the bore."""

import math

from chipwise.errors import fill
from chipwise.turning import passes, reach
from chipwise.turning.profile_function import Graph, Piece, above, clip, flat, highest, lower, segment, upper, value
from chipwise.turning.path import Move, NoRoom
from chipwise.turning.sides import ROUGH_MM
from chipwise.turning.state import CLEARANCE_MM, OVERRUN_MM, State, Step, tools_of_role
from chipwise.turning.tool import LatheTool

PECK_MM = 0.25  # of feed before the bottom that a drill has made itself


def drill(state: State, name: str) -> Step:
    """The hole that the boring bar needs, or the bore itself."""
    order = state.order
    if not state.part[True]:
        return Step(name, False, "the part has no bore")
    drills = sorted((t for t in order.tools.get("drill", ()) if t.point_angle), key=lambda t: -t.diameter)
    if not drills:
        return Step(name, False, "no tool for it: none of role DRILL")
    failed = []
    for allowance in dict.fromkeys((order.allowance, 0.0) if tools_of_role(state, "finish", True) else (0.0,)):
        for tool in (t for t in drills if _fits(state, t, allowance)):
            try:
                return _drilled(state, name, tool, allowance)
            except NoRoom as error:
                failed.append((name, tool, error))
    state.failed += failed
    room = _room(state)
    return Step(
        name,
        False,
        " and ".join(f"T{tool.number}: {fill(error.problem, error.values, 'mm')}" for _, tool, error in failed)
        or (
            f"no drill is smaller than the bore, diameter {2 * room:.3f} mm"
            if room > ROUGH_MM
            else "the point of no drill fits into the end of the bore"
        ),
    )


def _room(state: State) -> float:
    """Smallest radius of the bore, mm."""
    return -highest(state.order.part.bore, *state.domain)


def _fits(state: State, tool: LatheTool, allowance: float) -> bool:
    """Whether a drill stays inside of the bore less an allowance, if need be with its point only."""
    return tool.diameter / 2 <= _room(state) - allowance + passes.ROUNDING_MM or (
        not state.through and _deepest(state, tool, allowance) <= state.order.part.bore[0].z0 + allowance + _point(tool)
    )


def _drilled(state: State, name: str, tool: LatheTool, allowance: float) -> Step:
    """Step of a drill.  Raises NoRoom."""
    part, z0, z1 = state.part[True], state.order.part.bore[0].z0, state.order.part.z1
    now = -highest(clip(state.stock[True], z0 + ROUGH_MM, z1), *state.domain)
    if now >= tool.diameter / 2 - ROUGH_MM:
        return Step(name, False, f"the bore is {2 * now:.3f} mm wide already")
    end = max(p.z1 for p in state.stock[True])
    point, tip = _point(tool), _tip(state, z0, tool, allowance)
    if tip < z0:
        part = clip(part, z0, math.inf)
    shape = _shape(tool, tip, state.domain[1])
    if end - tip > tool.edge:
        raise NoRoom(
            "the hole is {deep} deep, more than the drill's flutes of {edge}",
            "use a longer drill",
            deep=end - tip,
            edge=tool.edge,
        )
    if tip + point >= end:
        return Step(
            name, False, f"the hole is {end - tip:.3f} mm deep, too shallow for the drill's point of {point:.3f} mm"
        )
    before = state.stock[True]
    drilled = upper(lower(before, shape), clip(before, state.domain[0], tip))
    if not passes.worth(above(before, drilled), ROUGH_MM):
        return Step(name, False, f"the hole of {tool.diameter:g} mm is there already")
    _check_room(state, part, shape, tip, tool)
    step = Step(name, True, "solid stock where the bore is", tool, "inside, along the axis", tip, end)
    beside = max(PECK_MM, state.order.beside) if end >= state.faced else state.order.approach
    step.start, step.moves = (state.safe_z, 0.0), _pecks(end, tip, tool.depth, state.safe_z, beside)
    state.stock[True] = state.given[True] = state.standing[True] = drilled
    step.removed = sum(a[2] for a in above(before, state.stock[True]))
    return step


def _tip(state: State, z0: float, tool: LatheTool, allowance: float) -> float:
    """Z of the tip at the bottom of the hole; z0: of the bore's end."""
    point = _point(tool)
    if state.through and not highest(state.barrier[True], z0 - point - 4 * OVERRUN_MM, z0) > -math.inf:
        return z0 - point - 2 * OVERRUN_MM
    return max(z0 + allowance, _deepest(state, tool, allowance))


def _check_room(state: State, part: Graph, shape: Graph, tip: float, tool: LatheTool) -> None:
    """Raise NoRoom if the shape of the hole meets a barrier or the part."""
    inside = above(clip(state.barrier[True], tip, math.inf), shape, passes.ROUNDING_MM)
    if inside:
        raise NoRoom(
            "a drill of {d} would enter a barrier at Z{z}",
            "end the barrier of the tailstock with G23",
            d=tool.diameter,
            z=inside[-1][0],
        )
    if above(part, shape, passes.ROUNDING_MM):
        raise NoRoom("a drill of {d} does not stay inside the bore", "use a smaller drill", d=tool.diameter)


def _shape(tool: LatheTool, tip: float, z1: float) -> list[Piece]:
    """Graph of a drill whose tip is at Z `tip`, up to Z z1."""
    point, radius = _point(tool), tool.diameter / 2
    return [*([segment(tip, 0.0, tip + point, -radius)] if point else []), flat(tip + point, z1, -radius)]


def _point(tool: LatheTool) -> float:
    """Length of a drill's point, mm."""
    return tool.diameter / 2 / math.tan(math.radians(tool.point_angle) / 2) if tool.point_angle < 180 else 0.0


def _deepest(state: State, tool: LatheTool, allowance: float) -> float:
    """The lowest place of a drill's tip at which its point stays inside of a bore that narrows towards its end, mm."""
    part, rise = reach.disc(state.part[True], allowance), math.tan(math.radians(tool.point_angle) / 2)
    tips = [-math.inf]
    for z0, z1, _, _ in above(part, [flat(*state.domain, -tool.diameter / 2)], passes.ROUNDING_MM):
        for p in clip(part, z0, z1):
            touch = reach.tangent(p, -rise)
            tips += [z + value(p, z) / rise for z in (p.z0, p.z1, touch) if z is not None and p.z0 <= z <= p.z1]
    return max(tips)


def _pecks(end: float, tip: float, depth: float, far: float, first: float) -> list[Move]:
    """Moves of a drill: by `depth`, out after each.  first: mm of feed before the stock."""
    count, moves = math.ceil((end - tip) / depth - 1e-9), []
    for k in range(1, count + 1):
        top = end + (tip - end) * (k - 1) / count
        moves += [
            Move("rapid", top + (first if k == 1 else PECK_MM), 0.0),
            Move("feed", end + (tip - end) * k / count, 0.0),
            Move("rapid", end + CLEARANCE_MM, 0.0),
        ]
    return [*moves, Move("rapid", far, 0.0)]
