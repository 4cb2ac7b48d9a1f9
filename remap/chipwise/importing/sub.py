# SPDX-License-Identifier: GPL-2.0-or-later
"""Imported -> the text of a program with a sub for each layer.  Called by cli/import_drawing.py and filter/model.py.
mm.

A layer of up to MOST_LOOPS loops has a sub for each loop (for G77 and G78) and one that calls them all (for G79).
Boundaries run counter-clockwise and islands clockwise, so P41 is inside of the pocket along each.  Started as a program
it moves nothing: the subs are called in the preview only, which shows them.
"""

import math
import re

FIRST = 100
MOST_LOOPS = 50


def program(found, name, tolerance):
    """(text, {layer: (number of its sub, {what: number})}) of an Imported; name: of the drawing."""
    lines = [
        _comment(f"chipwise import of {name}, tolerance {tolerance:g} mm"),
        *(_comment(word) for word in found.words),
    ]
    ready, numbers = [], {}
    called: list = []
    number = FIRST
    for layer in found.layers:
        subs, own, last = _subs(layer, number)
        lines += [
            "",
            _comment(
                f"layer {layer.name}: {len(layer.pockets)} pockets, {len(layer.loops)} closed loops, {len(layer.open)} "
                f"open chains"
            ),
            *subs,
        ]
        numbers[layer.name], called = own, called + [n for what, n in own if what != "loop" or len(layer.loops) == 1]
        ready += [_comment(f"layer {layer.name}"), *(_line(what, n) for what, n in own)]
        number = FIRST * (last // FIRST + 1)
    show = [
        "",
        _comment("shown in the preview only; nothing moves when it is started"),
        "G21 G90 G17",
        "o99 if [#<_task> EQ 0]",
        "F1000",
        *(f"o{n} call" for n in called),
        "o99 endif",
        "",
        _comment("lines for your program, with your own Z, R, F, after this file's subs:"),
    ]
    return "\n".join([*lines, *show, *ready, "M2", ""]), numbers


def _subs(layer, number):
    """(lines, [(what, number), ..], last number) of a layer; what: pocket, contour, loop, open."""
    loops, lines, own, last = layer.loops, [], [], number
    if len(loops) == 1:
        lines, own = _sub(number, [loops[0]]), [("contour", number)]
    elif 1 < len(loops) <= MOST_LOOPS:
        for loop in loops:
            last += 1
            lines, own = lines + _sub(last, [loop]), own + [("loop", last)]
        lines += [f"o{number} sub", *(f"o{n} call" for _, n in own), f"o{number} endsub"]
        own = [("pocket", number), *own]
    elif loops:
        lines, own = _sub(number, loops), [("pocket", number)]
    for chain in layer.open[:MOST_LOOPS]:
        last += 1
        lines, own = lines + _sub(last, [chain]), own + [("open", last)]
    return lines, own, last


def _line(what, number):
    """A line that is ready to use, as a comment."""
    return {
        "pocket": f"(pocket: G79 Q{number} Z-1 R1 F500)",
        "contour": f"(pocket: G79 Q{number} Z-1 R1 F500; inside: G77 Q{number} P41 Z-1 R1 F500, outside: P42; to "
        f"finish: G78)",
        "loop": f"(one loop: G77 Q{number} P41 Z-1 R1 F500, its other side: P42; to finish: G78)",
        "open": f"(open: G78 Q{number} P41 Z-1 R1 F500, its other side: P42)",
    }[what]


def _sub(number, chains):
    lines = [f"o{number} sub"]
    for chain in chains:
        x, y = (round(v, 6) for v in chain[0].start)
        lines.append(f"G0 X{_n(x)} Y{_n(y)}")
        for part in chain:
            ex, ey = (round(v, 6) for v in part.end)
            if hasattr(part, "centre"):
                if (ex, ey) == (x, y) and math.dist(part.start, part.end) > 1e-6:
                    continue
                lines.append(
                    f"{'G3' if part.ccw else 'G2'} X{_n(ex)} Y{_n(ey)} I{_n(part.centre[0] - x)} "
                    f"J{_n(part.centre[1] - y)}"
                )
            elif (ex, ey) != (x, y):
                lines.append(f"G1 X{_n(ex)} Y{_n(ey)}")
            x, y = ex, ey
    return [*lines, f"o{number} endsub"]


def _n(value):
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _comment(text):
    return "(" + re.sub(r"[^ -~]", "?", text).replace("(", "[").replace(")", "]")[:200] + ")"
