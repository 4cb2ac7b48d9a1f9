# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves (mm) -> plain G0 G1 G2 G3 lines in program units, in chunks.  Pure.

Called by plans.py; glue/emit.py executes the lines, in G90, G91.1 and G8: absolute XYZ, incremental I J K; it begins and ends in G17.
"""

from typing import Iterable, Iterator, Optional, Sequence

from chipwise.errors import CycleError
from chipwise.moves import CALLERS_PATH, PATH, Arc, Code, Line, Move, PlaneArc, Rapid, Thread

DECIMALS = 6  # of a mm or an inch: arcs then close far inside LinuxCNC's 0.0283 mm and 0.1 %
AXES = "XYZABC"

_CENTRE = {"G17": ((0, "I"), (1, "J")), "G18": ((0, "I"), (2, "K")), "G19": ((1, "J"), (2, "K"))}

# A chunk ends at the first place to rest after so many moves.  LinuxCNC takes 50,000 to 100,000 lines a second, and
# serves nobody meanwhile.
CHUNK_MOVES = 2000

# The most moves without a place to rest: a third of a second.
MOST_MOVES = 20_000


def path_text(code: float, tolerance: Optional[float], naive: Optional[float], unit_mm: float) -> str:
    """The line of a path mode: 61, 61.1 or 64, and the tolerances P and Q of G64 in mm, None without the word."""
    if code != 64:
        return f"G{code:g}"
    return "G64" + "".join(f" {letter}{value / unit_mm:.9f}" for letter, value in (("P", tolerance), ("Q", naive)) if value is not None)


def _place(decimals: int, axes: str) -> str:
    """The words of a place: a % format of x, y, z; of x, z on a machine without Y."""
    return " ".join(f"{letter}%.{decimals}f" for letter in "XYZ" if letter != "Y" or "Y" in axes)


def _angles(abc: tuple, axes: str) -> str:
    """The words of degrees of A, B and C, each after a blank."""
    return "".join(f" {letter}{value:.6f}" for letter, value in zip("ABC", abc) if letter in axes)


def _lines(moves: Iterable[Move], start: tuple, unit_mm: float, decimals: int = DECIMALS, axes: str = AXES) -> Iterator:
    """(move, text, feed in program units or None) of each move that moves, and of each Code."""
    scale, plane, turned = 1.0 / unit_mm, "G17", None
    place, has_y, centres = _place(decimals, axes), "Y" in axes, f" %s%.{decimals}f %s%.{decimals}f"
    x, y, z = (round(value * scale, decimals) for value in start)
    for move in moves:
        if isinstance(move, Code):
            yield move, move.text, None
            continue
        was, was_turned, turned = (x, y, z), turned, move.abc
        new_x, new_y, new_z = move.end if isinstance(move, PlaneArc) else (move.x, move.y, move.z)
        if new_x is not None:
            x = round(new_x * scale, decimals)
        if new_y is not None:
            y = round(new_y * scale, decimals)
        if new_z is not None:
            z = round(new_z * scale, decimals)
        target = place % ((x, y, z) if has_y else (x, z))
        if turned is not None:
            target += _angles(turned, axes)
        if isinstance(move, (Arc, PlaneArc)):
            own, centre = (move.plane, move.centre) if isinstance(move, PlaneArc) else ("G17", (move.cx, move.cy))
            (a, first), (b, second) = _CENTRE[own]
            words = centres % (first, centre[a] * scale - was[a], second, centre[b] * scale - was[b])
            turns = f" P{move.turns}" if move.turns != 1 else ""
            yield move, f"{own + ' ' if own != plane else ''}G{3 if move.ccw else 2} {target}{words}{turns}", move.feed * scale
            plane = own
        elif was == (x, y, z) and was_turned == turned:
            continue
        elif isinstance(move, Thread):
            yield move, f"G33 {target} K{move.pitch * scale:.9f}", None
        elif isinstance(move, Line):
            yield move, "G1 " + target, move.feed * scale
        elif isinstance(move, Rapid):
            yield move, "G0 " + target, None
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


def chunks(moves: Sequence[Move], start: tuple, unit_mm: float, decimals: int = DECIMALS, axes: str = AXES) -> tuple:
    """Tuple of chunks, each a tuple of rows: (feed in program units or None: as it is, lines joined by "\\n"), and the line of the
    program if it is not the cycle's.  Each chunk sets the path mode that its moves have: between two of them the caller's is in force.

    start    (x, y, z) mm before the first move
    unit_mm  mm of a program unit
    axes     letters of the machine's axes
    Raises CycleError for more than MOST_MOVES moves without a place where the tool may rest.
    """
    found: list[tuple] = []
    rows = _Rows()
    count, path = 0, ""
    for move, text, feed in _lines(moves, start, unit_mm, decimals, axes):
        if count >= CHUNK_MOVES and _may_rest(move):
            found.append(rows.taken())
            count = 0
            if path:
                rows.add(path, None, move.line)
        if text.startswith(PATH) and isinstance(move, Code):
            path = "" if text == CALLERS_PATH else text
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
