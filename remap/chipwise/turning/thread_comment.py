# SPDX-License-Identifier: GPL-2.0-or-later
"""Threads that the drawing names: a comment on the line of the sub that draws the cylinder.

    G1 Z-18 (THREAD,PITCH=1.5)          or (THREAD,PITCH=1.5,STARTS=2)

Called by read_part.py.  Outside the drawn cylinder is the major diameter, in a bore the minor one, as it is before the
thread is cut.
"""

import math
import re
from dataclasses import dataclass
from typing import Literal, TypedDict

from chipwise.program import comments
from chipwise.program.find_sub import Found
from chipwise.turning.profile_function import Graph, Piece, value

OUTSIDE, INSIDE = (
    0.61343,
    0.54127,
)  # depth / pitch of a metric thread of 60 degrees, ISO 68-1: 17/24 and 5/8 of the height of its triangle
MOST_MM = 50.0  # of a lead
MOST_STARTS = 12
CYLINDER_MM = 1e-4  # a cylinder's ends differ by less
_Number = Literal["PITCH", "DEPTH", "SPEED"]
_NUMBERS: tuple[_Number, ...] = ("PITCH", "DEPTH", "SPEED")


@dataclass(frozen=True)
class Thread:
    """A thread on a cylinder of the part.

    z0, z1      mm, ends of the cylinder; x: its radius, mm
    pitch       mm from one turn of the thread to the next; depth: mm, radial, from the cylinder to the root
    starts      threads side by side, each with a lead of so many pitches
    standard    the depth is that of a thread of 60 degrees
    left        left-handed; speed: 1/min, 0: the program's
    inside      in the bore; line: of the file
    """

    z0: float
    z1: float
    x: float
    pitch: float
    depth: float
    standard: bool
    left: bool
    speed: float
    inside: bool
    line: int
    starts: int = 1

    @property
    def lead(self) -> float:
        """mm per revolution."""
        return self.pitch * self.starts


class ThreadWords(TypedDict, total=False):
    """Of a THREAD comment: PITCH and DEPTH mm, SPEED 1/min."""

    PITCH: float
    DEPTH: float
    SPEED: float
    HAND: str
    STARTS: int


def read_threads(found: Found, outside: Graph, bore: Graph, unit_mm: float) -> tuple[Thread, ...]:
    """(Thread, ..) of the comments in a sub (find.Found), for its graphs.  Raises CycleError naming the line."""
    threads: list[Thread] = []
    for number, text in found.body:
        for comment in comments.insides(text, "THREAD", comma=False):
            fields = _fields(found, number, comment, unit_mm)
            pieces = [(p, side) for graph, side in ((outside, False), (bore, True)) for p in graph if p.line == number]
            if not pieces:
                raise found.fault(
                    number, "the THREAD comment is on a line that draws nothing", "put it on the line of the cylinder"
                )
            threads += [_thread(found, number, fields, p, side) for p, side in pieces]
    return tuple(threads)


def _fields(found: Found, number: int, comment: str, unit_mm: float) -> ThreadWords:
    """{PITCH, DEPTH: mm, SPEED: 1/min, HAND: text, STARTS: number} of the inside of a comment."""
    fields: ThreadWords = {}
    for part in filter(None, (p.strip().upper() for p in comment.split(","))):
        key, given = (word.strip() for word in part.partition("=")[::2])
        named = next((name for name in _NUMBERS if name == key), None)
        if key == "HAND" and given in ("LEFT", "RIGHT"):
            fields["HAND"] = given
        elif key == "STARTS" and re.fullmatch(r"\d{1,2}", given) and 1 <= int(given) <= MOST_STARTS:
            fields["STARTS"] = int(given)
        elif named and re.fullmatch(r"\d+(?:\.\d*)?|\.\d+", given) and float(given) > 0.0:
            fields[named] = float(given) * (1.0 if key == "SPEED" else unit_mm)
        else:
            raise found.fault(
                number,
                f"THREAD comment: {part[:40]} is not understood",
                f"write (THREAD,PITCH=1.5), with DEPTH= SPEED= as numbers above 0, HAND=LEFT or RIGHT, STARTS= from 1 "
                f"to {MOST_STARTS} where needed",
            )
    if not 0.0 < fields.get("PITCH", 0.0) * fields.get("STARTS", 1) <= MOST_MM:
        raise found.fault(
            number,
            f"THREAD comment: PITCH is not above 0 and, times STARTS, up to {MOST_MM:g} mm",
            "write (THREAD,PITCH=1.5)",
        )
    if fields.get("DEPTH", 0.0) > fields["PITCH"]:
        raise found.fault(number, "THREAD comment: DEPTH is more than PITCH", "give the depth on one side")
    return fields


def _thread(found: Found, number: int, fields: ThreadWords, piece: Piece, inside: bool) -> Thread:
    """Thread of a piece of a graph; a bore's graph is mirrored."""
    ends = value(piece, piece.z0), value(piece, piece.z1)
    if piece.r or abs(ends[0] - ends[1]) > CYLINDER_MM:
        raise found.fault(
            number,
            "the thread is not on a cylinder",
            "put the THREAD comment on a line along Z; a tapered thread is not planned: cut it after G26, with G33 in "
            "X and Z",
        )
    x = math.fabs(ends[0])
    depth = fields.get("DEPTH", fields["PITCH"] * (INSIDE if inside else OUTSIDE))
    if not inside and depth >= x:
        raise found.fault(
            number,
            f"the thread is {depth:.3f} mm deep, more than its radius of {x:.3f} mm",
            "correct PITCH, DEPTH or the diameter",
        )
    return Thread(
        piece.z0,
        piece.z1,
        x,
        fields["PITCH"],
        depth,
        "DEPTH" not in fields,
        fields.get("HAND") == "LEFT",
        fields.get("SPEED", 0.0),
        inside,
        number,
        fields.get("STARTS", 1),
    )
