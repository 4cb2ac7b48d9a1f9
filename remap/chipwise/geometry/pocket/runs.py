"""Places on a run of elements, and runs cut and turned there.

Called by rings.py, leftovers.py and cycles/pocket.py.  A place is (element index, parameter).
"""
import numpy as np

from .. import elements
from ..elements import Elements
from ..intersect import parameters

# A place nearer than this to an end of its element is that end: no piece is ever shorter. mm
SNAP_MM = 1e-3


def rising(values):
    """Indices (n,) of lengths (n,) mm from the smallest up; equal within SNAP_MM in their order, so
    that rounding (an inch machine's tool table) does not turn choices over."""
    return np.argsort(np.round(np.asarray(values) / SNAP_MM), kind="stable")


def least(values):
    """Index of the smallest of lengths, mm, flattened; the first of several that are equal."""
    return int(np.argmin(np.round(np.asarray(values) / SNAP_MM)))


def nearest(run, point):
    """(distance mm, index, t) of the place on a run nearest to a point (2,) mm."""
    index = np.arange(len(run))
    at = np.broadcast_to(point, (len(run), 2))
    gap = elements.distances(run, index, at)
    k = least(gap)
    t = float(np.clip(parameters(run, index[k:k + 1], at[k:k + 1])[0], 0.0, 1.0))
    if run.is_arc[k]:                             # beyond an end the nearer end, not the nearer angle
        ends = np.hypot(*(run.start[k] - point)), np.hypot(*(run.end[k] - point))
        if min(ends) <= gap[k]:
            t = 0.0 if ends[0] <= ends[1] else 1.0
    return float(gap[k]), k, t


def place_at(run, along):
    """(index, t) of the place `along` mm from the start of a closed run, counted round."""
    length = elements.lengths(run)
    upto = np.cumsum(length)
    along = along % upto[-1] if upto[-1] > 0.0 else 0.0
    k = min(int(np.searchsorted(upto, along, side="right")), len(run) - 1)
    return k, float(np.clip(1.0 - (upto[k] - along) / max(length[k], 1e-300), 0.0, 1.0))


def along_of(run, index, t):
    """mm from the start of a run to a place."""
    length = elements.lengths(run)
    return float(np.sum(length[:index]) + t * length[index])


def point(run, index, t):
    """(2,) mm"""
    return elements.point_at(run, np.array([index]), np.array([t]))[0]


def snapped(run, index, t):
    """The place, or the end of its element where that is nearer than SNAP_MM."""
    length = elements.lengths(run)[index]
    if t * length <= SNAP_MM:
        return index, 0.0
    if (1.0 - t) * length <= SNAP_MM:
        return (index + 1) % len(run), 0.0
    return index, t


def piece(run, index, t0, t1):
    """One element (as Elements) from t0 to t1 of element `index`."""
    pick = np.array([index])
    start = run.start[pick] if t0 == 0.0 else elements.point_at(run, pick, np.array([t0]))
    end = run.end[pick] if t1 == 1.0 else elements.point_at(run, pick, np.array([t1]))
    sweep = run.sweep[pick] * (t1 - t0)
    return Elements(start, end, run.centre[pick], run.radius[pick],
                    run.start_angle[pick] + t0 * run.sweep[pick], sweep)


def rotated(run, index, t):
    """A closed run that starts and ends at a place."""
    index, t = snapped(run, index, t)
    order = (np.arange(len(run)) + index) % len(run)
    if t == 0.0:
        return elements.take(run, order)
    return elements.join((piece(run, index, t, 1.0), elements.take(run, order[1:]),
                          piece(run, index, 0.0, t)))


def line(start, end):
    """One line (as Elements)."""
    return elements.make_lines(np.array(start, float).reshape(1, 2),
                               np.array(end, float).reshape(1, 2))


def flat(run, sagitta):
    """Points (m, 2) mm on a run, arcs in chords no further than `sagitta` mm from them."""
    half = np.arccos(np.clip(1.0 - sagitta / np.maximum(run.radius, sagitta), 0.0, 1.0))
    count = np.where(run.is_arc, np.ceil(np.abs(run.sweep) / np.maximum(2.0 * half, 1e-9)), 1)
    count = np.clip(count, 1, 2000).astype(int)
    index = np.repeat(np.arange(len(run)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    points = elements.point_at(run, index, step / count[index])
    return np.concatenate((points, run.end[-1:]))
