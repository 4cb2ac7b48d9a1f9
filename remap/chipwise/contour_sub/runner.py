# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a contour sub in an interpreter of its own and prints what it would have moved.  A program, not a module.

    /usr/bin/python3 -s runner.py PARENT_PID  < JSON of the job  > JSON of the result

Started by run.py, one process per sub, so that whatever the sub does (an endless loop, a crash) happens to this process
and never to the task or the preview.  It ends with its parent.

Job:     program, parameters (paths), units_per_mm, tool (number, diameter in machine units), codes (run first), begin,
         end
         (comments that stand around the call), mark (a comment "mark N" stands before source line N), max_moves, cpu_s
         own_code (program/canon.py); lathe: the contour lies in ZX, and z, x, y are given for x, y, z
Result:  moves: [kind, line, x, y, z (, cx, cy, turns)] in mm, kind "rapid", "feed", "arc"; stop: null or [line, text]
         of what does not belong in a contour; error: null or [line, text] of the interpreter; ended: bool; line: where
         it was last

Line numbers are those of the marks: the interpreter's own are gone after an error, and a line of a file that the sub
calls is reported as the line of the call.
"""

import json
import os
import sys

# modules are imported from the package, not from this file's folder
sys.path[0] = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

import gcode  # noqa: E402

from chipwise.program import canon as interpreter_process  # noqa: E402
from chipwise.program.canon import Stop, mm, tool_entry  # noqa: E402
from chipwise.host.processes import die_with_parent  # noqa: E402

MOTIONS = (0, 10, 20, 30)  # G0 G1 G2 G3 as the active motion mode, times ten


class Canon(interpreter_process.Canon):
    """What the interpreter calls; every call that does not move in XY ends the run."""

    def __init__(self, job):
        super().__init__(job)
        self.moves, self.stop = [], None
        self.inside = self.ended = False
        self.modes: tuple = ()  # (G codes, M codes) at the begin
        self.line = 0

    def _refuse(self, line, text):
        self.stop = self.stop or [line, text]
        raise Stop(text)

    def refuse_python(self, text):
        self.stop = self.stop or [self.line, text]

    def other(self, name):
        if self.inside:
            self._refuse(self.line, name.replace("_", " ") + " is not a move of a contour")

    def next_line(self, code):
        """Before every mark: the line that was done since the last one must have left the modes alone."""
        motion, *modes = list(code.gcodes)[1:]
        others = list(code.mcodes)[1:]
        if self.inside and not self.modes:
            self.modes = modes, others
        elif self.inside and (motion not in MOTIONS or (modes, others) != self.modes):
            new = [motion] if motion not in MOTIONS else [a for a, b in zip(modes, self.modes[0]) if a != b and a >= 0]
            self._refuse(self.line, "a code other than G0 G1 G2 G3" + "".join(f" (G{g / 10:g})" for g in new[:1]))

    def _move(self, kind, *numbers):
        if not self.inside:
            return
        if len(self.moves) >= self.job["max_moves"]:
            self._refuse(self.line, f"the sub makes more than {self.job['max_moves']} moves")
        self.moves.append([kind, self.line, *numbers])

    def _plane(self, x, y, z):
        """Coordinates in the order of the plane: first, second, along.  Those of an arc come in that order."""
        return (z, x, y) if self.job.get("lathe") else (x, y, z)

    def straight_traverse(self, x, y, z, *rest):
        self._move("rapid", *mm(*self._plane(x, y, z)))

    def straight_feed(self, x, y, z, *rest):
        self._move("feed", *mm(*self._plane(x, y, z)))

    def arc_feed(self, x, y, cx, cy, turns, z, *rest):
        self._move("arc", *mm(x, y, z, cx, cy), turns)

    def comment(self, text):
        if text == self.job["begin"]:
            self.inside = True
        elif text == self.job["end"]:
            self.inside, self.ended = False, True
        elif text.startswith(self.job["mark"]):
            self.line = int(text[len(self.job["mark"]) :])

    def set_feed_rate(self, rate):
        """F is ignored."""

    def message(self, text):
        """Comments of the kind (MSG,..): the program's own call says them."""

    def get_tool(self, pocket):
        return tool_entry(*(self.job["tool"] if pocket == 0 else (-1, 0.0)))


def _mark_before(job, line):
    """The last mark up to a line of the program, for errors that come before anything is run."""
    with open(job["program"], encoding="utf-8", errors="replace") as program:
        marks = [text for text in program.read().splitlines()[:line] if text.startswith("(" + job["mark"])]
    return int(marks[-1][len(job["mark"]) + 1 : -1]) if marks else 0


def main():
    die_with_parent(int(sys.argv[1]))
    job, output = json.load(sys.stdin), os.fdopen(interpreter_process.own_output(), "w")
    interpreter_process.limit_run(job["cpu_s"])
    interpreter_process.make_tool_table()
    canon = Canon(job)
    error = None
    try:
        result, line = interpreter_process.parse(canon, job["program"])
        if result > gcode.MIN_ERROR:
            error = [canon.line or _mark_before(job, line), gcode.strerror(result)]
    except RuntimeError:
        if canon.stop is None:
            raise
    json.dump(
        {"moves": canon.moves, "stop": canon.stop, "error": error, "ended": canon.ended, "line": canon.line}, output
    )
    output.close()


if __name__ == "__main__":
    main()
