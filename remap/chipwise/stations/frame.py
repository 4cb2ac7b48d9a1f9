# SPDX-License-Identifier: GPL-2.0-or-later
"""The coordinate system of a station from taught points.  Pure; mm, machine coordinates.

Principle:
 1. Point 1 is the origin, point 2 lies on +X, point 3 in the XY plane on the +Y side.  All further points lie in the XY
    plane.
 2. The plane is the least-squares plane of all points: with three it passes through them.  The origin is point 1 and X
    the direction to point 2, both projected on it.
 3. The residual of a point is its distance from the plane: with three points it is 0 and says nothing.
 4. If each point may be off by e in any direction, a place p of the station is off by at most e times the sum over the
    points of the norms of dp / dpoint, to the first order.
"""

import math
from dataclasses import dataclass

import numpy as np
from typing import Sequence

from chipwise.errors import CycleError
from chipwise.stations import ON_X, ON_Y, ORIGIN

MIN_SPAN = 1.0  # mm between two of the first three points; nearer ones are a mistake of the operator
MIN_ANGLE = 5.0  # degrees between the directions to points 2 and 3
MAX_COORDINATE = 1e6  # mm
SECOND_ORDER = 1.01  # factor on principle 4 for what the first order leaves out
STEP = 1e-4  # of the least distance of two points, for the derivatives


@dataclass(frozen=True)
class Frame:
    """A station's coordinate system in machine coordinates.

    matrix: 3 x 3 rows, its columns are the station's X, Y and Z; origin: (x, y, z) mm; points: {number: (x, y, z)} it
    is made from.
    """

    matrix: tuple
    origin: tuple
    points: tuple

    @property
    def tilt(self) -> float:
        """Degrees between the station's Z and the machine's."""
        x, y, z = (row[2] for row in self.matrix)
        return math.degrees(math.atan2(math.hypot(x, y), z))

    @property
    def residuals(self) -> dict:
        """{number: distance (mm) of the point from the XY plane, with its sign}."""
        axes, origin = np.array(self.matrix), np.array(self.origin)
        return {number: float((np.array(point) - origin) @ axes[:, 2]) for number, point in self.points}

    def local(self, place) -> tuple:
        """(x, y, z) of the machine -> (x, y, z) of the station."""
        return tuple((np.array(self.matrix).T @ (np.array(place, float) - np.array(self.origin))).tolist())

    def predicted_error(self, place: Sequence[float], error: float) -> float:
        """How far (mm) a place (x, y, z) of the station may be off if each point may be off by `error` mm (principle
        4)."""
        numbers = [number for number, _ in self.points]
        points = np.array([point for _, point in self.points], float)
        step = STEP * min(
            np.linalg.norm(points[a] - points[b])
            for a in range(len(points))
            for b in range(a)
            if (points[a] != points[b]).any()
        )
        total = 0.0
        for k in range(len(points)):
            columns = []
            for axis in range(3):
                ends = []
                for sign in (1.0, -1.0):
                    other = points.copy()
                    other[k, axis] += sign * step
                    matrix, origin = _axes(numbers, other)
                    ends.append(matrix @ np.array(place, float) + origin)
                columns.append((ends[0] - ends[1]) / (2.0 * step))
            total += float(np.linalg.norm(np.array(columns).T, 2))
        return SECOND_ORDER * error * total


def frame_of(points: dict) -> Frame:
    """{number: (x, y, z)} -> Frame.  Raises CycleError that names the point."""
    for number, point in points.items():
        check_point(number, point)
    missing = [number for number in (ORIGIN, ON_X, ON_Y) if number not in points]
    if missing:
        raise CycleError(
            "point " + ", ".join(map(str, missing)) + (" is" if len(missing) == 1 else " are") + " not taught",
            f"teach it with M255 Q{missing[0]}",
        )
    for a, b in ((ORIGIN, ON_X), (ORIGIN, ON_Y), (ON_X, ON_Y)):
        distance = math.dist(points[a], points[b])
        if distance < MIN_SPAN:
            raise CycleError(
                f"point {b} is {{distance}} from point {a}, less than {{least}}",
                f"teach point {b} farther away",
                distance=distance,
                least=MIN_SPAN,
            )
    first, second, third = (np.array(points[number], float) for number in (ORIGIN, ON_X, ON_Y))
    angle = math.degrees(
        math.atan2(np.linalg.norm(np.cross(second - first, third - first)), (second - first) @ (third - first))
    )
    if min(angle, 180.0 - angle) < MIN_ANGLE:
        raise CycleError(
            f"point 3 is {min(angle, 180.0 - angle):.1f} degrees from the line through points 1 and 2, less than "
            f"{MIN_ANGLE:g}",
            "teach point 3 farther to the side",
        )
    ordered = tuple(sorted((number, tuple(map(float, point))) for number, point in points.items()))
    matrix, origin = _axes([number for number, _ in ordered], np.array([point for _, point in ordered]))
    normal = np.cross(second - first, third - first)
    normal = normal / np.linalg.norm(normal)
    if matrix[:, 2] @ normal < math.cos(math.radians(MIN_ANGLE)):
        heights = {number: float(abs((np.array(point) - first) @ normal)) for number, point in ordered}
        worst = max(heights, key=lambda number: heights[number])
        raise CycleError(
            f"point {worst} is {{height}} above or below the plane of points 1, 2 and 3",
            "teach the points anew",
            height=heights[worst],
        )
    return Frame(tuple(map(tuple, matrix.tolist())), tuple(origin.tolist()), ordered)


def check_point(number: int, point) -> None:
    """Raise CycleError for numbers that are not a position."""
    for axis, value in zip("XYZ", point):
        if not (math.isfinite(value) and abs(value) <= MAX_COORDINATE):
            raise CycleError(f"{axis}{value:g} of point {number} is not a position", "teach the point anew")


def _axes(numbers, points):
    """(matrix, origin): principles 1 and 2.  points: (n, 3) in the order of their numbers."""
    first, second, third = (points[numbers.index(number)] for number in (ORIGIN, ON_X, ON_Y))
    z = np.cross(second - first, third - first)
    if len(points) > 3:
        _, _, directions = np.linalg.svd(points - points.mean(axis=0))
        z = directions[2] * (1.0 if directions[2] @ z > 0 else -1.0)
    z = z / np.linalg.norm(z)
    middle = points.mean(axis=0) if len(points) > 3 else first
    origin = first - ((first - middle) @ z) * z
    x = second - first
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z]), origin
