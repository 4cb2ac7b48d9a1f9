# SPDX-License-Identifier: GPL-2.0-or-later
"""Trials of one path: its points are shifted until the flutes are long enough, its corners rounded, its turned segments
bridged.

Called by flute.py, whose [2] and [3] this is.  Source: CN105492980 [0094]..[0115] (shift.py has the amounts).
Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Callable

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.check.simulate import SEGMENT_MM
from chipwise.rewrite import path_moves, sections
from chipwise.rewrite import shift
from chipwise.rewrite.cut_cache import PART_POINTS, Recut
from chipwise.rewrite.merge_moves import beside, with_fewer
from chipwise.rewrite.links import OVER_MM
from chipwise.rewrite.trial_proof import ALLOWED_MM

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats, Ints
    from chipwise.rewrite.flute import Ground
    from chipwise.rewrite.program import Program

LEFT_MM = 0.002  # smaller shifts are ignored
MOST_ROUNDS = 400  # of trials of one path; each raises some point
MOST_PROOFS = 20  # of one path
# by which paths are raised higher than is needed once the proof has found one too deep: what check and the next level
# read of a slope is a little more
RESERVE_MM = 0.06
GOUGE_MM3 = 1e-3  # what a bridge may take of the part


class Trials:
    """Of one path: a path_moves.Body in the stock of a flute.Ground as it is.  lead_in: cuts the moves that lead to a
    path (n, 3); limit: mm, depth up to which the flutes are used; more: mm by which what is deeper is raised higher
    than that."""

    def __init__(
        self,
        program: Program,
        body: path_moves.Body,
        ground: Ground,
        lead_in: Callable[[Floats], None],
        limit: float,
        more: float,
    ) -> None:
        self.program, self.body, self.lead_in = program, body, lead_in
        self.stock, self.tool, self.sought = ground.stock, ground.tool, ground.proof
        self.limit, self.more = limit, more
        self.bridged = 0  # points of the path that was found
        self.proofs = 0
        self.window = ground.window(body.points)
        self.recut = Recut(self.stock, self.tool.shape)
        self.s = shift.along(body.points)

    def shifted(self, radius: float, target: sections.Window | None = None, depth: Floats | None = None) -> Floats:
        """The shifted path, which is cut: (n, 3) points, NaN where they are left out (_path()).

        radius: of corners; depth: what the path has met, if that is known; target: Window of what the first path
        leaves, if there may be bridges.
        """
        points, window = self.body.points, self.window
        if depth is None:
            self.lead_in(points)
            depth = self.stock.cut(self.tool.shape, points[0], points[1:])["depth"]
            window.restore()
        air = depth <= OVER_MM
        need, dropped = np.full(len(points), -np.inf), np.zeros(len(points), bool)
        self._raise_first(need, dropped, depth)
        tried: set[int] = set()
        moved = None
        for _ in range(MOST_ROUNDS):
            if moved is None:
                amount = shift.held(self.s, np.maximum(need - points[:, 2], 0.0), air)
                moved = shift.shifted(points, shift.rounded(self.s, amount, radius))
            path, new = self._path(moved, dropped), None
            chords, spans = self._written(path)
            too_low = self._too_low_as_written(chords, spans)
            if not too_low and not dropped.any():
                too_low = self._too_low_proved(chords, spans, need, dropped)
            if not too_low:
                new = self._bridges(moved, dropped, tried, target) if target is not None else None
            if not too_low and new is None and dropped.any() and self._too_low_proved(chords, spans, need, dropped):
                new, target = np.zeros_like(dropped), None  # bridges have left what is met now: none then
            if too_low:
                _raise(need, dropped, *too_low)
                moved = None
            elif new is None:
                self.sought.keep()
                self.bridged = int(dropped.sum())
                return path
            else:
                dropped = new
            window.restore()
        raise Unreadable(
            "the flutes are too short, and the path cannot be shifted so that they reach",
            "take smaller steps in Z, or a tool with longer flutes",
            int(self.program.line[self.body.move[0]]),
        )

    def _raise_first(self, need: Floats, dropped: Bools, depth: Floats) -> None:
        """Both ends of each segment of the first path that meets too much; depth (n - 1,): what they meet."""
        z, over = self.body.points[:, 2], depth - self.limit
        k = np.flatnonzero(over > ALLOWED_MM)
        if len(k):
            _raise(need, dropped, k, k + 1, np.minimum(z[k], z[k + 1]) + over[k] + self.more)

    def _path(self, moved: Floats, dropped: Bools) -> Floats:
        """(n, 3): the path that is written; points that are bridged or left out are NaN."""
        path = moved.copy()
        path[dropped] = np.nan
        return with_fewer(self.program, self.body, path, beside(self.tool.shape))

    def _written(self, path: Floats) -> tuple[Floats, Ints]:
        """(chords (n, 3), spans (n - 1, 2)): a path as it will be read back; first and last point that each chord goes
        to."""
        moves, spans = path_moves.moves_along(self.program, self.body, path)
        chords, owner = path_moves.polyline(path[0], moves)
        return self.program.as_written(chords, int(self.program.step[self.body.move[0]])), spans[owner]

    def _too_low_as_written(self, chords: Floats, spans: Ints) -> tuple[Ints, Ints, Floats] | None:
        """Cuts a path as it will be read back; -> (first point, last point, Z (k,)) that they must not be below where
        it is too deep, None:  nowhere."""
        self.window.restore()
        points, piece = sections.pieces(chords, SEGMENT_MM)
        spans = spans[piece]
        self.lead_in(points)
        over = self.recut.depths(points[0], points[1:], spans[:, 1] // PART_POINTS) - self.limit
        low, at = np.minimum(points[:-1, 2], points[1:, 2]), shift.along(points)
        k = np.flatnonzero(over > ALLOWED_MM)
        if not len(k):
            return None
        first, last = self._between(spans[k], at[k], at[k + 1])
        return first, last, low[k] + over[k] + self.more

    def _between(self, spans: Ints, begin: Floats, end: Floats) -> Ints:
        """(first, last), each (k,): the points round begin .. end (k,) mm along the path, which are between those of
        spans (k, 2)."""
        bounds = []
        for span, a, b in zip(spans.tolist(), begin, end):
            own = self.s[span[0] : span[1] + 1]
            bounds.append(
                (
                    max(span[0] + int(own.searchsorted(a, side="right")) - 1, span[0]),
                    min(span[0] + int(own.searchsorted(b, side="left")), span[1]),
                )
            )
        return np.array(bounds).T

    def _too_low_proved(
        self, chords: Floats, spans: Ints, need: Floats, dropped: Bools
    ) -> tuple[Ints, Ints, Floats] | None:
        """The same without needles: trial_proof.py; what no raising of points helps is left to the repeats."""
        self.proofs += 1
        found = self.sought.too_deep(self.tool, chords)
        if not len(found) or self.proofs > MOST_PROOFS:
            return None
        self.more = RESERVE_MM
        at, move = shift.along(chords), found["move"]
        place = at[move] + found["at"] * (at[move + 1] - at[move])
        first, last = self._between(spans[move], place, place)
        z = found["height"] - self.limit + self.more
        helps = (need[first] < z) | (need[last] < z) | dropped[first] | dropped[last]
        return (first[helps], last[helps], z[helps]) if helps.any() else None

    def _bridges(self, moved: Floats, dropped: Bools, tried: set[int], target: sections.Window) -> Bools | None:
        """[0101]..[0103]: points to drop besides; None where there are none that may go."""
        points, kept = self.body.points, np.flatnonzero(~dropped)
        sharp = kept[shift.turned_points(points[kept], moved[kept])]
        raised = moved[sharp, 2] > points[sharp, 2] + LEFT_MM
        turned = [int(k) for k in sharp[raised] if int(k) not in tried]
        if not turned:
            return None
        tried.update(turned)
        new = dropped.copy()
        new[turned] = True
        return new if not self._interferes(moved, new, target) else self._bridges(moved, dropped, tried, target)

    def _interferes(self, moved: Floats, dropped: Bools, target: sections.Window) -> bool:
        """Whether a bridge would cut into what the first path leaves."""
        now = target.swapped()
        index, gouged = np.flatnonzero(~dropped), False
        gaps = np.flatnonzero(np.diff(index) > 1)
        for a, b in zip(index[gaps], index[gaps + 1]):
            met = self.stock.cut(self.tool.shape, moved[a], moved[b][None])
            gouged = gouged or bool(met["volume"][0] > GOUGE_MM3 and met["depth"][0] > OVER_MM)
        now.restore()
        return gouged


def _raise(need: Floats, dropped: Bools, first: Ints, last: Ints, z: Floats) -> None:
    """Points first .. last, each (k,), must not be below z (k,); those of a bridge that is too deep are points of the
    path again."""
    for at in range(int((last - first).max()) + 1):
        own = last - first >= at
        np.maximum.at(need, first[own] + at, z[own])
        dropped[first[own] + at] = False
