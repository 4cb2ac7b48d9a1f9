# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the program stopped: the first place whose cut is not done.  Called by run.py.

1. At a place p of the path, what is not done before it and what is done behind it speaks against it; the sum of both
   volumes has its least value where the program stopped.  The first place with the least value counts: moves that
   remove nothing do not count.
2. The journal's note has where the tool was.  A place of the path within OFF_MM of it, at the same time as [1], is the
   stop.  The note may be older or newer than the cells by AGE_S: the earlier of both counts, so that no cut is left
   out.
3. The kept stock is compared, cell by cell, with the one that the program leaves up to there (prove()), with tools that
   are a little larger for what must not be cut, and a little smaller for what must be. A cell in a wall that is cut in
   several parts can be lower after a smaller tool, so what is too much then has to be too much for the tool itself.
"""

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.program.records import RAPID
from chipwise.resume import stocks, walk

OFF_MM = 0.1  # of the stop from the path
AGE_S = 3.0  # of program time between the last cells and the note, at any override up to 2
SURE_MM3 = 1e-3  # of [1]
SLIVERS_MM3 = 0.02  # that are left on the walls of what is done
LEFT_MM3, LEFT_SHARE = 0.5, 1e-4  # of stock that may be there and is cut by the program, and share of what is cut
MISSING_SHARE = 2e-3  # of what is cut, and LEFT_MM3, that may be missing
DONE_SHARE = 0.1  # of what a part of the path cuts, that may be there still
MOST_BEHIND = 4  # segments
SLACK_MM = 0.05  # heights may differ by
ROUND_MM = 0.06  # by which the machine's path may be beside the program's: rounded corners


@dataclass
class Place:
    """segment and share of it; tip: where the machine stopped, if that is known, and off: mm from the path."""

    segment: int
    share: float
    tip: Optional[tuple] = None
    off: float = 0.0


def change(wanted, undone):
    """(first segment that is not done [1], first segment that still has something to cut).  Where nothing is left to
    cut, the second is the number of segments.  Where the stop is inside a segment, so that a part of it is left, the
    second is that segment, just before the first."""
    done_before = np.concatenate(([0.0], np.cumsum(np.minimum(undone, wanted))))
    left_behind = np.concatenate((np.cumsum(np.maximum(wanted - undone, 0.0)[::-1])[::-1], [0.0]))
    cost = done_before + left_behind
    first = int(np.flatnonzero(cost <= cost.min() + SURE_MM3)[0])
    if first and undone[first - 1] > SLIVERS_MM3 + DONE_SHARE * wanted[first - 1]:
        return first, first - 1
    still = np.cumsum(np.where(undone[first:] > 0.3 * wanted[first:], undone[first:], 0.0))
    behind = np.flatnonzero(still > SLIVERS_MM3)
    return first, first + int(behind[0]) if len(behind) else len(wanted)


def locate(path, program, found, wanted, undone):
    """The Place of a stocks.Kept.  Raises Unreadable."""
    first, behind = change(wanted, undone)
    if not (wanted - undone)[:first].sum() > SURE_MM3:
        raise Unreadable(
            "the kept stock is as the program begins: nothing of it is cut", "start the program from its beginning"
        )
    return _by_note(path, program, found, wanted, first, behind)


def check_left(path, program, wanted, undone, place):
    """Unreadable where nothing is left to cut behind a Place of locate()."""
    if change(wanted, undone)[1] == len(wanted) and not (program.kind[path.move[place.segment :]] != RAPID).any():
        raise Unreadable("everything that the program cuts is cut in the kept stock", "nothing is left to go on with")


def _by_note(path, program, found, wanted, first, behind):
    """The Place between two segments [2]."""
    note = found.note
    if note is None or not note.tip:
        return Place(min(first, behind), 0.0)
    near = walk.nearest(path, np.array(note.tip), OFF_MM)
    at = path.at
    tip = "X{:.3f} Y{:.3f} Z{:.3f} mm machine".format(*note.tip)
    if not near:
        off = min((n[2] for n in walk.nearest(path, np.array(note.tip), 1e9)), default=0.0)
        raise Unreadable(
            f"the tool stopped at {tip}, {off:.3g} mm off the program's path, more than {OFF_MM:g} mm",
            "see that the work offsets and the program are those of then, or say where to go on with --line N",
        )

    def apart(candidate):
        own = at[candidate[0]] + candidate[1] * path.seconds[candidate[0]]
        return max(at[min(first, behind)] - own, own - at[max(first, behind)], 0.0)

    fitting = [candidate for candidate in near if apart(candidate) <= AGE_S]
    if not fitting:
        raise Unreadable(
            f"the tool stopped at {tip}, where the program is not when the kept stock is as it is",
            "if the tool was moved by hand, say where to go on with --line N",
        )
    lines = [candidate for candidate in fitting if program.line[path.move[candidate[0]]] == note.line]
    inside = [candidate for candidate in lines or fitting if apart(candidate) == 0.0]
    best = min(inside or lines or fitting, key=lambda c: (apart(c), c[0] + c[1]))
    if best[0] + best[1] <= behind or _is_done(path, program, found, behind, best, wanted):
        return Place(best[0], best[1], note.tip, best[2])
    return Place(behind, 0.0, note.tip, best[2])


def _is_done(path, program, found, first, candidate, wanted):
    """Whether the kept stock is cut from the beginning of a segment to a candidate: the segment that the stop is in is
    done in part."""
    segment, share, _off = candidate
    if segment - first > MOST_BEHIND:
        return False
    stock, most = stocks.stock_of(found), SLIVERS_MM3 + DONE_SHARE * float(wanted[first : segment + 1].sum())
    left = float(walk.removed(path, stock, program, first, segment).sum()) + walk.cut_part(path, stock, segment, share)
    return left <= most


def before_older(path, wanted, undone, place):
    """The Place to go on from where some cells are older than others, because they are copied part by part: the
    beginning of the first cut that is not done completely, at most AGE_S of program time before `place`.  Without such
    a cut, the segment before."""
    last = min(change(wanted, undone)[0], place.segment)
    first = int(np.searchsorted(path.at, path.at[last] - AGE_S))
    left = np.flatnonzero(undone[first:last] > SLIVERS_MM3)
    return replace(place, segment=first + int(left[0]) if len(left) else max(last - 1, 0), share=0.0)


def prove(path, program, found, place, wanted):
    """Unreadable where the kept stock is not the one that the program leaves at a Place [3]."""
    ends = path.at[1:]
    late = min(len(ends), int(np.searchsorted(ends, ends[min(place.segment, len(ends) - 1)] + AGE_S)) + 1)
    own, later, area = stocks.heights(stocks.stock_of(found)), stocks.blank(found.head), found.head.cell**2
    walk.removed(walk.with_tools(path, ROUND_MM), later, program, 0, late)
    less = np.maximum(stocks.heights(later) - SLACK_MM - own, 0.0).sum() * area
    cut = float(wanted[: place.segment].sum())
    most = LEFT_MM3 + LEFT_SHARE * cut

    def above(tools):
        """mm of the kept stock above what tools leave."""
        stock = stocks.blank(found.head)
        walk.cut_to(tools, stock, program, place.segment, place.share)
        return np.maximum(own - SLACK_MM - stocks.heights(stock), 0.0)

    over = above(walk.with_tools(path, -ROUND_MM))
    if over.sum() * area > most:
        over = np.minimum(over, above(path))
    more = over.sum() * area
    causes = (
        "name the program that ran, unchanged, with the work offsets and tools of then, or say where to go on "
        "with --line N"
    )
    if less > LEFT_MM3 + MISSING_SHARE * cut:
        raise Unreadable(f"the kept stock is cut where the program has not cut up to there ({less:.1f} mm3)", causes)
    if more > most:
        raise Unreadable(f"the kept stock has {more:.1f} mm3 that the program has cut up to there", causes)


def back_by(path, place, seconds):
    """The Place some seconds of program time before another one."""
    at = path.at
    wanted = (
        at[place.segment]
        + (place.share * path.seconds[place.segment] if place.segment < len(path.move) else 0.0)
        - seconds
    )
    if wanted <= 0:
        return Place(0, 0.0)
    segment = int(np.searchsorted(at, wanted, side="right")) - 1
    return Place(
        segment, float(min(1.0, (wanted - at[segment]) / path.seconds[segment])) if path.seconds[segment] > 0 else 0.0
    )
