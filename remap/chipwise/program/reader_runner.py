# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a program in LinuxCNC's interpreter and writes its moves.  A program, not a module.

    /usr/bin/python3 -s reader_runner.py PARENT_PID  < JSON of the job  > blocks

Started by reader.py, one process per program: whatever the program does (an endless loop, a crash) happens to this
process.  It is the interpreter of AXIS's preview (module gcode): the INI file's remaps, tool table, offsets and subs
count, and neither HAL nor a machine is needed.  Read in LinuxCNC 2.9: gcodemodule.cc, rs274/interpret.py.

Job:     program, parameters, table (paths), random (tool changer), units_per_mm, axis_mask, codes (run first),
         most_moves, quiet_s (computing time without a block of moves), cpu_s (in all), chord_mm, stock (null or low,
         high: mm, work coordinates at the first move), written (whether CIRCLE records are wanted, for rewriting),
         judged (whether what cannot be judged ends it), memory_mb (of this process; null: no limit), tool (number of
         the one in the spindle; 0: none), watched (null, or the parameters of a marked program: executed_words.py),
         targets (whether TARGET records are wanted), block_delete (whether lines with / are left out), own_code
         (program/canon.py), diameters, spindle (of reader.Machine), clamps (whether CLAMP records are wanted)
Blocks:  b"R", uint32 number of bytes, records of WIDTH doubles; b"E", uint32 number of bytes, JSON of the end

The records: records.py.
"""

import array
import functools
import itertools
import json
import math
import os
import resource
import signal
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))

import gcode  # noqa: E402

from chipwise.program.clamp_comments import ClampComments  # noqa: E402
from chipwise.program.motion_modes import MotionModes  # noqa: E402
from chipwise.program.records import ARC, CIRCLE, DWELL, FEED, FRAME, RAPID, STOCK, TARGET, VOLUME, WIDTH  # noqa: E402
from chipwise.program import canon as interpreter_process  # noqa: E402
from chipwise.geometry.base.arc_sweep import arc_sweep, chord_angle  # noqa: E402
from chipwise.program.canon import (
    ARC_AXES,
    INCH,
    Stop,
    ToolTable,
    fails_alike,
    limit_computing,
    own_output,
    parse,
    sender,
)  # noqa: E402
from chipwise.program.tool_calls import ToolCalls  # noqa: E402
from chipwise.program.program_code import PYTHON_REMEDY  # noqa: E402
from chipwise.host.processes import die_with_parent, limit_memory  # noqa: E402

BLOCK = 4096 * WIDTH
MAX_POSITION_MM = 1e6
# modes that are not checked, by feed_mode of the interpreter's state, ten times the code, and of the interpreter itself
_INVERSE_TIME, _PER_REVOLUTION = "G93 (inverse time)", "G95 (feed per revolution)"
_UNCHECKED = {930: _INVERSE_TIME, 950: _PER_REVOLUTION}
_UNCHECKED_NOW = {1: _INVERSE_TIME, 2: _PER_REVOLUTION}


class Canon(ToolCalls, ClampComments, interpreter_process.Canon):
    """What the interpreter calls."""

    def __init__(self, job, send, tools):
        super().__init__(job)
        self.send, self.tools = send, tools
        self.records = array.array("d")
        self.count, self.line, self.seen, self.plane = 0, 0, 0, 1
        self.feed_rate, self.unchecked = 0.0, None  # mm/min, and the mode it counts in if that is not judged
        self.spindle = self.tools.entry(0) if job["random"] else self.tools.of_number(job["tool"])
        self.g5x, self.g92, self.angle, self.sin, self.cos = (0.0,) * 3, (0.0,) * 3, 0.0, 0.0, 1.0
        self.at = [0.0, 0.0, 0.0]  # inch, work coordinates without offsets
        self.stop, self.fed, self.probed, self.ended, self.carries = (
            None,
            False,
            False,
            False,
            False,
        )  # ended: judged up to here
        self.messages, self.notes, self.trace, self.modes = [], [], None, MotionModes(job["axis_mask"])
        self.pending = []
        self.wants_targets, self._owns_stock = job["targets"], False
        self.exact = job["written"] or job["targets"]  # for rewriting and the page: nothing is read around
        if job["spindle"] is not None or job["tool"] and self.spindle[0] > 0:
            self._tool_event(job["spindle"])
        if job["stock"]:
            self._put = self._first_put

    def _first_put(self, *move):
        """Before the first move: the stock the user has named, in the work coordinates that are in force."""
        del self._put
        self.box_event(STOCK, 0.0, *self.job["stock"])
        self._put(*move)

    def refuse_python(self, text):
        self.stop = self.stop or [self.line or self.seen + 1, text, PYTHON_REMEDY, False]

    def refuse(self, text, remedy, unfinished=False):
        if self.job["judged"] or unfinished:
            self.stop = self.stop or [self.line or self.seen + 1, text, remedy, unfinished]
            raise Stop(text)

    # ---- places ---------------------------------------------------------------------------------------------

    def set_g5x_offset(self, index, *offsets):
        self._frame(offsets[:3], self.g92, self.angle)

    def set_g92_offset(self, *offsets):
        self._frame(self.g5x, offsets[:3], self.angle)

    def set_xy_rotation(self, angle):
        self._frame(self.g5x, self.g92, math.radians(angle))

    def _frame(self, g5x, g92, angle):
        """The tool stays where it is, its work coordinates do not."""
        x, y, z = (v / INCH for v in self._machine(*self.at))
        self.g5x, self.g92, self.angle = g5x, g92, angle
        self.cos, self.sin = math.cos(angle), math.sin(angle)
        x, y = x - g5x[0], y - g5x[1]
        self.at = x * self.cos + y * self.sin - g92[0], y * self.cos - x * self.sin - g92[1], z - g5x[2] - g92[2]
        self._event(FRAME, self.angle, *(v * INCH for v in (*self.g5x, *self.g92)))
        if self.probed and not self.fed and not self._owns_stock:
            self.carries = True  # the zero that is probed is that of the stock
            if self.job["stock"]:
                self._put = self._first_put

    def set_plane(self, plane):
        self.plane = plane

    def _machine(self, x, y, z):
        """Work coordinates, inch -> machine coordinates, mm."""
        g92, g5x = self.g92, self.g5x
        x += g92[0]
        y += g92[1]
        if self.sin:
            x, y = x * self.cos - y * self.sin, x * self.sin + y * self.cos
        elif self.cos < 0.0:
            x, y = -x, -y
        return (x + g5x[0]) * INCH, (y + g5x[1]) * INCH, (z + g92[2] + g5x[2]) * INCH

    def _put(self, kind, x, y, z, feed, first=0.0):
        """A move to a place in work coordinates, inch."""
        if self.pending:
            self.place_clamps()
        unnamed = self.modes.unnamed and self.modes.named(
            self._interpreter, [] if kind == ARC else [a - b for a, b in zip((x, y, z), self.at)]
        )
        self.records.extend((kind, self.line, *self._machine(x, y, z), feed, first, unnamed, 0.0, 0.0))
        self.count += 1
        if len(self.records) >= BLOCK:
            self._flush()

    def _flush(self):
        if self.count > self.job["most_moves"]:
            self.refuse(
                f"the program makes more than {self.job['most_moves']} moves", "look for a loop without an end", True
            )
        self.send(b"R", self.records.tobytes())
        del self.records[:]
        limit_computing(self.job["quiet_s"])  # from here, unless more moves come

    def _event(self, kind, *values):
        self.records.extend((kind, self.line, *values, *(0.0,) * (WIDTH - 2 - len(values))))
        if len(self.records) >= BLOCK:
            self._flush()

    # ---- moves ----------------------------------------------------------------------------------------------

    def next_line(self, state):
        self._judge_feed_mode(_UNCHECKED.get(state.feed_mode))  # the modes are those after the line before
        self.units = state.units
        self.modes.touched_off(self.modes.unnamed and self._interpreter)
        if self.job["judged"] and not self.job["written"]:
            for kind, value in self.modes.changes(state, self.count, self._interpreter):
                self._event(kind, value)
        if self.trace is None:
            self.line = state.sequence_number if state.sequence_number >= 0 else self.seen  # -1: within G70 to G72
            self.seen = self.line or self.seen  # under G93 a line with F, which is remapped, has no number

    def _judge_feed_mode(self, unchecked):
        if unchecked == _INVERSE_TIME and not self.exact:
            self._note(
                f"{unchecked}: it is judged at the feeds that follow from its times"
            )  # the interpreter gives those
        elif unchecked == _PER_REVOLUTION and not self.exact and self._speed():
            self._note(f"{unchecked}: it is judged at the feeds that follow from S")
        elif unchecked:
            self.refuse(f"{unchecked} is not judged", "use G94")

    def _speed(self):
        """1/min; 0: not known."""
        return self._interpreter.speed[0] if self._interpreter else 0.0

    @functools.cached_property
    def _interpreter(self):
        """The interpreter as Python sees it, None where the INI file has no [PYTHON]."""
        try:
            import interpreter

            return interpreter.this
        except ImportError:
            return None

    def straight_traverse(self, x, y, z, *rest):
        self._judge_move(rest, False)
        self._put(RAPID, x, y, z, 0.0)
        self.at = x, y, z

    def straight_feed(self, x, y, z, *rest):
        self._judge_move(rest)
        self._put(FEED, x, y, z, self.feed_rate * (self._speed() if self.unchecked == _PER_REVOLUTION else 1.0))
        self.at = x, y, z

    def _judge_move(self, rest, feeds=True):
        self._judge_feed_mode(self.unchecked)
        if any(rest[:3]):
            if self.fed and self.job["judged"] and not self.exact:
                self._note("a rotary axis moves: it is judged up to here")
                self.ended = True
                raise Stop("rotary")
            self.refuse("a rotary axis moves", "only X, Y and Z are judged")
        self.fed = self.fed or feeds

    def _note(self, text):
        if all(text != other for _line, other in self.notes):
            self.notes.append([self.line or self.seen + 1, text])

    def arc_feed(self, x1, y1, cx, cy, turns, z1, *rest):
        self._judge_move(rest)
        order = ARC_AXES[self.plane]
        # place in the arc's own axes: first, second, along
        own = [self.at[i] for i in ((0, 1, 2), (1, 2, 0), (2, 0, 1))[self.plane - 1]]
        a0, b0, radius = own[0] - cx, own[1] - cy, math.hypot(own[0] - cx, own[1] - cy)
        end_radius = math.hypot(x1 - cx, y1 - cy)
        start = math.atan2(b0, a0)
        sweep = arc_sweep(own, (x1, y1), (cx, cy), turns, INCH * self.job["units_per_mm"])
        pieces = max(1, math.ceil(abs(sweep) / chord_angle(radius * INCH, self.job["chord_mm"])))
        if pieces > self.job["most_moves"]:
            self.refuse(f"an arc of {abs(turns)} turns", "use fewer turns", True)
        feed = self.feed_rate * (self._speed() if self.unchecked == _PER_REVOLUTION else 1.0)
        if self.job["written"]:
            centre = (cx, cy, own[2])
            self._event(CIRCLE, self.plane, *self._machine(*(centre[i] for i in order)), turns)
        for k in range(1, pieces + 1):
            t = k / pieces
            angle, r = start + sweep * t, radius + (end_radius - radius) * t
            p = (
                (cx + r * math.cos(angle), cy + r * math.sin(angle), own[2] + (z1 - own[2]) * t)
                if k < pieces
                else (x1, y1, z1)
            )
            self._put(ARC, p[order[0]], p[order[1]], p[order[2]], feed, 1.0 if k == 1 else 0.0)
        self.at = [(x1, y1, z1)[i] for i in order]

    def rigid_tap(self, x, y, z, *rest):
        back = self.at
        self._put(FEED, x, y, z, self.feed_rate)
        self._put(FEED, *back, self.feed_rate)

    def straight_probe(self, *place):
        """It may end anywhere: it cuts nothing, and ends at its target as in a preview."""
        if self.exact:
            self.refuse(
                "the program probes (G38): what it finds is known on the machine only",
                "check the parts before and behind it",
            )
        self._note(
            "the program probes (G38): it is judged as if the probe met nothing, what it finds is known on the machine "
            "only"
        )
        self.at, self.probed = place[:3], True

    def set_feed_rate(self, rate):
        """A line with an F that is remapped leaves the state of next_line() as it was (2.9), also if it has G93 or G95,
        which need one."""
        if self._interpreter is not None:
            self.unchecked = _UNCHECKED_NOW.get(int(self._interpreter.feed_mode))
        self.feed_rate = rate * INCH

    def dwell(self, seconds):
        self._event(DWELL, seconds)

    def stock(self, line, low, high, shape, turn):
        """M250 (program/preview.py)."""
        self.line = line
        self._program_has("M250")
        self._event(STOCK, shape, turn, *low, *high)

    def _program_has(self, code):
        """A stock of the program's own: it takes the place of the one named by the user."""
        if self.job["stock"] and not self._owns_stock:
            self._owns_stock, before = True, "_put" in self.__dict__
            self.notes.append(
                [
                    self.line,
                    f"--stock is not used: the program defines its stock with {code}"
                    if before
                    else f"the stock of --stock ends: the program defines its own with {code}",
                ]
            )
            self.__dict__.pop("_put", None)

    def restored(self, line, slot):
        """M254 (program/preview.py)."""
        self.line = line
        self._program_has("M254")
        self._event(STOCK, -1.0, slot)

    def volume(self, line, mode, target, lower, ceiling):
        """M251, M252 (program/preview.py)."""
        self.line = line
        self._event(VOLUME, mode, target, lower, ceiling or 0.0)

    def target(self, line, loops):
        """A contour (program/preview.py)."""
        self.line = line
        for loop in loops:
            for number, point in enumerate(loop):
                self._event(TARGET, *self._machine(*(value / INCH for value in point)), float(number == 0))

    def get_block_delete(self):
        return self.job["block_delete"]

    def message(self, text):
        if len(self.messages) < 20:
            self.messages.append([self.line, text])
        if self.trace is not None:
            self.trace.message(text)

    def comment(self, text):
        if self.trace is not None:
            self.trace.comment(text)
        self.clamp_comment(text)

    def mark(self, kind, *values):
        """Of a marked program (executed_words.py)."""
        self._event(kind, *values)


def limit(cpu_s):
    """Computing time until the end of this process in any case."""
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)


def line_of(canon, line, text):
    """The line of an error.  gcode returns the next line if one cannot be read, but not if it cannot be executed
    (2.9)."""
    job = canon.job
    with open(job["program"], encoding="utf-8", errors="surrogateescape") as program:
        before = next(itertools.islice(program, line - 2, None), "") if line > 1 else ""
    other = Canon({**job, "stock": None, "written": False}, lambda *block: None, canon.tools)
    return line - 1 if fails_alike(other, before, text) else line


def main():
    die_with_parent(int(sys.argv[1]))
    job = json.load(sys.stdin)
    send = sender(own_output())
    limit_computing(job["quiet_s"])
    limit(job["cpu_s"])
    if job["memory_mb"]:
        limit_memory(job["memory_mb"])
    canon = Canon(job, send, ToolTable(job["table"], job["random"]))
    from chipwise.program import preview

    preview.listener = canon
    if job["watched"] is not None:
        from chipwise.program.executed_words import Trace

        canon.trace = Trace(canon, job["watched"])
    error, line = None, 0
    try:
        canon.refuse_lost()
        result, line = parse(canon, job["program"])
        if result > gcode.MIN_ERROR:
            text = gcode.strerror(result)
            error = [line_of(canon, line, text), text]
    except RuntimeError:
        if canon.stop is None and not canon.ended:
            raise
    except Stop:
        pass
    send(b"R", canon.records.tobytes())
    send(
        b"E",
        json.dumps(
            {
                "error": error,
                "stop": canon.stop,
                "line": line,
                "last": canon.line,
                "moves": canon.count,
                "carries": canon.carries,
                "messages": canon.messages,
                "notes": canon.notes,
                "trace": canon.trace and canon.trace.items,
            }
        ).encode(),
    )


if __name__ == "__main__":
    main()
