# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the sub of a pattern in an interpreter of its own and prints what it does.  A program, not a module.

    /usr/bin/python3 -s runner.py PARENT_PID  < JSON of the job  > JSON of the result

Started by run.py, one process per run.  The remaps of the INI file run here as in the preview; cycles in a mirrored
pattern plan the other hand (pattern/mirroring.py), so that the mirrored cut is climb milling again.

Job:     program, parameters, table (paths), random (tool changer), units_per_mm, tool (number, diameter in machine
         units, orientation), codes (run first), begin, end (comments around the call), max_moves, cpu_s, mirrored,
         axis_mask, per_rev, stock_top (mm or null), unit_mm (mm of the caller's unit), own_code (program/canon.py)
Result:  rows: [kind, line, own, feed, x, y, z, a, b, c (, plane, cx, cy, cz, turns)] in mm, mm/min (set_feed_rate())
         and degrees, kind "rapid", "feed", "arc" or, with the pitch in place of the feed, "thread", own: the line of a
         cut that no cycle makes, else 0; ["code", line, text];
         ["path", line, code, p, q]: a path mode, code 0: the caller's; messages; stop: null or [line, text, remedy];
         error: null or [line, text] of the interpreter; ended: bool; line: the last

The interpreter calls Python for moves, comments and dwells, and with each of these once for a new line, with the modes
before it.  Spindle and coolant have no call: a change of them is seen at the next line, and comes before the moves of
the line that has made it (LinuxCNC executes M3 and M8 before the motion of their line).  Every line has a comment
(run.py), so none is missed.  Path modes and threads have no call either, and their numbers are in no mode: they are
read from the interpreter's block, a path mode at the comment of its line, which comes first.
Read in LinuxCNC 2.9: gcodemodule.cc, rs274ngc_pre.cc, interp_convert.cc.
"""

import json
import os
import re
import sys

# modules are imported from the package, not from this file's folder
sys.path[0] = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

import gcode  # noqa: E402

from chipwise.program import canon as interpreter_process, preview  # noqa: E402
from chipwise.program.canon import ARC_AXES, INCH, PLANES, Stop, fails_alike, mm, tool_entry  # noqa: E402
from chipwise.errors import CycleError  # noqa: E402
from chipwise.program import known_stock  # noqa: E402
from chipwise.pattern import mirroring  # noqa: E402
from chipwise.pattern.check import check_code  # noqa: E402
from chipwise.program.program_code import PYTHON_REMEDY  # noqa: E402
from chipwise.host.processes import die_with_parent  # noqa: E402

COOLANT = {"mist": "M7", "flood": "M8"}
MAX_MESSAGES = 20
PATH_CODES = {610: 61, 611: 61.1, 640: 64}
G33, G76 = 330, 760
_UNITS, _CONTROL_MODE = 6, 13  # interp_internal.hh: GM_LENGTH_UNITS, GM_CONTROL_MODE


class Canon(interpreter_process.Canon):
    """What the interpreter calls."""

    def __init__(self, job, tools):
        super().__init__(job)
        self.tools = tools
        self.rows, self.messages, self.stop = [], [], None
        self.inside = self.ended = False
        self.line = self.seen = self.reported = self.first_of_line = 0
        self.feed, self.turning, self.plane, self.at, self.abc = 0.0, 0.0, 1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self.machine_state = None
        self.called = 0  # line of the comment before the call

    def refuse(self, text, remedy):
        self.stop = self.stop or [
            self.line or self.seen + 1,
            text,
            remedy,
        ]  # a line with F, which is remapped, has no number
        raise Stop(text)

    def refuse_python(self, text):
        self.stop = self.stop or [self.line or self.seen + 1, text, PYTHON_REMEDY]

    # ---- lines ----------------------------------------------------------------------------------------------

    def next_line(self, state):
        """Before the first call of a line, with the state that the one before it has left."""
        now = state.spindle, state.speed, state.mist == 7, state.flood == 8
        if self.inside and now != self.machine_state:
            codes = [["code", self.line, text] for text in _changes(self.machine_state, now)]
            self.rows[self.first_of_line : self.first_of_line] = codes
        self.machine_state = now
        self.line, self.first_of_line = state.sequence_number, len(self.rows)
        self.seen = self.line or self.seen

    def comment(self, text):
        if text == self.job["begin"]:
            self.inside, self.called = True, self.line
        elif text == self.job["end"]:
            self.inside, self.ended = False, True
        elif text == mirroring.CALLERS:
            self._put_path()
        elif self.inside:
            self._look_at_codes()
        self.reported = self.line

    def _look_at_codes(self):
        """Refuse what a sub that is called may not hold either, and see the path mode that the line sets."""
        block = _block()
        if block is None:
            return
        modes = list(block.g_modes)
        for letter, code in [("g", mode / 10) for mode in modes if mode >= 0] + [
            ("m", mode) for mode in block.m_modes if mode >= 0
        ]:
            try:
                check_code(letter, code, self.job["per_rev"])
            except CycleError as error:
                self.refuse(error.problem, error.remedy)
        code = PATH_CODES.get(modes[_CONTROL_MODE])
        if code:
            unit = {200: INCH, 210: 1.0}.get(modes[_UNITS]) or _unit_mm()
            self._put_path(code, *(value * unit if value >= 0 else None for value in (block.p_number, block.q_number)))

    def _put_path(self, code=0, p=None, q=None):
        self.rows.append(["path", self.line, code, p, q])
        mirroring.path = (code, p, q) if code else ()

    def message(self, text):
        if self.inside and len(self.messages) < MAX_MESSAGES and text not in self.messages:
            self.messages.append(text)

    # ---- moves ----------------------------------------------------------------------------------------------

    def _put(self, kind, feed, x, y, z, rest, *more):
        if any(rest[3:]):
            self.refuse("axis U, V or W moves", "a pattern moves X, Y, Z, A, B and C")
        if kind == "feed" and (x, y, z) == self.at and tuple(rest[:3]) != self.abc:
            feed = self.turning
        self.at, self.abc = (x, y, z), tuple(rest[:3])
        if self.inside:
            if len(self.rows) >= self.job["max_moves"]:
                self.refuse(f"the sub makes more than {self.job['max_moves']} moves", "divide it")
            own = self.line if kind in ("feed", "arc") and not mirroring.emitting else 0
            self.rows.append([kind, self.line, own, *mm(feed, x, y, z), *rest[:3], *more])

    def straight_traverse(self, x, y, z, *rest):
        self._put("rapid", 0.0, x, y, z, rest)

    def straight_feed(self, x, y, z, *rest):
        pitch = self._pitch() if self.inside else None
        if pitch is None:
            self._put("feed", self.feed, x, y, z, rest)
        else:
            self._put("thread", pitch / INCH, x, y, z, rest)

    def _pitch(self):
        """mm per revolution of a cut that is in step with the spindle, None of any other."""
        interp = _interpreter()
        if interp is None or interp.motion_mode not in (G33, G76):
            return None
        block = _block()
        if interp.motion_mode == G33:
            return block.k_number * _unit_mm()
        if block.l_number > 0:
            self.refuse("G76 with L has tapered passes", "leave L out, or program the passes with G33")
        return block.p_number * _unit_mm()

    def arc_feed(self, first, second, centre_first, centre_second, turns, along, *rest):
        order = ARC_AXES[self.plane]
        end, centre = (first, second, along), (centre_first, centre_second, self.at[order.index(2)])
        self._put(
            "arc",
            self.feed,
            *(end[k] for k in order),
            rest,
            PLANES[self.plane],
            *mm(*(centre[k] for k in order)),
            turns,
        )

    def set_plane(self, plane):
        self.plane = plane if plane in PLANES else 1

    def set_feed_rate(self, rate):
        """inch/min.  G93 comes as the rate of each move; a move under an isometry is as long as before, so it takes as
        long.

        F of a move that only turns is degrees/min in both units: the number that the caller's unit makes of it has to
        be the same one."""
        self.feed = rate
        self.turning = rate / _unit_mm() * self.job["unit_mm"]

    def dwell(self, seconds):
        if self.inside:
            self.rows.append(["code", self.line, f"G4 P{seconds:.6f}"])

    def rigid_tap(self, *_):
        self.refuse("G33.1 is synchronised with the spindle", "tap outside of the pattern")

    def straight_probe(self, *_):
        self.refuse("G38 probes", "probe outside of the pattern")

    def change_tool(self, _pocket):
        self.refuse("M6 is not allowed in a pattern", "load the tool before G75")

    def user_defined_function(self, number, *_):
        self.refuse(f"M{100 + number} is not allowed in a pattern", "program it before or after G75")

    # ---- the rest -------------------------------------------------------------------------------------------

    def get_tool(self, pocket):
        if pocket:
            return self.tools.entry(pocket)
        return tool_entry(*self.job["tool"])

    def stock(self, *_):
        self._no_stock("M250")

    def restored(self, *_):
        self._no_stock("M254")

    def volume(self, *_):
        self._no_stock("M251 or M252")

    def clamp_set_up(self, *_):
        self._no_stock("M256")

    def _no_stock(self, code):
        self.refuse(f"{code} is not allowed in a pattern", "program it before or after G75")


def _interpreter():
    """The interpreter that is running; None without one of Python's (an INI file without TOPLEVEL)."""
    return getattr(sys.modules.get("interpreter") or _imported(), "this", None)


def _imported():
    """LinuxCNC's module, which there is from the beginning of a program on."""
    try:
        import interpreter

        return interpreter
    except ImportError:
        return None


def _block():
    """The line that is being executed: interp_internal.hh, EXECUTING_BLOCK."""
    interp = _interpreter()
    return interp.blocks[0] if interp else None


def _unit_mm():
    """mm of the program's unit; that of a program in mm without an interpreter of Python's."""
    import emccanon

    interp = _interpreter()
    return INCH if interp and interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES else 1.0


def _changes(before, now):
    """Lines that make the state of spindle and coolant what it is now."""
    (turn, speed, *cooling), (new_turn, new_speed, *new_cooling) = before, now
    lines = []
    if (turn, speed) != (new_turn, new_speed):
        words = [f"S{new_speed:.6f}".rstrip("0").rstrip(".")] if new_speed != speed else []
        lines.append(" ".join(words + ([f"M{new_turn}"] if new_turn != turn else [])))
    if any(old and not new for old, new in zip(cooling, new_cooling)):
        lines.append("M9")
        cooling = [False, False]
    return lines + [code for code, old, new in zip(COOLANT.values(), cooling, new_cooling) if new and not old]


_OWN_LINE = re.compile(r" \(line (\d+)(?: of [^()]*)?\)$")


def located(canon, text):
    """[line, text] of an error.  Our own messages end with their line.  LinuxCNC's: a line that cannot be executed has
    been reported by its comment; one that cannot be read has not, and is the next one if it gives the same error alone;
    0: the first of the sub."""
    own = _OWN_LINE.search(text)
    if own:
        return [int(own[1]), text[: own.start()]]
    with open(canon.job["program"], encoding="utf-8", errors="surrogateescape") as program:
        lines = program.read().split("\n")
    if canon.reported == canon.called:  # in the first line of the sub
        return [0, text]
    following = next((k for k in range(canon.reported, len(lines)) if lines[k].strip()), None)
    same = following is not None and fails_alike(Canon(canon.job, canon.tools), lines[following], text)
    return [following + 1 if same else canon.reported, text]


def main():
    die_with_parent(int(sys.argv[1]))
    job, output = json.load(sys.stdin), os.fdopen(interpreter_process.own_output(), "w")
    interpreter_process.limit_run(job["cpu_s"])
    mirroring.mirrored = job["mirrored"]
    mirroring.path = ()
    known_stock.caller_top = job["stock_top"]
    canon = Canon(job, interpreter_process.ToolTable(job["table"], job["random"]))
    preview.listener = canon
    error = None
    try:
        result, _line = interpreter_process.parse(canon, job["program"])
        if result > gcode.MIN_ERROR:
            error = located(canon, gcode.strerror(result))
    except (RuntimeError, Stop):
        if canon.stop is None:
            raise
    json.dump(
        {
            "rows": canon.rows,
            "messages": canon.messages,
            "stop": canon.stop,
            "error": error,
            "ended": canon.ended,
            "line": canon.line,
        },
        output,
    )
    output.close()


if __name__ == "__main__":
    main()
