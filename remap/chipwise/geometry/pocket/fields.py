"""Where the tool centre may be in a pocket: loops to Fields.

Called by cycles/pocket.py for the pocket, and by rings.py for every ring of it.  A pocket whose
necks are narrower than the tool falls into several Fields.  The work is done by offset.py:
every ring comes from the original contours, so nothing adds up from ring to ring.
"""
import numpy as np

from .. import elements, winding
from ..judge import clear_lines, depths
from ..offset import make_pocket, pocket_ring
from ..paths import SpotPath
from .tracks import Field

# Places of a hole at which it is asked which boundary holds it: a loop may touch the boundary
# at one of them.
ASKED = 5

# A place or way counts as inside a Field this much nearer to the wall: rounding. mm
SLACK_MM = 1e-6


def split(boundary, islands, distance):
    """Fields of closed contours: tool centres at least `distance` (mm) inside the boundary and
    outside the islands; none where the tool fits nowhere."""
    return fields_at(make_pocket(boundary, islands), distance)


def fields_at(pocket, distance):
    """Fields of a Pocket at a distance (mm) from its contours."""
    loops = [path.elements for path in pocket_ring(pocket, distance).paths]
    spots = [isinstance(path, SpotPath) for path in pocket_ring(pocket, distance).paths]
    area = [elements.area(loop) for loop in loops]
    outer = [k for k in range(len(loops)) if area[k] >= 0.0 or spots[k]]
    owned = {k: [] for k in outer}
    for k in set(range(len(loops))) - set(outer):
        owner = _owner(loops, area, outer, k)
        if owner is None:                         # a way there and back that rounding turned
            owned[k] = []
        else:
            owned[owner].append(loops[k])
    return tuple(Field(_one_spot(loops[k]) if spots[k] else loops[k], tuple(owned[k]), pocket,
                       distance) for k in sorted(owned))


def _owner(loops, area, outer, hole):
    """The smallest boundary that holds a hole; None where none does."""
    count = len(loops[hole])
    index = np.linspace(0, count - 1, min(ASKED, count)).astype(int)
    asked = elements.point_at(loops[hole], index, np.full(len(index), 0.5))
    holds = [k for k in outer if area[k] > 0.0 and 2 * np.count_nonzero(
        winding.numbers(loops[k], asked) == 1) > len(index)]
    return min(holds, key=lambda k: area[k], default=None)


def _one_spot(loop):
    """A place where the tool just fits, as one line of no length."""
    return elements.take(loop, np.array([0]))


def inside(field, point):
    """Which of points (m, 2) mm lie inside a Field."""
    return winding.numbers(elements.join(field.contours), point) == 1


def clear_ways(field, start, end):
    """Which straight ways (m,) bool between places (m, 2) or (2,), and (m, 2) mm, keep inside a
    Field; the starts lie in it."""
    start = np.broadcast_to(start, end.shape)
    moved = np.hypot(*(end - start).T) > 0.0
    clear = np.ones(len(end), bool)
    if moved.any():
        clear[moved] = clear_lines(field.pocket.judge, start[moved], end[moved],
                                   field.distance - SLACK_MM)
    return clear


def clear_way(field, start, end):
    """Whether the straight way between two places (2,) mm keeps inside a Field."""
    return bool(clear_ways(field, start, end[None])[0])


def allowed(field, point, more=0.0):
    """Which points (m, 2) mm lie inside a Field, `more` mm further from every wall."""
    reach = field.distance + more
    return (depths(field.pocket.judge, point, reach) <= SLACK_MM) & inside(field, point)
