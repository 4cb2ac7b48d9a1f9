# SPDX-License-Identifier: GPL-2.0-or-later
"""Parts of steps, and what straight cuts of a flat tool leave against them, in closed form: an oracle that shares
nothing with check/part.py.

A part is a field of rectangles with a level each.  A place is inside of it as deep as the nearest point that is not,
and outside as far as the nearest point of it; both are distances to boxes that are open upwards or downwards.  Cuts are
level segments: the stock there is as low as the lowest one within the tool's radius.
"""

import numpy as np

GRID_MM = 0.05


def triangles(xs, ys, levels, bottom):
    """A closed STL of a field: levels (len(ys) - 1, len(xs) - 1) of the rectangles between the lines xs, ys, all above
    `bottom`; NaN: a hole."""
    found = []

    def quad(a, b, c, d):
        found.extend([(a, b, c), (a, c, d)])

    def level(j, i):
        inside = 0 <= j < len(ys) - 1 and 0 <= i < len(xs) - 1
        return bottom if not inside or np.isnan(levels[j][i]) else levels[j][i]

    for j in range(len(ys)):
        for i in range(len(xs)):
            here, left, front = level(j, i), level(j, i - 1), level(j - 1, i)
            if i + 1 < len(xs) and j + 1 < len(ys) and here > bottom:
                x0, x1, y0, y1 = xs[i], xs[i + 1], ys[j], ys[j + 1]
                quad((x0, y0, here), (x1, y0, here), (x1, y1, here), (x0, y1, here))
                quad((x0, y0, bottom), (x0, y1, bottom), (x1, y1, bottom), (x1, y0, bottom))
            if j + 1 < len(ys) and here != left:
                quad((xs[i], ys[j], left), (xs[i], ys[j], here), (xs[i], ys[j + 1], here), (xs[i], ys[j + 1], left))
            if i + 1 < len(xs) and here != front:
                quad((xs[i], ys[j], front), (xs[i + 1], ys[j], front), (xs[i + 1], ys[j], here), (xs[i], ys[j], here))
    return np.array(found, float)


def left_by(segments, radius, top, x, y):
    """Height of the stock at x, y (n,) after cuts ((x0, y0), (x1, y1), z) of a flat tool."""
    height = np.full(len(x), float(top))
    for a, b, z in segments:
        (ax, ay), (dx, dy) = a, (b[0] - a[0], b[1] - a[1])
        t = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-12), 0, 1)
        hit = np.hypot(x - ax - t * dx, y - ay - t * dy) <= radius
        height[hit] = np.minimum(height[hit], z)
    return height


def deviations(xs, ys, levels, bottom, segments, radius, top):
    """(largest gouge, largest rest) in mm, on a grid of GRID_MM over the part; levels without holes."""
    x, y = (
        v.ravel()
        for v in np.meshgrid(
            np.arange(xs[0] + GRID_MM / 2, xs[-1], GRID_MM), np.arange(ys[0] + GRID_MM / 2, ys[-1], GRID_MM)
        )
    )
    levels = np.asarray(levels, float)
    part = levels[np.searchsorted(ys, y) - 1, np.searchsorted(xs, x) - 1]
    height = np.maximum(left_by(segments, radius, top, x, y), bottom)
    gouge = np.minimum.reduce([x - xs[0], xs[-1] - x, y - ys[0], ys[-1] - y])
    rest = np.full(len(x), np.inf)
    for j in range(len(ys) - 1):
        for i in range(len(xs) - 1):
            dx = np.maximum(np.maximum(xs[i] - x, x - xs[i + 1]), 0)
            dy = np.maximum(np.maximum(ys[j] - y, y - ys[j + 1]), 0)
            gouge = np.minimum(gouge, np.sqrt(dx**2 + dy**2 + np.maximum(min(levels[j][i], top) - height, 0) ** 2))
            rest = np.minimum(rest, np.sqrt(dx**2 + dy**2 + np.maximum(height - levels[j][i], 0) ** 2))
    return float(np.where(height < np.minimum(part, top), gouge, 0).max()), float(
        np.where(height > part, rest, 0).max()
    )
