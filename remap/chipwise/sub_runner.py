"""Runs a contour sub in an interpreter of its own and prints what it would have moved.  A program, not a module.

    /usr/bin/python3 -s sub_runner.py PARENT_PID  < JSON of the job  > JSON of the result

Started by subs.py, one process per sub, so that whatever the sub does (an endless loop, a crash) happens to this process
and never to the task or the preview.  It ends with its parent.  It is the interpreter of AXIS's preview (module gcode): full doubles, line
numbers, no HAL, no machine.  Read in LinuxCNC 2.9: gcodemodule.cc.

Job:     program, parameters (paths), units_per_mm, tool (number, diameter in machine units), codes (run first), begin, end
         (comments that stand around the call), mark (a comment "mark N" stands before source line N), max_moves, cpu_s
Result:  moves: [kind, line, x, y, z (, cx, cy, turns)] in mm, kind "rapid", "feed", "arc"; stop: null or [line, text] of
         what is no contour; error: null or [line, text] of the interpreter; ended: bool; line: where it was last

Line numbers are those of the marks: the interpreter's own are gone after an error, and a line of a file that the sub
calls is told by the line of the call.
"""

import ctypes
import json
import os
import signal
import sys

import gcode

from processes import die_with_parent       # beside this file

INCH = 25.4
DECIMALS = 9        # of a mm: a program's decimals come out as they went in

MOTIONS = (0, 10, 20, 30)       # G0 G1 G2 G3 as the active motion mode, times ten


class Stop(Exception):
    """The sub does what no contour does."""


class Canon:
    """What the interpreter calls; every call that is no move in XY ends the run."""

    def __init__(self, job):
        self.job = job
        self.moves, self.stop = [], None
        self.inside = self.ended = False
        self.modes = None
        self.line = 0

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *arguments: self._other(name)

    def _refuse(self, line, text):
        self.stop = self.stop or [line, text]
        raise Stop(text)

    def _other(self, name):
        if self.inside:
            self._refuse(self.line, name.replace("_", " ") + " is no move of a contour")

    def next_line(self, code):
        """Before every mark: the line that was done since the last one must have left the modes alone."""
        motion, *modes = list(code.gcodes)[1:]
        others = list(code.mcodes)[1:]
        if self.inside and self.modes is None:
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

    def straight_traverse(self, x, y, z, *rest):
        self._move("rapid", *_mm(x, y, z))

    def straight_feed(self, x, y, z, *rest):
        self._move("feed", *_mm(x, y, z))

    def arc_feed(self, x, y, cx, cy, turns, z, *rest):
        self._move("arc", *_mm(x, y, z, cx, cy), turns)

    def comment(self, text):
        if text == self.job["begin"]:
            self.inside = True
        elif text == self.job["end"]:
            self.inside, self.ended = False, True
        elif text.startswith(self.job["mark"]):
            self.line = int(text[len(self.job["mark"]):])

    def set_feed_rate(self, rate):
        """F is ignored."""

    def message(self, text):
        """Comments of the kind (MSG,..): the program's own call says them."""

    def get_tool(self, pocket):
        number, diameter = self.job["tool"] if pocket == 0 else (-1, 0.0)
        return (number,) + (0.0,) * 9 + (diameter, 0.0, 0.0, 0)

    def get_external_length_units(self):
        return self.job["units_per_mm"]

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return 7

    def get_block_delete(self):
        return False

    def check_abort(self):
        return False

    @property
    def parameter_file(self):
        return self.job["parameters"]


def _mm(*inches):
    return [round(v * INCH, DECIMALS) for v in inches]


def _make_tool_table():
    """An empty ~/.tool.mmap: gcode expects that a task has made it, and crashes without (2.9)."""
    try:
        ctypes.CDLL("libtooldata.so.0")._Z17tool_mmap_creatorPK13EMC_TOOL_STATi(None, 0)
    except (OSError, AttributeError):
        pass    # another LinuxCNC, another way of keeping tools


def _mark_before(job, line):
    """The last mark up to a line of the program: where reading failed before anything was run."""
    with open(job["program"], encoding="utf-8", errors="replace") as program:
        marks = [text for text in program.read().splitlines()[:line] if text.startswith("(" + job["mark"])]
    return int(marks[-1][len(job["mark"]) + 1:-1]) if marks else 0


def _own_output():
    """Standard output for the result alone: (print,..) of a program, which writes there too, goes to standard error."""
    result = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return result


def main():
    die_with_parent(int(sys.argv[1]))
    job, output = json.load(sys.stdin), _own_output()
    signal.signal(signal.SIGPROF, signal.SIG_DFL)           # the end, also inside C code
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGPROF])
    signal.setitimer(signal.ITIMER_PROF, job["cpu_s"])
    _make_tool_table()
    canon = Canon(job)
    error = None
    try:
        result, line = gcode.parse(job["program"], canon, *job["codes"])
        if result > gcode.MIN_ERROR:
            error = [canon.line or _mark_before(job, line), gcode.strerror(result)]
    except RuntimeError:
        if canon.stop is None:
            raise
    json.dump({"moves": canon.moves, "stop": canon.stop, "error": error, "ended": canon.ended,
               "line": canon.line}, output)
    output.close()


if __name__ == "__main__":
    main()
