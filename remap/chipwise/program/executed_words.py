# SPDX-License-Identifier: GPL-2.0-or-later
"""What each executed line of a marked program does besides moving: its words with the values that its expressions have.

Called by reader_runner.py for programs that rewrite/line_marks.py has marked: a comment `chipwise-at FILE LINE WHAT`
before the line's own code is executed, and around each block.  The interpreter shows itself to Python as
`interpreter.this` (read in LinuxCNC 2.9:  interp_python.cc, pyinterp1.cc); its modes there are those in force at that
moment.
"""

import functools
from typing import TypedDict

from chipwise.program.records import MARK

PREFIX = "chipwise-at "
PLAIN, WORDS, COMMENT, BEGIN, END, STATE = "p", "w", "c", "b", "e", "s"
LINE, BEGINS, ENDS, STATES = range(4)  # values of a MARK record
# predefined named parameters that say what the machine does
WATCHED = (
    "_rpm",
    "_spindle_on",
    "_spindle_cw",
    "_mist",
    "_flood",
    "_coord_system",
    "_current_tool",
    "_tool_offset",
    "_x",
    "_y",
    "_z",
)
_LETTERS = "xyzpqrlhdijkefst"
NOT_KNOWN = [
    0.1,
    0.1,
]  # P and Q of G64 after a change of units (2.9: gcodemodule.cc, GET_EXTERNAL_MOTION_CONTROL_TOLERANCE)
_MM = {1: 25.4, 2: 1.0, 3: 10.0}  # of a length unit, by this.length_units
_ONLY_MOVES = {0, 1, 2, 3, 80, 90, 91}


class Watched(TypedDict):
    """Parameters of the user that a program sets: their numbers and names."""

    numbers: list[int]
    names: list[str]


class Active(TypedDict):
    """The modal codes in force: G codes ten times, M codes; settings: F, S, P and Q of G64, in the units in force."""

    g: list[int]
    m: list[int]
    settings: list[float]


class MarkItem(TypedDict, total=False):
    """What a mark refers to, as JSON.  g, m, words: of a line with WORDS; comment, said: of a COMMENT; state,
    parameters, changed, active: of BEGIN, END and STATE."""

    g: list[float]
    m: list[int]
    words: dict[str, float]
    comment: bool
    said: str
    state: dict[str, float]
    parameters: dict[str, float]
    changed: dict[str, float]
    active: Active


class Trace:
    """One run.  job: watched (numbers and names of parameters)."""

    def __init__(self, canon, watched):
        self.canon, self.watched = canon, watched
        self.items = []  # JSON of what marks refer to
        self.said = None  # item of the last COMMENT mark
        self.before = {}
        self.path_mode = None  # mm: P and Q of G64
        self._told, self._units, self._sets_it, self._look = None, 0, False, True

    @functools.cached_property
    def this(self):
        """The interpreter; its module is there once it runs."""
        import interpreter

        return interpreter.this

    def comment(self, text):
        if not text.startswith(PREFIX):
            return
        file, line, what = text[len(PREFIX) :].split()
        if self._look or what != PLAIN:
            self._follow_path_mode(what)
        item = -1
        if what == WORDS:
            words = self._words()
            item = self._keep(words) if words else -1
        elif what == COMMENT:
            self.said = {"comment": True}
            item = self._keep(self.said)
        elif what == BEGIN:
            self.before = self._parameters()
            item = self._keep({"state": self._state(), "parameters": self.before})
        elif what in (END, STATE):
            now = self._parameters()
            changed = {name: value for name, value in now.items() if self.before.get(name) != value}
            item = self._keep({"state": self._state(), "parameters": now, "changed": changed, "active": self._active()})
        this, canon = self.this, self.canon
        canon.line = int(line)
        canon.mark(
            MARK,
            int(file),
            {BEGIN: BEGINS, END: ENDS, STATE: STATES}.get(what, LINE),
            item,
            int(this.length_units) * 1000
            + int(this.distance_mode) * 100
            + int(this.plane) * 10
            + int(this.ijk_distance_mode),
            int(this.cutter_comp_side),
            int(this.motion_mode),
            canon.feed_rate,
        )

    def message(self, text):
        if self.said is not None:
            self.said["said"] = text

    def _keep(self, item):
        self.items.append(item)
        return len(self.items) - 1

    def _words(self):
        """The line's codes and words; None for one that only moves."""
        block = self.this.blocks[self.this.remap_level]
        words, codes = {}, [code / 10 for code in block.g_modes if code >= 0]
        others = [code for code in block.m_modes if code >= 0]
        if not others and _ONLY_MOVES.issuperset(codes) and not (block.s_flag or block.t_flag):
            return None
        for letter in _LETTERS:
            if getattr(block, letter + "_flag"):
                words[letter.upper()] = float(
                    getattr(block, letter + ("_number_float" if letter == "d" else "_number"))
                )
        return {"g": codes, "m": others, "words": words}

    def _parameters(self):
        """{name or number as text: value} of the watched parameters that exist."""
        params, result = self.this.params, {}
        for number in self.watched["numbers"]:
            result[str(number)] = float(params[number])
        for name in self.watched["names"]:
            try:
                result[f"<{name}>"] = float(params[name])
            except (KeyError, RuntimeError):
                continue
        return result

    def _follow_path_mode(self, what):
        """path_mode before the line of a mark.  After G20 or G21 the interpreter asks its machine for P and Q; here the
        answer is a constant in any units, which counts only where G64 was on the line before."""
        this = self.this
        told, units = [float(value) for value in list(this.active_settings)[3:5]], int(this.length_units)
        if self._told is None or self._sets_it or told != self._told and (units == self._units or told != NOT_KNOWN):
            self.path_mode = [value * _MM[units] for value in told]
        self._told, self._units, self._look = told, units, what != PLAIN
        self._sets_it = what == WORDS and 640 in this.blocks[this.remap_level].g_modes

    def _active(self):
        """The modal codes in force: G codes ten times, M codes; and [F, S, P of G64, Q of G64] in the units in
        force."""
        this = self.this
        path_mode = [value / _MM[int(this.length_units)] for value in self.path_mode]
        return {
            "g": [int(code) for code in list(this.active_g_codes)[1:] if code >= 0],
            "m": [int(code) for code in list(this.active_m_codes)[1:] if code >= 0],
            "settings": [float(value) for value in list(this.active_settings)[1:3]] + path_mode,
        }

    def _state(self):
        """What the machine does at a block's end, and how it reads what follows."""
        this, result = self.this, {}
        for name in WATCHED:
            try:
                result[name] = round(float(this.params[name]), 4)
            except (KeyError, RuntimeError):
                continue
        return {**result, "retract": int(this.retract_mode), "feed_mode": int(this.feed_mode)}
