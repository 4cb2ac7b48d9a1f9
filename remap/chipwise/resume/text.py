# SPDX-License-Identifier: GPL-2.0-or-later
"""The text of a program that goes on with another one: its head, which gets the tool to the place, and the rest.
Called by run.py.

1. Head: retract in machine coordinates, the stock, the tool, the modes as the program has them before the line,
   traverse high above, down to where no stock is near, and on at the feed of the place, in the space that the tool has
   cut before, onto the path.
2. The rest of the line in which the program stopped is written in absolute words (rewrite/text.py), the lines behind it
   keep their text.
3. Subs, and comments that do something, of the part that is done come first.
"""

import io
import math
import re

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.resume.split import steps_of
from chipwise.rewrite.edits import Edits, original
from chipwise.rewrite.move_text import Numbers, plain
from chipwise.rewrite.text import Writer
from chipwise.rewrite.marked_reader import FEED, FILE, LINE_NUMBER
from chipwise.rewrite.words import active_comments, code, words_of

DIGITS = 5
SLOW = 300.0  # mm/min, without a feed in force
_KEPT = ("WORKPIECE", "MATERIAL", "SURFACE")
_MOTION = {0, 1, 2, 3, *range(73, 90)}


class Rest(Writer):
    """The lines of a program from one on.  at (3,): where the tool is before it."""

    def __init__(self, program, edits, at):
        self._buffer = io.BytesIO()
        super().__init__(program, edits, self._buffer)
        self.at = at

    def text_from(self, line):
        """Bytes.  Raises Unreadable."""
        written_out = self._written_out()
        for number, text in enumerate(self.source[line - 1 :], line):
            if self.feed is not None and not written_out[number]:
                self._feed_before(number)
            self._line(number, text, written_out[number])
        return self._buffer.getvalue()

    def _feed_before(self, number):
        """The F that the program has before a line, behind moves that are written out."""
        marks = self.program.marks
        own = np.flatnonzero((marks[:, LINE_NUMBER] == number) & (marks[:, FILE] == 0))
        if len(own):
            self.out.end_line(self.end)
            self.out.line(
                "F" + plain(float(marks[own[0], FEED]) * Numbers(self.program.modes[number - 2].units).scale, 6),
                self.end,
            )
            self.feed = None


def own_motion(text):
    """Whether a line says by which G code it moves."""
    return any(letter == "G" and value in _MOTION for letter, value in words_of(text)) or bool(
        re.search(r"(?<![a-z<_])g\s*(1[23]|2[46]|7[5789])(?!\d)", code(text), re.I)
    )


def rest(found, modal, cycles=False):
    """Bytes of the lines from that of a Found on, in which its moves replace its step and the steps of its line before;
    without moves the line as it is.  modal: motion mode before it; cycles: whether cycles are written out as well,
    because they plan by what is done.  Lines with cutter compensation keep their text, because they have several moves
    at corners."""
    program, line, step, moves = found.followed.program, found.line, found.step, found.moves
    edits = Edits()
    own = steps_of(program, line)
    if (
        moves is None
        and not own_motion(program.source[line - 1])
        and (modal not in (0, 1) or program.modes_on(step).cycle)
    ):
        moves, step = [original(program, own[0])], own[0]
    for other in own if moves is not None else []:
        if other < step:
            edits.instead[other] = []
        elif other == step:
            edits.instead[other] = moves
    if cycles:
        place = program.places[program.first[:-1]]
        numbers, index, count = np.unique(place, return_index=True, return_counts=True)
        for number, first in zip(numbers[count > 1].tolist(), index[count > 1].tolist()):
            if (
                (number > line or number == line and moves is None)
                and number not in program.blocks.outermost
                and number not in program.blocks.subs
                and program.modes[number - 1].cutter_side == 40
            ):
                edits.instead[first] = [original(program, first)]
    return Rest(program, edits, found.approach.place).text_from(line)


def subs_before(program, line):
    """[lines of text] of the subs that are defined before a line, and of comments that do something there."""
    found = []
    for number in range(1, line):
        text = program.source[number - 1]
        if number in program.blocks.subs:
            found.append(text.rstrip("\r\n"))
        elif "(" in text or ";" in text:
            found += [own for own in active_comments(text) if own[1:].lstrip().split(",")[0].strip().upper() in _KEPT]
    return found


def _place(frame, point):
    return [plain(v, DIGITS) for v in frame.to_work(point)]


def head(state, frame, approach, slot, top, notes):
    """[lines] of the head [1].  approach: descent.Approach; top: mm, Z of the retract in machine coordinates; notes:
    comments."""
    lines = [f"({re.sub('[()]', ' ', note)})" for note in notes]
    lines += ["G90 G17 G40 G49 G80 G94 G21", f"G53 G0 Z{plain(top, DIGITS)}", f"M254 P{slot}"]
    if state.clamps is not None:
        lines.append(f"M256 P{state.clamps}")
    if state.tool:
        lines.append(f"T{state.tool} M6")
    if state.prepared != state.tool:
        lines.append(f"T{state.prepared}")
    lines += _system(state, frame)
    lines += [state.length, *state.outputs, *_parameters(state), *_spindle(state)]
    x, y, z = _place(frame, approach.place)
    lines += [
        f"G0 X{x} Y{y}",
        f"G0 Z{plain(frame.to_work((*approach.place[:2], approach.free))[2], DIGITS)}",
        *_path_mode(state),
    ]
    if state.volume:
        lines.append(_volume(state.volume))
    lines.append(f"G1 Z{z} F{plain(approach.feed or state.feed or SLOW, 3)}")
    return [*lines, *_modes(state)]


def _system(state, frame):
    found = [code for code in state.g if 540 <= code <= 593]
    number = found[0] if found else 540
    index = number // 10 - 53 if number < 590 else 6 + number - 590
    lines = [f"G{number / 10:g}"]
    if state.system:
        x, y, z = (plain(v, DIGITS + 1) for v in frame.offset)
        lines.insert(0, f"G10 L2 P{index} X{x} Y{y} Z{z} R{plain(math.degrees(frame.turn), 6)}")
    return lines


def _parameters(state):
    lines = []
    for name, value in state.parameters.items():
        if value or not name.isdigit():
            lines.append(f"#{name}={plain(value, 12)}")
    return lines


def _spindle(state):
    lines = []
    turning = [code for code in (3, 4) if code in state.m]
    speed = state.settings[1]
    if turning:
        lines.append(f"S{plain(speed, 3)} M{turning[0]}")
    elif speed > 0:
        lines.append(f"S{plain(speed, 3)}")
    return lines + [f"M{code}" for code in (7, 8) if code in state.m] + (["M49"] if 49 in state.m else [])


def _path_mode(state):
    if 611 in state.g:
        return ["G61.1"]
    if 610 in state.g:
        return ["G61"]
    p, q = (v * (25.4 if 200 in state.g else 1.0) for v in state.settings[2:4])
    return ["G64" + (f" P{plain(p, 6)}" if p > 0 else "") + (f" Q{plain(q, 6)}" if p > 0 and q > 0 else "")]


def _volume(values):
    mode, target, lower, ceiling = values
    return (
        f"M251 P{int(mode)}"
        + (f" Q{plain(target / 1000, 6)}" if target else "")
        + (f" R{plain(lower / 1000, 6)}" if lower else "")
        + (f" E{plain(ceiling, 4)}" if ceiling else "")
    )


def _modes(state):
    """The modes as the program has them."""
    if 930 in state.g or 950 in state.g:
        raise Unreadable("G93 or G95 is in force", "go on by hand")
    wanted = [code for code in state.g if code in (170, 180, 190, 200, 210, 900, 910, 901, 911, 980, 990)]
    lines = [" ".join(f"G{code / 10:g}" for code in wanted)]
    lines.append(f"F{plain(state.feed * Numbers(20 if 200 in state.g else 21).scale, 6)}" if state.feed > 0 else "")
    if state.motion == 0 or state.motion == 1 and state.feed > 0:
        lines.append(f"G{state.motion:g}")
    elif state.motion == 80:
        lines.append("G80")
    return [line for line in lines if line]


def without_percent(data):
    """The rest without the % lines."""
    return b"".join(line for line in data.splitlines(keepends=True) if line.strip() != b"%")
