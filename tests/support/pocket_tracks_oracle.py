# SPDX-License-Identifier: GPL-2.0-or-later
"""Judge of pocket strategies, written apart from them: plain tuples, brute force, a fine raster.

Used by tests/geometry/test_pocket_strategies.py.  Every check returns what is
wrong as a list of words, empty where all is well, so that a test can show it fail.
"""

import math

import numpy as np

from support.contour_oracle import from_elements, length, nearest, samples, winding


class Cleared:
    """A machinable region and what a strategy made of it, as plain tuples: field, tracks (lists of elements)."""

    def __init__(self, field, tracks, radius):
        self.contours = [from_elements(c) for c in field.contours]
        self.field = [el for c in self.contours for el in c]
        self.tracks = [from_elements(t.elements) for t in tracks]
        self.radius = radius

    @property
    def every(self):
        return [el for t in self.tracks for el in t]


def broken(job):
    """Tracks that are not connected or hold an element that goes nowhere."""
    wrong = []
    for k, track in enumerate(job.tracks):
        for a, b in zip(track, track[1:]):
            if math.dist(a[3:5], b[1:3]) > 1e-6:
                wrong.append(f"track {k} jumps {math.dist(a[3:5], b[1:3])} mm")
        if any(length(el) < 1e-10 for el in track) and len(track) > 1:
            wrong.append(f"track {k} holds an element without length")
    return wrong


def outside(job, step=0.2, allowed=1e-6):
    """Places of tracks further outside the closed region than allowed (mm)."""
    p = samples(job.every, step)
    out = p[winding(job.field, p) != 1]
    far = nearest(job.field, out) if len(out) else np.zeros(0)
    return [f"{far.max()} mm outside the region"] if len(far) and far.max() > allowed else []


def raster(job, cell, reach):
    """Places (n, 2), `cell` mm apart, whose distance from the region is at most reach."""
    p = samples(job.contours[0], 1.0)
    low, high = p.min(axis=0) - reach, p.max(axis=0) + reach
    x, y = (np.arange(a + 0.37 * cell, b, cell) for a, b in zip(low, high))
    p = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    within = winding(job.field, p) == 1
    beside = np.flatnonzero(~within)
    within[beside] = nearest(job.field, p[beside]) <= reach
    return p[within]


def residue(job, cell):
    """Places the tool can reach that no track reaches, with the depth of the worst (mm)."""
    p = raster(job, cell, job.radius - 1e-6)
    left = nearest(job.every, p) - job.radius
    return (
        [f"{np.count_nonzero(left > 1e-6)} places left of {len(p)}, the worst by {left.max()} mm"]
        if len(left) and left.max() > 1e-6
        else []
    )


def too_far_apart(job, step, cell):
    """Places of the region further from every track than a step-over."""
    p = raster(job, cell, 0.0)
    gap = nearest(job.every, p)
    return [f"{gap.max()} mm from the next track"] if len(gap) and gap.max() > step + 1e-6 else []


def contours_missed(job, climb):
    """Contours that the last tracks do not end with, run once in the direction asked for."""
    wrong, ends = [], job.tracks[len(job.tracks) - len(job.contours) :]
    for k, contour in enumerate(job.contours):
        mine = [t for t in ends if _ends_with(t, contour, climb)]
        if len(mine) != 1:
            wrong.append(f"contour {k} is run by {len(mine)} of the last tracks")
    return wrong


def _ends_with(track, contour, climb):
    """Whether the last elements of a track run a whole closed contour."""
    total, done, k = sum(map(length, contour)), 0.0, len(track)
    if total < 1e-3:
        return nearest(track, samples(contour, 0.5)).max() < 1e-6
    while k and done < total - 1e-4:
        k -= 1
        done += length(track[k])
    tail = track[k:]
    if abs(done - total) > 1e-4 or math.dist(tail[0][1:3], tail[-1][3:5]) > 1e-6:
        return False
    return (
        nearest(contour, samples(tail, 0.5)).max() < 1e-6
        and nearest(tail, samples(contour, 0.5)).max() < 1e-6
        and (abs(_area(contour)) < 1e-6 or (_area(tail) * _area(contour) > 0.0) == climb)
    )


def _area(shape):
    p = samples(shape, 0.05)
    return 0.5 * float(p[:, 0] @ np.roll(p[:, 1], -1) - p[:, 1] @ np.roll(p[:, 0], -1))


def entries(job, slack=1e-6):
    """Numbers of the tracks that begin where no track before them has been."""
    found, cut = [], []
    for k, track in enumerate(job.tracks):
        if not cut or nearest(cut, np.array([track[0][1:3]]))[0] > slack:
            found.append(k)
        cut += track
    return found


def chords(job, direction):
    """(start, end) across-coordinates and senses of the straight cuts along a direction inside the
    Region: [(across mm, +1 or -1)]."""
    u = np.array((math.cos(direction), math.sin(direction)))
    found = []
    for el in job.every:
        d = np.array(el[3:5]) - np.array(el[1:3])
        if el[0] == "L" and abs(d[0] * u[1] - d[1] * u[0]) < 1e-9 * math.hypot(*d):
            middle = 0.5 * (np.array(el[1:3]) + np.array(el[3:5]))
            if nearest(job.field, middle[None])[0] > 1e-9:
                found.append((float(middle @ (-u[1], u[0])), int(np.sign(d @ u))))
    return found
