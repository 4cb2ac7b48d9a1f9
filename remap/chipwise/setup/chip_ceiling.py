# SPDX-License-Identifier: GPL-2.0-or-later
"""How many times its F a tool may go by the largest chip of its edges, `chip_load` of the tool geometry.  Called by
measure.py.

times = chip_load * flutes * spindle speed / F, with the slowest spindle and the fastest F of the tool in the program's
text.  A text that does not say them, because it computes them, calls subs, or feeds per turn or in inverse time, gives
none.
"""

import io
import re

from chipwise.program.comments import bare
from chipwise.errors import MM_PER_INCH
from chipwise.host.files import open_regular

LEAST, MOST = 1.0, 10.0  # of SETUP_CEILING
_UNSAID = re.compile(rb"[SF][-+\[#]|M0*98(?![0-9.])|^/?(?:N[0-9.]+)?O[^\n]*CALL|G0*9[35](?![0-9.])", re.MULTILINE)
_WORD = re.compile(rb"(T|S|F)([0-9.]+)|(M)0*6(?![0-9.])|(G)0*(20|21)(?![0-9.])")


def ceilings(program, geometry, unit_mm, most_bytes):
    """{tool number: times F} with geometry {number: ToolGeometry}; only tools that have chip_load and flutes.  A tool
    that the program does not call has that of the moves before any tool change.  unit_mm: of the machine.  Raises
    OSError."""
    wanted = {number: g.chip_load * g.flutes for number, g in geometry.items() if g.chip_load and g.flutes}
    if not wanted:
        return {}
    with open_regular(program, most_bytes) as file:
        text = bare(file.read())
    if _UNSAID.search(text):
        return {}
    said = _said(text, unit_mm)
    pairs = ((number, said.get(number, said.get(None))) for number in wanted)
    return {
        number: round(min(max(wanted[number] * min(pair[0]) / max(pair[1]), LEAST), MOST), 2)
        for number, pair in pairs
        if pair and all(pair)
    }


def _said(text, unit_mm):
    """{tool number; None: before any tool change: (speeds, 1/min, feeds, mm/min)}; those in force at its tool change
    count where a tool has none of its own."""
    said: dict[int | None, tuple[list, list]] = {None: ([], [])}
    in_force: list[list] = [[], []]
    number, waiting = None, None
    unit = unit_mm
    for line in io.BytesIO(text):
        words = [(a or b or c, value or code) for a, value, b, c, code in _WORD.findall(line)]
        waiting = next((int(float(value)) for letter, value in words if letter == b"T" and _is_number(value)), waiting)
        unit = next((MM_PER_INCH if value == b"20" else 1.0 for letter, value in words if letter == b"G"), unit)
        if any(letter == b"M" for letter, _value in words):
            _complete(said[number], in_force)
            number = waiting
            said.setdefault(number, ([], []))
        for letter, value in words:
            if letter in b"SF" and _is_number(value) and float(value) > 0:
                which = letter == b"F"
                found = float(value) * (unit if which else 1.0)
                said[number][which].append(found)
                in_force[which] = [found]
    _complete(said[number], in_force)
    return said


def _complete(pair, in_force):
    for values, before in zip(pair, in_force):
        if not values:
            values.extend(before)


def _is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True
