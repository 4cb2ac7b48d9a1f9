# SPDX-License-Identifier: GPL-2.0-or-later
"""Where a chain runs back on itself: short spikes, and loops without an inside.

Called by contour.py and loops.py.  A spike comes from an element that was drawn a little past its corner and back; it
is dropped as a gap of its length is closed.
"""

import math

import numpy as np

from chipwise.geometry.base.tolerances import SHORT_MM

# Cosine of the angle between two neighbours from which the path turns back on itself: 150 degrees.
BACK = -math.cos(math.radians(30.0))

# Ends of a line and of the line back are the same within this. mm
SAME_MM = 1e-3


def without(rows, length, close_mm):
    """(mask (n,), start (n, 2), end (n, 2)): the rows of contour.py outside of any spike up to `close_mm` long, and
    their ends at the corner where the spike begins; length (n,) mm."""
    start, end, alive = rows.start.copy(), rows.end.copy(), np.arange(len(length))
    while len(alive) > 2:
        after = np.roll(alive, -1)
        first, last = _directions(rows, alive)
        back = (np.einsum("ij,ij->i", last, np.roll(first, -1, axis=0)) < BACK) & _joined(
            start[after], end[alive], close_mm
        )
        short = length[alive] <= close_mm
        drop = back & short | np.roll(back, 1) & short
        if not drop.any() or drop.all():
            break
        tip = back & np.roll(short, -1) & ~short
        end[alive[tip]] = end[after[tip]]
        tip = back & short & ~np.roll(short, -1)
        start[after[tip]] = start[alive[tip]]
        alive = alive[~drop]
    mask = np.zeros(len(length), bool)
    mask[alive] = True
    return mask, start, end


def _joined(start, end, close_mm):
    """Whether rows that end there go on where the next ones start."""
    return np.hypot(*(end - start).T) <= close_mm


def _directions(rows, alive):
    """Unit vectors (n, 2) in which rows begin and end."""
    arc, turn = rows.arc[alive], np.where(rows.ccw[alive], 1.0, -1.0)
    chord = rows.end[alive] - rows.start[alive]
    found = []
    for at in (rows.start[alive], rows.end[alive]):
        out = at - rows.centre[alive]
        tangent = np.stack((-out[:, 1] * turn, out[:, 0] * turn), axis=1)
        along = np.where(arc[:, None], tangent, chord)
        found.append(along / np.maximum(np.hypot(along[:, 0], along[:, 1]), SHORT_MM**2)[:, None])
    return found


def there_and_back(loop, close_mm):
    """Whether every part of a loop is run in both directions, or all on one straight line, so that it has no inside."""
    along = sum(math.dist(part.start, part.end) for part in loop)
    around = sum(part.start[0] * part.end[1] - part.end[0] * part.start[1] for part in loop)
    x, y = loop[0].start
    around -= sum(x * (part.end[1] - part.start[1]) - y * (part.end[0] - part.start[0]) for part in loop)
    if not abs(around) <= 2.0 * max(close_mm, SHORT_MM) * along:
        return False
    odd = set()
    for part in loop:
        odd ^= {_undirected(part)}
    return not odd and along > 0.0 or _is_straight(loop)


def _undirected(part):
    """What a part and the same one the other way have in common."""
    ends = [tuple(round(v / SAME_MM) for v in point) for point in (part.start, part.end)]
    if not hasattr(part, "centre"):
        return frozenset(ends)
    begin, end = ends if part.ccw else ends[::-1]
    is_circle = begin == end and _is_large(part)  # nearly a turn, not the short arc that closes one
    return begin, end, is_circle, tuple(round(v / SAME_MM) for v in part.centre)


def _is_large(part):
    """Whether an arc turns by more than half a turn."""
    (ax, ay), (bx, by), (x, y) = part.start, part.end, part.centre
    aside = (ax - x) * (by - y) - (ay - y) * (bx - x)
    return aside < 0.0 if part.ccw else aside > 0.0


def _is_straight(loop):
    """Whether a loop consists of lines, all on one straight line."""
    if any(hasattr(part, "centre") for part in loop):
        return False
    a = loop[0].start
    b = max((part.end for part in loop), key=lambda p: math.dist(a, p))
    far = math.dist(a, b)
    return far <= SHORT_MM or all(
        abs((b[0] - a[0]) * (p.end[1] - a[1]) - (b[1] - a[1]) * (p.end[0] - a[0])) <= SHORT_MM * far for p in loop
    )
