# SPDX-License-Identifier: GPL-2.0-or-later
"""What `chipwise contour` prints and draws: the contours of a sub, the centre path and rough shape of a tool,
inaccessible regions.

Called by cli/contour.py; the picture is contour.py's.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chipwise.contour_sub.read import shape_error
from chipwise.errors import CycleError, braceless
from chipwise.geometry.base import elements, winding
from chipwise.geometry.base.contour import ContourError
from chipwise.geometry.base.tolerances import CONNECT_MM
from chipwise.geometry.offset.inaccessible import InaccessibleRegion
from chipwise.geometry.offset.kernel import LEFT, RIGHT, OffsetResult, make_pocket, offset_contour, offset_pocket
from chipwise.geometry.pocket import nesting
from chipwise.geometry.pocket.meeting import MeetingResult, offset_meeting

GRIDS = (12, 60)  # points in each direction among which the middle of a region is sought; the finer one if needed


def wrong(problem, remedy):
    """CycleError of texts that may hold braces."""
    return CycleError(braceless(problem), braceless(remedy))


@dataclass(frozen=True, eq=False)
class Drawing:
    """The result for one sub and one tool, lengths in mm.

    title; unit: "mm" or "in" of the list; tool: diameter; where: "left", ..; contours: the finish shape;
    result: OffsetResult or MeetingResult; middles: a point inside of every inaccessible region; close_gap: mm
    """

    title: str
    unit: str
    tool: float
    where: str
    contours: tuple
    result: OffsetResult | MeetingResult
    middles: tuple
    close_gap: float = CONNECT_MM

    @cached_property
    def regions(self):
        """Inaccessible regions."""
        return tuple(u for u in self.result.inaccessible if isinstance(u, InaccessibleRegion))

    @cached_property
    def segments(self):
        """Segments of the contour without a centre path."""
        return tuple(u for u in self.result.inaccessible if not isinstance(u, InaccessibleRegion))


def offset(shape, contours, side, tool):
    """(OffsetResult, side of the tool as text)."""
    if side and len(contours) > 1:
        raise wrong(
            f"--side {side} and a sub of {len(contours)} contours: the tool is inside the pockets and outside of "
            "their islands",
            "leave --side out",
        )
    try:
        if len(contours) > 1:
            pockets, where = nesting.sort(contours, shape.close_gap).pockets, "inside, islands outside"
            result = _joined([_offset_pocket(boundary, islands, 0.5 * tool) for boundary, islands in pockets])
            where += f", {len(pockets)} pockets" if len(pockets) > 1 else ""
        else:
            left = side != "42"
            result = offset_contour(contours[0], LEFT if left else RIGHT, 0.5 * tool)
            where = f"{'left' if left else 'right'} ({41 if left else 42})" + inside(contours[0], left)
    except ContourError as error:
        raise shape_error(shape, error) from error
    if result.loose:
        raise CycleError(
            f"sub O{shape.sub}: the centre path has {result.loose} open ends, an error of chipwise",
            "report it with the program",
        )
    return result, where


def _offset_pocket(boundary, islands, distance):
    """OffsetResult or MeetingResult of one pocket."""
    pocket = make_pocket(boundary, islands)
    return offset_meeting(pocket, distance) if pocket.meeting else offset_pocket(boundary, islands, distance)


def _joined(results):
    """One result of those of several pockets."""
    if len(results) == 1:
        return results[0]
    paths, missed, rough = (
        tuple(part for result in results for part in getattr(result, name))
        for name in ("paths", "inaccessible", "rough")
    )
    return MeetingResult(paths, missed, rough, sum(result.loose for result in results))


def inside(contour, left):
    """Which side of a closed contour that is."""
    if not contour.closed:
        return ""
    return ", inside" if (elements.area(contour.elements) > 0.0) == left else ", outside"


def middle(region):
    """(x, y) mm in a region, the point of a grid that is farthest from its edge."""
    e = region.boundary
    low, high = elements.boxes(e)[0].min(axis=0), elements.boxes(e)[1].max(axis=0)
    for count in GRIDS:
        grid = np.stack(np.meshgrid(*((np.arange(count) + 0.5) / count,) * 2), axis=-1).reshape(-1, 2)
        point = low + grid * (high - low)
        point = point[winding.numbers(e, point) != 0]
        for hole in region.holes:
            point = point[winding.numbers(hole, point) == 0]
        if len(point):
            edges = elements.join((e, *region.holes))
            gap = np.full(len(point), np.inf)
            for k in range(len(edges)):
                np.minimum(gap, elements.distances(edges, np.full(len(point), k), point), out=gap)
            return tuple(point[int(np.argmax(gap))].tolist())
    longest = int(np.argmax(elements.lengths(e)))  # too narrow for any grid: the middle of its longest element
    return tuple(elements.point_at(e, np.array([longest]), np.array([0.5]))[0].tolist())
