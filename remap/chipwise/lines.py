# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves (mm) -> plain G0 G1 G2 G3 lines in program units, in chunks.  Pure.

Called by plans.py; glue/emit.py executes the lines, in G90 and G91.1: absolute XYZ, incremental I J K; it begins and ends in G17.
"""

from typing import Iterable, Iterator, Optional, Sequence

from chipwise.errors import CycleError
from chipwise.moves import Arc, Code, Line, Move, PlaneArc, Rapid

DECIMALS = 6  # of a mm or an inch: arcs then close far inside LinuxCNC's 0.0283 mm and 0.1 %

_CENTRE = {"G17": ((0, "I"), (1, "J")), "G18": ((0, "I"), (2, "K")), "G19": ((1, "J"), (2, "K"))}

# A chunk ends at the first place to rest after so many moves.  LinuxCNC takes 50,000 to 100,000 lines a second, and
# serves nobody meanwhile.
CHUNK_MOVES = 2000

# The most moves without a place to rest: a third of a second.
MOST_MOVES = 20_000


def _lines(moves: Iterable[Move], start: tuple, unit_mm: float, decimals: int = DECIMALS) -> Iterator:
    """(move, text, feed in program units or None) of each move that moves, and of each Code."""
    scale, plane = 1.0 / unit_mm, "G17"
    at = tuple(round(value * scale, decimals) for value in start)
    for move in moves:
        if isinstance(move, Code):
            yield move, move.text, None
            continue
        was = x, y, z = at
        new_x, new_y, new_z = move.end if isinstance(move, PlaneArc) else (move.x, move.y, move.z)
        if new_x is not None:
            x = round(new_x * scale, decimals)
        if new_y is not None:
            y = round(new_y * scale, decimals)
        if new_z is not None:
            z = round(new_z * scale, decimals)
        at = x, y, z
        target = f"X{x:.{decimals}f} Y{y:.{decimals}f} Z{z:.{decimals}f}"
        if isinstance(move, (Arc, PlaneArc)):
            own = move.plane if isinstance(move, PlaneArc) else "G17"
            centre = move.centre if isinstance(move, PlaneArc) else (move.cx, move.cy)
            words = " ".join(f"{letter}{centre[k] * scale - was[k]:.{decimals}f}" for k, letter in _CENTRE[own])
            turns = f" P{move.turns}" if move.turns != 1 else ""
            yield move, f"{own + ' ' if own != plane else ''}G{3 if move.ccw else 2} {target} {words}{turns}", move.feed * scale
            plane = own
        elif isinstance(move, Rapid) and move.abc is not None:
            turn = " ".join(f"{letter}{value:.6f}" for letter, value in zip("ABC", move.abc))
            yield move, f"G0 {target} {turn}", None
        elif at == was:
            continue
        elif isinstance(move, Line):
            yield move, f"G1 {target}", move.feed * scale
        elif isinstance(move, Rapid):
            yield move, f"G0 {target}", None
        else:
            raise TypeError(f"unknown move {move!r}")


def texts(moves: Sequence[Move], start: tuple, unit_mm: float, decimals: int) -> Iterator[str]:
    """The lines of a program, with F on each line that changes the feed."""
    active: Optional[float] = None
    for _move, text, feed in _lines(moves, start, unit_mm, decimals):
        yield text if feed is None or feed == active else f"{text} F{feed:.4f}".rstrip("0").rstrip(".")
        active = active if feed is None else feed


def _may_rest(move: Move) -> bool:
    """Whether the tool may rest before a move: a traverse or a plunge, before which it is off the finished wall."""
    return isinstance(move, Rapid) or isinstance(move, Line) and move.x is None and move.y is None


def chunks(moves: Sequence[Move], start: tuple, unit_mm: float, decimals: int = DECIMALS) -> tuple:
    """Tuple of chunks, each a tuple of rows: (feed in program units or None: as it is, lines joined by "\\n"), and the line of the
    program if it is not the cycle's.

    start    (x, y, z) mm before the first move
    unit_mm  mm of a program unit
    Raises CycleError for more than MOST_MOVES moves without a place where the tool may rest.
    """
    found: list[tuple] = []
    rows = _Rows()
    count = 0
    for move, text, feed in _lines(moves, start, unit_mm, decimals):
        if count >= CHUNK_MOVES and _may_rest(move):
            found.append(rows.taken())
            count = 0
        rows.add(text, feed, move.line)
        count += 1
        if count > MOST_MOVES:
            raise CycleError(f"more than {MOST_MOVES} moves follow one another without a traverse or a plunge",
                             "use a contour of fewer elements, or a larger step")
    last = rows.taken()
    return (*found, last) if last else tuple(found)


class _Rows:
    """The rows of one chunk under way."""

    def __init__(self) -> None:
        self._rows: list[tuple] = []
        self._texts: list[str] = []
        self._feed: Optional[float] = None
        self._line = 0

    def add(self, text: str, feed: Optional[float], line: int) -> None:
        """One more line; a new feed or line number begins a new row."""
        if feed is None:
            feed = self._feed
        if feed != self._feed or line != self._line:
            self._close()
            self._feed, self._line = feed, line
        self._texts.append(text)

    def _close(self) -> None:
        if self._texts:
            self._rows.append((self._feed, "\n".join(self._texts), *([self._line] if self._line else [])))
            self._texts = []

    def taken(self) -> tuple:
        """The chunk; a new one begins."""
        self._close()
        rows = tuple(self._rows)
        self._rows, self._feed, self._line = [], None, 0
        return rows
