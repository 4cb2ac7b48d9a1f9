# SPDX-License-Identifier: GPL-2.0-or-later
"""The named results of an offset, and how slices become them.

Called by kernel.py; read by the cycles.  Path elements keep the parameters of the finish
element they run along, so that rough shape and inaccessible regions follow without any
further intersection.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import parameters
from chipwise.geometry.offset.corners import absorbed, straightened
from chipwise.geometry.offset.raw import CORNER, ELEMENT, SHRUNK, Raw
from chipwise.geometry.base.tolerances import NEAR_MM, SHORT_MM


@dataclass(frozen=True, eq=False)
class Feet:
    """Where the tool touches the finish shape along k path elements.

    finish (k,) int: finish element; t0, t1 (k,): its parameters under the start and the
    end of the path element.  A rolling arc touches the end of `finish`: t0 = t1 = 1.
    """

    finish: np.ndarray
    t0: np.ndarray
    t1: np.ndarray


@dataclass(frozen=True, eq=False)
class ClosedPath:
    """A tool centre path that returns to its start."""

    elements: Elements
    feet: Feet
    closed: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class OpenPath:
    """A tool centre path with two ends, along an open contour."""

    elements: Elements
    feet: Feet
    closed: ClassVar[bool] = False


@dataclass(frozen=True, eq=False)
class PointContact:
    """The tool fits in exactly one position: elements of no length, one per touching foot."""

    elements: Elements
    feet: Feet
    closed: ClassVar[bool] = True

    @property
    def centre(self):
        """(x, y) mm."""
        return tuple(self.elements.start[0].tolist())


def chains_to_paths(chain, raw, slices, stitched):
    """Paths of stitched loops: whole loops, and the forward segments of mixed ones."""
    forward = chain.forward[raw.source] & ~((raw.kind == CORNER) & chain.cap[raw.source])
    forward = forward[slices.raw]
    made = []
    for loop in stitched.loops:
        loop = np.array(loop)
        wanted = forward[loop]
        if wanted.all():
            made.append(_path(ClosedPath, chain, raw, slices, _rotated(loop, slices)))
        elif wanted.any():
            first = int(np.flatnonzero(wanted & ~np.roll(wanted, 1))[0])
            loop, wanted = np.roll(loop, -first), np.roll(wanted, -first)
            edges = np.flatnonzero(np.diff(np.concatenate(([0], wanted.astype(int), [0]))))
            for a, b in zip(edges[::2], edges[1::2]):
                made.append(_path(OpenPath, chain, raw, slices, loop[a:b]))
    made = [path for path in made if path is not None]
    return sorted(made, key=lambda p: p.feet.finish[0] + p.feet.t0[0])


def point_contact(finish: Elements, point, radius, side):
    """PointContact at point (2,) mm, its feet in the order of the tool's side."""
    index = np.arange(len(finish))
    at = np.repeat(point[None], len(finish), axis=0)
    index = index[elements.distances(finish, index, at) <= radius + NEAR_MM]
    at = at[: len(index)]
    t = np.clip(parameters(finish, index, at), 0.0, 1.0)
    around = finish.is_arc[index] & (np.hypot(*(finish.centre[index] - at).T) <= NEAR_MM)
    foot = elements.point_at(finish, index, np.where(around, 0.5, t)) - at
    order = np.argsort(-side * np.arctan2(foot[:, 1], foot[:, 0]))
    feet = Feet(index[order], np.where(around, 0.0, t)[order], np.where(around, 1.0, t)[order])
    return PointContact(elements.make_lines(at, at), feet)


def _rotated(loop, slices):
    """Loop that begins with its first raw element along the contour, where one begins."""
    order = slices.raw[loop] + slices.t0[loop] * 0.5
    fresh = slices.raw[loop] != slices.raw[np.roll(loop, 1)]
    order = np.where(fresh, order, np.inf) if fresh.any() else order
    return np.roll(loop, -int(np.argmin(order)))


def _path(kind, chain, raw, slices, members):
    """Path of a chain of slices (indices), neighbours on the same raw element merged."""
    same = (slices.raw[members[1:]] == slices.raw[members[:-1]]) & (slices.t0[members[1:]] == slices.t1[members[:-1]])
    first = np.flatnonzero(np.concatenate(([True], ~same)))
    last = np.append(first[1:], len(members)) - 1
    index, t0, t1 = slices.raw[members[first]], slices.t0[members[first]], slices.t1[members[last]]
    node0, node1 = slices.node0[members[first]], slices.node1[members[last]]
    e = raw.elements
    long = (t1 - t0) * elements.lengths(e)[index]
    keep = np.flatnonzero((node0 != node1) | (long > SHORT_MM))
    index, t0, t1, node0, node1 = (v[keep] for v in (index, t0, t1, node0, node1))
    if not len(index):
        return None
    sweep = e.sweep[index] * (t1 - t0)
    made = Elements(
        slices.point[node0],
        slices.point[node1],
        e.centre[index],
        e.radius[index],
        e.start_angle[index] + t0 * e.sweep[index],
        sweep,
    )
    made, kept = absorbed(made, _between_own(chain, raw, index), kind.closed)
    return kind(straightened(made), _feet(chain, raw, index[kept], t0[kept], t1[kept]))


def _between_own(chain, raw, index):
    """Which path elements (k,) bool roll from the element before their corner to the one
    after it."""
    source, element = raw.source[index], raw.kind[index] == ELEMENT
    before, after = np.roll(index, 1), np.roll(index, -1)
    return (
        (raw.kind[index] == CORNER)
        & np.roll(element, 1)
        & np.roll(element, -1)
        & (raw.source[before] == source)
        & (raw.source[after] == chain.following[source])
    )


def _feet(chain, raw: Raw, index, t0, t1):
    """Feet of pieces t0..t1 of raw elements; backward pieces never get here."""
    kind = raw.kind[index]
    along = (kind == ELEMENT) | (kind == SHRUNK)
    return Feet(chain.finish[raw.source[index]], np.where(along, t0, 1.0), np.where(along, t1, 1.0))
