# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves (mm) -> plain G0 G1 G2 G3 lines in program units, in chunks.  Pure.

Called by planner/plans.py; glue/emit.py executes the lines, in G90, G91.1 and G8: absolute XYZ, incremental I J K; it
begins and ends in G17.
"""

import math
from typing import Iterable, Iterator, Optional, Sequence, Union

from chipwise.moves import CALLERS_PATH, PATH, Arc, Blend, Code, Copy, Line, Move, PlaneArc, Rapid, Thread

DECIMALS = 6  # of a mm or an inch: arcs then close far inside LinuxCNC's 0.0283 mm and 0.1 %
AXES = "XYZABC"

# LinuxCNC refuses an arc whose radius is below 0.00005 inch (interp_arc.cc: Zero-radius arc).  mm; the rounding of an
# inch's decimals is in it.
LEAST_RADIUS = 0.0014

# Ends of an arc within this, mm, are one place, and the arc is a whole turn.  LinuxCNC makes one of it as soon as the
# ends that are written are equal.
ONE_PLACE = 1e-7

_CENTRE = {"G17": ((0, "I"), (1, "J")), "G18": ((0, "I"), (2, "K")), "G19": ((1, "J"), (2, "K"))}

# A chunk ends at the first place to rest after so many moves.  LinuxCNC takes 50,000 to 100,000 lines a second, and
# serves nobody meanwhile.
CHUNK_MOVES = 2000

# After so many moves without a place to rest, a third of a second, the tool rests on the path: at the first corner,
# where it slows down in any case, after CORNER_MOVES fewer.
MOST_MOVES, CORNER_MOVES = 20_000, 5_000

# A turn of the path, rad, from which it is a corner.
CORNER = 0.5


def path_text(code: float, tolerance: Optional[float], naive: Optional[float], unit_mm: float) -> str:
    """The line of a path mode: 61, 61.1 or 64, and the tolerances P and Q of G64 in mm, None without the word."""
    if code != 64:
        return f"G{code:g}"
    return "G64" + "".join(
        f" {letter}{value / unit_mm:.9f}" for letter, value in (("P", tolerance), ("Q", naive)) if value is not None
    )


class _Writer:
    """Writes moves in program units: % formats, and the numbers for them.  The numbers of a move are x, y, z of its
    end, and i, j, k of an arc."""

    def __init__(self, unit_mm: float, decimals: int, axes: str) -> None:
        self.scale, self.decimals, self._axes = 1.0 / unit_mm, decimals, axes
        self.ends = tuple(k for k, letter in enumerate("XYZ") if letter != "Y" or "Y" in axes)
        self._place = " ".join(f"{'XYZ'[k]}%.{decimals}f" for k in self.ends)
        self._centre = {
            plane: f" {first}%.{decimals}f {second}%.{decimals}f"
            for plane, ((_a, first), (_b, second)) in _CENTRE.items()
        }
        self._sheets: dict[tuple, _Sheet] = {}

    def _target(self, abc: Optional[tuple]) -> str:
        """The words of a place, and of the degrees of A, B and C."""
        if abc is None:
            return self._place
        return self._place + "".join(
            f" {letter}{value:.6f}" for letter, value in zip("ABC", abc) if letter in self._axes
        )

    def straight(self, move: Move) -> tuple:
        """(format, feed in program units or None)."""
        if isinstance(move, Line):
            return "G1 " + self._target(move.abc), move.feed * self.scale
        if isinstance(move, Rapid):
            return "G0 " + self._target(move.abc), None
        if isinstance(move, Thread):
            return f"G33 {self._target(move.abc)} K{move.pitch * self.scale:.9f}", None
        raise TypeError(f"unknown move {move!r}")

    def arc(self, move: Union[Arc, PlaneArc], plane: str) -> tuple:
        """(format, feed in program units, its plane, which two of X, Y and Z its centre has) after that plane."""
        own = move.plane if isinstance(move, PlaneArc) else "G17"
        (a, _first), (b, _second) = _CENTRE[own]
        turns = f" P{move.turns}" if move.turns != 1 else ""
        return (
            f"{own + ' ' if own != plane else ''}G{3 if move.ccw else 2} "
            f"{self._target(move.abc)}{self._centre[own]}{turns}",
            move.feed * self.scale,
            own,
            (a, b),
        )

    def sheet(self, moves: tuple, plane: str, turned: Optional[tuple]) -> "_Sheet":
        """The _Sheet of the moves of a Copy, after that plane and those degrees."""
        key = id(moves), plane, turned
        if key not in self._sheets:
            self._sheets[key] = self._made(moves, plane, turned)
        return self._sheets[key]

    def _made(self, moves: tuple, plane: str, turned: Optional[tuple]) -> "_Sheet":
        parts: list[tuple] = []
        moving: list[int] = []
        turning: list[bool] = []
        for k, move in enumerate(moves):
            if isinstance(move, Code):
                parts.append((move, move.text.replace("%", "%%"), None, ()))
                continue
            columns: tuple = self.ends
            if isinstance(move, (Arc, PlaneArc)):
                text, feed, plane, centre = self.arc(move, plane)
                columns += tuple(3 + axis for axis in centre)
            else:
                text, feed = self.straight(move)
            parts.append((move, text, feed, tuple(6 * len(moving) + column for column in columns)))
            turning.append(len(columns) > len(self.ends) or turned != move.abc)
            moving.append(k)
            turned = move.abc
        return _Sheet(moves, parts, moving, turning, plane, turned)


class _Sheet:
    """The lines of all Copies of the same moves: made once, filled in for each."""

    def __init__(
        self, moves: tuple, parts: list, moving: list, turning: list, plane: str, turned: Optional[tuple]
    ) -> None:
        """parts: (move, format, feed, indices of its numbers) of each; moving: indices of those that are not Codes;
        turning: which of these are written even if they end where they begin; plane, turned: at their end."""
        self.moves, self._parts, self._moving, self._turning, self.plane, self.turned = (
            moves,
            parts,
            moving,
            turning,
            plane,
            turned,
        )
        self._filled: dict[bytes, tuple] = {}

    def lines(self, copy: Copy, writer: _Writer, here: tuple) -> tuple:
        """([(move, text, feed)], (x, y, z) at the end in program units) of a Copy that begins at here."""
        numbers = copy.places[self._moving] * writer.scale
        ends = numbers[:, :3].round(writer.decimals)
        numbers[1:, 3:] -= ends[:-1]
        numbers[0, 3:] -= here
        still = (ends[1:] == ends[:-1]).all(axis=1)
        written = [
            turns or not stays for turns, stays in zip(self._turning, [bool((ends[0] == here).all()), *still.tolist()])
        ]
        which = bytes(written)
        if which not in self._filled:
            self._filled[which] = self._form(written)
        form, index, moves, feeds = self._filled[which]
        text = form % tuple(numbers.ravel()[index].tolist())
        return zip(moves, text.split("\n"), feeds), tuple(ends[-1].tolist())

    def _form(self, written: list) -> tuple:
        """(format of all lines, indices of their numbers, moves, feeds) of the Codes and of those that are written."""
        skipped = {k for k, write in zip(self._moving, written) if not write}
        kept = [part for k, part in enumerate(self._parts) if k not in skipped]
        return (
            "\n".join(part[1] for part in kept),
            [k for part in kept for k in part[3]],
            [part[0] for part in kept],
            [part[2] for part in kept],
        )


def _lines(
    moves: Iterable[Union[Move, Copy]], start: tuple, unit_mm: float, decimals: int = DECIMALS, axes: str = AXES
) -> Iterator:
    """(move, text, feed in program units or None) of each move that moves, and of each Code and Blend."""
    writer = _Writer(unit_mm, decimals, axes)
    scale, plane, turned, has_y = writer.scale, "G17", None, len(writer.ends) == 3
    x, y, z = (round(value * scale, decimals) for value in start)
    place = start  # mm, without rounding
    for move in moves:
        if isinstance(move, Code):
            yield move, move.text, None
            continue
        if isinstance(move, Blend):
            yield move, CALLERS_PATH if move.tolerance is None else path_text(64, move.tolerance, None, unit_mm), None
            continue
        if isinstance(move, Copy):
            sheet = writer.sheet(move.moves, plane, turned)
            lines, (x, y, z) = sheet.lines(move, writer, (x, y, z))
            yield from lines
            plane, turned, place = sheet.plane, sheet.turned, (x / scale, y / scale)
            continue
        was, was_turned, turned = (x, y, z), turned, move.abc
        new_x, new_y, new_z = move.end if isinstance(move, PlaneArc) else (move.x, move.y, move.z)
        if new_x is not None:
            x = round(new_x * scale, decimals)
        if new_y is not None:
            y = round(new_y * scale, decimals)
        if new_z is not None:
            z = round(new_z * scale, decimals)
        numbers = (x, y, z) if has_y else (x, z)
        if isinstance(move, Arc) and _cannot_be_an_arc(move, place, was, (x, y), scale):
            for line, ends in _straight(move, was, (x, y, z), scale, decimals):
                text, feed = writer.straight(line)
                yield line, text % ends, feed
        elif isinstance(move, (Arc, PlaneArc)):
            text, feed, plane, (a, b) = writer.arc(move, plane)
            centre = move.centre if isinstance(move, PlaneArc) else (move.cx, move.cy)
            yield move, text % (*numbers, centre[a] * scale - was[a], centre[b] * scale - was[b]), feed
        elif was != (x, y, z) or was_turned != turned:
            text, feed = writer.straight(move)
            yield move, text % numbers, feed
        place = (place[0] if new_x is None else new_x, place[1] if new_y is None else new_y)


def _cannot_be_an_arc(arc: Arc, place: tuple, was: tuple, end: tuple, scale: float) -> bool:
    """Whether LinuxCNC would refuse an arc from a place (mm), or make a whole turn of it.  was, end: as written."""
    if abs(arc.cx - place[0]) < LEAST_RADIUS and abs(arc.cy - place[1]) < LEAST_RADIUS:
        return min(math.dist(p, (arc.cx * scale, arc.cy * scale)) for p in (was[:2], end)) < LEAST_RADIUS * scale
    return was[:2] == end and arc.turns == 1 and math.dist(place[:2], (arc.x, arc.y)) > ONE_PLACE


def _straight(arc: Arc, was: tuple, end: tuple, scale: float, decimals: int) -> Iterator[tuple]:
    """(Line, its end as written) of straight moves in place of an arc: one, or one for each quarter of a turn begun."""
    centre = (arc.cx * scale, arc.cy * scale)
    radius, first = math.dist(was[:2], centre), math.atan2(was[1] - centre[1], was[0] - centre[0])
    sign, count = (1.0 if arc.ccw else -1.0), 1
    turn = sign * (math.atan2(end[1] - centre[1], end[0] - centre[0]) - first) % (2.0 * math.pi)
    if radius < LEAST_RADIUS * scale:
        turn = turn or 2.0 * math.pi
        count = math.ceil(2.0 * turn / math.pi)
    here = was
    for k in range(1, count + 1):
        angle = first + sign * turn * k / count
        x, y = centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)
        z = was[2] + (end[2] - was[2]) * k / count
        there = end if k == count else (round(x, decimals), round(y, decimals), round(z, decimals))
        if there != here:
            x, y, z = there
            yield Line(x / scale, y / scale, z / scale, arc.feed, arc.line, arc.abc), there
        here = there


def texts(moves: Sequence[Union[Move, Copy]], start: tuple, unit_mm: float, decimals: int, path: str) -> Iterator[str]:
    """The lines of a program, with F on each line that changes the feed.  path: the line of its path mode, which a
    Blend(None) is."""
    active: Optional[float] = None
    for _move, text, feed in _lines(moves, start, unit_mm, decimals):
        text = path if text == CALLERS_PATH else text
        yield text if feed is None or feed == active else f"{text} F{feed:.4f}".rstrip("0").rstrip(".")
        active = active if feed is None else feed


def _may_rest(move: Move) -> bool:
    """Whether the tool may rest before a move: a traverse or a plunge, before which it is off the finished wall."""
    return isinstance(move, Rapid) or isinstance(move, Line) and move.x is None and move.y is None


class _Corners:
    """The turns of a path in XY.  Those of a Copy are the turns of the moves it is made of."""

    def __init__(self, start: tuple) -> None:
        self._at = start[:2]
        self._heading: Optional[tuple] = None

    def turn(self, move: Union[Rapid, Line, Thread, Arc, PlaneArc]) -> float:
        """rad from the moves so far into this one; 0 where either has no direction in XY.  Called for each move."""
        (x, y), before, turn = self._at, self._heading, 0.0
        end = (x if move.x is None else move.x, y if move.y is None else move.y)
        first = last = (end[0] - x, end[1] - y)
        if isinstance(move, Arc):
            side = 1.0 if move.ccw else -1.0
            first, last = ((side * (move.cy - b), side * (a - move.cx)) for a, b in (self._at, end))
        if before is not None and any(first):
            turn = abs(
                math.atan2(before[0] * first[1] - before[1] * first[0], before[0] * first[0] + before[1] * first[1])
            )
        self._at, self._heading = end, last if any(last) else before
        return turn


def chunks(
    moves: Sequence[Union[Move, Copy]], start: tuple, unit_mm: float, decimals: int = DECIMALS, axes: str = AXES
) -> tuple:
    """Tuple of chunks, each a tuple of rows: (feed in program units or None: as it is, lines joined by "\\n"), and the
    line of the program if it is not the cycle's.  Each chunk sets the path mode and the plane that its moves have:
    between two of them the caller's path mode and G17 are in force.

    start    (x, y, z) mm before the first move
    unit_mm  mm of a program unit
    axes     letters of the machine's axes
    After MOST_MOVES moves without a place where the tool may rest it rests on the path, if it can at a corner shortly
    before.
    """
    found: list[tuple] = []
    rows, corners = _Rows(), _Corners(start)
    count, path, plane = 0, "", "G17"
    for move, text, feed in _lines(moves, start, unit_mm, decimals, axes):
        turn = 0.0 if isinstance(move, (Code, Blend)) else corners.turn(move)
        long = isinstance(move, (Line, Arc, PlaneArc)) and count >= MOST_MOVES - (CORNER_MOVES if turn > CORNER else 0)
        if count >= CHUNK_MOVES and (long or _may_rest(move)):
            found.append(rows.taken())
            count = 0
            for mode in filter(None, (path, plane if plane != "G17" else "")):
                rows.add(mode, None, move.line)
        if text.startswith(PATH) and isinstance(move, (Code, Blend)):
            path = "" if text == CALLERS_PATH else text
        plane = text[:3] if text[:3] in _CENTRE else plane
        rows.add(text, feed, move.line)
        count += 1
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
