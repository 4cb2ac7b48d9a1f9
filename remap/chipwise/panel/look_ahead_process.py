# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the loaded program for the picture of `chipwise panel`, in a process of its own: an order as JSON on standard
input, the path and the contours of G77, G78 and G79 on standard output.  Called by look_ahead.py.

    {"ini", "program", "scene", "tip"}      scene: panel/machine.py: scene(); tip: (x, y, z) of the tool, mm, machine
                                            coordinates
    -> a line of JSON {"note", "line", "relative", "loops", "points", "step"}, then the arrays of drawn_path.Path, in
    their order

note: why the path ends at this line, "" for a program that was read to its end.  Computing time, memory and the number
of moves are limited.  It is LinuxCNC's own interpreter with the remaps of the machine (program/reader.py), so the
cycles plan as they do when the program runs.
"""

import json
import math
import re
import sys
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from chipwise.check.asked import take_order
from chipwise.check.drawn_path import Path, Thinner
from chipwise.check.in_force import machine_in_force
from chipwise.program.program_file import Unfinished, Unreadable
from chipwise.program.reader import Machine, Reader
from chipwise.program.records import ARC, RAPID, TARGET
from chipwise.errors import unnamed
from chipwise.host.temp_folder import FolderError, OwnFolder
from chipwise.panel import Json
from chipwise.panel.machine import Scene

NICE = 5  # LinuxCNC comes first; with 10 a busy computer showed no path for minutes
CPU_S = 120
MEMORY_MB = 1500  # of this process, and of the one that reads
MOST_MOVES = 5_000_000
MOST_LOOP_POINTS = 20_000  # of all contours together
_COMMENT = re.compile(r"\([^)\n]*\)|;[^\n]*")
_RELATIVE = re.compile(r"g\s*0*91(?!\s*[.0-9])", re.IGNORECASE)


def machine_at(ini: str, scene: Scene, tip: Sequence[float], folder: str) -> Machine:
    """The check.reader.Machine of an INI file as it is now."""
    machine = machine_in_force(ini, scene, folder)
    place = " ".join(f"{letter}{value / machine.unit_mm:.6f}" for letter, value in zip("XYZ", tip))
    machine.codes[0] += f" G90 G53 G0 {place}"
    return machine


def is_relative(program: str, scene: Scene) -> bool:
    """Whether the program may begin at the place of the tool: G91 in it, or in force."""
    if "G91 " in scene["codes"] + " ":
        return True
    with open(program, encoding="utf-8", errors="replace") as file:
        return any(_RELATIVE.search(_COMMENT.sub("", row)) for row in file)


def read(order: Json, folder: str) -> tuple[Json, Path | None]:
    """-> (dict of the answer, drawn_path.Path or None)."""
    thinner = Thinner()
    targets: list[npt.NDArray[np.float64]] = []
    note, line = "", 0
    try:
        machine = machine_at(order["ini"], order["scene"], order["tip"], folder)
        with Reader(
            order["program"], machine, cpu_s=CPU_S, most_moves=MOST_MOVES, memory_mb=MEMORY_MB, targets=True
        ) as reader:
            for block in reader:
                kinds = block[:, 0]
                moves = block[kinds <= ARC]
                thinner.add(moves[:, 2:5], moves[:, 0] == RAPID, moves[:, 1])
                targets.append(block[kinds == TARGET][:, 2:6])
    except FolderError as error:
        note = unnamed(error)
    except Unreadable as error:
        note = str(error)
        line = 0 if "(line " in note else error.line
        if isinstance(error, Unfinished):
            note = f"{note.partition(';')[0]}; the picture ends there"
    path = thinner.path()
    return {
        "note": note,
        "line": line,
        "relative": is_relative(order["program"], order["scene"]),
        "loops": loops(targets),
        "points": 0 if path is None else len(path.points),
        "step": 0.0 if path is None else path.step,
    }, path


def loops(targets: Sequence[npt.NDArray[np.float64]]) -> list[list[list[float]]]:
    """Rows x, y, z, first -> [[[x, y, z], ..], ..], each contour once, thinned to MOST_LOOP_POINTS."""
    rows = np.concatenate(targets) if targets else np.empty((0, 4))
    every = math.ceil(len(rows) / MOST_LOOP_POINTS) or 1
    found: dict[str, list[list[float]]] = {}
    for loop in np.split(rows[:, :3].round(4), np.flatnonzero(rows[:, 3])[1:]):
        if len(loop):
            kept = loop[::every].tolist()
            found[json.dumps(kept + loop[-1:].tolist())] = (
                kept if (len(loop) - 1) % every == 0 else kept + loop[-1:].tolist()
            )
    return list(found.values())


def main() -> None:
    order = take_order(NICE, 2 * MEMORY_MB)
    with OwnFolder("ahead") as folder:
        head, path = read(order, folder)
    output = sys.stdout.buffer
    output.write(json.dumps(head).encode() + b"\n")
    if path is not None:
        for array in (path.points, path.rapid, path.low, path.high):
            output.write(array.tobytes())
    output.flush()


if __name__ == "__main__":
    main()
