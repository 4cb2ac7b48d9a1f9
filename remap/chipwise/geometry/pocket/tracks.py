"""What every pocket strategy takes and gives: Field and Track.

Made by fields.py (Field) and the strategies rings.py, oneway.py, concentric.py (Track); read by
leftovers.py and cycles/pocket.py.

A strategy is a pure function

    strategy(field, radius, step, direction, climb) -> tuple of Track, in cutting order

radius: tool radius, mm; step: step-over, mm; direction: rad, of the straight strategies; climb:
the wall, and the stock still standing, is on the RIGHT of travel: counter-clockwise along the
boundary of a Field, clockwise about its holes.  That is climb milling with the spindle turning
clockwise (M3); with M4 climb milling is climb=False.

What holds for the Tracks of one Field:
1. Each stays inside the closed Field, so that its distance to the walls needs no other check.
2. Between two Tracks the tool is lifted, traverses, and goes down at the next start.  The first
   Track starts in solid stock, where the cycle ramps or helixes in; a later one that starts in
   solid costs an entry too.
3. The last Track or Tracks run every contour of the Field once, as `climb` says.
"""
from dataclasses import dataclass

import numpy as np

from .. import elements
from ..elements import Elements
from ..offset import Pocket


@dataclass(frozen=True, eq=False)
class Field:
    """One connected region of allowed tool centres, already the tool radius plus the side
    allowance away from every wall.

    boundary: Elements, closed, counter-clockwise; holes: tuple of Elements, closed, clockwise,
    one round each island or group of islands.  A Field of no area (the tool fits in one spot,
    or along one line) has a boundary that runs there and back, or one line of no length.
    pocket, distance: the original contours and their distance, mm, from which rings.py makes
    every ring anew (offset.py: pocket_ring).
    """
    boundary: Elements
    holes: tuple = ()
    pocket: Pocket = None
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

    cutting (n,) bool: False for a feed move through area that is cleared already.
    """
    elements: Elements
    cutting: np.ndarray

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


def make_track(run, cutting=True):
    """Track of Elements; cutting: bool or (n,) bool."""
    return Track(run, np.broadcast_to(np.asarray(cutting, bool), (len(run),)).copy())


def along(contour, climb):
    """A contour of a Field in the direction of travel that `climb` asks for."""
    return contour if climb else elements.reverse(contour)
