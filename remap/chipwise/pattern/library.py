# SPDX-License-Identifier: GPL-2.0-or-later
"""A library of patterns: folders with a file for each sub, whose first comment names and describes it.

Called by cli/patterns.py.  Source: the patent abstract on registered patterns: patterns are kept in a memory and called
by number.  A file is N.ngc with sub O N; the first comment is "name: description".  Each sub is run as G75 runs it, so
a pattern that is listed is one that G75 accepts, with this tool.
"""

import os
import re
from dataclasses import dataclass

import numpy as np

from chipwise.program import find_sub
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.parameters import OWN, check, hint_set
from chipwise.errors import CycleError, unnamed
from chipwise.host.files import printable, read_bytes
from chipwise.pattern.isometry import arc_points
from chipwise.pattern.job import PatternJob
from chipwise.pattern.recorded import ARC, RAPID, Recorded
from chipwise.pattern.run import read_pattern

MAX_BYTES = 1 << 24  # of a file in a library
MAX_FILES = 2000  # in a folder: each of them is run
SUFFIX = ".ngc"
START_Z = 10.0  # mm, of the tool before the sub
CHORD = 0.005  # mm, of arcs in the picture

_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)")
_ACTIVE = re.compile(
    r"\s*(msg|debug|print|py|log\w*|abort|probeopen|probeclose|workpiece|surface)\s*(,|$)", re.IGNORECASE
)


@dataclass(frozen=True, eq=False)
class Entry:
    """A pattern: number, name, text of its description, path of its file, what it does."""

    number: int
    name: str
    text: str
    path: str
    recorded: Recorded

    def box(self):
        """((x, y, z), (x, y, z)) of its cuts, mm; of the whole path if it cuts nothing."""
        parts = [points for rapid, points in self.paths() if not rapid] or [self.recorded.points[self.recorded.ends]]
        every = np.concatenate(parts)
        return tuple(every.min(axis=0).tolist()), tuple(every.max(axis=0).tolist())

    def paths(self):
        """[(is a traverse, points (n, 3))] of the path from the end of the first move on, mm."""
        found, here = [], np.array(self.recorded.moves[0].end)
        for step in self.recorded.moves[1:]:
            points = (
                arc_points(here, step.end, step.centre, step.axis, step.turns, CHORD)
                if step.kind == ARC
                else np.array([step.end])
            )
            if not found or found[-1][0] != (step.kind == RAPID):
                found.append((step.kind == RAPID, [here[None]]))
            found[-1][1].append(points)
            here = np.array(step.end)
        return [(rapid, np.concatenate(parts)) for rapid, parts in found]


@dataclass(frozen=True)
class Skipped:
    """A file without a pattern: path and reason."""

    path: str
    problem: str


def files_of(folder):
    """Paths of the files of a folder that may be patterns, by number, then by name.  Raises OSError, CycleError."""
    names = [name for name in os.listdir(folder) if name.lower().endswith(SUFFIX)]
    if len(names) > MAX_FILES:
        raise CycleError(f"{printable(folder)} has {len(names)} files, more than {MAX_FILES}", "divide it")
    return [os.path.join(folder, name) for name in sorted(names, key=lambda name: (_number(name) or 0, name))]


@dataclass(frozen=True)
class Caller:
    """From where a pattern is run to be read.  unit_mm: of a machine unit; tool_mm: its diameter; numbered, named:
    parameters of the Job."""

    ini: str
    unit_mm: float
    tool_mm: float
    numbered: tuple = ()
    named: tuple = ()

    def job(self, path, number, text):
        """The sub of a file as G75 would run it from Z10 above its origin."""
        return PatternJob(
            Job(
                program=path,
                sub=number,
                ini=self.ini,
                unit=find_sub.program_unit(text, self.unit_mm),
                machine_unit=self.unit_mm,
                position=(0.0, 0.0, START_Z),
                tool=(1, self.tool_mm / self.unit_mm),
                numbered=self.numbered,
                named=self.named,
            ),
            spindle=(3, 1000.0),
        )


def read_entry(path, caller):
    """Entry or Skipped of a file, run from a Caller."""
    number = _number(os.path.basename(path))
    if number is None:
        return Skipped(path, "its name is not a number as in 100.ngc; G75 Q cannot call it")
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "replace")
        said = first_comment(text)
        if not said:
            return Skipped(path, "it has no comment; begin it with (name: description)")
        job = caller.job(path, number, text)
        check(job.sub, OWN)
        recorded = read_pattern(job)
    except CycleError as error:
        hint_set(error)
        return Skipped(path, unnamed(error))
    except OSError as error:
        return Skipped(path, error.strerror or str(error))
    name, _colon, rest = (part.strip() for part in said.partition(":"))
    return (
        Entry(number, name, rest, path, recorded)
        if name
        else Skipped(path, "its first comment has no name before the colon")
    )


def found_by_g75(number, ini_folder, ini):
    """The file in which G75 finds a sub that is not in the program; None without one."""
    for folder in find_sub.sub_folders(ini):
        path = os.path.join(ini_folder, folder, f"{number}{SUFFIX}")
        if any(word == (str(number), "sub") for word in (find_sub.read_file(path) or ((), {}))[1].values()):
            return path
    return None


def first_comment(text):
    """The first comment of a program, without those that LinuxCNC acts on; "" if there are none."""
    for match in _COMMENT.finditer(text):
        said = (match[1] or match[2] or "").strip()
        if said and not _ACTIVE.match(said):
            return said
    return ""


def _number(name):
    """100 of "100.ngc", None of another name."""
    match = re.fullmatch(r"([1-9]\d{0,8})\.ngc", name)
    return int(match[1]) if match else None
