# SPDX-License-Identifier: GPL-2.0-or-later
"""The path ahead of the tool in the loaded program, and the contours of its G77, G78 and G79, for the picture of
`chipwise panel`.

Called by watch.py at each look, and by server.py for each page.

 1. While a page is open, the loaded program is read in a process of its own (look_ahead_process.py), again whenever the
    file, the work offset, the tool or the modes have changed.  A running program is the one that was loaded when it
    began.
 2. Before its first run the whole path is ahead.  While it runs, the tool is followed on it (path_window.py); a tool
    that is not near the path for LOST_S has left it, and no path is shown until it is there again.  After the end of
    the run, nothing is ahead.
 3. A page gets a window of the path: from a multiple of WINDOW points on, twice as many.

A message A: uint32 epoch, uint32 first point, float32 x, y, z, kind of each point (1: the segment that ends there is a
traverse).  C: JSON of the contours, loops of points.  mm, machine coordinates.
"""

import contextlib
import json
import struct
import subprocess
import threading
from collections.abc import Callable
from typing import Protocol, TypedDict

import numpy as np

from chipwise.check import asked
from chipwise.check.drawn_path import Path, lengths
from chipwise.host.clock import patience
from chipwise.program.loaded import identity, place
from chipwise.panel import Json
from chipwise.panel.machine import Pins, Scene, Tip
from chipwise.panel.path_window import anywhere, follow
from chipwise.panel.tiles import Message

WINDOW = 10_000  # points
READ_S = 300.0  # until a process that reads is ended
LOST_S = 1.0  # off the path; then it is looked for on the whole path, so long apart
SLACK_MM = 2.0  # beyond what the velocity says, in a look
FASTER = 1.5  # than the velocities that were read
PATH, TARGETS = b"A", b"C"  # kinds of messages (server.py: message)


class Head(TypedDict):
    """What is known of a program beside its path: why the path ends and at which line, whether it may begin at the
    place of the tool, and its contours, loops of points (mm)."""

    note: str
    line: int
    relative: bool
    loops: list[list[list[float]]]


Found = tuple[Head, Path | None]
Loaded = tuple[Scene, tuple[int, int, int] | None]  # the scene, and the identity of the file
_FIELDS = (("<f4", 3), ("?", 1), ("<i4", 1), ("<i4", 1))


def _unread(note: str) -> Head:
    """Of a program that has not been read: why."""
    return {"note": note, "line": 0, "relative": False, "loops": []}


NOTHING = _unread("")  # known of a program


def unpacked(answer: bytes) -> Found:
    """(dict, Path or None) of what look_ahead_process.py has written.  Raises ValueError."""
    first, _, data = answer.partition(b"\n")
    head = json.loads(first)
    arrays: list[np.ndarray] = []
    at = 0
    for kind, width in _FIELDS:
        size = np.dtype(kind).itemsize * width * head["points"]
        arrays.append(np.frombuffer(data[at : at + size], kind).reshape((-1, width) if width > 1 else -1))
        at += size
    points, rapid, low, high = arrays
    return head, Path(points, rapid, low, high, head["step"], lengths(points)) if head["points"] else None


class Reading(threading.Thread):
    """A program that is being read; found: what unpacked() gives, None until then."""

    def __init__(self, order: Json) -> None:
        super().__init__(daemon=True)
        self.found: Found | None = None
        self._order = json.dumps(order).encode()
        self._child = asked.start("chipwise.panel.look_ahead_process")
        self.start()

    def run(self) -> None:
        answer = b""
        with contextlib.suppress(subprocess.TimeoutExpired, OSError, ValueError):
            answer, _ = self._child.communicate(self._order, patience(READ_S))
        self.end()
        try:
            self.found = unpacked(answer)
        except (ValueError, KeyError):
            self.found = _unread("it could not be read within the time and memory for it"), None

    def end(self) -> None:
        with contextlib.suppress(OSError):
            asked.end(self._child)


class Reader(Protocol):
    """A program that is being read: a Reading, or what a test has in its place."""

    found: Found | None

    def end(self) -> None: ...


class Ahead:
    """Of one machine.  look() is for one thread, messages() and state() for any."""

    def __init__(self, ini: str, read: Callable[[Json], "Reader"] = Reading) -> None:
        """ini: path of the INI file, "": no program is read; read: order -> an object as Reading."""
        self._ini, self._read = ini, read
        self._lock = threading.Lock()
        self._loaded: Loaded | None = None  # of the program that runs, or would
        self._asked: Loaded | None = None
        self._order: Json | None = None
        self._reading: Reader | None = None
        self._head = NOTHING
        self._path: Path | None = None
        self._epoch = 0  # counts paths
        self._run = False  # a program runs
        self._ended: object = None  # _place() of the program whose run has ended
        self._done = 0.0  # mm of path
        self._shown = True  # whether the tool is on the path
        self._reach = self._lost = self._velocity = 0.0

    # ---- one look --------------------------------------------------------------------------------------------------

    def look(self, dt: float, scene: Scene | None, running: bool, pins: Pins, wanted: bool) -> None:
        """dt: s since the look before; scene: panel/machine.py; running: whether a program runs; wanted: whether a page
        is open."""
        begins, ends, self._run = running and not self._run, self._run and not running, running
        if scene is not None and (not running or self._loaded is None or begins and self._is_other(scene)):
            self._loaded = scene, identity(scene["program"])
        elif scene is None and not running:
            self._loaded = None
        if begins:
            self._done, self._shown, self._lost, self._ended = 0.0, True, 0.0, None
            if (
                self._head["relative"]
                and self._order
                and np.abs(np.subtract(self._order["tip"], pins["tip"])).max() > 1e-3
            ):
                self._asked = None
        if ends:
            self._ended = _place(self._loaded)
        elif self._ended is not None and _place(self._loaded) != self._ended:
            self._ended = None
        if wanted and self._ini and self._loaded != self._asked:
            self._ask(pins["tip"])
        self._take()
        if running and self._path is not None:
            self._follow(self._path, dt, pins)

    def _is_other(self, scene: Scene) -> bool:
        """Whether a program was opened and begun between two looks."""
        if self._loaded is None:
            return True
        return scene["program"] != self._loaded[0]["program"] or identity(scene["program"]) != self._loaded[1]

    def _ask(self, tip: Tip) -> None:
        """Have the loaded program read; what is known of another one goes."""
        if self._reading is not None:
            self._reading.end()
        self._asked, self._reading = self._loaded, None
        self._put(NOTHING, None)
        if self._loaded is not None and self._loaded[1] is not None:
            scene = self._loaded[0]
            self._order = {
                "ini": self._ini,
                "program": scene["program"],
                "scene": scene,
                "tip": [round(v, 6) for v in tip],
            }
            try:
                self._reading = self._read(self._order)
            except OSError as error:  # no process or no memory for it: the page works without the path
                self._put(_unread(f"it could not be read: {error.strerror}; open the program again"), None)

    def _take(self) -> None:
        """What has been read, if the file is still what it was then."""
        if self._reading is None or self._reading.found is None:
            return
        found, self._reading = self._reading.found, None
        if self._asked is not None and identity(self._asked[0]["program"]) == self._asked[1]:
            self._put(*found)

    def _put(self, head: Head, path: Path | None) -> None:
        with self._lock:
            self._head, self._path = head, path
            self._epoch += 1
            self._done, self._reach = 0.0, 0.0
            self._shown, self._lost = not self._run, LOST_S * self._run  # the tool may be anywhere on it

    def _follow(self, path: Path, dt: float, pins: Pins) -> None:
        """Where the tool is on the path."""
        velocity = pins["current_vel"]
        self._reach += SLACK_MM + FASTER * max(velocity, self._velocity) * dt
        self._velocity = velocity
        line = int(pins["line"])
        found = follow(path, self._done, pins["tip"], line, self._reach)
        if found is None:
            self._lost += dt
            if self._lost < LOST_S:
                return
            self._lost = 0.0
            found = anywhere(path, self._done, pins["tip"], line)
        self._shown = found is not None
        if found is not None:
            self._done, self._reach, self._lost = found, 0.0, 0.0

    # ---- for pages -------------------------------------------------------------------------------------------------

    def _from(self) -> int | None:
        """Number of the first point that is ahead; None: nothing is."""
        if self._path is None or self._ended is not None or not self._shown:
            return None
        return self._path.after(self._done) if self._run else 0

    def state(self) -> Json:
        """{"epoch", "from": first point ahead or None, "joined": whether the tool is on its segment, "note": why the
        path ends, "line": there}."""
        with self._lock:
            return {
                "epoch": self._epoch,
                "from": self._from(),
                "joined": self._run,
                "note": self._head["note"],
                "line": self._head["line"],
            }

    def messages(self, seen: tuple[int, int]) -> tuple[list[Message], tuple[int, int]]:
        """What a page needs that has `seen` = (epoch, first point of its window).  -> ([(kind, bytes), ..], the new
        seen)."""
        with self._lock:
            first = (self._from() or 0) // WINDOW * WINDOW
            if seen == (self._epoch, first):
                return [], seen
            parts = []
            if seen[0] != self._epoch:
                parts.append((TARGETS, json.dumps(self._head["loops"]).encode()))
            window = slice(first, first + 2 * WINDOW)
            rows = (
                np.empty((0, 4), "<f4")
                if self._path is None
                else np.column_stack((self._path.points[window], self._path.rapid[window])).astype("<f4")
            )
            return [*parts, (PATH, struct.pack("<II", self._epoch, first) + rows.tobytes())], (self._epoch, first)

    def close(self) -> None:
        if self._reading is not None:
            self._reading.end()


def _place(loaded: Loaded | None) -> object:
    """What of a (scene, identity) is the same after the program has changed tool and modes."""
    return loaded and (loaded[0]["program"], place(loaded[0]), loaded[1])
