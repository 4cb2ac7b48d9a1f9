# SPDX-License-Identifier: GPL-2.0-or-later
"""Where paths of constant engagement may start: poses along the border of a region, and a grid of places within it.

Called by engage.py.  Lengths mm, angles rad.
"""

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from chipwise.geometry.pocket.engage_ground import patches, slack
from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.pocket.engage_links import FINE_MM, RIM_MM
from chipwise.geometry.pocket.machinable import machinable_regions

# Spacing of poses and of the grid, in tool radii.
POSES, GRID = 0.08, 0.17

# A start is this far before the stock, in tool radii, unless the border turns by more.
BACK, BACK_TURN = 0.2, 0.35

# A path begins so long before it cuts, in tool radii; steps in which that place is looked for.
BEFORE, FIRST_STEPS = 0.05, 40

# Joints that turn by more than this get poses of their own, so far apart. rad
FAN = 0.05


# The deepest place is found to this, in tool radii, by steps in so many directions.
CLOSE = 0.005
AROUND = np.array([(math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8)])


@dataclass(frozen=True, eq=False)
class Segment:
    """kind: "entry" (a full circle at the level, after a helix on it), "ramp" (down along it, to and fro), "cut",
    "feed" (over cleared ground), "rapid" (lines, lifted), "over" (up, across and down to where the next one starts).
    share: of the feed, for each element; None: 1."""

    kind: str
    elements: Elements
    share: Optional[np.ndarray] = None


class Poses:
    """Poses (n, 3) along one contour of a region, tool beside its border, what each is known by, and which of them are
    cleared so far."""

    def __init__(self, pose):
        self.pose, self.cleared = pose, np.zeros(len(pose), bool)
        self.key = [tuple(place) for place in np.round(pose[:, :2], 2).tolist()]
        self.gap = np.hypot(*(np.roll(pose[:, :2], -1, axis=0) - pose[:, :2]).T)
        self._asked = -1

    def refresh(self, ground):
        """Ask again for those that are not cleared, if the ground has grown."""
        if self._asked == ground.grown:
            return
        self._asked = ground.grown
        waiting = np.flatnonzero(~self.cleared)
        self.cleared[waiting] = ground.rim(self.pose[waiting, :2], slack(ground.radius))

    def starts(self, back):
        """[(pose, key)] of places where cleared ground ends, backed off."""
        found = []
        for i in np.flatnonzero(self.cleared & ~np.roll(self.cleared, -1)):
            j, gone, n = int(i), 0.0, len(self.pose)
            while gone < back:
                before = (j - 1) % n
                if (
                    not self.cleared[before]
                    or abs(math.remainder(self.pose[before, 2] - self.pose[j, 2], 2 * math.pi)) > BACK_TURN
                ):
                    break
                gone, j = gone + self.gap[before], before
            found.append((tuple(self.pose[j]), self.key[i]))
        return found


def along_contour(contour, aside, spacing):
    """Poses (n, 3) along a closed chain, moved `aside` to its right, with a fan at corners to the left."""
    length = elements.lengths(contour)
    known = np.flatnonzero(length > 0.0)
    if not len(known):
        return np.empty((0, 3))
    count = np.maximum(1, np.ceil(length[known] / spacing)).astype(int)
    index, ends = np.repeat(known, count), np.cumsum(count)
    t = (np.arange(len(index)) - np.repeat(ends - count, count)) / np.repeat(count, count)
    point, along = elements.point_at(contour, index, t), elements.tangent_at(contour, index, t)
    pose = _aside(point, np.arctan2(along[:, 1], along[:, 0]), aside)
    if aside <= 0.0:
        return pose
    last = elements.tangent_at(contour, known, np.ones(len(known)))
    first = elements.tangent_at(contour, (known + 1) % len(contour), np.zeros(len(known)))
    found = []
    for k, some, out, into in zip(known.tolist(), np.split(pose, ends[:-1]), last, first):
        found.append(some)
        turn = math.atan2(out[0] * into[1] - out[1] * into[0], out @ into)
        if turn > FAN:
            n = math.ceil(aside * turn / spacing) + 1
            heading = math.atan2(out[1], out[0]) + turn * np.arange(n) / n
            found.append(_aside(np.broadcast_to(contour.end[k], (n, 2)), heading, aside))
    return np.concatenate(found)


def _aside(point, heading, aside):
    return np.column_stack((point[:, 0] + aside * np.sin(heading), point[:, 1] - aside * np.cos(heading), heading))


def border_poses(region, inset, rho, radius, lags=()):
    """Poses along the border of what remains of a region `inset` within it, with its corners rounded by rho; and the
    same further within it by each of the lags."""
    found = []
    for part in [
        part for lag in (0.0, *lags) for part in machinable_regions(region.pocket, region.distance + inset + lag + rho)
    ]:
        found += [Poses(pose) for contour in part.contours if len(pose := along_contour(contour, rho, POSES * radius))]
    return found


def before_cut(ground, pose, keep):
    """The pose shortly before a path from a pose cuts."""
    found, _ = ground.trace(pose, keep, False, FIRST_STEPS)
    cut = np.flatnonzero(found[:, 3] > 0.0)
    first = (int(cut[0]) if len(cut) else 0) - math.ceil(BEFORE * ground.radius / keep.step)
    return tuple(found[first, :3].tolist()) if first >= 0 else pose


class Grid:
    """Places within a region a share of the tool radius apart, and which are cleared."""

    def __init__(self, region, ground):
        low, high = (f(part, axis=0) for f, part in zip((np.min, np.max), elements.boxes(region.boundary)))
        self.size = GRID * ground.radius
        self.ground, self.low = ground, low
        columns, rows = (np.ceil((high - low) / self.size).astype(int) + 1).tolist()
        i, j = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
        self.point = low + self.size * np.stack((i, j), axis=2)
        self.depth = ground.depth(self.point.reshape(-1, 2)).reshape(columns, rows)
        self.cleared = np.zeros((columns, rows), bool)
        self._roomy: dict[float, np.ndarray] = {}
        self._asked = -1

    def refresh(self):
        """Ask again for places that are not cleared, if the ground has grown."""
        if self._asked == self.ground.grown:
            return
        self._asked = self.ground.grown
        waiting = np.nonzero(~self.cleared & (self.depth >= 0.0))
        if len(waiting[0]):
            self.cleared[waiting] = self.ground.rim(self.point[waiting], slack(self.ground.radius))

    def roomy(self, clearance):
        """Which of the cleared places have a clearance at the tool's side, as a raster; those that had it keep it, as
        ground only grows."""
        free = self._roomy.setdefault(clearance, np.zeros(self.cleared.shape, bool))
        asked = np.nonzero(self.cleared & (self.depth >= clearance) & ~free)
        if len(asked[0]):
            free[asked] = self.ground.rim(self.point[asked], -clearance)
        return free

    def seat(self):
        """(x, y) of a place whose whole circle is on cleared ground, the one with the most room; None."""
        self.refresh()
        index = np.argwhere(self.cleared)
        for k in np.argsort(-self.depth[self.cleared], kind="stable"):
            place = self.point[tuple(index[k])]
            if self.ground.swept_line(place, place, -RIM_MM, FINE_MM):
                return tuple(place.tolist())
        return None

    def patches(self, least, area=0.0):
        """[(indices (n, 2))] of connected places, deeper than `least`, that are not cleared: of more than an area,
        mm2."""
        self.refresh()
        found = patches(~self.cleared & (self.depth >= least))
        return [patch for patch in found if len(patch) * self.size**2 > area]

    def patch_starts(self, least, area, pose):
        """[(pose, key)] beside patches as above, which touch no border, across from where the tool is."""
        found = []
        for patch in self.patches(least, area):
            near = self.beside(patch)
            if not len(near):
                continue
            point = self.point[tuple(near.T)]
            k = int(np.argmin(np.hypot(*(point - pose[:2]).T)))
            over = self.point[tuple(patch.T)]
            toward = over[int(np.argmin(np.hypot(*(over - point[k]).T)))] - point[k]
            found.append(
                (
                    (*point[k].tolist(), math.atan2(toward[1], toward[0]) + 0.5 * math.pi),
                    ("patch", *np.round(point[k], 1).tolist()),
                )
            )
        return found

    def deepest(self, patch):
        """(place (2,), its depth): the deepest of a patch, in the middle of several; nearer to it than the grid is."""
        depth = self.depth[tuple(patch.T)]
        best = patch[depth >= depth.max() - 0.01 * self.ground.radius]
        place = self.point[tuple(best[int(np.argmin(np.hypot(*(best - patch.mean(axis=0)).T)))])]
        most, size = float(self.ground.depth(place[None])[0]), self.size
        while most < self.ground.radius and size > CLOSE * self.ground.radius:
            near = place + size * AROUND
            found = self.ground.depth(near)
            if found.max() > most + 1e-9:
                place, most = near[int(found.argmax())], float(found.max())
            else:
                size *= 0.5
        return place, most

    def beside(self, patch):
        """Indices (n, 2) of cleared places beside a patch."""
        over, (i, j) = np.zeros(np.add(self.cleared.shape, 2), bool), patch.T + 1
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            over[i + di, j + dj] = True
        return np.argwhere(over[1:-1, 1:-1] & self.cleared)
