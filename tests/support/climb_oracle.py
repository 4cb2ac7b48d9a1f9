# SPDX-License-Identifier: GPL-2.0-or-later
"""How much of a cut is climb milling, and what it leaves: moves (pattern_oracle.Move) on a grid of heights, with numpy
alone.

A flat tool that turns clockwise (M3) climbs where the stock it meets is on the right of its path.  Used by
tests/interpreter.
"""

import random

import numpy as np

CELL, HALF, STEP = 0.25, 16.0, 0.3  # mm
GRID = np.arange(-HALF + CELL / 2, HALF, CELL)
X, Y = np.meshgrid(GRID, GRID)


def disc(radius, top=0.0, floor=-9.0):
    """Heights of a round blank about the origin, its own mirror image."""
    return np.where(np.hypot(X, Y) <= radius, top, floor)


def cut(moves, start, heights, radius):
    """(share of the volume that climbs, volume in mm3, heights afterwards) of the cuts across."""
    heights, here, sides = heights.copy(), np.array(start, float), np.zeros(2)
    for move in moves:
        for end in move.points:
            count = max(1, int(np.ceil(np.linalg.norm(end - here) / STEP)))
            along = (end - here)[:2]
            for share in np.arange(1, count + 1) / count:
                x, y, z = here + (end - here) * share
                i0, i1 = np.searchsorted(GRID, (x - radius, x + radius))
                j0, j1 = np.searchsorted(GRID, (y - radius, y + radius))
                part = heights[j0:j1, i0:i1]
                dx, dy = X[j0:j1, i0:i1] - x, Y[j0:j1, i0:i1] - y
                met = np.where((dx * dx + dy * dy <= radius * radius) & (part > z), part - z, 0.0)
                if np.hypot(*along) > 1e-9 and move.kind != "rapid":
                    right = along[0] * dy - along[1] * dx < 0
                    sides += met[right].sum(), met[~right].sum()
                part -= met
            here = np.array(end, float)
    volume = sides.sum() * CELL * CELL
    return (sides[0] / sides.sum() if volume else 0.5), volume, heights


def random_profile(seed):
    """Lines of a sub O100 that goes round the origin in closed chains with lead-ins, in one direction, at several
    depths."""
    r = random.Random(f"climb {seed}")
    count, turn, phase = r.randint(4, 8), r.choice((1, -1)), r.uniform(0, 6)
    corners = [(r.uniform(7, 11), phase + turn * k * 2 * np.pi / count) for k in range(count)]
    corners = [(radius * np.cos(a), radius * np.sin(a)) for radius, a in corners]
    ahead = 1.4 * np.array(corners[0])
    body = [f"G0 X{ahead[0]:.4f} Y{ahead[1]:.4f}", "G0 Z2"]
    at = np.round(ahead, 4)
    for depth in sorted(r.uniform(-5, -1) for _ in range(r.randint(1, 3)))[::-1]:
        body.append(f"G1 Z{depth:.3f} F120")
        for k, (x, y) in enumerate([*corners, corners[0], ahead]):
            end = np.round((x, y), 4)
            kind = r.choice("123") if 0 < k <= count else "1"
            size = f" R{np.hypot(*(end - at)) * r.uniform(0.8, 2):.4f}" if kind != "1" else ""
            body.append(f"G{kind} X{end[0]:.4f} Y{end[1]:.4f}{size}" + (" F400" if k == 0 else ""))
            at = end
    return ["o100 sub", *body, "G0 Z7", "o100 endsub"]
