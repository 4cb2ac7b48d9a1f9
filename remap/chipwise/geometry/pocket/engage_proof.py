# SPDX-License-Identifier: GPL-2.0-or-later
"""What a finished path of constant engagement does: the certificate of P4.

Called by cycles/pocket_engage.py.  The path is followed once more from the first segment on, as its lines and arcs are,
over ground that is again as it was before.  Lengths mm, angles rad.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from chipwise.geometry.pocket.engage_ground import Ground
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.elements import make_lines
from chipwise.geometry.pocket.engage_links import RIM_MM

# Spacing of the places that are judged, in tool radii; width of stock that is not seen.
SPACING, FINE_MM = 0.03, 0.02

# A path may be nearer to a wall than allowed by this; rounding of the fit.
GOUGE_MM = 0.002

# More engagement than that of the step-over by this is named; and is a full slot from this on. rad
OVER, FULL = math.radians(5.0), math.radians(172.0)

# Kinds of segments that are an entry.
ENTRIES = ("entry", "ramp")

# More engagement may last this long without a word about the feed, in tool radii: in a corner, on the arc between its
# walls.  From SLOW more on, for longer, the feed is less. rad
CORNER, SLOW = 1.0, math.radians(10.0)


@dataclass(frozen=True)
class Proof:
    """over: [(x, y, mm, engagement)] of places with more engagement than OVER allows; gouge, gouge_at: mm, and where;
    left_mm2, left_at: what is not cleared; rapid_at, plunge_at: (x, y) of a rapid that would meet stock, of a descent
    that would; or None.  load: for each segment the most engagement of each of its elements, or None.  full: as over,
    of full slots; none of an entry."""

    over: tuple
    gouge: float
    gouge_at: tuple
    left_mm2: float
    left_at: tuple
    rapid_at: object
    plunge_at: object
    load: tuple = ()
    full: tuple = ()

    @property
    def longest(self):
        """The longest place, or None."""
        return max(self.over, key=lambda row: row[2], default=None)


def prove(region, segments, radius, angle, cleared=None):
    """Proof of the segments of one level of a region.  cleared: a chain of places that the tool may have been at
    before."""
    ground = Ground(region.contours, radius)
    if cleared is not None:
        ground.clear(cleared)
    over, gouge, rapid_at, plunge_at, gouge_at = [], 0.0, None, None, (0.0, 0.0)
    load, full = [], []
    for segment, after in zip(segments, (*segments[1:], *segments[-1:])):
        load.append(None)
        if segment.kind == "over" and after.kind not in ENTRIES:
            end = segment.elements.end
            if plunge_at is None and not ground.swept(make_lines(end, end), -RIM_MM, FINE_MM):
                plunge_at = tuple(end[0].tolist())
        elif segment.kind == "rapid":
            if rapid_at is None and not ground.swept(segment.elements, 0.0, FINE_MM):
                rapid_at = tuple(segment.elements.start[0].tolist())
        elif segment.kind != "over":
            rows = ground.along(segment.elements, SPACING * radius)
            if len(rows):
                depth = ground.depth(rows[:, :2])
                if -depth.min() > gouge:
                    gouge, gouge_at = -float(depth.min()), tuple(rows[depth.argmin(), :2].tolist())
            if segment.kind not in ENTRIES:
                over += _places(rows, angle + OVER, SPACING * radius)
                full += _places(rows, FULL, SPACING * radius)
                load[-1] = _most(segment.elements, rows[:, 3], SPACING * radius)
    left, place = ground.left(FINE_MM)
    return Proof(
        tuple(over), gouge, gouge_at, left, tuple(place.tolist()), rapid_at, plunge_at, tuple(load), tuple(full)
    )


def left_mm2(region, radius, cleared=None):
    """Of what the tool reaches: what stands before the first path."""
    ground = Ground(region.contours, radius)
    if cleared is not None:
        ground.clear(cleared)
    return ground.left(FINE_MM)[0]


def _most(chain, engagement, spacing):
    """(n,) the most engagement of each element, of which each was judged at even places."""
    count = np.ceil(elements.lengths(chain) / spacing).astype(int)
    ends = np.minimum(np.cumsum(count), len(engagement))
    return np.array([engagement[b - n : b].max(initial=0.0) for b, n in zip(ends, count)])


def slowed(region, segments, proof, radius, angle, cleared=None):
    """Segments with less feed where the engagement is above that of the step-over by SLOW for long: no more is cut in a
    time there."""
    if not proof.longest or proof.longest[2] <= CORNER * radius:
        return segments
    parts = [
        segment
        if load is None or not (load > angle + SLOW).any()
        else replace(segment, elements=_divided(segment.elements, load > angle + SLOW, CORNER * radius))
        for segment, load in zip(segments, proof.load)
    ]
    found = []
    for segment, load in zip(parts, prove(region, parts, radius, angle, cleared).load):
        if load is not None and (load > angle + SLOW).any():
            width = 1.0 - np.cos(np.clip(load, angle, math.pi))
            segment = replace(segment, share=np.where(load > angle + SLOW, (1.0 - math.cos(angle)) / width, 1.0))
        found.append(segment)
    return tuple(found)


def _divided(chain, which, most):
    """A chain whose elements of some are no longer than `most`."""
    found = []
    for k, length in enumerate(elements.lengths(chain)):
        n = math.ceil(length / most) if which[k] else 1
        found += [chains.segment(chain, k, i / n, (i + 1) / n) for i in range(n)]
    return elements.join(found)


def _places(rows, limit, spacing):
    """(x, y, mm, engagement) of each group of rows above a limit; the length errs to the long side."""
    found, above = [], np.flatnonzero(rows[:, 3] > limit)
    for group in np.split(above, np.flatnonzero(np.diff(above) > 1) + 1):
        if len(group):
            found.append((*rows[group[0], :2].tolist(), len(group) * spacing, float(rows[group, 3].max())))
    return found
