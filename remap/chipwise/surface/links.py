# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tool must keep above from the end of a cut to the start of the next: model and stock.

Called by cycles/surface.py.  The stock is a height map that every cut is taken out of as it is planned.  All lengths
mm.
"""

import itertools
import math

import numpy as np

from chipwise.clib import layout
from chipwise.surface.curve import Curve
from chipwise.clib.drop_cutter import drop_tool
from chipwise.surface.needed import points_at, steps
from chipwise.surface.raster import GOUGE, MOST_SAG

HOLDER_SAME = 1e-3  # mm: less is not raised
HOLDER_STEP = 1.0  # mm of a cut for which the holder has one height


class Obstacles:
    """Model and stock.

    probe         drop.Probe of the model
    shape         check.sweep.Shape of the tool
    stock         check.sweep.HeightMap, which the cuts are taken out of
    ridge         how much (mm) what cuts have left may be above that
    clearance     mm that the side of a link keeps from stock
    """

    def __init__(self, probe, shape, stock, ridge=0.0, clearance=0.0):
        self._probe, self._shape, self.stock, self.ridge, self._clearance = probe, shape, stock, ridge, clearance
        self.tool = drop_tool(shape)
        self._parts = [(self.tool, 0.0)]
        if probe.has_holder:
            self._parts.append((layout.DropTool(shape.holder_diameter / 2, 0.0, 0.0), -shape.stick_out))

    def cut(self, chain):
        """Takes a chain (k, 3) out of the stock -> how deep (mm) the tool is in it at most."""
        return float(self.stock.cut(self._shape, chain[0], chain)["depth"].max())

    def held_up(self, curve):
        """A Curve raised so far that the holder is clear of the stock as it is -> (Curve, mm by which, (x, y) where
        most).  A raised one has no arcs."""
        same = curve, 0.0, (0.0, 0.0)
        if len(self._parts) < 2 or float(self.stock.height.max()) + self._parts[1][1] <= curve.points[:, 2].min():
            return same
        chain = curve.points if len(curve.points) > 1 else np.repeat(curve.points, 2, axis=0)
        places = steps(chain, HOLDER_STEP)
        points = points_at(chain, places)
        holder, up = self._parts[1]
        least = np.array(
            [self.stock.lowest_over(holder, a, b) + up for a, b in itertools.pairwise(points[:, :2].tolist())]
        )
        rise = np.maximum(np.maximum(np.append(least, -np.inf), np.append(-np.inf, least)) - points[:, 2], 0.0)
        if rise.max() < HOLDER_SAME:
            return same
        is_arc = np.isfinite(curve.centre[np.minimum(np.ceil(places).astype(int), len(curve.centre) - 1), 0])
        is_arc[:-1] |= is_arc[1:]  # chords may be below their arc
        raised = points + np.column_stack([np.zeros((len(points), 2)), np.maximum(rise, MOST_SAG * is_arc)])
        changed = rise > 0.0
        keep = (places == np.floor(places)) | changed | np.append(changed[1:], False) | np.append(False, changed[:-1])
        return Curve.straight(raised[keep]), float(rise.max()), tuple(points[int(rise.argmax()), :2].tolist())

    def lowest(self, start, end=None, least=None):
        """The lowest level (mm) of the tip on which a straight move from start (x, y) to end is clear of model and
        stock; least (mm), else the floor, if that is enough."""
        end = start if end is None else end
        floor = self._probe.floor if least is None else max(least, self._probe.floor)
        above = max(floor, self._over_ridges(start, end))
        rise, _share = self._probe.excess(
            [(*start[:2], above)], [(*end[:2], above)], 0.0
        )  # above the stock there is little to look for
        return above + float(rise[0])

    def lowest_at(self, places):
        """As lowest(), at each of places (n, 2) -> (n,) mm."""
        stock = [self._over_ridges(place, place) for place in places.tolist()]
        return np.maximum(self._probe.heights(places), stock)

    def lowest_along(self, places, point=None):
        """As lowest(), on each of the moves between places (n, 2) -> (n - 1,) mm.  point: as lowest_ahead(), only stock
        that is not behind it, and no higher ridges."""
        stock = [
            self._over_ridges(a, b) if point is None else self.lowest_ahead(a, b, point)
            for a, b in itertools.pairwise(places.tolist())
        ]
        above = np.maximum(self._probe.floor, stock)
        rise, _share = self._probe.excess(
            np.column_stack([places[:-1], above]), np.column_stack([places[1:], above]), 0.0
        )
        return above + rise

    def touches_model(self, start, end):
        """Whether a straight move from a point (3,) to another one is in the model."""
        return bool(self._probe.excess([start], [end], GOUGE)[0][0] > GOUGE)

    def lowest_ahead(self, start, end, point):
        """The lowest level (mm) of the tip on a move from start (x, y) to end that is clear of the stock, after the
        tool has cut at a point (3,).  Stock behind the point keeps it no higher than the point: of that it goes away.
        Lower it is met again."""
        step = np.subtract(end[:2], point[:2])
        found = self._over_stock(start, end, (*point[:2], *(step / max(math.hypot(*step), 1e-12))))
        return found if found >= point[2] else max(found, min(self._over_stock(start, end), point[2]))

    def _over_ridges(self, start, end):
        """As _over_stock(), with what a ridge may be higher than the map."""
        found = self._over_stock(start, end)
        return min(found + self.ridge, max(found, self.stock.z_max))

    def _over_stock(self, start, end, ahead=None):
        """HeightMap.lowest_over() for tool and holder."""
        return max(
            self.stock.lowest_over(part, start[:2], end[:2], ahead, self._clearance) + up for part, up in self._parts
        )

    def deepest(self, points):
        """How far (mm) the stock keeps the tool above the lowest of points (n, 3), each taken alone; 0 in air."""
        return max(
            0.0, *(self.stock.lowest_over(self.tool, point[:2], point[:2]) - point[2] for point in points.tolist())
        )

    def is_free(self, point, least):
        """Whether the tool at a point (3,) lowers no stock by more than `least` (mm)."""
        return not self.stock.needed(self.tool, [point], [point], least)[0]
