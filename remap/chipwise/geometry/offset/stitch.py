# SPDX-License-Identifier: GPL-2.0-or-later
"""Clear slices joined end to end into loops.

Called by kernel.py.  Nearly every node has one slice in and one out.  Where several meet
(parts of the path that touch, or slices that overlap within the tolerance) the walk takes
the turn that keeps the path on the tool's side, so that a path which touches itself
comes out as separate loops and no slice is used twice.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.offset.raw import LINK
from chipwise.geometry.base.tolerances import ANGLE_RAD, LOOSE_MM, STRONG_MM, slight_corner_gap


@dataclass(frozen=True, eq=False)
class Stitched:
    """loops: lists of slice indices in travel order; loose: the same for runs with a dead
    end that hold clear slices longer than LOOSE_MM, which only rounding can leave behind."""

    loops: list
    loose: list


@dataclass(frozen=True, eq=False)
class _Branches:
    """What the walk needs to choose: per slice the directions it leaves and arrives in
    (rad), its curvatures (1/mm, left positive), whether it is clear beyond doubt, and
    whether it only closes a gap."""

    leave: list
    arrive: list
    bend: list
    strong: list
    link: list


def stitch(raw, slices, depth, side, radius):
    """Loops of slices; side +1: tool of `radius` (mm) right of the contour, -1: left."""
    alive = _without_dead_ends(slices, depth)
    outs = {}
    for k in np.flatnonzero(alive).tolist():
        outs.setdefault(int(slices.node0[k]), []).append(k)
    ends = _ends(raw, slices, depth) if any(len(o) > 1 for o in outs.values()) else None
    order = np.flatnonzero(alive)
    order = order[np.argsort(depth[order] > STRONG_MM, kind="stable")].tolist()
    to_node = slices.node1.tolist()
    used, loops, loose = set(), [], []
    sure = np.where(depth <= STRONG_MM, slices.t1 - slices.t0, 0.0)
    sure *= elements.lengths(raw.elements)[slices.raw]
    for first in order:
        if first not in used:
            chain, closed = _walk(first, outs, to_node, used, ends, side)
            if closed:
                loops.append(chain)
            elif sure[chain].sum() > LOOSE_MM:
                loose.append(chain)
    return Stitched(_without_slivers(loops, raw, slices, radius), loose)


def _walk(first, outs, to_node, used, ends, side):
    """Slices from `first` on until it comes round, or to a dead end."""
    chain, here = [first], first
    used.add(first)
    while True:  # every step uses up a slice
        choice = [k for k in outs.get(to_node[here], ()) if k not in used or k == first]
        if not choice:
            return chain, False
        here = choice[0] if len(choice) == 1 else _choose(here, choice, ends, side)
        if here == first:
            return chain, True
        used.add(here)
        chain.append(here)


def _choose(here, choice, ends, side):
    """The slice that turns furthest to the tool's side; gap closers, doubtful and backward
    ones last."""

    def rank(k):
        turn = (ends.leave[k] - ends.arrive[here]) / (2.0 * np.pi)
        turn = 2.0 * np.pi * (turn - round(turn))
        back = abs(turn) > np.pi - ANGLE_RAD
        level = round(-side * turn / ANGLE_RAD)
        return (not ends.link[k], ends.strong[k], not back, level, -side * ends.bend[k])

    return max(choice, key=rank)


def _ends(raw, slices, depth):
    e = raw.elements
    leave = elements.tangent_at(e, slices.raw, slices.t0)
    arrive = elements.tangent_at(e, slices.raw, slices.t1)
    return _Branches(
        np.arctan2(leave[:, 1], leave[:, 0]).tolist(),
        np.arctan2(arrive[:, 1], arrive[:, 0]).tolist(),
        elements.curvatures(e)[slices.raw].tolist(),
        (depth <= STRONG_MM).tolist(),
        (raw.kind[slices.raw] >= LINK).tolist(),
    )


def _without_dead_ends(slices, depth):
    """Which slices (m,) bool remain when doubtful ones that lead nowhere are taken away,
    again and again; every round removes at least one."""
    alive = np.ones(len(slices.raw), bool)
    doubtful = depth > STRONG_MM
    while True:
        entered = np.zeros(len(slices.point), bool)
        left = np.zeros(len(slices.point), bool)
        entered[slices.node1[alive]] = True
        left[slices.node0[alive]] = True
        dead = alive & doubtful & ~(entered[slices.node0] & left[slices.node1])
        if not dead.any():
            return alive
        alive &= ~dead


def _without_slivers(loops, raw, slices, radius):
    """Loops without the tiny ones that hang on another loop's node at a slight corner."""
    length = (slices.t1 - slices.t0) * elements.lengths(raw.elements)[slices.raw]
    total = [float(length[loop].sum()) for loop in loops]
    tiny = 4.0 * slight_corner_gap(radius)
    if not any(t < tiny for t in total):
        return loops
    others = set(int(n) for loop, t in zip(loops, total) if t >= tiny for n in slices.node0[loop])
    return [loop for loop, t in zip(loops, total) if t >= tiny or not others.intersection(slices.node0[loop].tolist())]
