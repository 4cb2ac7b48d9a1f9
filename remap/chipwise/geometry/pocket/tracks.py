# SPDX-License-Identifier: GPL-2.0-or-later
"""What every pocket strategy takes and gives: machinable region and Track.

Made by machinable.py (machinable region) and the strategies rings.py, oneway.py, concentric.py (Track); read by
rest_material.py and cycles/pocket.py.

A strategy is a pure function

    strategy(field, radius, step, direction, climb, walls) -> tuple of Track, in cutting order

radius: tool radius, mm; step: step-over, mm; direction: rad, of the straight strategies; climb:
the wall, and the stock still standing, is on the RIGHT of travel: counter-clockwise along the
boundary of a machinable region, clockwise about its holes.  That is climb milling with the spindle turning
clockwise (M3); with M4 climb milling is climb=False.  walls: wall_arcs.py's Walls, for the arcs onto
and off the contours, and for rows that end before them; None: neither.

What holds for the Tracks of one machinable region:
1. Each stays inside the closed machinable region, so that its distance to the walls needs no other check.
2. Between two Tracks the tool goes over cleared ground (links.py), or lifts and goes down at the next start.  The first
   Track starts in solid stock, where the cycle ramps or helixes in; a later one that starts in
   solid costs an entry too.
3. The last Track or Tracks run every contour of the machinable region once, as `climb` says.
"""

from dataclasses import dataclass
from typing import Optional

import numpy as np

from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.offset.kernel import Pocket


@dataclass(frozen=True, eq=False)
class MachinableRegion:
    """One connected region of allowed tool centres, already the tool radius plus the side
    allowance away from every wall.

    boundary: Elements, closed, counter-clockwise; holes: tuple of Elements, closed, clockwise,
    one round each island or group of islands.  A machinable region of no area (the tool fits at one point,
    or along one line) has a boundary that runs there and back, or one line of no length.
    pocket, distance: the original contours and their distance, mm, from which rings.py makes
    every ring anew (kernel.py: pocket_ring).
    """

    boundary: Elements
    holes: tuple = ()
    pocket: Optional[Pocket] = None
    distance: float = 0.0

    @property
    def contours(self):
        """The boundary and the holes."""
        return (self.boundary,) + tuple(self.holes)

    @property
    def area(self):
        """mm2 of allowed tool centres."""
        return sum(elements.area(e) for e in self.contours)


@dataclass(frozen=True, eq=False)
class Track:
    """A connected run of the tool centre, one element or more.

    cutting (n,) bool: False for a feed move through area that is cleared already.  wall: it is one
    contour of the machinable region and nothing else, but for the arcs onto and off it.  cleared: all that the tool
    covers at its start is cleared before, though no Track may have been there.
    """

    elements: Elements
    cutting: np.ndarray
    wall: bool = False
    cleared: bool = False

    @property
    def start(self):
        """(2,) mm"""
        return self.elements.start[0]

    @property
    def end(self):
        """(2,) mm"""
        return self.elements.end[-1]

    @property
    def length(self):
        """mm"""
        return float(np.sum(elements.lengths(self.elements)))


def make_track(chain, cutting=True, wall=False):
    """Track of Elements; cutting: bool or (n,) bool."""
    return Track(chain, np.broadcast_to(np.asarray(cutting, bool), (len(chain),)).copy(), wall)


def along(contour, climb):
    """A contour of a machinable region in the direction of travel that `climb` asks for."""
    return contour if climb else elements.reverse(contour)
