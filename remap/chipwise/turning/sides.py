# SPDX-License-Identifier: GPL-2.0-or-later
"""Roughing, rest machining and finishing of a side, and undercuts: levels, columns and cuts along the profile.

Called by steps.py, which has the order of the steps.  A tool cuts what it reaches, and leaves to later steps what only
they reach: nothing of that is a reason to refuse the plan.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from chipwise.errors import fill
from chipwise.turning import passes, reach
from chipwise.turning.profile_function import Graph, Interval, Piece, Region, above, clip, negative, upper
from chipwise.turning.grooves import left_to_groove
from chipwise.turning.path import NoRoom, Path, Work
from chipwise.turning.state import CLEARANCE_MM, Frame, State, Step, roof, tools_of_role, without_tool
from chipwise.turning.tool import LatheTool

ROUGH_MM = 0.05  # a roughing step leaves what is thinner
FINISH_MM = 0.003  # a finishing step, too
THICK, THIN_MM = 1.5, 0.3  # a finishing cut is thinner than so many allowances, and than so much at least
TOOTH, TOOTH_MM, TOOTH_SHARE = (
    THICK - 1.0,
    0.15,
    0.75,
)  # of the allowance, mm, and of what a rapid keeps: may stay at a wall after each level, for the finish
FINISHES = 3  # of a finishing tool, one after the other: each finds the stock lower that its holder has to be clear of


def _out_of_reach(state: State, tool: LatheTool, contact: Graph) -> list[Piece]:
    """Stock in the bore (graph) that the tool cannot cut because its bar would touch the far side: what lies behind it,
    too."""
    far = reach.window(state.stock[True], tool.holder_left, state.domain[1] - state.domain[0])
    roof = [p._replace(xr=p.xr + tool.nose - tool.bar - 2 * CLEARANCE_MM) for p in negative(far)]
    beyond = above(contact, roof)
    return clip(state.stock[True], -math.inf, beyond[-1][1]) if beyond else []


class _Asked(NamedTuple):
    """What a step asks of each of its tools: its name, whether it finishes along the profile, allowance and least
    thickness of what it cuts (mm)."""

    name: str
    finishing: bool
    allowance: float
    least: float


class _Found(NamedTuple):
    """What a tool can do: path (None: nothing), mm2 within its reach, its frame, text of what it leaves ("")."""

    path: Path | None
    area: float
    frame: Frame
    left: str = ""


def turn(state: State, name: str, role: str, inside: bool, finishing: bool, rest: bool = False) -> Step:
    """Roughing or finishing, outside or inside, with the first tool of the role that has something to do; rest: all
    that may rough, the first one last.  A tool that cannot go there is passed over; why is remembered (State.failed)
    and counts if nothing else takes the stock."""
    if inside and not state.part[True]:
        return Step(name, False, "the part has no bore")
    tools = tools_of_role(state, role, inside)
    if rest:
        tools = list({t.number: t for t in tools[1:] + tools_of_role(state, "finish", inside) + tools[:1]}.values())
    if not tools:
        return without_tool(name, role, inside)
    allowance, least = (
        (0.0, FINISH_MM) if finishing else (0.0 if role == "undercut" else state.order.allowance, ROUGH_MM)
    )
    asked = _Asked(name, finishing, allowance, least)
    reasons = []
    for tool in tools:
        if (name, tool.number) in state.made:  # it has had its turn
            continue
        try:
            step, left = _turned(state, tool, asked)
        except NoRoom as error:
            state.failed.append((name, tool, error))
            step, left = None, f"T{tool.number}: {fill(error.problem, error.values, 'mm')}"
        if step:
            state.made.add((name, tool.number))
            return step
        reasons += [left] * bool(left)
    return Step(
        name,
        False,
        " and ".join(reasons)
        or f"nothing thicker than {least:g} mm is left within reach of " + " or ".join(f"T{t.number}" for t in tools),
    )


def _turned(state: State, tool: LatheTool, asked: _Asked) -> tuple[Step | None, str]:
    """(Step of a tool, None if it has nothing to do; text of what it leaves).  A finish is made again where the holder
    could not go before the stock beside it was cut: the allowance of a face keeps it from the axis."""
    step, found, inside = None, None, tool.inside
    for _ in range(FINISHES if asked.finishing else 1):
        try:
            found = _path(state, tool, asked, step is not None)
        except NoRoom:
            if step is None:
                raise
            break
        if found.path is None:
            break
        step = step or Step(
            asked.name,
            True,
            f"{found.area:.2f} mm2 within its reach",
            tool,
            f"{'inside' if inside else 'outside'}, {_direction(found.path, tool)}"
            + (", along the profile" if asked.finishing else ""),
        )
        state.cut(step, found.path, found.frame)
    left = found.left if found else ""
    if step and left:
        step.why += f"; {left}"
    return step, left


def _path(state: State, tool: LatheTool, asked: _Asked, again: bool) -> _Found:
    """_Found of a tool."""
    keep = (
        _out_of_reach(state, tool, reach.dilated(state.stock[True], tool, 0.0, state.domain))
        if tool.inside
        else left_to_groove(state, asked.name, tool)
    )
    work, frame = state.work(tool, asked.allowance, not asked.finishing, keep)
    regions = _regions(work, frame.domain, asked.least)
    if not regions:
        return _Found(None, 0.0, frame)
    if tool.inside:
        work = replace(work, roof=roof(state, frame.tool, min(r[0] for r in regions)))
    if asked.finishing:
        return _finish(state, work, keep, frame, asked.least, again)
    if _finished_later(state, asked.name, tool.inside):
        work = replace(work, tooth=min(TOOTH * asked.allowance, TOOTH_MM, TOOTH_SHARE * work.beside))
    depth = min(state.order.depth, tool.depth, max(tool.holder_up, 0.0))
    return _found(passes.rough(work, frame.domain, depth, asked.least), regions, frame)


def _found(path: Path | None, regions: list[Region], frame: Frame, left: str = "") -> _Found:
    return _Found(path if path and path.cut else None, sum(r[2] for r in regions), frame, left)


def _regions(work: Work, domain: Interval, least: float) -> list[Region]:
    """Regions of positions with stock that is worth a cut."""
    return passes.worth(above(clip(work.contact, *domain), work.reach, passes.ROUNDING_MM), least)


def _finish(state: State, work: Work, keep: Graph, frame: Frame, least: float, again: bool) -> _Found:
    """_Found of a finishing tool.  Stock that is too thick for it is left to other steps: there no position is below
    contact.

    again: the tool has been there, and comes back only where nothing is too thick: else it would nibble at that, a
    finishing cut at a time.  In a bore the passage around what is too thick may be barred by the far side: then all
    behind it stays."""
    tool = frame.own
    most, thick = _thickness(state, tool, work.contact, keep)
    if not thick:
        return _finished(work, frame, least)
    ends = sorted(-z if tool.towards > 0 else z for z in (thick[0][0], thick[-1][1]))
    left = f"T{tool.number} leaves what is thicker than {most:g} mm, between Z{ends[1]:.3f} mm and Z{ends[0]:.3f} mm"
    if again:
        return _found(None, [], frame, left)
    thin = upper(work.reach, [p for z0, z1, _, _ in thick for p in clip(work.contact, z0, z1)])
    try:
        return _finished(replace(work, reach=thin), frame, least, left)
    except NoRoom:
        if not tool.inside:
            raise
    keep = upper(keep, clip(state.stock[True], -math.inf, thick[-1][1]))
    return _finished(replace(state.work(tool, 0.0, False, keep)[0], roof=work.roof), frame, least, left)


def _finished(work: Work, frame: Frame, least: float, left: str = "") -> _Found:
    regions = _regions(work, frame.domain, least)
    return _found(passes.finish(work, frame.domain, least) if regions else None, regions, frame, left)


def _direction(path: Path, tool: LatheTool) -> str:
    """Text: levels along Z, columns, or both."""
    found = [f"longitudinal, towards {'-Z' if tool.towards < 0 else '+Z'}"] if len(path.cut) > path.columns else []
    return " and ".join(
        found + [f"transverse, {'away from' if tool.inside else 'towards'} the axis"] * bool(path.columns)
    )


def _finished_later(state: State, name: str, inside: bool) -> bool:
    """Whether a step after this one finishes the side."""
    later = state.order.order[state.order.order.index(name) + 1 :]
    return f"finish {'inside' if inside else 'outside'}" in later and bool(tools_of_role(state, "finish", inside))


def _thickness(state: State, tool: LatheTool, contact: Graph, keep: Graph) -> tuple[float, list[Region]]:
    """(mm, regions of positions) that are too thick for a finishing cut."""
    most = max(THICK * state.order.allowance, THIN_MM)
    reserve = state.lowest(tool, most, keep=keep)[0]
    return most, passes.worth(above(contact, reserve, passes.ROUNDING_MM), ROUGH_MM)
