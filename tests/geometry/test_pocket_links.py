# SPDX-License-Identifier: GPL-2.0-or-later
"""Links from Track to Track of G79 at a level: the tool lifts for entries only, and sweeps nothing that is not
cleared."""

import math

import numpy as np
import pytest
from support.engagement_shapes import SHAPES
from support.pocket_judge import random_request
from support.random_cases import random_count, random_seed

from chipwise.cycles.pocket import region_tracks
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.base.tolerances import NODE_MM
from chipwise.geometry.pocket import links
from chipwise.geometry.pocket.machinable import split
from chipwise.geometry.pocket.path_graph import along
from chipwise.geometry.pocket.shortest import over_raster
from chipwise.geometry.pocket.strategies import NAMES, STRATEGIES
from chipwise.geometry.pocket.tracks import make_track

RADIUS, STEP, CLEARANCE, FEED = 3.0, 2.4, 0.2, 25.0
SEEN_MM, SPACING_MM, AROUND = 0.02, 0.3, 90  # stock that the judge sees; where it looks


def regions(name):
    contours = [make_contour(parts) for parts in SHAPES[name]]
    return split(contours[0], contours[1:], RADIUS)


def in_stock(tracks, piece, radius):
    """Places (m, 2) on the rim of the tool, less what is not seen, that no Track has cleared, along a Piece."""
    path = elements.join([track.elements for track in tracks])
    size = radius - SEEN_MM + (CLEARANCE if piece.rapid else 0.0)
    angle = 2 * math.pi * np.arange(AROUND) / AROUND
    rim = size * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    found = []
    for k, length in enumerate(elements.lengths(piece.elements)):
        t = np.linspace(0.0, 1.0, math.ceil(length / SPACING_MM) + 1)
        for place in elements.point_at(piece.elements, np.full(len(t), k), t):
            gap = [
                elements.distances(path, np.arange(len(path)), np.broadcast_to(p, (len(path), 2))).min()
                for p in place + rim
            ]
            found += (place + rim)[np.array(gap) > radius].tolist()
    return found


def faults(tracks, routes):
    """What is wrong with the links between Tracks."""
    wrong, known = [], links.known_starts(tracks)
    for k, route in enumerate(routes):
        if route is None:
            continue
        if not known[k]:
            wrong.append(f"link {k} leads into stock")
        here = tracks[k - 1].end
        for piece in route:
            if math.dist(here, piece.elements.start[0]) > 1e-6:
                wrong.append(f"link {k} is not connected")
            here = piece.elements.end[-1]
        if math.dist(here, tracks[k].start) > links.ON_PATH_MM:
            wrong.append(f"link {k} does not end where its track begins")
    return wrong


@pytest.mark.parametrize("strategy", sorted(NAMES))
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_the_tool_lifts_for_entries_only(name, strategy):
    """Also in the comb: no line leads from tooth to tooth beside the walls, so the link is along the path."""
    lifts = 0
    for region in regions(name):
        tracks = STRATEGIES[strategy](region, RADIUS, STEP, 0.0, True)
        routes = links.linked(region, tracks, RADIUS, CLEARANCE, FEED)
        assert faults(tracks, routes) == []
        lifts += sum(route is None and known for route, known in zip(routes, links.known_starts(tracks)))
    assert lifts == 0


@pytest.mark.parametrize("strategy", sorted(NAMES))
def test_random_pockets(strategy):
    """Links are connected and lead to cleared ground only."""
    first = random_seed()
    for seed in range(first, first + random_count(2)):
        asked = random_request(seed, strategy)
        contours = [make_contour(parts) for parts in asked.loops]
        for region in split(contours[0], contours[1:], asked.tool_radius):
            tracks = region_tracks(region, asked)
            routes = links.linked(region, tracks, asked.tool_radius, CLEARANCE, FEED)
            assert faults(tracks, routes) == [], f"CHIPWISE_SEED={seed}"


@pytest.mark.parametrize("strategy, name", [(1, "rectangle"), (2, "island"), (0, "island")])
def test_no_link_meets_stock(strategy, name):
    """The circle of the tool, for a rapid with the clearance, against the distance of all Tracks before."""
    (region,) = regions(name)
    tracks = STRATEGIES[strategy](region, RADIUS, STEP, 0.0, True)
    routes = links.linked(region, tracks, RADIUS, CLEARANCE, FEED)
    pieces = [(k, piece) for k, route in enumerate(routes) for piece in route or ()][::4]
    assert any(piece.rapid for _, piece in pieces) or strategy != 1
    for k, piece in pieces:
        assert in_stock(tracks[:k], piece, RADIUS) == []
    far = chains.line(tracks[0].start, region.boundary.start[0] + (2.0 * RADIUS, 0.0))
    assert in_stock(tracks[:1], links.Piece(far), RADIUS)  # the judge sees stock


def test_a_link_begins_and_ends_with_the_clearance_kept():
    """One-route in a rectangle: the rapids keep 0.2 mm to the walls and to the row that still stands."""
    (region,) = regions("rectangle")
    tracks = STRATEGIES[1](region, RADIUS, STEP, 0.0, True)
    rapids = [
        piece.elements
        for route in links.linked(region, tracks, RADIUS, CLEARANCE, FEED)
        for piece in route or ()
        if piece.rapid
    ]
    assert len(rapids) >= len(tracks) // 2
    for e in rapids:
        assert (
            min(
                elements.distances(c, np.arange(len(c)), np.broadcast_to(p, (len(c), 2))).min()
                for c in region.contours
                for p in (e.start[0], e.end[0])
            )
            >= CLEARANCE - 1e-6
        )


def test_shortest_goes_round_what_is_not_free():
    free = np.ones((7, 7), bool)
    free[3, :6] = False
    route = over_raster(free, (0, 0), (6, 0), links.NEIGHBOURS)
    assert route[0] == (0, 0) and route[-1] == (6, 0) and (3, 6) in route and all(free[at] for at in route)
    free[3, 6] = False
    assert over_raster(free, (0, 0), (6, 0), links.NEIGHBOURS) is None
    assert over_raster(free, (0, 0), (0, 0), links.NEIGHBOURS) == [(0, 0)]


def walked(route):
    """Places of a run of elements."""
    return [route.start[0].tolist()] + [end.tolist() for end in route.end]


def test_along_a_path_from_track_to_track():
    """A square, a line that ends on its side, a circle that touches the line; and one that touches nothing."""
    square = elements.make_lines(
        np.array([(0.0, 0), (10, 0), (10, 10), (0, 10)]), np.array([(10.0, 0), (10, 10), (0, 10), (0, 0)])
    )
    spur = chains.line((20, 4), (10, 4))
    ring = elements.make_arcs(
        np.array([(20.0, 4)]), np.array([(20.0, 4)]), np.array([(22.0, 4)]), np.array([2.0]), np.array([2 * math.pi])
    )
    far = chains.line((30, 0), (40, 0))
    path = elements.join((square, spur, ring, far))
    route = along(path, (0.0, 2.0), (22.0, 2.0), 1e-4)
    assert np.allclose(walked(route), [(0, 2), (0, 0), (10, 0), (10, 4), (20, 4), (22, 2)])
    assert elements.lengths(route).sum() == pytest.approx(2 + 10 + 4 + 10 + math.pi)
    route = along(path, (22.0, 6.0), (5.0, 10.0), 1e-4)  # over the seam of the circle, backwards
    assert elements.lengths(route).sum() == pytest.approx(math.pi + 10 + 6 + 5)
    assert along(path, (0.0, 2.0), (35.0, 0.0), 1e-4) is None


def test_a_link_along_the_path_leads_over_what_the_path_has_cleared(monkeypatch):
    """P3 where nothing shorter is found; the same links lift if they take too long."""
    (region,) = regions("star")
    tracks = STRATEGIES[3](region, RADIUS, STEP, 0.0, True)
    linker = links._Linker(region, RADIUS, CLEARANCE, FEED)
    for track in tracks:
        linker.add(track)
    here, to = tracks[-1].end, tracks[0].start
    route = linker._along(here, to)
    assert math.dist(route[0].start[0], here) < 1e-6 and math.dist(route[-1].end[0], to) < links.ON_PATH_MM
    assert all(in_stock(tracks, links.Piece(piece), RADIUS) == [] for piece in route)
    linker._searched = lambda a, b, step: None
    assert len(linker._found(here, to)) == len(route)
    monkeypatch.setattr(links, "SHORT", 0.0)
    linker.feed_mm_s = 0.01
    assert linker._found(here, to) is None


def test_a_track_that_begins_where_the_last_ended_needs_no_link():
    (region,) = regions("rectangle")
    whole = STRATEGIES[1](region, RADIUS, STEP, 0.0, True)[0].elements
    first, second = (chains.line(whole.start[0], whole.end[0]), elements.take(whole, np.arange(1, len(whole))))
    tracks = [make_track(first), make_track(second)]
    assert math.dist(tracks[0].end, tracks[1].start) <= NODE_MM
    assert links.linked(region, tracks, RADIUS, CLEARANCE, FEED) == [None, ()]
