# SPDX-License-Identifier: GPL-2.0-or-later
"""Shifted paths with fewer moves: of those that are short and on one line across the tool's axis, one takes the place
of many.

Called by trials.py.  A path that is shifted need not be followed to the last digit: it may be a little higher, never
lower, and never beside.  Points that are where the first path is stay, all of them.  Lengths mm, machine coordinates of
the tool's tip.

 1. A *run* is a part of the path between two points that stay, whose points inside have been shifted; straight steps of
    lines one behind the other, with one F and no comments, each of which goes on where the one before goes, to beside()
    mm.
 2. Over a run, components/offline/chain_fit.c finds as few points as a band of HIGHER_MM above the path allows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterator

import numpy as np

from chipwise.clib.chain_fit import fitted
from chipwise.rewrite import shift

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.clib.height_map import Shape
    from chipwise.rewrite.path_moves import Body
    from chipwise.rewrite.program import Program

HIGHER_MM = 0.01  # than the shifted path: a sixth of the flutes' reserve (trials.py)
# of a line: the rounding of programs in three digits; less than depth_proof.h allows beside an earlier level
BESIDE_MM = 1e-3
BESIDE_ROUND_MM = 4e-4  # the same of tools that are not flat
LEAST = 4  # segments of a run


def beside(shape: Shape) -> float:
    """mm by which the path of a tool of this Shape may be beside a line."""
    return BESIDE_ROUND_MM if shape.corner_radius or shape.tip_angle else BESIDE_MM


def with_fewer(program: Program, body: Body, path: Floats, most: float) -> Floats:
    """The path of an along.Body (n, 3), NaN where it is bridged, with NaN also at points that are left out; others may
    be higher for it.

    most: mm beside a line."""
    result, s = path.copy(), shift.along(body.points)
    for a, b in _runs(_joined(program, body, path, most)):
        for first, last in _lines(path, a, b, most):
            z = path[first : last + 1, 2]
            kept, height, _arcs = fitted(s[first : last + 1], z, z + HIGHER_MM)
            result[first : last + 1, 2] = np.nan
            result[first + kept, 2] = height
    return result


def _joined(program: Program, body: Body, path: Floats, most: float) -> Bools:
    """(n,) bool: points of a path that may go: shifted, within a line [1]."""
    step, line = program.step[body.move], program.places[body.move]
    with np.errstate(invalid="ignore"):  # bridged
        may = path[:, 2] > body.points[:, 2] + 1e-9
        d = np.diff(path[:, :2], axis=0)
        a, b = d[:-1], d[1:]
        off = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / np.maximum(np.sqrt(((a + b) ** 2).sum(axis=1)), 1e-12)
        on = ((a * b).sum(axis=1) > 0.0) & (off <= most)
    there, straight, feed = ~np.isnan(path[:, 2]), program.circle[step] < 0, program.feed[body.move]
    remark = program.remarks[np.minimum(line[1:], len(program.remarks) - 1)]  # lines of subs in other files are beyond
    same = ((np.diff(line) == 1) & ~remark) | (np.diff(step) == 0)
    may[[0, -1]] = False
    may[1:-1] &= on & there[:-2] & there[2:] & straight[:-1] & straight[1:] & same & (feed[:-1] == feed[1:])
    return may


def _runs(may: Bools) -> Iterator[tuple[int, int]]:
    """[(first, last)]: the points that stay round those of `may` (n,) bool that follow one another, where there are
    enough."""
    edge = np.diff(may.astype(np.int8))
    first, last = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0) + 1
    own = last - first >= LEAST
    return zip(first[own].tolist(), last[own].tolist())


def _lines(path: Floats, first: int, last: int, most: float) -> Iterator[tuple[int, int]]:
    """Yield (first, last): the parts of a run of points whose points are all on a line."""
    waiting = [(first, last)]
    while waiting:
        a, b = waiting.pop()
        if b - a < LEAST:
            continue
        along, p = path[b, :2] - path[a, :2], path[a : b + 1, :2] - path[a, :2]
        off = np.abs(along[0] * p[:, 1] - along[1] * p[:, 0])
        worst = int(off.argmax())
        if off[worst] <= most * np.hypot(*along):
            yield a, b
        else:
            waiting += [(a, a + worst), (a + worst, b)]
