# SPDX-License-Identifier: GPL-2.0-or-later
"""The chop lines of a closed inside contour as moves, cut before the contour's own pass.  Pure; mm.

Called by cycles/contour.py (G78) for the paths of its last pass.  Which lines: geometry/slug/slug.py; how each is cut:
chop_lines.py, as for a hole.  Source: JP H05-7134, fig. 5: the lines first, then the outline.

Order of work, and why no piece is loose while it is still large:
 1. The lines of the first group, each to full depth.  The strips between them stay joined to the part at both ends.
 2. The lines of the second group, in rising or falling order.  Each frees one row of cells, at their final size.
    What lies beyond the last line cut still hangs on the part at the far end of its strip.
 3. The contour (the caller's).  The pieces at the rim come loose one after the other as the tool passes them.
Several slugs (a contour whose necks are narrower than the tool, or nearly) are cut one after the other.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from chipwise.cycles.chop_lines import cut_line, ends
from chipwise.cycles.mover import Mover
from chipwise.geometry.slug import slug
from chipwise.geometry.base.elements import Elements


@dataclass(frozen=True)
class ChopPlan:
    """What becomes of the slugs of a contour: a SlugChop for each."""

    chops: tuple

    @property
    def chopped(self):
        """Whether there are lines to cut."""
        return any(chop.segments for chop in self.chops)

    @property
    def segments(self):
        """All lines in no particular order."""
        return [segment for chop in self.chops for segment in chop.segments]

    @property
    def cleared(self):
        """Whether a slug is cut to chips as a whole."""
        return any(chop.segments and not chop.pieces for chop in self.chops)

    @property
    def too_small(self):
        """Whether that is so because the chop size is too small for this tool to leave pieces."""
        return any(chop.too_small for chop in self.chops)

    @property
    def pieces(self):
        """Number of loose pieces after the contour's own pass."""
        return sum(chop.pieces for chop in self.chops)

    @property
    def largest_piece(self):
        """Diameter (mm) of the smallest circle round the largest piece; 0.0 where none comes loose."""
        return max((chop.largest for chop in self.chops), default=0.0)


def chop_plan(paths, islands, tool_radius, chop_size):
    """ChopPlan for the slugs inside closed tool centre paths.

    paths     Elements of each closed path of the contour's last pass, the tool inside it
    islands   Elements of each closed path round an island
    tool_radius, chop_size   mm; chop_size 0: never chop
    """
    return _cached_plan(tuple(map(_frozen, paths)), tuple(map(_frozen, islands)), float(tool_radius), float(chop_size))


def cut_chops(mover: Mover, plan: ChopPlan, end, tool_radius: float, levels: list[float]) -> None:
    """All lines of a plan, then up to the clearance plane; end: (x, y) where the tool goes afterwards; levels: Z of
    each pass."""
    for line in slug.order_chops(plan.chops, mover.xy, end, *ends(tool_radius, len(levels))):
        cut_line(mover, line, tool_radius, levels)
    if plan.chopped:
        mover.up()


# Choosing the lines is the slow step (some 0.1 s); preview and task, and every pass of a program's loop, ask again.
@lru_cache(maxsize=64)
def _cached_plan(paths, islands, tool_radius, chop_size):
    return ChopPlan(slug.chop_slugs([_thawed(p) for p in paths], [_thawed(p) for p in islands], tool_radius, chop_size))


_FIELDS = ("start", "end", "centre", "radius", "start_angle", "sweep")


def _frozen(run):
    """Elements by value, to be a key of the cache."""
    return tuple(np.ascontiguousarray(getattr(run, name), float).tobytes() for name in _FIELDS)


def _thawed(key):
    """Elements of a key."""
    arrays = [np.frombuffer(data, float) for data in key]
    return Elements(*(a.reshape(-1, 2) for a in arrays[:3]), *arrays[3:])
