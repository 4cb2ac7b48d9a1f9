# SPDX-License-Identifier: GPL-2.0-or-later
"""The steps of a plan as lines of G-code: X a radius (G8), absolute, program units; the points are those that the tool
table controls.

Called by nc.py, which writes them to a file, and by g26_plan.py, whose lines G26 executes: both have the same moves.

    tool change             where the machine was when the plan began, which the operator has found clear for every tool
    approach(block)         in front of the work by rapids in X and Z, one after the other
    block.lines             the step; it ends where it began
    retreat(..)             back to the place of the tool change, X first: before another tool, and at the end
"""

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from chipwise.turning.request import Request, rpm
from chipwise.turning.profile_function import Place
from chipwise.turning.stock_file import Record

if TYPE_CHECKING:  # the interpreter's process loads this module, and no planning
    from chipwise.turning.path import Move
    from chipwise.turning.plan import Plan
    from chipwise.turning.state import Step

Chunk = tuple[tuple[float, str], ...]
FOOT_M = 0.3048
FINE = ("finish outside", "finish inside", "groove", "undercut", "part off", "drill")  # steps with the finish feed


class Block(NamedTuple):
    """One needed step.

    number, name        of the step
    tool                number of the tool; change: another one than before; back: the next one is another, or there is
                        none
    spindle             line that makes the spindle turn
    feed                program units per minute or revolution
    first               (z, x) program units, where the moves begin; z_first: the approach moves Z before X
    lines               of G0 G1 G2 G3 G33
    """

    number: int
    name: str
    tool: int
    change: bool
    back: bool
    spindle: str
    feed: float
    first: Place
    z_first: bool
    lines: tuple[str, ...]


class Run(NamedTuple):
    """A Block as it is executed.

    chunks      a chunk is a tuple of rows (feed, lines joined by "\n"), as those of lines.chunks()
    stages      of every chunk the number of the stage that is done after it, 0 for none
    """

    block: Block
    chunks: Iterable[Chunk]
    stages: tuple[int, ...]


class Turning(NamedTuple):
    """What G26 executes.

    blocks      (Run, ..)
    clear       (z, x) program units: in front of z and outside of x every tool is clear of work and barriers
    spindle     the program's own spindle line
    record      stock_file.Record of the file that says how far the machine has come, None without one
    question    what the operator has to confirm before anything moves, "" for nothing
    """

    blocks: tuple[Run, ...]
    clear: Place
    spindle: str
    record: Record | None = None
    question: str = ""


def blocks(plan: "Plan", request: Request) -> Iterator[Block]:
    """Block of every needed step, in order."""
    scale = 1.0 / request.scale
    needed = [(n, s) for n, s in enumerate(plan.steps, 1) if s.needed]
    tools = [None, *(s.used_tool.number for _, s in needed), None]
    for k, (number, step) in enumerate(needed, 1):
        z, x = controlled(step, *step.start)
        yield Block(
            number,
            step.name,
            step.used_tool.number,
            tools[k] != tools[k - 1],
            tools[k] != tools[k + 1],
            spindle_line(request, step),
            feed_of(step, request) * scale,
            (z * scale, x * scale),
            step.used_tool.inside,
            tuple(_lines(step, scale)),
        )


def controlled(step: "Step", z: float, x: float) -> Place:
    """(z, x) mm of the controlled point, in the machine's frame: x a radius."""
    return z + step.used_tool.tip[0], (-x if step.used_tool.inside else x) + step.used_tool.tip[1]


def feed_of(step: "Step", request: Request) -> float:
    """Feed of a step, mm/min or mm/rev: the tool's own, else the program's.  Per minute it is that of the largest
    radius, where the spindle is slowest."""
    own = step.used_tool.finish_feed if step.name.startswith("finish") else step.used_tool.feed
    if own:
        return own if request.per_rev else own * speed_at(step, request, _largest_radius(step))
    return request.words["E"] if step.name in FINE else request.words["F"]


def speed_at(step: "Step", request: Request, radius: float) -> float:
    """1/min of the spindle in a step with the tool at a radius, mm."""
    if step.speed:
        return step.speed
    at = step.used_tool.diameter / 2 if step.used_tool.point_angle else radius if request.css else _largest_radius(step)
    own = 1000.0 * step.used_tool.cutting_speed / (2 * math.pi * max(at, 0.5))
    if not own:
        return rpm(request, at)
    most = request.cap if request.css else request.speed
    return min(own, most) if most else own


def spindle_line(request: Request, step: "Step | None" = None) -> str:
    """G96 or G97 with the tool's own cutting speed, else the program's.

    A drill turns at the speed of its rim, a thread is cut under G97.  G97 of the program is the largest speed: a tool's
    own only lowers it."""
    if step is None or not (step.speed or step.used_tool.cutting_speed or request.css and step.used_tool.point_angle):
        return (f"G96 D{request.cap:g}" if request.css else "G97") + f" S{request.speed:g} M{request.direction}"
    if request.css and not step.speed and not step.used_tool.point_angle:
        return (
            f"G96 D{request.cap:g} S{step.used_tool.cutting_speed / (1.0 if request.unit == 'mm' else FOOT_M):g} "
            f"M{request.direction}"
        )
    return f"G97 S{max(math.floor(speed_at(step, request, 0.0)), 1):d} M{request.direction}"


def _largest_radius(step: "Step") -> float:
    """mm, of the controlled point on feeds."""
    return max((abs(controlled(step, m.z, m.x)[1]) for m in step.moves if m.kind != "rapid"), default=0.0)


def approach(block: Block) -> tuple[str, str]:
    """Lines of the rapids to where the moves of a block begin."""
    z, x = f"G0 Z{block.first[0]:.6f}", f"G0 X{block.first[1]:.6f}"
    return (z, x) if block.z_first else (x, z)


def _lines(step: "Step", scale: float) -> Iterator[str]:
    """The moves of a step."""
    z, x = step.start
    for move in step.moves:
        yield _line(step, move, z, scale, x)
        z, x = move.z, move.x


def _line(step: "Step", move: "Move", z: float, scale: float, x: float) -> str:
    """One move."""
    zt, xt = controlled(step, move.z, move.x)
    code = {"rapid": "G0", "feed": "G1"}.get(move.kind)
    end = f"X{xt * scale:.6f} Z{zt * scale:.6f}"
    if code:
        return f"{code} {end}"
    if move.kind == "thread":
        return f"G33 {end} K{move.pitch * scale:.9f}"
    sign = -1.0 if step.used_tool.inside else 1.0
    code = "G3" if move.ccw != step.used_tool.inside else "G2"
    return f"{code} {end} I{sign * (move.centre[1] - x) * scale:.6f} K{(move.centre[0] - z) * scale:.6f}"
