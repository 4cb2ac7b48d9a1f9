# SPDX-License-Identifier: GPL-2.0-or-later
"""What is in force in a program before one of its lines: modes, offsets, tool, spindle, coolant, parameters.  Called by
run.py.

Read by LinuxCNC's own interpreter with a mark behind the line before (rewrite/line_marks.py,
program/executed_words.py).
"""

from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from chipwise.program import records
from chipwise.program.reader import Unreadable
from chipwise.program.executed_words import LINE, STATES
from chipwise.rewrite.marked_reader import FEED, ITEM, LINE_NUMBER, MOTION, WHAT, Followed

_REFUSED = {92: "G92", 92.3: "G92.3", 52: "G52", 5.1: "G5.1", 43.1: "G43.1", 43.2: "G43.2", 96: "G96"}
_OUTPUTS = {62: 64, 63: 65, 64: 64, 65: 65, 67: 68, 68: 68}  # the code that sets one at once


@dataclass
class State:
    """g: modal G codes ten times; m: modal M codes; motion: G code; feed: F, mm/min; settings: F as LinuxCNC shows it,
    S, P and Q of G64, in the units in force; parameters: {name: value}; tool, prepared: numbers; length: text of G43 or
    G49; volume: values of a VOLUME record or None; outputs: texts; system: whether a coordinate system was set;
    skipped: [(line, text)] of what is not run again; clamps: set-up of the last M256, 0: none, None without M256;
    clamps_line: its line."""

    g: list
    m: list
    motion: float
    feed: float
    settings: list
    parameters: dict
    tool: int = 0
    prepared: int = 0
    length: str = "G49"
    volume: Optional[tuple] = None
    outputs: list = field(default_factory=list)
    system: bool = False
    skipped: list = field(default_factory=list)
    clamps: Optional[int] = None
    clamps_line: int = 0


class Checks:
    """What traced.Followed asks of an unroller: a mark behind a line."""

    def __init__(self, line, lines):
        self.checks, self.origin = {line: line}, list(range(1, lines + 1))


def line_before(program, line):
    """The last line before another one that is neither in a sub nor inside a block; 0: none."""
    blocks = program.blocks
    for number in range(line - 1, 0, -1):
        block = blocks.outermost.get(number)
        if number in blocks.subs or block and number != block.last or program.source[number - 1].strip() == "%":
            continue
        return number
    return 0


def before(followed, line, move, machine, limits):
    """The State before a line of a Followed program, whose first move is `move`.  Raises Unreadable."""
    program = followed.program
    at = line_before(program, line)
    if not at:
        raise Unreadable("nothing is set before the line", "start the program from its beginning", line)
    own = Followed(program, machine, None, followed, Checks(at, len(program.source)), limits)
    found = np.flatnonzero((own.program.marks[:, WHAT] == STATES) & (own.program.marks[:, LINE_NUMBER] == at))
    if len(found) != 1:
        raise Unreadable("the line before is not run once", "write the program without the jump", at)
    mark = own.program.marks[found[0]]
    item = own.program.items[int(mark[ITEM])]
    active = item["active"]
    state = State(
        active["g"], active["m"], float(mark[MOTION]) / 10, float(mark[FEED]), active["settings"], item["parameters"]
    )
    _codes(state, own.program, int(found[0]))
    for event in program.events:
        if event.at <= move and event.kind == records.VOLUME and event.line < line:
            state.volume = tuple(event.values[:4]) if event.values[0] else None
    return state


def _codes(state, program, last):
    """What the lines up to a mark have set that the modes do not show."""
    outputs = {}
    for k in np.flatnonzero((program.marks[:last, WHAT] == LINE) & (program.marks[:last, ITEM] >= 0)).tolist():
        item, line = program.items[int(program.marks[k, ITEM])], int(program.marks[k, LINE_NUMBER])
        if "g" not in item:
            continue
        words = item["words"]
        for code in item["g"]:
            if code in _REFUSED:
                raise Unreadable(
                    f"{_REFUSED[code]} is in the part that is done, and what it has set cannot be set again",
                    "go on by hand",
                    line,
                )
            if code == 43:
                state.length = "G43" + (f" H{int(words['H'])}" if "H" in words else "")
            elif code == 49:
                state.length = "G49"
            elif code == 10:
                if int(words.get("L", 0)) not in (2, 20):
                    raise Unreadable(
                        f"G10 L{int(words.get('L', 0))} is in the part that is done, and is not run again",
                        "go on by hand",
                        line,
                    )
                state.system = True
        if "T" in words:
            state.prepared = int(words["T"])
        for code in item["m"]:
            if code in (6, 61):
                state.tool = int(words["Q"]) if code == 61 and "Q" in words else state.prepared
            elif code in _OUTPUTS:
                letter = "E" if code in (67, 68) else "P"
                number = int(words.get(letter, 0))
                outputs[letter, number] = f"M{_OUTPUTS[code]} {letter}{number}" + (
                    f" Q{words.get('Q', 0.0):g}" if letter == "E" else ""
                )
            elif code == 256:
                state.clamps = int(words.get("P", 0))
                state.clamps_line = line
            elif code in (66, 70, 71, 72, 73, 19, 253, 255) or 100 <= code < 200:
                state.skipped.append((line, f"M{code}"))
    state.outputs = list(outputs.values())
