# SPDX-License-Identifier: GPL-2.0-or-later
"""Collects the moves of a cycle and knows where the tool is.

Used by hole.py, contour.py, contour_chop.py and pocket.py.  What rapids may do is decided here: they run across on or
above the clearance plane, and straight up and down.
"""

import math

from chipwise.cycles.word_checks import EQUAL
from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.moves import Arc, Line, Move, Rapid


class Mover:
    """moves: the moves so far; at: (x, y, z) mm, where they end."""

    def __init__(self, request):
        """request: anything with .start (x, y, z), .clearance, .feed and .plunge_feed; mm, mm/min."""
        self.clearance, self.feed, self.plunge_feed = request.clearance, request.feed, request.plunge_feed
        self.moves: list[Move] = []
        self.at = tuple(map(float, request.start))

    @property
    def xy(self):
        """(x, y) of the tool."""
        return self.at[:2]

    @property
    def z(self):
        """Z of the tool."""
        return self.at[2]

    def _add(self, move):
        self.moves.append(move)
        self.at = tuple(old if new is None else new for old, new in zip(self.at, (move.x, move.y, move.z)))

    # ---- above the stock -----------------------------------------------------------------------------------------

    def rapid(self, x=None, y=None, z=None):
        """A traverse, unless the tool is there already."""
        if any(new is not None and new != old for old, new in zip(self.at, (x, y, z))):
            self._add(Rapid(x=x, y=y, z=z))

    def up(self):
        """Straight up to the clearance plane."""
        self.rapid(z=self.clearance)

    def over(self, point, z=None):
        """By rapids: up to the clearance plane if needed, across to (x, y), then to z (default: the clearance plane).

        Before the first move the tool may be above the clearance plane; then it goes across at that height.
        """
        if self.moves or self.z < self.clearance - EQUAL:
            self.up()
        self.rapid(x=point[0], y=point[1])
        z = self.clearance if z is None else z
        if abs(z - self.z) > EQUAL:
            self.rapid(z=z)

    # ---- in the stock --------------------------------------------------------------------------------------------

    def down(self, z):
        """Straight down to z at the cutting feed: nothing is below, but stock may be at the tool's side."""
        if z < self.z - EQUAL:
            self._add(Line(z=z, feed=self.feed))

    def plunge(self, z):
        """Straight down to z at the plunge feed."""
        if z < self.z - EQUAL:
            self._add(Line(z=z, feed=self.plunge_feed))

    def descent_feed(self, angle):
        """The cutting feed, or less, so that the vertical speed at this angle (rad) to the work plane is the plunge
        feed at most."""
        return min(self.feed, self.plunge_feed / math.sin(angle))

    def line(self, point, z=None, feed=None):
        """A straight cut to (x, y); feed: default the cutting feed."""
        self._add(Line(x=point[0], y=point[1], z=z, feed=self.feed if feed is None else feed))

    def arc(self, end, centre, ccw, z=None, feed=None):
        """An arc, or a helix if z is given, to (x, y) about a centre (x, y); feed: default the cutting feed."""
        self._add(
            Arc(x=end[0], y=end[1], cx=centre[0], cy=centre[1], ccw=ccw, z=z, feed=self.feed if feed is None else feed)
        )

    def follow(self, chain: Elements, z=None, feed=None):
        """Along a chain of elements, level or with an even slope down to z; feed: default the cutting feed."""
        feed = self.feed if feed is None else feed
        length, top = elements.lengths(chain), self.z
        total, done = float(length.sum()), length.cumsum()
        for k in range(len(chain)):
            height = None
            if z is not None:
                height = z if k == len(chain) - 1 else top + (z - top) * float(done[k]) / total
            end = tuple(chain.end[k].tolist())
            if chain.is_arc[k]:
                self.arc(end, tuple(chain.centre[k].tolist()), bool(chain.sweep[k] > 0.0), height, feed)
            elif length[k] > 0.0 or height is not None:
                self._add(Line(x=end[0], y=end[1], z=height, feed=feed))
