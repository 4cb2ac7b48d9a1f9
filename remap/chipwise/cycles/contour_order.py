# SPDX-License-Identifier: GPL-2.0-or-later
"""The order of the paths of several radial passes of G77: chamber by chamber.  Called by contour.py; pure, mm.

In a narrow place the outer passes fall into parts that the inner ones do not have.  A path has to wait for those next
to it on the side of the stock: what lies between them is the step.  So it is run right after them, and the tool leaves
a chamber when nothing of it is left.

The path of the next pass that a place belongs to: the place moved towards the wall, along the path's normal, by the
step.  The disc about the place that touches the wall holds the smaller one about that point, so the point lies on the
next pass.
"""

import numpy as np

from chipwise.geometry.base import elements

# Places of an open path that are looked at; all of a closed one belong to one path, because it bounds one region.
PLACES = 64


def chambers(radial, step, normals):
    """Lists of paths, each to be run in its order at one depth after the other, from the paths of each pass, outside
    in.

    step: distance of the passes; normals(elements, index, t): unit normals (m, 2) away from the wall.
    """
    outer = [[[] for _ in paths] for paths in radial]  # of each path: those of the pass before that it waits for
    for k, paths in enumerate(radial[:-1]):
        for number, path in enumerate(paths):
            for other in _inner(path, radial[k + 1], step, normals):
                outer[k + 1][other].append(number)
    done = [[False] * len(paths) for paths in radial]

    def after(k, number):
        """A path behind all that it waits for."""
        if done[k][number]:
            return []
        done[k][number] = True
        return [path for other in outer[k][number] for path in after(k - 1, other)] + [radial[k][number]]

    last = len(radial) - 1
    return [after(last, number) for number in range(len(radial[last]))]


def _inner(path, following, step, normals):
    """Numbers of the paths of the next pass that places of a path belong to."""
    if len(following) == 1:
        return (0,)
    e, length = path.elements, elements.lengths(path.elements)
    if not length.any():
        places = e.start[:1]
    else:
        index = (
            np.array([length.argmax()])
            if path.closed
            else np.unique(np.linspace(0, len(e) - 1, min(len(e), PLACES)).round().astype(int))
        )
        middle = np.full(len(index), 0.5)
        places = elements.point_at(e, index, middle) - normals(e, index, middle) * step
    gaps = [_gaps(other.elements, places) for other in following]
    return sorted(set(np.argmin(gaps, axis=0).tolist()))


def _gaps(e, places):
    """Distance (m,) mm of places (m, 2) from a path."""
    which, element = np.divmod(np.arange(len(places) * len(e)), len(e))
    return elements.distances(e, element, places[which]).reshape(len(places), len(e)).min(axis=1)
