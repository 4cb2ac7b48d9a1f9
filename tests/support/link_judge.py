# SPDX-License-Identifier: GPL-2.0-or-later
"""Judges the links between the cuts of a surface: where the tool really is when LinuxCNC rounds their corners, and how
long it takes.

Shares nothing with the package but the moves.  Corners are arcs that are off the corner by at most the tolerance of G64
and take at most half of each side; the speed is found by passing over points of the path forwards and backwards.
"""

from dataclasses import dataclass, field

import numpy as np

from support import surface_judge

STEP = 0.05  # mm between points of a path
SPEED, ACCEL = 100.0, 500.0  # mm/s, mm/s2 of each axis of the simulated mill
ACROSS, ALONG = 0.866, 0.5  # of the acceleration on an arc
EXACT = 0.002  # mm: G64 P of the cuts


@dataclass
class Link:
    """first: number of its first move; before: (feed, points) of a lift; corners: (k, 3) of its traverses; blend: mm;
    after: (feed, points) in"""

    first: int
    corners: list
    blend: float
    before: tuple = ()
    after: tuple = field(default=())


def links_of(moves, start):
    """The Links of moves from a start, without what leads to the first cut and from the last one."""
    at, found, one, last, blend = np.array(start, float), [], None, None, EXACT
    for k, move in enumerate(moves):
        kind = type(move).__name__
        if kind == "Blend":
            blend = EXACT if move.tolerance is None else move.tolerance
            continue
        new = np.array([old if value is None else value for old, value in zip(at, (move.x, move.y, move.z))], float)
        if kind == "Rapid":
            if one is None:
                lifts = (
                    last is not None
                    and last[0] == "Line"
                    and np.allclose(last[1][0][:2], last[1][1][:2])
                    and last[1][1][2] > last[1][0][2]
                )
                one = Link(k, [at], blend, (last[2], last[1]) if lifts else ())
            one.corners.append(new)
        elif one is not None:
            one.after = move.feed, (at, new)
            found.append(one)
            one = None
        last, at = (kind, (at, new), getattr(move, "feed", 0.0)), new
    return found[1:]


def rounded(corners, blend):
    """Points (n, 3) of a path with rounded corners, and the radius (n,) there: inf on straight parts."""
    corners = [corners[0], *(b for a, b in zip(corners, corners[1:]) if np.linalg.norm(b - a) > 1e-9)]
    points, radii, begin = [], [], corners[0]
    for k in range(1, len(corners)):
        arc, end, after = None, corners[k], corners[k]
        if k + 1 < len(corners):
            u, v = corners[k] - corners[k - 1], corners[k + 1] - corners[k]
            a, b = np.linalg.norm(u), np.linalg.norm(v)
            u, v = u / a, v / b
            half = np.arccos(np.clip(u @ v, -1, 1)) / 2
            if 1e-6 < half < np.pi / 2 - 1e-6:
                radius = min(blend / (1 / np.cos(half) - 1), min(a, b) / 2 / np.tan(half))
                taken = radius * np.tan(half)
                end, after = corners[k] - taken * u, corners[k] + taken * v
                inward = (v - u) / np.linalg.norm(v - u)
                centre = corners[k] + inward * radius / np.cos(half)
                angle = np.linspace(-half, half, max(3, int(np.ceil(2 * half * radius / STEP)) + 1))
                along = (u + v) / np.linalg.norm(u + v)
                arc = centre + radius * (np.sin(angle)[:, None] * along - np.cos(angle)[:, None] * inward)
        count = max(2, int(np.ceil(np.linalg.norm(end - begin) / STEP)) + 1)
        points.append(np.linspace(begin, end, count))
        radii.append(np.full(count, np.inf))
        if arc is not None:
            points.append(arc)
            radii.append(np.full(len(arc), radius))
        begin = after
    return np.concatenate(points), np.concatenate(radii)


def path_seconds(points, radii, speed=np.inf):
    """Seconds along points (n, 3) from rest to rest, each axis with SPEED and ACCEL, at most `speed` mm/s."""
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    keep = length > 1e-9
    step, length, radius = step[keep], length[keep], np.minimum(radii[:-1], radii[1:])[keep]
    most = np.abs(step / length[:, None]).max(axis=1)
    is_arc = np.isfinite(np.maximum(radii[:-1], radii[1:])[keep])
    accel = np.where(is_arc, ALONG * ACCEL, ACCEL / most)
    top = np.minimum(
        np.minimum(speed, SPEED / most), np.where(is_arc, np.sqrt(ACROSS * ACCEL * np.minimum(radius, 1e9)), np.inf)
    )
    square = np.concatenate([[0.0], np.minimum(top[:-1], top[1:]) ** 2, [0.0]])
    for k in range(len(length)):
        square[k + 1] = min(square[k + 1], square[k] + 2 * accel[k] * length[k])
    for k in range(len(length) - 1, -1, -1):
        square[k] = min(square[k], square[k + 1] + 2 * accel[k] * length[k])
    peak = np.minimum(top, np.sqrt((square[:-1] + square[1:]) / 2 + accel * length))
    ramps = (2 * peak**2 - square[:-1] - square[1:]) / (2 * accel)
    return float(
        ((2 * peak - np.sqrt(square[:-1]) - np.sqrt(square[1:])) / accel + np.maximum(length - ramps, 0) / peak).sum()
    )


def rounded_positions(moves, start):
    """As surface_judge.positions(), but the traverses of a link are one path with rounded corners."""
    at, found, corners, blend = np.array(start, float), [], [], EXACT
    for move in moves:
        kind = type(move).__name__
        if kind != "Rapid" and corners:
            found.append((True, rounded(corners, blend)[0] if len(corners) > 2 else surface_judge.between(*corners)))
            corners = []
        if kind == "Blend":
            blend = EXACT if move.tolerance is None else move.tolerance
            continue
        new = np.array([old if value is None else value for old, value in zip(at, (move.x, move.y, move.z))], float)
        if kind == "Rapid":
            corners = [*(corners or [at]), new]
        else:
            found.append((False, surface_judge.along(move, at, new)))
        at = new
    return found + ([(True, rounded(corners, blend)[0])] if corners else [])


def seconds(link):
    """Seconds of a Link, its lift and its lead-in."""
    total = path_seconds(*rounded(link.corners, link.blend))
    for feed, ends in filter(None, (link.before, link.after)):
        total += path_seconds(np.array(ends), np.full(2, np.inf), feed / 60)
    return total
