# SPDX-License-Identifier: GPL-2.0-or-later
"""What a cycle hands to the glue: a tuple of moves.

Lengths in mm, feeds in mm/min (mm per revolution under G95), absolute work coordinates in the XY plane.
None for an axis means: unchanged.  line: of the program, 0 for the line of the cycle.
Frozen, so that whole tuples can be cached and compared.
"""

from dataclasses import dataclass
from typing import Any, Optional, Union


PATH = "G6"  # all codes of the path mode begin so: G61, G61.1, G64
CALLERS_PATH = "G6 caller"  # a Code: the path mode of the program that has called; glue/path_mode.py puts it in


@dataclass(frozen=True)
class Rapid:
    """A traverse (G0); abc: degrees of the axes A, B and C at its end."""

    x: Optional[float] = None
    y: Optional[float] = None
    z: Optional[float] = None
    line: int = 0
    abc: Optional[tuple] = None


@dataclass(frozen=True)
class Line:
    """A straight cut (G1); abc: as for a traverse."""

    x: Optional[float] = None
    y: Optional[float] = None
    z: Optional[float] = None
    feed: float = 0.0
    line: int = 0
    abc: Optional[tuple] = None


@dataclass(frozen=True)
class Thread:
    """A straight cut in step with the spindle (G33): pitch mm of the path per revolution."""

    x: float
    y: float
    z: float
    pitch: float
    line: int = 0
    abc: Optional[tuple] = None


@dataclass(frozen=True)
class Arc:
    """A circular cut (G2, or G3 where ccw) about (cx, cy); z not None makes a helix.

    End point equal to start point means a full turn; turns counts started turns as LinuxCNC's P word does.
    """

    x: float
    y: float
    cx: float
    cy: float
    ccw: bool
    z: Optional[float] = None
    feed: float = 0.0
    turns: int = 1
    line: int = 0
    abc: Optional[tuple] = None


@dataclass(frozen=True)
class PlaneArc:
    """An arc of plane "G18" or "G19" about centre, ccw as seen from the end of the axis it turns about; else as Arc."""

    plane: str
    end: tuple
    centre: tuple
    ccw: bool
    feed: float = 0.0
    turns: int = 1
    line: int = 0
    abc: Optional[tuple] = None

    @property
    def x(self) -> float:
        """Of its end, as y and z."""
        return float(self.end[0])

    @property
    def y(self) -> float:
        """As x."""
        return float(self.end[1])

    @property
    def z(self) -> float:
        """As x."""
        return float(self.end[2])


@dataclass(frozen=True)
class Code:
    """A line that moves nothing, as "M8"; of a pattern's sub.  PATH, then a code of the path mode: "G64 P0.01", or the
    caller's."""

    text: str
    line: int = 0


@dataclass(frozen=True)
class Blend:
    """The path mode of the moves after it: G64 with a tolerance in mm; None: the caller's again.  It moves nothing."""

    tolerance: Optional[float]
    line: int = 0
    x = y = z = abc = None
    feed = 0.0


Move = Union[Rapid, Line, Thread, Arc, PlaneArc, Code, Blend]


@dataclass(frozen=True, eq=False)
class Copy:
    """Moves of an earlier part of the plan at another place: 200 copies of a pattern are made of arrays.

    moves    what they are: kinds, feeds, turns, angles, lines; a tuple of Move with all coordinates
    places   numpy array (n, 6): end, and of an arc the centre, of each of them; the row of a Code is not used
    """

    moves: tuple
    places: Any
