# SPDX-License-Identifier: GPL-2.0-or-later
"""Mirror, rotation and shift: of points, and of moves.  Pure; mm.

Source: the patent abstract on registered patterns: a pattern has a coordinate system of its own (Xp-Yp); shift and
rotation (SX, SY, SR) place it on the machine, and a mirror image is placed in the same way.
A move under an isometry x -> R x + t: a line stays a line.  An arc about the axis n by the angle a turns about R n, by
a if R is a rotation and by -a if it mirrors; it stays an arc if R n is one of the three axes, and becomes chords
otherwise.  So a turn of the work by a about the axis n = A, B or C is one by det(R) s a if R n = s n, with s = 1 or -1,
and none of that axis otherwise.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chipwise import moves
from chipwise.geometry.base.arc_sweep import arc_sweep, chord_angle
from chipwise.moves import Arc, Line, Move, PlaneArc, Rapid, Thread
from chipwise.pattern.recorded import ARC, FEED, PLANE_OF_AXIS, RAPID, THREAD, Code, Recorded

EXACT = 1e-12  # of a direction: rounding of a rotation by whole quarters


@dataclass(frozen=True)
class Isometry:
    """x -> matrix x + shift; matrix: 3 x 3 rows, orthogonal; shift: mm."""

    matrix: tuple
    shift: tuple

    def points(self, points):
        """(n, 3) -> (n, 3)."""
        return np.asarray(points, float).reshape(-1, 3) @ np.array(self.matrix).T + np.array(self.shift)

    def point(self, point):
        """(x, y, z) -> (x, y, z)."""
        return tuple(self.points([point])[0].tolist())

    def back(self, point):
        """The point that becomes this one."""
        return tuple((np.array(self.matrix).T @ (np.array(point) - np.array(self.shift))).tolist())

    def inverse(self) -> "Isometry":
        """The one that leads back."""
        matrix = np.array(self.matrix).T
        return Isometry(tuple(map(tuple, matrix.tolist())), tuple((-matrix @ np.array(self.shift)).tolist()))

    @cached_property
    def mirrors(self) -> bool:
        """Whether a left hand becomes a right one."""
        return float(np.linalg.det(np.array(self.matrix))) < 0.0

    @cached_property
    def senses(self) -> tuple:
        """Of the axes A, B and C: 1 if a turn keeps its sense, -1 if it changes it, 0 if it becomes one about another
        axis."""
        return tuple(
            axis[1] * (-1 if self.mirrors else 1) if axis and axis[0] == k else 0 for k, axis in enumerate(self.axes)
        )

    @cached_property
    def axes(self) -> tuple:
        """What X, Y and Z become: (index, sign) of an axis, None if it lies between them."""
        return tuple(_axis(np.array(self.matrix)[:, k]) for k in range(3))

    def after(self, first: "Isometry") -> "Isometry":
        """This one after another."""
        matrix = np.array(self.matrix) @ np.array(first.matrix)
        return Isometry(tuple(map(tuple, matrix.tolist())), self.point(first.shift))


IDENTITY = Isometry(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0))


def placed(mirror: int, degrees: float, shift: tuple) -> Isometry:
    """Mirror first (1: X changes its sign, 2: Y, 3: both), then rotate about Z, then shift."""
    quarter, rest = divmod(degrees, 90.0)
    if rest == 0.0:  # exact, so that arcs of G18 and G19 stay arcs
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    else:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y = (-1.0 if mirror & 1 else 1.0), (-1.0 if mirror & 2 else 1.0)
    return Isometry(((c * x, -s * y, 0.0), (s * x, c * y, 0.0), (0.0, 0.0, 1.0)), tuple(map(float, shift)))


def placed_in_zx(mirror: int, shift: tuple) -> Isometry:
    """On a lathe: mirror (1: X changes its sign, 2: Z, 3: both), then shift."""
    return Isometry(
        (((-1.0 if mirror & 1 else 1.0), 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, (-1.0 if mirror & 2 else 1.0))),
        tuple(map(float, shift)),
    )


def moved(recorded: Recorded, points, start, isometry: Isometry, chord: float) -> list:
    """The moves (moves.py) of a sub under an isometry.

    points: of Recorded.points, or what takes their place (k, 3); start: (x, y, z) before them; chord: largest distance
    (mm) of chords from an arc that cannot stay one.
    """
    images: list[tuple] = list(map(tuple, isometry.points(points).tolist()))
    senses, abc = isometry.senses, turned(isometry.senses, recorded.abc)
    axes = isometry.axes
    turn = -1 if isometry.mirrors else 1
    found: list[Move] = []
    here, at = np.array(start), 0
    for step in recorded.steps:
        if isinstance(step, Code):
            found.append(moves.Code(step.text, step.line))
            continue
        before, abc, (x, y, z) = abc, None if step.abc is None else turned(senses, step.abc), images[at]
        if step.kind == RAPID:
            found.append(Rapid(x, y, z, step.line, abc))
        elif step.kind == FEED:
            found.append(Line(x, y, z, step.feed, step.line, abc))
        elif step.kind == THREAD:
            found.append(Thread(x, y, z, step.pitch, step.line, abc))
        elif axes[step.axis] is not None:
            axis, sign = axes[step.axis]
            found.append(_arc(step, images[at], images[at + 1], axis, step.turns * turn * sign, abc))
        else:
            chords = isometry.points(arc_points(here, points[at], points[at + 1], step.axis, step.turns, chord))
            angles = [None] * len(chords) if abc is None else np.linspace(before, abc, len(chords) + 1)[1:].tolist()
            found += [
                Line(x, y, z, step.feed, step.line, turns and tuple(turns))
                for (x, y, z), turns in zip((*chords[:-1].tolist(), images[at]), angles)
            ]
        here = points[at]
        at += 2 if step.kind == ARC else 1
    return found


def turned(senses, abc):
    """Angles of A, B and C under an isometry; those of an axis that it gives another direction stay."""
    return tuple(angle * (sense or 1) for angle, sense in zip(abc, senses))


def _arc(step, end, centre, axis, turns, abc) -> Move:
    """The arc about an axis by so many started turns."""
    ccw, count = turns > 0, abs(turns)
    if axis == 2:
        return Arc(end[0], end[1], centre[0], centre[1], ccw, end[2], step.feed, count, step.line, abc)
    return PlaneArc(PLANE_OF_AXIS[axis], end, centre, ccw, step.feed, count, step.line, abc)


def _axis(direction):
    """(index, sign) of the axis a unit vector lies on, None if it lies on none."""
    k = int(np.argmax(np.abs(direction)))
    return (k, 1 if direction[k] > 0 else -1) if abs(abs(direction[k]) - 1.0) < EXACT else None


def arc_points(start, end, centre, axis: int, turns: int, chord: float):
    """Points on an arc or a helix, its end among them: (n, 3), so close that a chord is at most so far (mm) from it."""
    first, sweep, (radius, end_radius) = _turn(start, end, centre, axis, turns)
    count = max(1, math.ceil(abs(sweep) / chord_angle(max(radius, end_radius), chord)))
    share = np.arange(1, count + 1) / count
    points = _at_shares(start, end, centre, axis, (first, sweep, (radius, end_radius)), share)
    points[-1] = end
    return points


def arc_extremes(start, end, centre, axis: int, turns: int, directions):
    """The points of an arc where the coordinate along one of some directions (m, 3) is largest or smallest, and its
    end: (n, 3)."""
    turn = first, sweep, _radii = _turn(start, end, centre, axis, turns)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    tops = np.array([math.atan2(direction[b], direction[a]) for direction in np.asarray(directions)])
    angles = np.concatenate([tops, tops + math.pi])
    share = ((angles - first) % (2 * math.pi) if sweep > 0 else (angles - first) % (2 * math.pi) - 2 * math.pi) / sweep
    return np.vstack([_at_shares(start, end, centre, axis, turn, share[share < 1.0]), np.array(end)[None]])


def _turn(start, end, centre, axis, turns):
    """(angle of the start, angle swept, (radius at the start, at the end)) of an arc."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    first = math.atan2(start[b] - centre[b], start[a] - centre[a])
    radii = tuple(math.hypot(p[a] - centre[a], p[b] - centre[b]) for p in (start, end))
    return first, arc_sweep((start[a], start[b]), (end[a], end[b]), (centre[a], centre[b]), turns), radii


def _at_shares(start, end, centre, axis, turn, share):
    """Points of an arc at shares (n,) of its turn: (n, 3)."""
    first, sweep, (radius, end_radius) = turn
    a, b = (axis + 1) % 3, (axis + 2) % 3
    angle, r = first + sweep * share, radius + (end_radius - radius) * share
    points = np.empty((len(share), 3))
    points[:, a], points[:, b] = centre[a] + r * np.cos(angle), centre[b] + r * np.sin(angle)
    points[:, axis] = start[axis] + (end[axis] - start[axis]) * share
    return points
