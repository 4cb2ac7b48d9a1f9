# SPDX-License-Identifier: GPL-2.0-or-later
"""Touched points of a blank from a file -> points in machine coordinates.

Called by cli/blank.py.  The kind is read from the content:

    log of probe_grid.ngc       begins with LOG; it has the unit and the work offset in force beside the points
    points, PROBEOPEN           a line x y z (or x y z a b c u v w) for each, anywhere; between blanks, commas or
                                semicolons
    height map                  of Candle, bCNC or OpenCNCPilot (surface/height_map_file.py): the points of its grid
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.host.files import read_bytes
from chipwise.program.records import Frame
from chipwise.surface import height_map_file

LOG = "chipwise probe"  # the first line of the sub's log
MOST_BYTES = height_map_file.MAX_BYTES
OFFSETS = {"unit": 1, "g5x": 3, "g92": 3, "rotation": 1}  # lines of the log's head: so many numbers
COLUMNS = 3, 9  # of a line with a point
MOST_WRONG = 0.5  # of the lines of a list of points


@dataclass
class Place:
    """Where the zero of the points is in the machine: mm, degrees."""

    g5x: tuple = (0.0, 0.0, 0.0)
    g92: tuple = (0.0, 0.0, 0.0)
    rotation: float = 0.0

    def machine(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3), mm, work coordinates -> machine coordinates of the tool's tip."""
        frame = Frame(math.radians(self.rotation), self.g5x, self.g92)
        return np.column_stack(frame.to_machine(np.asarray(points, float).T))


@dataclass
class Touched:
    """points (n, 3) mm, work coordinates; place: None if the file does not say it."""

    points: np.ndarray
    place: Place | None = None
    head: dict = field(default_factory=dict)


def read(path: str, unit_mm: float | None, machine_mm: float | None) -> Touched:
    """The points of a file.  unit_mm: mm of a unit of the file, None: the log says it, else mm; machine_mm: mm of a
    machine unit, in which LinuxCNC keeps offsets.

    Raises CycleError for another file, OSError."""
    data = read_bytes(path, MOST_BYTES)
    lines = [line.strip() for line in data.removeprefix(b"\xef\xbb\xbf").decode("ascii", "replace").splitlines()]
    lines = [line for line in lines if line]
    if not lines:
        raise CycleError(f"{path} is empty", "probe first")
    if lines[0].startswith(LOG):
        return _of_log(path, lines[1:], machine_mm)
    return Touched(_of_map_or_list(path, data, lines) * (unit_mm or 1.0))


def _of_map_or_list(path: str, data: bytes, lines: list[str]) -> np.ndarray:
    """(n, 3).  A height map first: the head of one of bCNC looks like points."""
    trouble = CycleError(
        f"{path} is not a list of points",
        "give the log of probe_grid.ngc, lines x y z, or a height map of Candle, bCNC or OpenCNCPilot",
    )
    try:
        found = height_map_file.read_height_map(data)
    except CycleError as error:  # points that are not a grid, too
        found, trouble = None, error
    if found is not None:
        x, y = np.meshgrid(found.x, found.y)
        return np.column_stack((x.ravel(), y.ravel(), found.height.ravel()))
    rows = [numbers(line) for line in lines]
    if rows[0] is None and len(rows) > 1:  # the columns' names
        rows = rows[1:]
    wrong = [number for number, row in enumerate(rows) if row is None or len(row) not in COLUMNS]
    if wrong and len(wrong) < MOST_WRONG * len(rows):  # else it is something else than a list
        raise CycleError(
            f"{path} has a line that is not a point: {lines[wrong[0] - len(rows)][:40]}",
            "correct the line, or take it out",
        )
    if wrong:
        raise trouble
    return np.array([row[:3] for row in rows if row])


def numbers(line: str) -> list[float] | None:
    """The numbers of a line, None if something else is in it."""
    try:
        found = [float(word) for word in line.replace(";", " ").replace(",", " ").split()]
    except ValueError:
        return None
    return found if all(map(math.isfinite, found)) else None


def _of_log(path: str, lines: list[str], machine_mm: float | None) -> Touched:
    """Points and place of the sub's log."""
    head, rows = {}, []
    ended = False
    for line in lines:
        word, _, rest = line.partition(" ")
        found = numbers(rest if word in OFFSETS else line)
        if line.startswith("end"):
            ended = True
        elif found is None or len(found) != OFFSETS.get(word, 3) or ended:
            raise CycleError(f"{path} has a line that probe_grid.ngc does not write: {line[:40]}", "probe again")
        elif word in OFFSETS:
            head[word] = found
        else:
            rows.append(found)
    missing = [word for word in OFFSETS if word not in head]
    if missing or head["unit"][0] not in (1.0, MM_PER_INCH):
        raise CycleError(f"{path} does not say its {missing[0] if missing else 'unit'}", "probe again")
    if not ended:
        raise CycleError(f"{path} ends after {len(rows)} points: the probing was interrupted", "probe again")
    if machine_mm is None:
        raise CycleError("the log has work offsets in units of its machine", "name the machine with --ini INI")
    g5x, g92 = (tuple(value * machine_mm for value in head[word]) for word in ("g5x", "g92"))
    return Touched(np.array(rows).reshape(-1, 3) * head["unit"][0], Place(g5x, g92, head["rotation"][0]), head)
