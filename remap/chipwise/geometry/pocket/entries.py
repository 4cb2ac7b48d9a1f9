# SPDX-License-Identifier: GPL-2.0-or-later
"""How the tool gets down into solid stock at the start of a Track: helix, ramp, or plunge.

Called by cycles/pocket.py.  Lengths mm, angles rad.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base import chains
from chipwise.geometry.pocket.machinable import allowed

# Radii of a helix that are tried, in tool radii: the widest first.  Below 1, so that no core
# is left standing in the middle.
HELIX = (0.9, 0.75, 0.6, 0.45, 0.3)

# Shortest pass of a ramp, in tool radii: the chips of a shorter one have nowhere to go.
SHORTEST_RAMP = 2.0


@dataclass(frozen=True)
class Helix:
    """Full turns about a centre, from the Track's start back to it."""

    centre: tuple
    ccw: bool
    radius: float
    turns: int


@dataclass(frozen=True, eq=False)
class Ramp:
    """Legs to and fro over the first elements of a Track, ending at its start."""

    segments: tuple  # of Elements, there and back in turn
    pairs: int


@dataclass(frozen=True)
class Plunge:
    """Neither fits."""


def entry(region, track, radius, depth, angle):
    """Helix, Ramp or Plunge for a tool of `radius` that goes down `depth` at `angle`."""
    if angle >= math.radians(89.9):
        return Plunge()
    return _helix(region, track, radius, depth, angle) or _ramp(track, radius, depth, angle) or Plunge()


def move_count(how):
    """How many moves an entry takes."""
    if isinstance(how, Helix):
        return how.turns
    return how.pairs * sum(len(segment) for segment in how.segments) if isinstance(how, Ramp) else 1


def cut(how, track):
    """Elements of what an entry of a Track has cut at its depth."""
    if isinstance(how, Helix):
        start, turn = track.start[None], 2.0 * math.pi if how.ccw else -2.0 * math.pi
        return elements.make_arcs(start, start, np.array([how.centre]), np.array([how.radius]), np.array([turn]))
    return how.segments[0] if isinstance(how, Ramp) else chains.line(track.start, track.start)


def _helix(region, track, radius, depth, angle):
    """The widest circle that touches the Track's start and keeps inside the machinable region."""
    along = elements.tangent_at(track.elements, np.array([0]), np.array([0.0]))[0]
    if not np.any(along):
        along = np.array((1.0, 0.0))
    left = np.array((-along[1], along[0]))
    for share in HELIX:
        size = share * radius
        for side in (1.0, -1.0):
            centre = track.start + side * size * left
            if allowed(region, centre[None], size)[0]:
                turns = max(1, math.ceil(depth / (2.0 * math.pi * size * math.tan(angle)) - 1e-9))
                return Helix(tuple(centre.tolist()), side > 0.0, size, turns)
    return None


def _ramp(track, radius, depth, angle):
    """To and fro along the Track, as few passes as its length allows."""
    available = track.length
    if available < SHORTEST_RAMP * radius:
        return None
    travel = depth / math.tan(angle)
    pairs = max(1, math.ceil(travel / (2.0 * available) - 1e-9))
    there = _first(track.elements, travel / (2.0 * pairs))
    return Ramp((there, elements.reverse(there)), pairs)


def _first(chain, length):
    """The first `length` mm of a run."""
    upto = np.cumsum(elements.lengths(chain))
    k = min(int(np.searchsorted(upto, length)), len(chain) - 1)
    before = upto[k - 1] if k else 0.0
    t = min(1.0, (length - before) / max(upto[k] - before, 1e-300))
    return elements.join((elements.take(chain, np.arange(k)), chains.segment(chain, k, 0.0, t)))
