# SPDX-License-Identifier: GPL-2.0-or-later
"""An oracle for G77/G78, written apart from the cycle: judges what the tool did against the finish shape.

It takes elements of hole_oracle.walk() (or LinuxCNC's canonical calls) and the finish shape as plain tuples of
contour_oracle.py; distances are exact, numpy only.
  deepest()       how much nearer than allowed the tool came to the finish shape anywhere below the clearance plane
  missed()        depths and distances at which a piece of the parallel curve that is certainly free was not run
  slants()        the slanted paths down and up: height, angle, and how far from normal to the outline
  plunges()       feeds straight down that leave the clearance plane: (x, y), and how near the finish shape they end
Each has been seen to fail: test_contour.py feeds sabotaged traces.
"""

import math

import numpy as np

from support import contour_oracle as shape_oracle
from support.hole_oracle import rapid_faults  # noqa: F401  part of this oracle

LEVEL = 1e-5  # heights nearer than this are one, mm


def plan_view(e):
    """An element from above as a tuple of contour_oracle; None where it is a point."""
    if e.kind == "arc":
        return ("A", *e.a[:2], *e.b[:2], *e.centre, e.sweep[1])
    return ("L", *e.a[:2], *e.b[:2]) if math.dist(e.a[:2], e.b[:2]) > 1e-9 else None


def deepest(elements, finish, reach, clearance, step=0.1):
    """Largest depth (mm) to which a tool of radius `reach` below the clearance plane overlaps the finish shape.

    The path up from where the tool stood before is not the cycle's.
    """
    first = 1 if elements and elements[0].kind == "rapid" and elements[0].b[2] > elements[0].a[2] else 0
    below = [e for e in elements[first:] if min(e.a[2], e.b[2]) < clearance - LEVEL]
    views = [plan_view(e) for e in below]
    points = [np.array([e.b[:2]]) for e in below] + [shape_oracle.samples([v], step) for v in views if v]
    if not points:
        return 0.0
    return float(np.max(reach - shape_oracle.nearest(finish, np.concatenate(points))))


def missed(elements, finish, closed, side, distances, levels):
    """[(z, distance, length, place)] of what was not run of the parallel curves at every level."""
    found = []
    for z in levels:
        flat = [e for e in elements if e.kind != "rapid" and abs(e.a[2] - z) < LEVEL and abs(e.b[2] - z) < LEVEL]
        path = [view for view in map(plan_view, flat) if view]
        for distance in distances:
            found += [(z, distance, *lost) for lost in shape_oracle.missing(finish, closed, side, distance, path)]
    return found


def slants(elements, finish):
    """[(dz, angle in degrees, deviation from the outline's normal in rad, goes down)] of every feed that goes
    aslant."""
    found = []
    for e in elements:
        across, dz = math.dist(e.a[:2], e.b[:2]), abs(e.a[2] - e.b[2])
        if e.kind == "feed" and across > LEVEL and dz > LEVEL:
            low, high = sorted((e.a, e.b), key=lambda p: p[2])
            away = np.array(high[:2]) - np.array(low[:2])
            found.append(
                (dz, math.degrees(math.atan2(dz, across)), _off_normal(finish, low[:2], away), e.a[2] > e.b[2])
            )
    return found


def _off_normal(finish, point, away):
    """Angle between a direction and the path from the nearest places of the shape to a point; the best of them."""
    p = np.array([point])
    gaps = [float(shape_oracle.distance(el, p)[0]) for el in finish]
    nearest = min(gaps)
    best = math.pi
    for el, gap in zip(finish, gaps):
        if gap < nearest + 1e-4:
            foot = _foot(el, point)
            u, v = np.array(point) - foot, np.asarray(away)
            best = min(best, abs(math.atan2(u[0] * v[1] - u[1] * v[0], u @ v)))
    return best


def _foot(el, point):
    """Nearest point of one element, by golden sections around the best sample."""
    t = np.linspace(0.0, 1.0, 2001)
    gap = np.hypot(*(shape_oracle.point(el, t) - point).T)
    k = int(np.argmin(gap))
    low, high = t[max(k - 1, 0)], t[min(k + 1, 2000)]
    for _ in range(60):
        a, b = low + 0.382 * (high - low), high - 0.382 * (high - low)
        at = shape_oracle.point(el, np.array([a, b]))
        if np.hypot(*(at[0] - point)) < np.hypot(*(at[1] - point)):
            high = b
        else:
            low = a
    return shape_oracle.point(el, np.array([0.5 * (low + high)]))[0]


def plunges(elements, finish, clearance):
    """[(x, y, distance to the finish shape)] of feeds straight down that end below the clearance plane."""
    down = [
        e
        for e in elements
        if e.kind == "feed" and math.dist(e.a[:2], e.b[:2]) < 1e-9 and e.b[2] < min(e.a[2], clearance) - LEVEL
    ]
    if not down:
        return []
    gap = shape_oracle.nearest(finish, np.array([e.b[:2] for e in down]))
    return [(*e.b[:2], float(g)) for e, g in zip(down, gap)]
