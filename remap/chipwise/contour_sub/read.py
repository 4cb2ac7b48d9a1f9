# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads a contour sub: from an O-sub number to loops of lines and arcs, and to contours.

Called by planner/plans.py (G77, G78, G79) and by bin/chipwise contour.

    shape = read_shape(Job(program="part.ngc", sub=100, ini="mill.ini"))
    shape.loops             ((LineElement | ArcElement, ..), ..): mm, absolute work coordinates, source lines
    one_contour(shape)      the Contour of its only loop

Results are kept by the text of the files and, if the sub reads parameters, by their values.
"""

import math
import re
from dataclasses import dataclass, replace
from functools import lru_cache

from chipwise.contour_sub.check import check_text
from chipwise.program.find_sub import find_sub, plain_text, quoted
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.run import called_files, relevant, run
from chipwise.errors import CycleError
from chipwise.geometry.base import loops as chain_loops
from chipwise.geometry.base.contour import (
    ArcElement,
    Contour,
    ContourError,
    LineElement,
    make_contour,
    refuse_nearly_closed,
)
from chipwise.geometry.base.tolerances import CONNECT_MM, NEARLY_CLOSED_MM
from chipwise.geometry.pocket import nesting

_PLACE = (7.25, 3.5)  # mm, another than zero: a shape that is the same from there does not depend on the place
SAME_MM = 1e-6
HEIGHT_MM = 1e-6  # a move that leaves its height by more is a Z move


@dataclass(frozen=True, eq=False)
class Shape:
    """loops: tuples of elements, one per contour; sub: O-number; file: that holds it; close_gap: as in the Job."""

    sub: int
    file: str
    loops: tuple[tuple[LineElement | ArcElement, ...], ...]
    close_gap: float = CONNECT_MM


class UnknownStart(CycleError):
    """The shape depends on where the tool is when the sub is called."""


def read_shape(job: Job) -> Shape:
    """Shape of a contour sub.  Raises CycleError for whatever is not a contour, UnknownStart if it needs a position
    that the Job has not."""
    found = find_sub(job)
    if job.position is None:
        return _from_anywhere(found, job)
    return _read(found, relevant(job, found), called_files(job, found))


def _from_anywhere(found, job):
    """Shape of a sub that is the same wherever the tool is: read from two places."""
    check_text(found, job.lathe)
    first = _first_move(found)
    if first:
        raise _unknown(found, job, first)
    x, other = _PLACE
    shape, moved = (
        _from(found, replace(job, position=at))
        for at in ((0.0, 0.0, 0.0), (x, 0.0, other) if job.lathe else (x, other, 0.0))
    )
    if isinstance(shape, CycleError):
        raise shape
    if isinstance(moved, CycleError):
        raise _unknown(found, job, shape.loops[0][0].line)
    for e, f in zip((e for loop in shape.loops for e in loop), (e for loop in moved.loops for e in loop)):
        if max(math.dist(e.start, f.start), math.dist(e.end, f.end)) > SAME_MM:
            raise _unknown(found, job, e.line)
    return shape


def _from(found, job):
    """Shape, or the CycleError that it makes."""
    try:
        return _read(found, relevant(job, found), called_files(job, found))
    except CycleError as error:
        return error


def _first_move(found):
    """Number of the first line if it is a G1, G2 or G3 without expressions before it; 0 for any other."""
    for number, text in found.body:
        plain = plain_text(text)
        if re.search(r"[#o\[]", plain):
            return 0
        if re.search(r"[xyz]", plain):
            return number if re.search(r"g0*[123](?![\d.])", plain) else 0
    return 0


def _unknown(found, job, line):
    error = found.fault(
        line,
        "the shape begins where the tool is, and that place is not known",
        f"begin the sub with G0 X.. {'Z' if job.lathe else 'Y'}..",
    )
    return UnknownStart(error.problem, error.remedy)


@lru_cache(maxsize=128)
def _read(found, job, _files):
    """Shape of a found sub; kept by the text of its file, the files it calls, and all it can read."""
    return _shape(found, job, run(found, job))


def _shape(found, job, moves):
    """Loops of elements from the runner's moves, a new one after every G0 that goes somewhere."""
    loops: list[list] = [[]]
    here, before = job.in_plane, None
    for kind, line, *numbers in moves:
        there = tuple(numbers[:3])
        if not all(math.isfinite(v) for v in numbers):
            raise found.fault(line, "a coordinate is not a finite number", "give every expression a value", before)
        if abs(there[2] - here[2]) > HEIGHT_MM:
            raise found.fault(
                line,
                "a move in Z is not allowed in a contour sub",
                "a contour lies in XY; heights are the words Z and R of the cycle",
                before,
            )
        if kind != "rapid":
            loops[-1].append(_element(found, kind, line, here[:2], numbers, before))
        elif loops[-1] and math.dist(there[:2], loops[-1][-1].end) > job.close_gap:
            loops.append([])
        here, before = there, line
    kept = tuple(tuple(loop) for loop in loops if loop)
    if not kept:
        raise found.fault(found.first, "the sub holds no G1, G2 or G3", "put the contour in it")
    return Shape(int(job.sub), found.path, kept, job.close_gap)


def _element(found, kind, line, start, numbers, before):
    """Element of a feed move or an arc."""
    end = tuple(numbers[:2])
    if kind == "feed":
        return LineElement(start, end, line)
    centre, turns = tuple(numbers[3:5]), int(numbers[5])
    if abs(turns) > 1:
        raise found.fault(line, f"an arc of {abs(turns)} turns runs over itself", "leave P out", before)
    return ArcElement(start, end, centre, turns > 0, line)


# ---- from loops to contours ------------------------------------------------------------------------------------------


def shape_error(shape, error):
    """A ContourError of the kernel about a shape -> CycleError naming the sub."""
    problem, _, remedy = error.template.partition("; ")
    return CycleError(f"sub O{shape.sub} of {quoted(shape.file)}: {problem}", remedy, **error.lengths)


def contours(shape: Shape) -> tuple[Contour, ...]:
    """Contour of every loop, in order; one that was drawn twice is there once.  Raises CycleError for a loop that is
    not a contour."""
    try:
        made = tuple(
            make_contour(list(loop), shape.close_gap)
            for drawn in shape.loops
            for loop in chain_loops.split(drawn, shape.close_gap)[0]
        )
        if len(made) > 1:
            made = nesting.without_doubled(made, shape.close_gap)
        for contour in made:
            refuse_nearly_closed(contour, shape.close_gap)
        return made
    except ContourError as error:
        raise shape_error(shape, error) from error


def _refuse_near_gaps(shape):
    """Loops of which one begins where another ends, but for a gap: parts of one contour."""
    for loop, other in zip(shape.loops, shape.loops[1:]):
        gap = math.dist(loop[-1].end, other[0].start)
        if gap <= NEARLY_CLOSED_MM and math.dist(loop[-1].end, loop[0].start) > gap:
            x, y = other[0].start
            raise CycleError(
                f"sub O{shape.sub} of {quoted(shape.file)}: the contour is not connected: line {loop[-1].line} "
                f"ends {{gap}} from where line {other[0].line} starts, more than the {{most}} that are closed",
                f"end line {loop[-1].line} at X{{x}} Y{{y}}",
                gap=gap,
                most=shape.close_gap,
                x=x,
                y=y,
            )


def one_loop(shape: Shape) -> tuple:
    """The parts of a sub that holds exactly one contour, also if it was drawn more than once; else a CycleError."""
    drawn = shape.loops
    if len(drawn) == 1:
        try:
            drawn = chain_loops.split(drawn[0], shape.close_gap)[0]
        except ContourError:  # an open contour that touches itself: the kernel says where
            return shape.loops[0]
    if len(drawn) > 1 and not _all_the_same(drawn, shape.close_gap):
        _refuse_several(shape, drawn)
    return drawn[0]


def _all_the_same(drawn, close_gap):
    """Whether closed loops repeat the first one."""
    try:
        made = [make_contour(list(loop), close_gap) for loop in drawn]
    except ContourError:
        return False
    return all(contour.closed for contour in made) and len(nesting.without_doubled(made, close_gap)) == 1


def _refuse_several(shape, drawn):
    """Raise the CycleError of a sub with several contours for a cycle of one."""
    if len(shape.loops) > 1:
        _refuse_near_gaps(shape)
    found = ", ".join(f"line {loop[0].line}" for loop in drawn[:4])
    raise CycleError(
        f"sub O{shape.sub} of {quoted(shape.file)} holds {len(drawn)} contours (from {found})"
        + (", separated by G0" if len(shape.loops) > 1 else ""),
        "use one sub for each",
    )


def one_contour(shape: Shape) -> Contour:
    """The Contour of a sub that holds exactly one."""
    one_loop(shape)
    return contours(shape)[0]
