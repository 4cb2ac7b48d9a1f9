# SPDX-License-Identifier: GPL-2.0-or-later
"""Raw offset elements that lie within the widened contour all along: gone before the raw offset is cut.

Called by kernel.py for the rings of a pocket.  Of a wall of thousands of elements few reach the inner rings; what is
sunk at one ring is at every further one, because its foot stays where it is and the tool only goes further from it.
The result is the same without: no slice of them is clear, and they lie too deep to share a node with one that is.
"""

from dataclasses import dataclass, field

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.clearance import gouge_depths, gouge_depths_beside
from chipwise.geometry.offset.raw import CORNER, ELEMENT, Raw

# An element is sunk if the tool's edge would be deeper than this wherever its centre is on it. mm; a thousand nodes
# wide
MARGIN_MM = 1e-4

# A raw offset of fewer elements is cut whole: a matter of speed only.
FEWEST = 1000


@dataclass(eq=False)
class Sunk:
    """What is known to be sunk: (distance mm, (n, 2) bool by source: its ELEMENT, its CORNER)."""

    known: list = field(default_factory=list)

    def at(self, count, distance):
        """(count, 2) bool at a distance."""
        nearer = [gone for known, gone in self.known if known <= distance]
        return np.logical_or.reduce(nearer) if nearer else np.zeros((count, 2), bool)


def afloat(sunk, clearance_check, chain, raw, distance):
    """The raw offset at a distance without what is sunk there, which `sunk` keeps for further rings."""
    if len(raw.elements) < FEWEST:
        return raw
    gone = sunk.at(len(chain.finish), distance)
    lasting = (raw.kind == ELEMENT) | (raw.kind == CORNER)
    corner = (raw.kind == CORNER).astype(int)
    left = np.flatnonzero(~(lasting & gone[raw.source, corner]))
    half = 0.5 * elements.lengths(raw.elements)[left] + MARGIN_MM
    middle = elements.point_at(raw.elements, left, np.full(len(left), 0.5))
    drowned = gouge_depths_beside(clearance_check, middle, chain.finish[raw.source[left]], distance) > half
    asked = np.flatnonzero(~drowned)
    drowned[asked] = gouge_depths(clearance_check, middle[asked], distance) > half[asked]
    which = left[drowned]
    which = which[lasting[which]]
    gone[raw.source[which], corner[which]] = True
    sunk.known.append((distance, gone))
    left = left[~drowned]
    return Raw(elements.take(raw.elements, left), raw.kind[left], raw.source[left], raw.point_contacts)
