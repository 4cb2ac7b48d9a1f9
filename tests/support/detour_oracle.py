# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether a cycle among clamps keeps clear of them, and whether it could: written apart from chipwise.cycles.detour.
Called by tests/cycles/test_detour.py.

Distances are those of clamp_oracle.py, at places along the path.  Whether there is a route is looked for on a grid at
the highest height, by flooding the cells whose middles are free; a route on the grid is one of the tool, since cells
beside each other are nearer than GRID_MARGIN.  mm.
"""

import math
from collections import deque

import numpy as np

from chipwise.moves import Arc, Blend, Code, Copy, Rapid
from support import clamp_oracle
from support.detour_cases import REACH

SAMPLED_MM = 0.004  # chords of 0.002 mm and the tangents of a rounded end, 0.00008 of its radius
CELL, GRID_MARGIN = 0.5, 0.36
STEP = 0.1


def segments(moves, start):
    """[(whether a traverse, places (n, 3))] of each move."""
    here, found = tuple(start), []
    for move in moves:
        for own, row in zip(move.moves, move.places.tolist()) if isinstance(move, Copy) else ((move, None),):
            if isinstance(own, (Code, Blend)):
                continue
            values = row[:3] if row else (own.x, own.y, own.z)
            end = tuple(old if new is None else float(new) for new, old in zip(values, here))
            centre = (row[3:5] if row else (own.cx, own.cy)) if isinstance(own, Arc) else None
            found.append((isinstance(own, Rapid), _places(here, end, centre, own)))
            here = end
    return found


def _places(start, end, centre, move):
    if centre is None:
        share = np.linspace(0, 1, max(2, math.ceil(math.dist(start, end) / STEP)))[:, None]
        return np.array(start) + share * (np.array(end) - np.array(start))
    first, last = (math.atan2(p[1] - centre[1], p[0] - centre[0]) for p in (start, end))
    turn = (last - first if move.ccw else first - last) % (2 * math.pi)
    turn = (turn if turn > 1e-9 else 2 * math.pi) + 2 * math.pi * (move.turns - 1)
    radius = math.dist(start[:2], centre)
    share = np.linspace(0, 1, max(8, math.ceil(turn * radius / STEP)))
    angles = first + (turn if move.ccw else -turn) * share
    return np.column_stack(
        (
            centre[0] + radius * np.cos(angles),
            centre[1] + radius * np.sin(angles),
            start[2] + share * (end[2] - start[2]),
        )
    )


def distance(case, places):
    """mm of the clamps from the tool, its shank and its holder at the nearest of the places."""
    parts = ["tool"] + ["holder"] * ("holder_diameter" in case.tool)
    return min(
        float(clamp_oracle.grown(case.tool, part, clamp, places).min()) for clamp in case.clamps for part in parts
    )


def nearest(case, moves):
    """As distance(), of a whole plan."""
    return distance(case, np.concatenate([places for _rapid, places in segments(moves, case.start)]))


def hindered(case):
    """(whether a cut of the plan comes nearer than the clearance, whether a link between its cuts has no route on the
    grid)."""
    runs, cuts = [], []
    for rapid, places in segments(case.moves, case.start):
        if not rapid:
            cuts.append(places)
            runs.append(None)
        elif runs and runs[-1] is not None:
            runs[-1] = runs[-1][0], places[-1]
        else:
            runs.append((places[0], places[-1]))
    cut = bool(cuts) and distance(case, np.concatenate(cuts)) < case.clearance + SAMPLED_MM
    ends = [run for run in runs if run]
    if any(distance(case, np.array(run)) < case.clearance + SAMPLED_MM for run in ends):
        return cut, True
    label = _parts(case, max(case.limit if case.limit < 1000 else 100.0, max(p[2] for run in ends for p in run)))
    return cut, any(not _same(label, *run) for run in ends)


def _parts(case, z):
    """The grid: a number for each cell, the same for those that are connected, 0 where the tool must not be."""
    axis = np.arange(-REACH, REACH + CELL / 2, CELL)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    places = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, z)))
    free = np.full(x.size, True)
    for clamp in case.clamps:
        for part in ["tool"] + ["holder"] * ("holder_diameter" in case.tool):
            free &= clamp_oracle.grown(case.tool, part, clamp, places) >= min(
                case.clearance + GRID_MARGIN, clamp_oracle.FAR
            )
    label = np.where(free.reshape(x.shape), -1, 0)
    number = 0
    for seed in np.argwhere(label == -1):
        if label[tuple(seed)] != -1:
            continue
        number += 1
        label[tuple(seed)] = number
        queue = deque([tuple(seed)])
        while queue:
            i, j = queue.popleft()
            for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if 0 <= a < len(axis) and 0 <= b < len(axis) and label[a, b] == -1:
                    label[a, b] = number
                    queue.append((a, b))
    return label


def _same(label, start, end):
    """Whether two places are in one part of the grid."""
    cells = [tuple(np.rint((place[:2] + REACH) / CELL).astype(int)) for place in (start, end)]
    found = [label[cell] for cell in cells]
    return found[0] == found[1] != 0
