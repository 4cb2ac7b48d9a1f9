# SPDX-License-Identifier: GPL-2.0-or-later
"""Operations on straight lines, on arrays.

Called by elements.py and intersect.py.  All lengths mm; shapes as given.
"""

import numpy as np

from chipwise.geometry.base.tolerances import PARALLEL


def cross(a, b):
    """z of the cross product of a and b, both (..., 2) -> (...)."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def dot(a, b):
    """Scalar product of a and b, both (..., 2) -> (...)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def right_normal(direction):
    """Unit normal to the right of a direction (..., 2)."""
    length = np.hypot(direction[..., 0], direction[..., 1])
    return np.stack((direction[..., 1] / length, -direction[..., 0] / length), axis=-1)


def parameter(point, start, end):
    """Parameter (n,) on the carrier of the line start-end of the foot of `point`, all
    (n, 2); 0 at the start, 1 at the end."""
    along = end - start
    length2 = dot(along, along)
    return dot(point - start, along) / np.where(length2 > 0.0, length2, 1.0)


def intersect_lines(start_a, end_a, start_b, end_b):
    """Parameters (t, u) of the common point of the carriers of n pairs of lines.

    All arguments (n, 2) mm.  Parallel pairs give nan: what they share, if they lie on one
    another, are end points, which the caller tests by distance.
    """
    along_a, along_b = end_a - start_a, end_b - start_b
    denominator = cross(along_a, along_b)
    scale = np.hypot(*along_a.T) * np.hypot(*along_b.T)
    denominator = np.where(np.abs(denominator) > PARALLEL * scale, denominator, np.nan)
    between = start_b - start_a
    return cross(between, along_b) / denominator, cross(between, along_a) / denominator
