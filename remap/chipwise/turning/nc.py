# SPDX-License-Identifier: GPL-2.0-or-later
"""A plan as plain G-code: one commented block a step, for machines without chipwise; and the times of its steps.

Called by cli/turn.py.  Radii (G8), absolute, exact path (G61); the points are those that the tool table controls.
"""

import math

from chipwise.errors import CycleError, printable
from chipwise.turning.plan import lengths

FINE = ("finish outside", "finish inside", "groove", "part off", "drill")       # steps with the finish feed


def controlled(step, move):
    """(z, x) mm of the controlled point after a move, in the machine's frame: x a radius."""
    tool = step.tool
    return move.z + tool.tip[0], (-move.x if tool.inside else move.x) + tool.tip[1]


def feed_of(step, request):
    """Feed of a step, mm/min or mm/rev."""
    return request.words["E" if step.name in FINE else "F"]


def program(plan, request, title):
    """Text of the whole program.  Raises CycleError if the spindle would not turn."""
    if not request.speed or not request.direction:
        raise CycleError("the spindle does not turn at G26", "program S and M3 or M4 before G26", "G26")
    scale = 1.0 / request.scale
    lines = [f"({_plain(title)})", "(X is a radius. Begin with every tool clear of work, chuck and tailstock.)",
             f"{'G20' if request.unit == 'in' else 'G21'} G18 G8 G40 G49 G61 G80 G90 G91.1", "G95" if request.per_rev else "G94"]
    for number, step in enumerate(plan.steps, 1):
        if not step.needed:
            lines += ["", f"(step {number}: {step.name}: not needed: {_plain(step.why)})"]
            continue
        lines += ["", *_block(number, step, request, scale)]
    return "\n".join([*lines, "", *(["G7"] if request.diameter else []), "M5", "M2", ""])


def _plain(text):
    """Text that may be in a comment."""
    return printable(text).replace("(", "[").replace(")", "]")


def spindle_words(request, step):
    """G96 or G97 with the program's speed; a drill turns at the speed of its rim."""
    if request.css and step.tool.point_angle:
        return f"G97 S{math.floor(_rpm(request, step.tool.diameter / 2)):d} M{request.direction}"
    return (f"G96 D{request.cap:g}" if request.css else "G97") + f" S{request.speed:g} M{request.direction}"


def _block(number, step, request, scale):
    """Lines of one step."""
    z, x = step.start
    z0, x0 = z + step.tool.tip[0], (-x if step.tool.inside else x) + step.tool.tip[1]
    yield f"(step {number}: {step.name}, T{step.tool.number}: {_plain(step.why)})"
    yield f"({step.direction}, Z{step.z1 * scale:.3f} to Z{step.z0 * scale:.3f})"
    yield f"T{step.tool.number} M6"
    yield "G43"
    yield spindle_words(request, step)
    if step.tool.inside:
        yield f"G0 Z{z0 * scale:.6f}"
        yield f"G0 X{x0 * scale:.6f}"
    else:
        yield f"G0 X{x0 * scale:.6f}"
        yield f"G0 Z{z0 * scale:.6f}"
    yield f"F{feed_of(step, request) * scale:.6g}"
    for move in step.moves:
        yield _line(step, move, z, scale, x)
        z, x = move.z, move.x
    yield f"({step.name} ends)"


def _line(step, move, z, scale, x):
    """One move."""
    zt, xt = controlled(step, move)
    code = {"rapid": "G0", "feed": "G1"}.get(move.kind)
    end = f"X{xt * scale:.6f} Z{zt * scale:.6f}"
    if code:
        return f"{code} {end}"
    sign = -1.0 if step.tool.inside else 1.0
    code = "G3" if move.ccw != step.tool.inside else "G2"
    return f"{code} {end} I{sign * (move.centre[1] - x) * scale:.6f} K{(move.centre[0] - z) * scale:.6f}"


def seconds(step, request, rapid_mm_s):
    """Time of a step's moves, s; None if the feed is per revolution and there is no speed."""
    total, x = 0.0, step.start[1]
    for (kind, length), move in zip(lengths(step), step.moves):
        if kind == "rapid":
            total += length / rapid_mm_s
        else:
            rate = feed_of(step, request) * (_rpm(request, step.tool.diameter / 2 if step.tool.point_angle else 0.5 * (abs(x) + abs(move.x))) if request.per_rev else 1.0)
            total += 60.0 * length / rate
        x = move.x
    return total


def _rpm(request, x):
    """Speed at radius x, 1/min."""
    if not request.css:
        return request.speed
    surface = request.speed * (1000.0 if request.unit == "mm" else 12 * 25.4)       # mm/min
    rpm = surface / (2 * math.pi * max(x, 0.5))
    return min(rpm, request.cap) if request.cap else rpm
