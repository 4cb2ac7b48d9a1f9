# SPDX-License-Identifier: GPL-2.0-or-later
"""CLAMP comments of a program.  Called by program/clamp_comments.py, program/clamp_places.py and
planner/program_clamps.py.

    (CLAMP,BOX,XMIN=..,YMIN=..,ZMIN=..,XMAX=..,YMAX=..,ZMAX=..)
    (CLAMP,CYLINDER,X=..,Y=..,ZMIN=..,ZMAX=..,DIAMETER=..)

They have the units and work coordinates of the first move that follows, and stay at that place of the machine.  One
that names neither a shape nor a KEY=value is a remark for people.  LinuxCNC executes the last comment of a line only,
and none of an O line (2.9), so that lines where one would be lost are refused.
"""

import re

from chipwise.stock import shape_comment
from chipwise.errors import CycleError
from chipwise.clib.layout import MAX_COORDINATE

NAME = "CLAMP"
MOST = 100
_COMMENT = re.compile(rb"\(\s*CLAMP\s*,([^)\n]*)\)([^\n]*)", re.IGNORECASE)
_O_LINE = re.compile(rb"\s*(?:/\s*)?(?:N\s*[\d.]+\s*)?O", re.IGNORECASE)


def inside(text):
    """What is behind the name of a comment, as LinuxCNC hands it over (without parentheses); None of another comment,
    and of a remark."""
    name, comma, rest = text.partition(",")
    return rest if name.strip().upper() == NAME and comma and _is_meant(rest) else None


def _is_meant(rest):
    return "=" in rest or rest.partition(",")[0].strip().upper() in ("BOX", "CYLINDER")


def lost(program):
    """(line, what is wrong) of the first CLAMP comment in the bytes of a program that LinuxCNC does not execute, or
    None."""
    for line, _inside, before, behind in _meant(program):
        if b"(" in behind or b";" in behind:
            return line, "another comment is behind the CLAMP comment, and LinuxCNC executes only the last of a line"
        if _O_LINE.match(before):
            return line, "the CLAMP comment is on an O line, where LinuxCNC executes none"
    return None


def of_program(program):
    """[(line, what inside() finds)] of the bytes of a program without a lost() one."""
    return [(line, inside.decode("utf-8", "replace")) for line, inside, _before, _behind in _meant(program)]


def _meant(program):
    """(line, what is behind the name, before and behind the comment on its line) of each CLAMP comment that is one."""
    line = counted = 0
    for found in _COMMENT.finditer(program):
        if not _is_meant(found.group(1).decode("utf-8", "replace")):
            continue
        begin = program.rfind(b"\n", 0, found.start()) + 1
        before = program[begin : found.start()]
        if b";" in before or before.count(b"(") > before.count(b")"):
            continue  # in a remark
        line, counted = line + program.count(b"\n", counted, begin), begin
        yield line + 1, found.group(1), before, found.group(2)


def read(text, unit_mm):
    """What inside() has found -> (low, high, shape), mm, work coordinates.  Raises CycleError with a sentence for the
    operator."""
    low, high, shape = shape_comment.parse(text, NAME, "clamp")
    low, high = ([value * unit_mm for value in corner] for corner in (low, high))
    far = max((*low, *high), key=abs)
    if not abs(far) <= MAX_COORDINATE:
        raise CycleError(
            "CLAMP comment: a corner is at {far}, more than {most} from zero",
            "correct the comment",
            far=far,
            most=MAX_COORDINATE,
        )
    return low, high, shape
