# SPDX-License-Identifier: GPL-2.0-or-later
"""The lowest tip of a tool over triangles by brute force: an oracle for the drop cutter that shares nothing with it.

The profile is written down from what the tools are (ball: sphere, bull-nose: torus, ..), and the maximum of z - g(r) over each
triangle is searched on grids of points of it that shrink around the best.  Called by tests/surface and bench/bench_surface.py.
"""
import math

import numpy as np

GRID, ZOOMS = 24, 130
STEEP = 2.0             # how fast a point outside of the tool's radius falls in rank, times what the triangle may rise there


def profile(shape):
    """g(r) of a check.sweep.Shape: mm above the tip at r mm from the axis."""
    radius, corner, half = shape.diameter / 2, min(shape.corner_radius, shape.diameter / 2), math.radians(shape.tip_angle) / 2

    def height(r):
        if half:            # a sphere of the corner's radius in a cone
            touch = corner * math.cos(half)
            sphere = corner - np.sqrt(np.maximum(corner ** 2 - r ** 2, 0))
            cone = corner - corner / math.sin(half) + r / math.tan(half)
            return np.where(r <= touch, sphere, cone)
        inner = np.maximum(r - (radius - corner), 0)
        return corner - np.sqrt(np.maximum(corner ** 2 - inner ** 2, 0))
    return height, radius


def _weights():
    i, j = np.meshgrid(np.arange(GRID + 1), np.arange(GRID + 1))
    keep = i + j <= GRID
    return np.stack([i[keep], j[keep], GRID - i[keep] - j[keep]], axis=1) / GRID


def steepest(triangles):
    """Largest rise of each triangle per mm in XY, at most 1000."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.minimum(np.hypot(normal[:, 0], normal[:, 1]) / np.maximum(np.abs(normal[:, 2]), 1e-12), 1000)


def over_triangles(triangles, shape, x, y):
    """(n, 3, 3) -> (n,): the lowest tip over each alone with the axis at (x, y); -inf where it is not met."""
    height, radius = profile(shape)
    area, found = np.array(triangles, float), np.full(len(triangles), -np.inf)
    weights, fall = _weights(), STEEP * (1 + steepest(area))[:, None]
    for _ in range(ZOOMS if len(area) else 0):
        points = np.einsum("wk,nkc->nwc", weights, area)
        r = np.hypot(points[:, :, 0] - x, points[:, :, 1] - y)
        value = points[:, :, 2] - height(np.minimum(r, radius))
        found = np.maximum(found, np.where(r <= radius, value, -np.inf).max(axis=1))
        best = points[np.arange(len(area)), (value - fall * np.maximum(r - radius, 0)).argmax(axis=1)]
        moved = area + 0.12 * (best[:, None, :] - area)         # a triangle of 0.88 times the size, inside, around the best
        area = moved
    found = np.maximum(found, on_edges(np.asarray(triangles, float), height, radius, x, y))
    found = np.maximum(found, on_axis(np.asarray(triangles, float), x, y))
    return np.maximum(found, on_rim(np.asarray(triangles, float), radius, x, y) - height(radius))


def on_axis(triangles, x, y):
    """(n, 3, 3) -> (n,): height of each at the axis, where a pointed tool has its tip; -inf beside it."""
    found = np.full(len(triangles), -np.inf)
    for number, (a, b, c) in enumerate(triangles):
        matrix = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        if abs(np.linalg.det(matrix)) > 1e-12:
            u, v = np.linalg.solve(matrix, np.array([x, y]) - a[:2])
            if u >= 0 and v >= 0 and u + v <= 1:
                found[number] = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
    return found


def on_edges(triangles, height, radius, x, y):
    """(n, 3, 3) -> (n,): as over_triangles, of the edges only: the grids hardly follow a ridge."""
    found = np.full(len(triangles), -np.inf)
    for k in range(3):
        a, step = triangles[:, k], triangles[:, (k + 1) % 3] - triangles[:, k]
        middle, width = np.full(len(a), 0.5), 0.5
        for _ in range(10):
            share = np.clip(middle[:, None] + width * np.linspace(-1, 1, 101), 0, 1)
            points = a[:, None] + share[:, :, None] * step[:, None]
            r = np.hypot(points[:, :, 0] - x, points[:, :, 1] - y)
            value = np.where(r <= radius, points[:, :, 2] - height(np.minimum(r, radius)), -1e9 - r)     # none met: the nearest
            best = value.argmax(axis=1)
            middle, width = share[np.arange(len(a)), best], width / 20
            top = value.max(axis=1)
            found = np.maximum(found, np.where(top > -1e9, top, -np.inf))
    return found


def on_rim(triangles, radius, x, y):
    """(n, 3, 3) -> (n,): the highest point of each on the tool's radius about (x, y): where its edges cross it, and at angles that
    zoom in; -inf without."""
    found = np.full(len(triangles), -np.inf)
    centre = np.array([x, y])
    for k in range(3):
        a, step = triangles[:, k], triangles[:, (k + 1) % 3] - triangles[:, k]
        along = np.einsum("nc,nc->n", a[:, :2] - centre, step[:, :2])
        square = np.maximum(np.einsum("nc,nc->n", step[:, :2], step[:, :2]), 1e-300)
        root = along ** 2 - square * (((a[:, :2] - centre) ** 2).sum(axis=1) - radius ** 2)
        for sign in (-1, 1):
            share = (-along + sign * np.sqrt(np.maximum(root, 0))) / square
            found = np.maximum(found, np.where((root >= 0) & (share >= 0) & (share <= 1), a[:, 2] + share * step[:, 2], -np.inf))
    for number, (a, b, c) in enumerate(triangles):
        matrix = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        angle, width = 0.0, math.pi
        for _ in range(5):
            angles = angle + width * np.linspace(-1, 1, 2001)
            u, v = np.linalg.solve(matrix, (centre - a[:2])[:, None] + radius * np.stack([np.cos(angles), np.sin(angles)]))
            height = np.where((u >= 0) & (v >= 0) & (u + v <= 1), a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]), -np.inf)
            best = int(height.argmax())
            if height[best] == -np.inf:
                break
            found[number] = max(found[number], height[best])
            angle, width = angles[best], width / 200
    return found


def lowest(triangles, shape, x, y, floor):
    """The lowest tip over all triangles with the axis at (x, y), mm, or the floor."""
    triangles = np.asarray(triangles, float).reshape(-1, 3, 3)
    low, high = triangles[:, :, :2].min(axis=1), triangles[:, :, :2].max(axis=1)
    reach = shape.diameter / 2
    near = ((low <= np.array([x, y]) + reach) & (high >= np.array([x, y]) - reach)).all(axis=1)
    return max([floor, *over_triangles(_candidates(triangles[near], shape, x, y), shape, x, y)])


def _candidates(triangles, shape, x, y):
    """Those that can be above what the corners of all of them already ask for: a tip is never above its triangle."""
    height, radius = profile(shape)
    r = np.hypot(triangles[:, :, 0] - x, triangles[:, :, 1] - y)
    bound = np.where(r <= radius, triangles[:, :, 2] - height(np.minimum(r, radius)), -np.inf).max(initial=-np.inf)
    gap = np.maximum(0, np.maximum(triangles[:, :, :2].min(axis=1) - (x, y), (x, y) - triangles[:, :, :2].max(axis=1)))
    top = triangles[:, :, 2].max(axis=1) - height(np.minimum(np.hypot(*gap.T), radius))
    return triangles[top >= bound - 1e-9]
