# SPDX-License-Identifier: GPL-2.0-or-later
"""A move as text: G0, G1, G2 or G3 in given units, plane and arc mode.  Called by text.py and unroll.py."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from chipwise.program.records import ARC, FEED, RAPID

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.program.records import Frame
    from chipwise.rewrite.edits import Move
    from chipwise.rewrite.program import Circle, Modes

INCH = 25.4
_ARC_LETTERS = {1: ((0, "I"), (1, "J")), 2: ((1, "J"), (2, "K")), 3: ((0, "I"), (2, "K"))}
G = {RAPID: "G0", FEED: "G1"}
PLANE = {1: 17, 2: 19, 3: 18}  # G word of a Circle's plane


class Numbers:
    """Lengths and feeds as text in the units of a line."""

    def __init__(self, units: float) -> None:
        self.inch = units == 20
        self.scale = 1.0 / INCH if self.inch else 1.0

    def length(self, mm: float, digits: int = 0) -> str:
        return plain(mm * self.scale, (6 if self.inch else 5) + digits)

    def feed(self, mm_min: float) -> str:
        """Rounded down: a feed is never larger than was wanted."""
        digits = 3 if self.inch else 2
        value = mm_min * self.scale
        return plain(math.floor(value * 10**digits + 1e-6) / 10**digits, digits) if value > 1.0 else plain(value, 5)


def plain(value: float, digits: int) -> str:
    """A number as text, without what says nothing."""
    text = ("%.*f" % (digits, value)).rstrip("0").rstrip(".")
    return "0" if text == "-0" or not text else text


def g_code(move: Move) -> str:
    """The G word of a Move."""
    return G.get(move.kind) or ("G3" if move.arc.turns > 0 else "G2")


def changed_words(text: list[str], had: list[str] | None) -> list[str]:
    """The words of X Y Z, as text, that are not those of the place before; all of them if that is None."""
    if had is None:
        return ["X" + text[0], "Y" + text[1], "Z" + text[2]]
    return [letter + t for letter, t, before in zip("XYZ", text, had) if t != before]


class MoveText:
    """Moves one after the other in one coordinate system: at, mm, machine coordinates: where the tool is."""

    def __init__(self, frame: Frame, modes: Modes, at: Floats | tuple[float, ...]) -> None:
        self.frame, self.modes = frame, modes
        self.at: Floats | tuple[float, ...] = at
        self.numbers = Numbers(modes.units)
        self.written: list[str] | None = None  # X Y Z as the output has them

    def words(self, move: Move) -> list[str]:
        """The words of a Move but for F; none for a straight one that goes nowhere."""
        text = [self.numbers.length(v) for v in self.frame.to_work(move.end)]
        before, self.written = self.written, text
        begin, self.at = self.at, move.end
        words = changed_words(text, None if move.kind == ARC else before)
        if not words:
            return []
        words.insert(0, g_code(move))
        if move.kind == ARC:
            words += self._centre(
                move.arc,
                np.array([float(t) for t in before]) / self.numbers.scale if before else self.frame.to_work(begin),
            )
        return words

    def _centre(self, circle: Circle, begin: Floats | tuple[float, ...]) -> list[str]:
        """I J K of an arc that begins at a place in work coordinates."""
        centre = self.frame.to_work(circle.centre)
        origin = (0.0, 0.0, 0.0) if self.modes.arc_distance == 90.1 else begin
        words = [letter + self.numbers.length(centre[k] - origin[k], 1) for k, letter in _ARC_LETTERS[circle.plane]]
        turns = round(abs(circle.turns))
        return words + ([f"P{turns}"] if turns > 1 else [])
