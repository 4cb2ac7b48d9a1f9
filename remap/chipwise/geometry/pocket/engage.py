# SPDX-License-Identifier: GPL-2.0-or-later
"""P4: a path through one level of a machinable region on which the tool's engagement stays at that of the step-over.

Called by cycles/pocket_engage.py.  Pure; lengths mm, angles rad.  components/offline/engage.h has the equation that is
followed.

1. A helix where the region is widest; then stages, each with less room kept to the border and narrower bends: the open
   area, the band along the walls, the corners.
2. In each stage a path is traced from where, along the border, cleared ground ends.  A closed front so becomes a
   spiral, an open one a row of paths that all climb.
3. The parts of the walls that no path has followed are followed last, exactly.
4. What a region behind a neck leaves gets an entry of its own.
5. Ground that was cleared before (a pocket that was begun) needs no helix: the stages begin there.
6. Needles between paths, which are too small to start a path at, are run over (engage_needles.py).
The stock is on the RIGHT of travel; for the other link round the pocket is mirrored.
"""

import math
from typing import NamedTuple, Optional

import numpy as np

from chipwise.geometry.pocket.engage_ground import Ground, fitted, rule
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.elements import make_lines
from chipwise.geometry.base.tolerances import NODE_MM
from chipwise.geometry.pocket import engage_links as links
from chipwise.geometry.pocket import engage_needles
from chipwise.geometry.pocket.engage_starts import BACK, Grid, Segment, before_cut, border_poses
from chipwise.geometry.pocket.engage_walls import VISITED_MM, Wall, beginning, nearest, sound

# (kept to the border, in step-overs; least radius of the path, in tool radii)
STAGES = ((0.9, 0.42), (0.0, 0.133), (0.0, 0.033))

# Step of the trace, in tool radii and in least radii of the path.
STEP, STEP_BEND = 0.05, 0.5

# Length in air after which a path ends, in tool radii; the first one of a stage goes on for longer.
AIR, FIRST_AIR = 0.8, 2.0

# A path that would cut less is left to the next stage: tool radii along which it cuts and share of a whole step; and,
# in the last ones, the engagement: rad, and share of that which is kept to.
FEWEST, SHARE, LEAST_ANGLE, LEAST_SHARE = 1.0, 0.3, 0.5, 0.6

# Of the fitted arcs from the traced path.
FIT_MM = 0.0003

# A patch of a region gets an entry of its own if it is this far from its border and this large, in tool radii and tool
# areas.
PATCH_WIDE, PATCH_LARGE = 0.13, 0.05

# A link at the feed is as bad as a quicker one by rapids whose time is larger by this.
FEED_WORSE = 1.4

# Corners this near are finished before the tool goes away, in tool radii; the wall there, if no more than this is left
# before it.
NEAR, FILLET = 2.5, 0.1

# More engagement than that of the step-over, where the path keeps to it; the most of P4 is 3 degrees more. rad.  With a
# step-over below FINE tool radii the tool turns away so often that ESCAPE takes more of the rest.
MORE, MORE_FINE, FINE = math.radians(1.8), math.radians(1.4), 0.24

# And while the tool turns away: no step is made after which that would need more. rad
ESCAPE = 0.03

# To a wall that begins in stock the tool goes straight from so near, and else down a ramp of this length; in tool
# radii.
STRAIGHT, RAMP = 1.0, 2.0

# Helix, and the least, in tool radii.
HELIX, NARROWEST = 0.9, 0.05

# A path goes on for so long after it cuts, in tool radii.
AHEAD = 0.1

# Ground that was cleared before falls short of what was by about so many cells: where it ends along a wall is looked
# for so far from it, too.
LAGS = (1.3, 2.2)

# A path that ends no further than this from a wall leaves it on an arc.
ON_WALL_MM = 0.05

MOST_PATHS, MOST_ENTRIES = 4000, 40


class Cut(NamedTuple):
    """How a level is cut.  radius: of the tool; step: the nominal step-over; clearance: as in links; overlap: mm that a
    wall that is run all around is run on over its start."""

    radius: float
    step: float
    feed_mm_s: float
    clearance: float
    overlap: float = 0.0


class Planner:
    """Segments of one region."""

    def __init__(self, region, how, cleared=None, lag=0.0):
        self.region = region
        self.radius, self.step, self.feed_mm_s, self.clearance, self.overlap = how
        radius, step = how.radius, how.step
        self.angle = math.acos(1.0 - step / radius) + (MORE_FINE if step < FINE * radius else MORE)
        self.ground = Ground(region.contours, radius)
        self.lags = () if cleared is None else (LAGS[0] * lag, LAGS[1] * lag)
        if cleared is not None:
            self.ground.clear(cleared)
        self.track = Ground(region.contours, VISITED_MM, size=radius / 2)  # knows which walls were followed
        self.walls = [Wall(contour, radius) for contour in region.contours]
        self.corners, self.tried = [], {}  # of the last stage
        self.grid = Grid(region, self.ground)
        self.segments: list[Segment] = []
        self.pose: Optional[tuple] = None
        self.paths = 0

    def plan(self):
        """All segments."""
        seat = self.grid.seat()
        if seat is not None:
            self.pose = (*seat, 0.0)
            self.segments.append(Segment("over", make_lines(np.array([seat]), np.array([seat]))))
            self._stages()
        waiting = self.grid.patches(0.0) if seat is None else self._waiting()
        for _ in range(MOST_ENTRIES):
            if not waiting or not self._enter(
                max(waiting, key=lambda patch: self.grid.depth[tuple(patch.T)].max(initial=-1.0))
            ):
                break
            self._stages()
            waiting = self._waiting()
        if self.pose is None:  # too narrow for a helix: only its border
            self.pose = (*self.region.boundary.start[0].tolist(), 0.0)
        self._walls()
        engage_needles.clear(self)
        self._off()
        return tuple(self.segments)

    # ---- parts of the path ---------------------------------------------------------------------------------------

    def _waiting(self):
        return self.grid.patches(PATCH_WIDE * self.radius, PATCH_LARGE * self.radius**2)

    def _enter(self, patch):
        """By a helix at the deepest place of a patch; whether it has room for one."""
        centre, depth = self.grid.deepest(patch)
        if depth < NARROWEST * self.radius and not self.segments:
            return False
        radius = min(HELIX * self.radius, depth)
        start = centre + (radius, 0.0)
        circle = elements.make_arcs(
            start[None], start[None], centre[None], np.array([radius]), np.array([2.0 * math.pi])
        )
        if self.segments:
            self._over(start)
        self._add("entry", circle)
        self.ground.clear(circle)
        self.pose = (*start.tolist(), 0.5 * math.pi)
        return True

    def _add(self, kind, chain):
        chain = sound(chain) if kind == "cut" else chain
        if len(chain):
            self.segments.append(Segment(kind, chain))
            if kind in ("cut", "entry"):
                self.track.clear(chain)

    def _rule(self, inset, rho, air):
        rho = rho * self.radius
        return rule(self.angle, rho, inset, min(STEP * self.radius, STEP_BEND * rho), air * self.radius, ESCAPE)

    def _go(self, pose):
        """To a pose over cleared ground; whether the tool may be there: a rib under it may be left."""
        at = self.pose
        if math.dist(at[:2], pose[:2]) < 1e-6:
            return True
        link, lifted = links.direct(self.ground, at, pose), None
        least = links.rapid_seconds(math.dist(at[:2], pose[:2])) + links.STOP_S
        feed = math.inf if link is None else float(elements.lengths(link).sum()) / self.feed_mm_s * FEED_WORSE
        if feed > least:
            self.grid.refresh()
            lifted = links.lifted(self.ground, self.grid, at, pose, self.clearance)
        if lifted is not None and links.seconds(lifted, self.feed_mm_s) < feed:
            self._lifted(*lifted)
            return True
        link = links.along(self.ground, self.grid, at[:2], pose[:2]) if link is None else link
        if link is not None:
            self._add("feed", link)
            return True
        if not self._cleared(np.array(pose[:2])):
            return False
        self._over(pose[:2])
        return True

    def _over(self, to):
        """Up, across and down to a place."""
        self.segments.append(Segment("over", make_lines(np.array([self._off()]), np.array([to]))))

    def _off(self):
        """Off a wall, before the tool goes up, on an arc tangent to it, if there is one over cleared ground; the place
        (x, y) then."""
        at = self.pose[:2]
        if (
            self.segments
            and self.segments[-1].kind == "cut"
            and float(self.ground.depth(np.array([at]))[0]) <= ON_WALL_MM
        ):
            arc = links.off_wall(self.ground, self.grid, self.pose, self.clearance)
            if arc is not None:
                self._add("feed", arc)
                at = tuple(arc.end[-1].tolist())
        return at

    def _lifted(self, off, points, onto):
        """Off the path, across by rapids and onto the next one."""
        points = np.array(points)
        points = points[np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-6))]
        self._add("feed", off)
        if len(points) > 1:
            self._add("rapid", make_lines(points[:-1], points[1:]))
        self._add("feed", onto)

    def _path(self, pose, keep):
        """A path of constant engagement from a pose; nothing if it would cut nothing."""
        known = len(self.segments)
        pose = before_cut(self.ground, pose, keep)
        if not self._go(pose):  # before the path is cleared: the link there has to be so already
            return
        found, _ = self.ground.trace(pose, keep, True)
        cut = np.flatnonzero(found[:, 3] > 0.0)
        if not len(cut):
            del self.segments[known:]
            return
        last = min(len(found) - 1, cut[-1] + int(AHEAD * self.radius / keep.step))
        poses = np.vstack([[pose], found[: last + 1, :3]])
        self._add("cut", fitted(poses, FIT_MM))
        self.pose = tuple(poses[-1])
        self.paths += 1

    # ---- stages ----------------------------------------------------------------------------------------------------

    def _stages(self):
        first, last_inset = True, None
        *stages, (last, bend) = STAGES
        self.corners = self.corners or border_poses(
            self.region, last * self.step, bend * self.radius, self.radius, self.lags
        )
        for share, rho in stages:
            inset = share * self.step
            if float(self.ground.depth(np.array([self.pose[:2]]))[0]) < inset - 1e-3:
                continue
            poses = border_poses(self.region, inset, rho * self.radius, self.radius, () if inset else self.lags)
            if inset and not poses:
                continue
            if inset != last_inset:
                self._path(self.pose, self._rule(inset, rho, FIRST_AIR if first else AIR))
                first = False
            last_inset = inset
            self._stage(self._rule(inset, rho, AIR), poses, {}, inset == last * self.step)
        self._stage(self._rule(last * self.step, bend, AIR), self.corners, self.tried, False)

    def _stage(self, keep, poses, tried, corners):
        """Paths from all starts; corners: the last stage is done meanwhile where no start is near."""
        while self.paths < MOST_PATHS:
            starts = self._starts(poses, tried)
            if not starts:
                starts = [s for s in self._beside(keep.inset) if not tried.get(s[1])]
            if not starts:
                break
            start = min(starts, key=lambda s: math.dist(s[0][:2], self.pose[:2]))
            if not (corners and math.dist(start[0][:2], self.pose[:2]) > NEAR * self.radius and self._corner()):
                self._try(start, keep, tried)

    def _starts(self, poses, tried):
        for p in poses:
            p.refresh(self.ground)
        return [s for p in poses for s in p.starts(BACK * self.radius) if tried.get(s[1], 0) < 2]

    def _try(self, start, keep, tried):
        """A path from a start, if it is worth it; whether it was."""
        pose, key = start
        tried[key] = tried.get(key, 0) + 1
        if self._worth(pose, keep):
            self._path(pose, keep)
            return True
        tried[key] = 9
        return False

    def _corner(self):
        """One path of the last stage near the tool, or else along what is left of the wall there; whether there was
        any."""
        keep, near = self._rule(STAGES[-1][0] * self.step, STAGES[-1][1], AIR), NEAR * self.radius
        starts = [s for s in self._starts(self.corners, self.tried) if math.dist(s[0][:2], self.pose[:2]) < near]
        for start in sorted(starts, key=lambda s: math.dist(s[0][:2], self.pose[:2])):
            if self._try(start, keep, self.tried):
                return True
        place = self.pose[:2]
        for chain in [chain for wall in self.walls for chain in wall.chains(self.ground, self.track, place, near)]:
            if (
                math.dist(chain.start[0], place) < near
                and elements.lengths(chain).sum() < near
                and self.ground.swept(chain, -FILLET * self.radius, links.FINE_MM)
            ):
                self._along_wall(chain)
                return True
        return False

    def _worth(self, pose, keep):
        """Whether a path from a pose would cut enough for this stage."""
        found, _ = self.ground.trace(pose, keep, False, 500)
        angle = found[:, 3][found[:, 3] > 0.06]
        if not len(angle):
            return False
        if keep.inset <= 0.0:
            return bool(angle.max() >= min(LEAST_ANGLE, LEAST_SHARE * keep.angle))
        area, length = float((1.0 - np.cos(angle)).sum()) * self.radius * keep.step, len(angle) * keep.step
        return area >= FEWEST * self.radius * self.step and area >= SHARE * length * self.step

    def _beside(self, inset):
        area = FEWEST * self.radius * self.step if inset else PATCH_LARGE * self.radius**2
        return self.grid.patch_starts(inset + 0.02 * self.radius, area, self.pose)

    def _walls(self):
        """Exactly along all parts of the walls that no path has followed."""
        left = [chain for wall in self.walls for chain in wall.chains(self.ground, self.track)]
        while left:
            self._along_wall(left.pop(int(np.argmin([math.dist(chain.start[0], self.pose[:2]) for chain in left]))))

    def _along_wall(self, chain):
        start = chain.start[0]
        if not self._cleared(start) and np.array_equal(start, chain.end[-1]):
            chain = chains.rotated(chain, *nearest(chain, self.pose[:2]))
            start = chain.start[0]
        first = elements.tangent_at(chain, np.array([0]), np.array([0.0]))[0]
        if self._cleared(start):
            self._go((*start.tolist(), math.atan2(first[1], first[0])))
        else:
            self._into(chain)
        if self.overlap > NODE_MM and np.array_equal(start, chain.end[-1]):
            chain = elements.join((chain, beginning(chain, self.overlap)))
        last = elements.tangent_at(chain, np.array([len(chain) - 1]), np.array([1.0]))[0]
        self._add("cut", chain)
        self.ground.clear(chain)
        self.pose = (*chain.end[-1].tolist(), math.atan2(last[1], last[0]))

    def go_to(self, place, chain):
        """To a place, to go on along a chain; whether the tool may be there."""
        along = chain.end[0] - chain.start[0]
        if not self._cleared(place) or not self._go((*place.tolist(), math.atan2(along[1], along[0]))):
            return False
        self.pose = (*place.tolist(), math.atan2(along[1], along[0]))
        return True

    def cut(self, chain):
        """Along a chain from where the tool is."""
        self._add("cut", chain)
        self.ground.clear(chain)
        along = chain.end[-1] - chain.start[-1]
        self.pose = (*chain.end[-1].tolist(), math.atan2(along[1], along[0]))

    def _cleared(self, place):
        return self.ground.swept_line(place, place, -links.RIM_MM, links.FINE_MM)

    def _into(self, chain):
        """To the start of a chain in stock: straight there if that is near, else down a ramp on it."""
        at, start = np.array([self.pose[:2]]), chain.start[:1]
        straight = make_lines(at, start)
        if (
            self.segments
            and math.dist(at[0], start[0]) < STRAIGHT * self.radius
            and links.inside(self.ground, straight)
        ):
            self._add("cut", straight)
            self.ground.clear(straight)
            return
        down = sound(beginning(chain, RAMP * self.radius))
        self._over(start[0])
        self._add("ramp", down)
        self.ground.clear(down)


def planned(region, how, cleared=None, lag=0.0):
    """Segments of one level of a region, climbing with the stock on the right.  how: a Cut; cleared: a chain of places
    that the tool may have been at before; lag: side of the cells that it was read from."""
    return Planner(region, how, cleared, lag).plan()
