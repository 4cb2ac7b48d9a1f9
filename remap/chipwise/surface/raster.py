# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts side by side in one direction over a model, as chains of lines and arcs within a tolerance.

Called by cycles/surface.py.  All lengths mm.

A chain is on or above the model: at most GOUGE below it anywhere, at most the tolerance above the lowest path of the
    tool
    1. stations are halved until the middle of two is within a fifth of the tolerance of the line between them;
    2. a step between stations as close as a quarter of the tolerance is a wall: the path goes straight up or down
       beside it;
    3. chip_chain_fit keeps as few stations as the rest of the tolerance allows, upwards only, with lines between them
       and, on tracks along X or Y, arcs;
    4. chip_drop_excess looks at every segment between its ends, too; a station is added where the model is higher.  For
       an arc it looks at chords or tangents that are below it by at most ARC_SAG of the tolerance.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.clib.chain_fit import fitted
from chipwise.clib.drop_cutter import Probe
from chipwise.errors import CycleError
from chipwise.surface import curve

GOUGE = 5e-4  # mm [4]
SAMPLING = 0.2  # of the tolerance [1]
NARROW = 0.25  # of the tolerance [2]
ROUNDS = 8  # of adding stations [4]; then the segment is raised
ARC_ROUNDS = 5  # of them with arcs
ARC_SAG, MOST_SAG = 0.25, 0.0025  # of the tolerance, and mm: of the chords in place of an arc
LEAST_STEP = 0.05  # mm, of the first stations
MOST_STATIONS = 6_000_000  # of all tracks: each needs about 80 bytes


@dataclass(frozen=True)
class Tracks:
    """Straight tracks seen from above.  start (n, 2), direction (n, 2) unit vectors, length (n,); mm"""

    start: np.ndarray
    direction: np.ndarray
    length: np.ndarray

    def backwards(self, which):
        """The tracks of the mask `which` (n,) the other way round."""
        which = np.asarray(which)[:, None]
        return Tracks(
            np.where(which, self.start + self.direction * self.length[:, None], self.start),
            np.where(which, -self.direction, self.direction),
            self.length,
        )

    @property
    def end(self):
        return self.start + self.direction * self.length[:, None]


def between(start, end):
    """Tracks from points (n, 2) to points (n, 2)."""
    step = end - start
    length = np.hypot(step[:, 0], step[:, 1])
    return Tracks(start, step / np.maximum(length, 1e-12)[:, None], length)


def with_links(tracks):
    """Tracks of a zigzag with the tracks from the end of each to the start of the next between them."""
    links = between(tracks.end[:-1], tracks.start[1:])
    order = np.argsort(
        np.concatenate([np.arange(len(tracks.length)), np.arange(len(links.length)) + 0.5]), kind="stable"
    )
    return Tracks(
        *(
            np.concatenate([a, b])[order]
            for a, b in (
                (tracks.start, links.start),
                (tracks.direction, links.direction),
                (tracks.length, links.length),
            )
        )
    )


def count_of(low, high, degrees, step):
    """Number of parallel tracks over a rectangle."""
    return max(1, math.ceil(width_of(low, high, degrees) / step - 1e-9) + 1)


def width_of(low, high, degrees):
    c, s = direction_of(degrees)
    return abs(s) * (high[0] - low[0]) + abs(c) * (high[1] - low[1])


def direction_of(degrees):
    angle = math.radians(degrees)
    return round(math.cos(angle), 15), round(math.sin(angle), 15)


def evenly(low, high, degrees, step):
    """Where tracks of a rectangle are, at most `step` apart: mm from its middle, both sides of it included -> (n,)."""
    count = count_of(low, high, degrees, step)
    return np.linspace(-0.5, 0.5, count) * width_of(low, high, degrees) if count > 1 else np.zeros(1)


def parallel(low, high, degrees, across, climb):
    """Tracks over the rectangle low .. high at `across` (n,), mm from its middle.  climb: each has the ones not yet cut
    on its right, else on its left."""
    c, s = direction_of(degrees)
    count = len(across)
    middle = (np.asarray(low[:2], float) + np.asarray(high[:2], float)) / 2
    half = (np.asarray(high[:2], float) - np.asarray(low[:2], float)) / 2
    if climb:
        across = across[::-1]
    first, last = np.full(count, -1e9), np.full(count, 1e9)
    for axis, along, side in ((0, c, -s), (1, s, c)):
        if abs(along) > 1e-12:
            ends = np.sort((np.array([[-half[axis]], [half[axis]]]) - across * side) / along, axis=0)
            first, last = np.maximum(first, ends[0]), np.minimum(last, ends[1])
    corner = np.minimum(first, last)  # a track through a corner is a point, whatever rounding says
    start = middle + np.stack([-s * across + c * corner, c * across + s * corner], axis=1)
    return Tracks(start, np.tile((c, s), (count, 1)), np.maximum(last - first, 0.0))


def chains(probe, tracks, shape, tolerance, progress=lambda share: None, arcs=True):
    """One curve.Curve per track, and how many stations were sampled.  probe: drop.Probe; shape: check.sweep.Shape;
    arcs: whether they may be in it."""
    line, s, z = _sampled(probe, tracks, _first_step(shape, tolerance), tolerance, lambda share: progress(0.6 * share))
    line, s, z = _walls(line, s, z, tolerance)
    bounds = np.searchsorted(line, np.arange(len(tracks.length) + 1))
    samples = [(s[a:b], z[a:b]) for a, b in zip(bounds[:-1], bounds[1:])]
    found = [None] * len(samples)
    fit = _Fit(probe, tracks, tolerance, samples, found)
    waiting = np.arange(len(samples))
    with_arcs = curve.may_have_arcs(tracks.direction) & arcs
    for turn in range(ROUNDS):
        for k in waiting:
            found[k] = _fitted(*samples[k], tolerance, with_arcs[k] and turn < ARC_ROUNDS)
        waiting = fit.add(waiting, turn == ROUNDS - 1)
        progress(0.6 + 0.4 * (1.0 - len(waiting) / len(samples)))
        if not len(waiting):
            break
    sag = min(ARC_SAG * tolerance, MOST_SAG)
    return [curve.placed(tracks.start[k], tracks.direction[k], *part, sag) for k, part in enumerate(found)], len(s)


def _first_step(shape, tolerance):
    """So close that a bump as high as the tolerance is not passed over: the tip over a point of the model is the tool
    upside down."""
    radius = shape.diameter / 2
    flat = 0.0 if shape.tip_angle else radius - shape.corner_radius
    return max(min(flat + math.sqrt(2.0 * shape.corner_radius * tolerance), radius / 4), min(LEAST_STEP, radius / 4))


def _sampled(probe, tracks, step, tolerance, progress):
    """(track, station, height) of each sample [1]."""
    counts = np.maximum(np.ceil(tracks.length / step), 1.0) + 1.0
    _check_stations(counts.sum())
    counts = counts.astype(int)
    line = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(line)) - np.repeat(np.cumsum(counts) - counts, counts)
    s = place * np.repeat(tracks.length / (counts - 1), counts)
    z = _heights(probe, tracks, line, s, progress)
    left = np.flatnonzero(line[:-1] == line[1:])
    while len(left):
        left = left[s[left + 1] - s[left] > NARROW * tolerance]
        middle = (s[left] + s[left + 1]) / 2
        height = _heights(probe, tracks, line[left], middle)
        off = np.abs(height - (z[left] + z[left + 1]) / 2) > SAMPLING * tolerance
        left, middle, height = left[off], middle[off], height[off]
        _check_stations(len(line) + len(left))
        line, s, z = (np.insert(old, left + 1, new) for old, new in zip((line, s, z), (line[left], middle, height)))
        left = left + np.arange(len(left))
        left = np.sort(np.concatenate([left, left + 1]))
    return line, s, z


def _check_stations(count):
    """Raises CycleError for more stations than MOST_STATIONS, before their arrays are made."""
    if count > MOST_STATIONS:
        raise CycleError(
            f"the cuts need {count:.0f} points of the model, more than {MOST_STATIONS}",
            "use a larger D or tolerance, or correct SCALE of the model",
        )


def _heights(probe, tracks, line, s, progress=lambda share: None, part=20_000):
    z = np.empty(len(s))
    for begin in range(0, len(s), part):
        some = slice(begin, begin + part)
        z[some] = probe.heights(tracks.start[line[some]] + s[some, None] * tracks.direction[line[some]])
        progress(begin / len(s))
    return z


def _walls(line, s, z, tolerance):
    """A sample at the upper height is put beside each step [2]."""
    at = np.flatnonzero(
        (line[:-1] == line[1:]) & (s[1:] - s[:-1] <= NARROW * tolerance) & (np.abs(z[1:] - z[:-1]) > tolerance)
    )
    lower = np.where(z[at] < z[at + 1], s[at], s[at + 1])
    return tuple(
        np.insert(old, at + 1, new) for old, new in zip((line, s, z), (line[at], lower, np.maximum(z[at], z[at + 1])))
    )


def _fitted(s, z, tolerance, arcs):
    """(stations, heights, arcs as in chip_chain_fit) of as few as the tolerance above the samples allows [3]."""
    kept, height, arc = fitted(s, z, z + (1.0 - SAMPLING) * tolerance, z + ARC_SAG * tolerance if arcs else None)
    return s[kept], height, arc


def thinned(points, room):
    """A chain (k, 3) over a straight track as lines that are at most `room` (mm) above it, and nowhere below."""
    far = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    s, z, _arc = _fitted(far, points[:, 2], room, False)
    return np.column_stack([np.interp(s, far, points[:, 0]), np.interp(s, far, points[:, 1]), z])


@dataclass(frozen=True, eq=False)
class _Fit:
    """Of each track its samples (stations, heights) and the chain that was fitted to them."""

    probe: Probe
    tracks: Tracks
    tolerance: float
    samples: list
    found: list

    def add(self, waiting, is_last):
        """Add a sample where the model rises above a segment of a waiting track, and say for which tracks [4]; at last
        raise the segment instead."""
        owner, s0, z0, s1, z1, segment = _segments([self.found[k] for k in waiting], self.tolerance)
        track = waiting[owner]
        start, end = (
            np.column_stack([self.tracks.start[track] + s[:, None] * self.tracks.direction[track], z])
            for s, z in ((s0, z0), (s1, z1))
        )
        excess, share = self.probe.excess(start, end, GOUGE)
        high = np.flatnonzero(excess > GOUGE)
        for i in high if is_last else ():
            self.found[track[i]][1][segment[i] : segment[i] + 2] += excess[i]
        new, height = s0 + share * (s1 - s0), z0 + share * (z1 - z0) + excess
        dirty = np.unique(owner[high])
        for w in dirty:
            mine = high[owner[high] == w]
            old_s, old_z = self.samples[waiting[w]]
            at = np.searchsorted(old_s, new[mine])
            self.samples[waiting[w]] = np.insert(old_s, at, new[mine]), np.insert(old_z, at, height[mine])
        return waiting[dirty]


def _segments(parts, tolerance):
    """Straight segments on or below chains as in _fitted(): (number of the chain, s, z of the start, s, z of the end,
    edge of the chain) of each."""
    s, z, arc = (np.concatenate([part[k] for part in parts]) for k in range(3))
    chain = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
    first = np.searchsorted(chain, chain)
    edge, more_s, more_z = curve.divided(s, z, arc[1:], ARC_SAG * tolerance, outside=True)
    before_s, before_z = (np.concatenate([v[:1], more[:-1]]) for v, more in ((s, more_s), (z, more_z)))
    inside = chain[edge] == chain[edge + 1]  # not from the end of a chain to the start of the next
    edge = edge[inside]
    return chain[edge], before_s[inside], before_z[inside], more_s[inside], more_z[inside], edge - first[edge]
