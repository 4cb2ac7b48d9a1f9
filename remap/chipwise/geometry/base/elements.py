# SPDX-License-Identifier: GPL-2.0-or-later
"""A run of lines and arcs as arrays: the kernel's common type.

Made by contour.py (the finish shape), raw.py (its raw offset) and paths.py (the result);
read by every other module.  A line has sweep 0 and radius 0.  Parameter t runs from 0 at
the start to 1 at the end of an element, along its length.
"""

from dataclasses import dataclass, field
from typing import Iterable, Sequence, Union

import numpy as np

from chipwise.geometry.base import arcs, lines
from chipwise.geometry.base.lines import dot


@dataclass(frozen=True, eq=False)
class Elements:
    """n lines and arcs.

    start, end, centre (n, 2) float, mm; radius (n,) float, mm; start_angle, sweep (n,)
    float, rad, sweep positive counter-clockwise, 0 for a line.
    """

    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    start_angle: np.ndarray
    sweep: np.ndarray
    is_arc: np.ndarray = field(init=False)
    middle: np.ndarray = field(init=False, repr=False)  # unit vector to the arc's middle
    cos_half: np.ndarray = field(init=False, repr=False)  # cosine of half the sweep

    def __post_init__(self) -> None:
        middle_angle = self.start_angle + 0.5 * self.sweep
        middle = np.stack((np.cos(middle_angle), np.sin(middle_angle)), axis=1)
        object.__setattr__(self, "is_arc", self.sweep != 0.0)
        object.__setattr__(self, "middle", middle)
        object.__setattr__(self, "cos_half", np.cos(0.5 * self.sweep))

    def __len__(self) -> int:
        return len(self.radius)


def take(elements: Elements, index: Union[np.ndarray, Sequence]) -> Elements:
    """The elements at `index` (m,) int or bool, in that order."""
    return Elements(
        elements.start[index],
        elements.end[index],
        elements.centre[index],
        elements.radius[index],
        elements.start_angle[index],
        elements.sweep[index],
    )


def join(parts: Iterable[Elements]) -> Elements:
    """One run from several."""
    return Elements(
        *(
            np.concatenate([getattr(p, name) for p in parts])
            for name in ("start", "end", "centre", "radius", "start_angle", "sweep")
        )
    )


def make_lines(start: np.ndarray, end: np.ndarray) -> Elements:
    """Elements of n lines from start to end, both (n, 2) mm."""
    zero = np.zeros(len(start))
    return Elements(start, end, np.zeros_like(start), zero, zero, zero)


def make_arcs(
    start: np.ndarray, end: np.ndarray, centre: np.ndarray, radius: np.ndarray, sweep: np.ndarray
) -> Elements:
    """Elements of n arcs; the start angle follows from start and centre."""
    v = start - centre
    return Elements(start, end, centre, radius, np.arctan2(v[:, 1], v[:, 0]), sweep)


def reverse(elements: Elements) -> Elements:
    """The same way travelled backwards."""
    return Elements(
        elements.end[::-1],
        elements.start[::-1],
        elements.centre[::-1],
        elements.radius[::-1],
        (elements.start_angle + elements.sweep)[::-1],
        -elements.sweep[::-1],
    )


def point_at(e: Elements, index: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Points (m, 2) mm at parameters t (m,) of elements index (m,)."""
    start = e.start[index]
    along = start + (e.end[index] - start) * t[:, None]
    angle = e.start_angle[index] + t * e.sweep[index]
    on_arc = e.centre[index] + np.stack((np.cos(angle), np.sin(angle)), axis=1) * e.radius[index][:, None]
    return np.where(e.is_arc[index][:, None], on_arc, along)


def tangent_at(e: Elements, index: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Unit tangents (m, 2) in the direction of travel at parameters t of elements index."""
    chord = e.end[index] - e.start[index]
    length = np.hypot(chord[:, 0], chord[:, 1])
    chord = chord / np.where(length > 0.0, length, 1.0)[:, None]
    angle = e.start_angle[index] + t * e.sweep[index]
    sign = np.sign(e.sweep[index])
    on_arc = np.stack((-np.sin(angle) * sign, np.cos(angle) * sign), axis=1)
    return np.where(e.is_arc[index][:, None], on_arc, chord)


def parameters(e: Elements, index: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Parameter (m,) of the foot of point (m, 2) on the carrier of element index (m,), held within 0 .. 1."""
    t = lines.parameter(point, e.start[index], e.end[index])
    v, sweep = point - e.centre[index], e.sweep[index]
    turn = (np.arctan2(v[:, 1], v[:, 0]) - e.start_angle[index]) * np.sign(sweep) % (2 * np.pi)
    arc = e.is_arc[index]
    return np.clip(np.where(arc, turn / np.where(arc, np.abs(sweep), 1.0), t), 0.0, 1.0)


def lengths(e: Elements) -> np.ndarray:
    """Length (n,) mm of every element."""
    chord = e.end - e.start
    return np.where(e.is_arc, e.radius * np.abs(e.sweep), np.hypot(chord[:, 0], chord[:, 1]))


def curvatures(e: Elements) -> np.ndarray:
    """Signed curvature (n,) 1/mm, positive to the left."""
    return np.where(e.is_arc, np.sign(e.sweep) / np.where(e.is_arc, e.radius, 1.0), 0.0)


def area(e: Elements) -> float:
    """Signed area mm2 of a closed run, positive counter-clockwise."""
    origin = e.start[0]
    polygon = 0.5 * np.sum(lines.cross(e.start - origin, e.end - origin))
    return float(polygon + np.sum(arcs.segment_area(e.radius, e.sweep)))


def boxes(e: Elements) -> tuple[np.ndarray, np.ndarray]:
    """Bounding boxes (n, 2), (n, 2) mm of every element, arcs exactly."""
    low, high = np.minimum(e.start, e.end), np.maximum(e.start, e.end)
    arc = np.flatnonzero(e.is_arc)
    if not len(arc):
        return low, high
    centre, radius = e.centre[arc], e.radius[arc]
    for axis in (0, 1):
        along = e.middle[arc, axis]
        top, bottom = along >= e.cos_half[arc], -along >= e.cos_half[arc]
        high[arc[top], axis] = (centre[:, axis] + radius)[top]
        low[arc[bottom], axis] = (centre[:, axis] - radius)[bottom]
    return low, high


def distances(e: Elements, index: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Distance (m,) mm from point (m, 2) to the element index (m,) of each."""
    arc = e.is_arc[index]
    if not arc.any():
        return _line_distances(e, index, point)
    if arc.all():
        return _arc_distances(e, index, point)
    result = np.empty(len(index))
    for kind, measure in ((arc, _arc_distances), (~arc, _line_distances)):
        which = np.flatnonzero(kind)
        result[which] = measure(e, index[which], point[which])
    return result


def _line_distances(e: Elements, index: np.ndarray, point: np.ndarray) -> np.ndarray:
    start, end = e.start[index], e.end[index]
    t = np.clip(lines.parameter(point, start, end), 0.0, 1.0)
    off = point - start - (end - start) * t[:, None]
    return np.hypot(off[:, 0], off[:, 1])


def _arc_distances(e: Elements, index: np.ndarray, point: np.ndarray) -> np.ndarray:
    v = point - e.centre[index]
    out = np.hypot(v[:, 0], v[:, 1])
    beside = dot(v, e.middle[index]) >= out * e.cos_half[index]
    a, b = point - e.start[index], point - e.end[index]
    to_end = np.sqrt(np.minimum(dot(a, a), dot(b, b)))
    return np.where(beside, np.abs(out - e.radius[index]), to_end)
