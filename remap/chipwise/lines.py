# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves (mm) -> plain G0 G1 G2 G3 lines in program units, in chunks.  Pure.

Called by plans.py; glue/emit.py executes the lines, in G90 and G91.1: absolute XYZ, incremental I J.
"""

from typing import Iterable, Iterator, Sequence

from chipwise.errors import CycleError
from chipwise.moves import Arc, Line, Move, Rapid

DECIMALS = 6  # of a mm or an inch: arcs then close far inside LinuxCNC's 0.0283 mm and 0.1 %

# A chunk ends at the first place to rest after so many moves.  LinuxCNC takes 50,000 to 100,000 lines a second, and
# serves nobody meanwhile.
CHUNK_MOVES = 2000

# The most moves without a place to rest: a third of a second.
MOST_MOVES = 20_000


def _lines(moves: Iterable[Move], start: tuple, unit_mm: float) -> Iterator:
    """(move, text, feed in program units or None) of each move that moves."""
    scale = 1.0 / unit_mm
    x, y, z = (round(value * scale, DECIMALS) for value in start)
    for move in moves:
        was = (x, y, z)
        x, y, z = (old if new is None else round(new * scale, DECIMALS)
                   for old, new in zip(was, (move.x, move.y, move.z)))
        target = f"X{x:.{DECIMALS}f} Y{y:.{DECIMALS}f} Z{z:.{DECIMALS}f}"
        if isinstance(move, Arc):
            i, j = move.cx * scale - was[0], move.cy * scale - was[1]
            turns = f" P{move.turns}" if move.turns != 1 else ""
            yield (move, f"G{3 if move.ccw else 2} {target} I{i:.{DECIMALS}f} J{j:.{DECIMALS}f}{turns}",
                   move.feed * scale)
        elif (x, y, z) == was:
            continue
        elif isinstance(move, Line):
            yield move, f"G1 {target}", move.feed * scale
        elif isinstance(move, Rapid):
            yield move, f"G0 {target}", None
        else:
            raise TypeError(f"unknown move {move!r}")


def _may_rest(move: Move) -> bool:
    """Whether the tool may rest before a move: a traverse or a plunge, before which it is off the finished wall."""
    return isinstance(move, Rapid) or isinstance(move, Line) and move.x is None and move.y is None


def chunks(moves: Sequence[Move], start: tuple, unit_mm: float) -> tuple:
    """Tuple of chunks, each a tuple of (feed in program units or None: as it is, lines joined by "\\n").

    start    (x, y, z) mm before the first move
    unit_mm  mm of a program unit
    Raises CycleError for more than MOST_MOVES moves without a place where the tool may rest.
    """
    found: list[tuple] = []
    chunk: list[tuple] = []
    run: list[str] = []
    feed, count = None, 0
    for move, text, new_feed in _lines(moves, start, unit_mm):
        if count >= CHUNK_MOVES and _may_rest(move):
            chunk.append((feed, "\n".join(run)))
            found.append(tuple(chunk))
            chunk, run, feed, count = [], [], None, 0
        if new_feed is not None and new_feed != feed:
            if run:
                chunk.append((feed, "\n".join(run)))
            run, feed = [], new_feed
        run.append(text)
        count += 1
        if count > MOST_MOVES:
            raise CycleError(f"more than {MOST_MOVES} moves follow one another without a traverse or a plunge",
                             "use a contour of fewer elements, or a larger step")
    if run:
        chunk.append((feed, "\n".join(run)))
    return (*found, tuple(chunk)) if chunk else tuple(found)
