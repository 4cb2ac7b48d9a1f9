# SPDX-License-Identifier: GPL-2.0-or-later
"""Links over cleared ground from one path of constant engagement to the next.

Called by engage.py.  Lengths mm, angles rad.

Either a curve tangent to both paths, at the feed; or off the stock at the feed, across by rapids with a clearance at
the tool's side, and onto the next path at the feed.  Every link is asked for the whole area that the tool sweeps on it.
"""

import math
from itertools import islice

import numpy as np

from chipwise.geometry.pocket.engage_ground import fitted, rows_of
from chipwise.geometry.base import elements
from chipwise.geometry.base.elements import make_lines
from chipwise.geometry.pocket.machinable import SLACK_MM
from chipwise.geometry.pocket.shortest import over_raster

# Width of stock that a link may not see, and what a feed over cleared ground may be short of its rim. mm
FINE_MM, RIM_MM = 0.01, 0.004

# Places of a link are asked for so near to one another beside a wall. mm
STRIDE_MM = 0.01

# Radii and turns of the arcs off and onto a path, in tool radii and rad.
LEADS = (0.12, 0.25, 0.5)
TURNS = np.radians((15, 30, 40, 50, 57, 65, 75, 90, 110, 130, 150, 180))

# So many further ends of such arcs are tried for one straight rapid instead of several, and so many places of a longer
# link.
FURTHER, PLACES = 4, 12

# A link that goes round something is looked for with so much more room at first, in tool radii: along its edge it would
# bend often.
WIDER = (0.3, 0.12, 0.0)

# From a place of the grid to its neighbours, and how far that is.
NEIGHBOURS = tuple(
    (i, j, math.hypot(i, j)) for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1))
)

# So many places of the grid are looked at to begin one.
NEAREST = 8

# A place with the clearance is not looked for further away, in tool radii.
OUT = 3.0

# An arc to such a place turns by more than the first (with less it is a line) and by less than the second. rad
FLAT, BENT = 1e-3, 2.6
BENDS = (0.0, 0.1, 0.2)

# Times of a rapid against those of a feed are only to choose between two links: the machine's own are not known here.
RAPID_MM_S, RAPID_MM_S2, STOP_S = 100.0, 500.0, 0.1


def rapid_seconds(length):
    """From standstill to standstill."""
    ramp = RAPID_MM_S**2 / RAPID_MM_S2
    return (
        2.0 * math.sqrt(length / RAPID_MM_S2)
        if length < ramp
        else ramp / RAPID_MM_S * 2.0 + (length - ramp) / RAPID_MM_S
    )


def direct(ground, a, b):
    """Elements of a curve at the feed from pose a to pose b over cleared ground; None."""
    if math.dist(a[:2], b[:2]) < 1e-6:
        return None
    link = fitted(np.array((a, b)), 1.0)
    if elements.lengths(link).sum() > 2.5 * math.dist(a[:2], b[:2]) or (np.abs(link.sweep) > 2.5).any():
        return None
    return link if inside(ground, link) and ground.swept(link, -RIM_MM, FINE_MM) else None


def inside(ground, link):
    """Whether a chain stays in the region."""
    return ground.inside(rows_of(link), SLACK_MM, STRIDE_MM)


def _passes(ground, link):
    """Whether one element, 7 numbers, stays in the region, over cleared ground."""
    return ground.passes(link, SLACK_MM, STRIDE_MM, -RIM_MM, FINE_MM)


def leads(ground, pose, clearance, backwards):
    """[elements] off a path to the left at its end, or onto it at its start (backwards), whose far end has the
    clearance; the shortest first.  An empty chain: the pose itself has it."""
    if _straight(ground, pose[:2], pose[:2], clearance):
        return [make_lines(np.empty((0, 2)), np.empty((0, 2)))]
    for share in LEADS:
        radius, found = share * ground.radius, []
        centre = np.array((pose[0] - radius * math.sin(pose[2]), pose[1] + radius * math.cos(pose[2])))
        angle = pose[2] - 0.5 * math.pi + (-TURNS if backwards else TURNS)
        far = centre + radius * np.column_stack((np.cos(angle), np.sin(angle)))
        for k in np.flatnonzero(ground.rim(far, -clearance)):
            start, end = (far[k], np.array(pose[:2])) if backwards else (np.array(pose[:2]), far[k])
            if not _passes(ground, (*start, *end, *centre, TURNS[k])):
                break
            if _straight(ground, far[k], far[k], clearance):
                found.append(
                    elements.make_arcs(
                        start[None], end[None], centre[None], np.array([radius]), np.array([float(TURNS[k])])
                    )
                )
        if found:
            return found
    return []


def off_wall(ground, grid, pose, clearance):
    """Elements at the feed off a path to where the clearance is; None."""
    arcs = [link for link in leads(ground, pose, clearance, False) if len(link)]
    grid.refresh()
    return arcs[0] if arcs else link_out(ground, grid, pose, clearance)


def lifted(ground, grid, at, pose, clearance):
    """(elements off a path, points of rapids, elements onto the next) from one pose to another, the quickest that is
    found; None."""
    off, onto = (leads(ground, p, clearance, p is pose) for p in (at, pose))
    if not off:
        off = [link for link in (link_out(ground, grid, at, clearance),) if link is not None]
    if off and not onto:
        onto = [link for link in (link_out(ground, grid, pose, clearance, True),) if link is not None]
    if not off or not onto:
        return None
    off_mm, onto_mm = ([float(elements.lengths(link).sum()) for link in arcs[:FURTHER]] for arcs in (off, onto))
    pairs = [(i, j) for i in range(len(off_mm)) for j in range(len(onto_mm))]
    pairs.sort(key=lambda pair: off_mm[pair[0]] + onto_mm[pair[1]])
    for a, b in ((off[i], onto[j]) for i, j in pairs):
        ends = _end_of(a, at), _start_of(b, pose)
        if _straight(ground, *ends, clearance):
            return a, list(ends), b
    points = across(ground, grid, _end_of(off[0], at), _start_of(onto[0], pose), clearance)
    return None if points is None else (off[0], points, onto[0])


def _end_of(link, pose):
    return tuple(link.end[-1].tolist()) if len(link) else tuple(pose[:2])


def _start_of(link, pose):
    return tuple(link.start[0].tolist()) if len(link) else tuple(pose[:2])


def seconds(link, feed_mm_s):
    """Of what lifted() returns."""
    off, points, onto = link
    feeds = sum(float(elements.lengths(part).sum()) for part in (off, onto)) / feed_mm_s
    return feeds + total_seconds(points) + STOP_S


def across(ground, grid, a, b, clearance):
    """Points of straight rapids from a to b with the clearance at the tool's side; None."""
    if _straight(ground, a, b, clearance):
        return [a, b]
    grid.refresh()
    for more in WIDER:
        link = _searched(grid, ground, a, b, clearance, more * ground.radius)
        found = None if link is None else _by_one_or_two(ground, link, clearance)
        if found is not None:
            return found
    return None if link is None else _pulled(ground, link, clearance)


def _by_one_or_two(ground, link, clearance):
    """The quickest of the links by one or two of the places of a longer one; None."""
    a, b, by = link[0], link[-1], link[1:-1][:: max(1, (len(link) - 2) // PLACES)]
    first, last = ([p for p in by if _straight(ground, end, p, clearance)] for end in (a, b))
    found = [[a, p, b] for p in first if p in last]
    if not found:
        pairs = sorted(((p, q) for p in first for q in last if p != q), key=lambda pair: total_seconds([a, *pair, b]))
        found = next(([[a, *pair, b]] for pair in pairs if _straight(ground, *pair, clearance)), [])
    return min(found, key=total_seconds, default=None)


def total_seconds(points):
    """Of rapids along lines, with a stop at each of their ends."""
    return sum(rapid_seconds(math.dist(a, b)) for a, b in zip(points, points[1:]))


def along(ground, grid, a, b):
    """Elements of lines at the feed from a to b over cleared ground; None."""
    points = across(ground, grid, a, b, -RIM_MM)
    if points is None:
        return None
    points = np.array(points)
    link = make_lines(points[:-1], points[1:])
    return link if inside(ground, link) else None


def link_out(ground, grid, pose, clearance, backwards=False):
    """Elements at the feed from a pose to a place of the grid near it that has the clearance, or from there to the pose
    (backwards): an arc along the path there (within BENDS: a path that ends in a corner may head for the wall) if one
    of the nearest places has one, else lines; None."""
    near = grid.point[(grid.depth >= clearance) & grid.cleared]
    gap = np.hypot(*(near - pose[:2]).T)
    order = np.flatnonzero(gap <= OUT * ground.radius)
    order = order[np.argsort(gap[order], kind="stable")]
    free = list(islice((k for k in order if ground.rim(near[k][None], -clearance)[0]), PLACES))
    for bend in BENDS:  # away from the stock on the right
        heading = pose[2] + (math.pi - bend if backwards else bend)
        for k in free:
            link = _tangent(ground, pose[:2], heading, near[k])
            if link is not None:
                return elements.reverse(link) if backwards else link
    link = along(ground, grid, tuple(pose[:2]), tuple(near[free[0]])) if free else None
    return elements.reverse(link) if backwards and link is not None else link


def _tangent(ground, start, heading, end):
    """The arc from a place with a heading to another place, if it is bent no further than BENT and over cleared ground;
    None."""
    along_, aside = (end - start) @ np.array(
        ((math.cos(heading), -math.sin(heading)), (math.sin(heading), math.cos(heading)))
    )
    sweep = 2.0 * math.atan2(aside, along_)
    if not FLAT < abs(sweep) < BENT:
        return None
    radius = (along_**2 + aside**2) / (2.0 * aside)  # positive: to the left
    centre = np.asarray(start) + radius * np.array((-math.sin(heading), math.cos(heading)))
    if not _passes(ground, (*start, *end, *centre, sweep)):
        return None
    return elements.make_arcs(
        np.array([start], float), end[None], centre[None], np.array([abs(radius)]), np.array([sweep])
    )


def _straight(ground, a, b, clearance):
    return ground.swept_line(a, b, clearance, FINE_MM)


def _searched(grid, ground, a, b, clearance, more):
    """Places of the grid from near a to near b, the shortest link that has so much more than the clearance, between
    both; None."""
    free = grid.roomy(clearance + more)
    known, place = np.argwhere(free), grid.point[free]
    first, last = (
        next(
            (
                tuple(known[k])
                for k in _nearest(np.hypot(*(place - p).T), NEAREST)
                if _straight(ground, p, place[k], clearance)
            ),
            None,
        )
        for p in (a, b)
    )
    if first is None or last is None:
        return None
    link = over_raster(free, first, last, NEIGHBOURS)
    return link and [tuple(a), *(tuple(grid.point[at]) for at in link), tuple(b)]


def _nearest(gap, count):
    """Numbers of the smallest of an array, in their order."""
    if len(gap) <= count:
        return np.argsort(gap, kind="stable")
    near = np.flatnonzero(gap <= np.partition(gap, count - 1)[count - 1])
    return near[np.argsort(gap[near], kind="stable")[:count]]


def _pulled(ground, link, clearance):
    """A link with as few points as see one another; None if even neighbours do not."""
    if link is None:
        return None
    found, i = [link[0]], 0
    while i < len(link) - 1:
        j = len(link) - 1
        while j > i + 1 and not _straight(ground, link[i], link[j], clearance):
            j = i + max(1, (j - i) // 2)
        if j == i + 1 and not _straight(ground, link[i], link[j], clearance):
            return None
        found.append(link[j])
        i = j
    return found
