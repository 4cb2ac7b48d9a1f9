# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool centre may be in a pocket: loops to machinable regions.

Called by cycles/pocket.py for the pocket, and by rings.py for every ring of it.  A pocket whose
necks are narrower than the tool falls into several machinable regions.  The work is done by kernel.py:
every ring comes from the original contours, so nothing adds up from ring to ring.
"""

import numpy as np

from chipwise.geometry.base import elements, winding
from chipwise.geometry.base.clearance import clear_lines, gouge_depths
from chipwise.geometry.offset.kernel import make_pocket, pocket_ring
from chipwise.geometry.offset.paths import PointContact
from chipwise.geometry.pocket.tracks import MachinableRegion

# Positions of a hole at which it is asked which boundary holds it: a loop may touch the boundary
# at one of them.
ASKED = 5

# A position or move counts as inside a machinable region this much nearer to the wall: rounding. mm
SLACK_MM = 1e-6


def split(boundary, islands, distance):
    """machinable regions of closed contours: tool centres at least `distance` (mm) inside the boundary and
    outside the islands; none where the tool fits nowhere."""
    return machinable_regions(make_pocket(boundary, islands), distance)


def machinable_regions(pocket, distance):
    """machinable regions of a Pocket at a distance (mm) from its contours."""
    loops = [path.elements for path in pocket_ring(pocket, distance).paths]
    point_contacts = [isinstance(path, PointContact) for path in pocket_ring(pocket, distance).paths]
    area = [elements.area(loop) for loop in loops]
    outer = [k for k in range(len(loops)) if area[k] >= 0.0 or point_contacts[k]]
    owned = {k: [] for k in outer}
    for k in set(range(len(loops))) - set(outer):
        owner = _owner(loops, area, outer, k)
        if owner is None:  # a path there and back that rounding turned
            owned[k] = []
        else:
            owned[owner].append(loops[k])
    return tuple(
        MachinableRegion(_one_spot(loops[k]) if point_contacts[k] else loops[k], tuple(owned[k]), pocket, distance)
        for k in sorted(owned)
    )


def _owner(loops, area, outer, hole):
    """The smallest boundary that holds a hole; None where none does."""
    count = len(loops[hole])
    index = np.linspace(0, count - 1, min(ASKED, count)).astype(int)
    asked = elements.point_at(loops[hole], index, np.full(len(index), 0.5))
    holds = [
        k for k in outer if area[k] > 0.0 and 2 * np.count_nonzero(winding.numbers(loops[k], asked) == 1) > len(index)
    ]
    return min(holds, key=lambda k: area[k], default=None)


def _one_spot(loop):
    """A position where the tool just fits, as one line of no length."""
    return elements.take(loop, np.array([0]))


def inside(region, point):
    """Which of points (m, 2) mm lie inside a machinable region."""
    return winding.numbers(elements.join(region.contours), point) == 1


def clear_segments(region, start, end):
    """Which straight moves (m,) bool between positions (m, 2) or (2,), and (m, 2) mm, keep inside a
    machinable region; the starts lie in it."""
    start = np.broadcast_to(start, end.shape)
    moved = np.hypot(*(end - start).T) > 0.0
    clear = np.ones(len(end), bool)
    if moved.any():
        clear[moved] = clear_lines(region.pocket.clearance_check, start[moved], end[moved], region.distance - SLACK_MM)
    return clear


def clear_segment(region, start, end):
    """Whether the straight line between two positions (2,) mm keeps inside a machinable region."""
    return bool(clear_segments(region, start, end[None])[0])


def allowed(region, point, more=0.0):
    """Which points (m, 2) mm lie inside a machinable region, `more` mm further from every wall."""
    reach = region.distance + more
    return (gouge_depths(region.pocket.clearance_check, point, reach) <= SLACK_MM) & inside(region, point)
