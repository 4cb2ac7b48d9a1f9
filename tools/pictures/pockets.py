# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/pocket_p0.svg to docs/user/pocket_p3.svg: the same pocket cleared by each strategy of G79.

    /usr/bin/python3 tools/pictures/pockets.py

Blue: cutting; the darker, the later, with the arcs onto and off the walls.  Green: feed through cleared area, links
from one Track to the next among it.  Red dashes: lifted; a red dot where a Track begins in solid stock.  Grey: pocket
and islands; thin line: where the tool centre may go.
"""

import math
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
sys.path.insert(0, str(DOCS.parent / "remap"))

import numpy as np  # noqa: E402

from chipwise.geometry.base import elements  # noqa: E402
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour  # noqa: E402
from chipwise.geometry.pocket import links  # noqa: E402
from chipwise.geometry.pocket.concentric import concentric  # noqa: E402
from chipwise.geometry.pocket.machinable import split  # noqa: E402
from chipwise.geometry.pocket.oneway import one_way  # noqa: E402
from chipwise.geometry.pocket.rings import contour_parallel  # noqa: E402
from chipwise.geometry.pocket.wall_arcs import Walls  # noqa: E402
from chipwise.geometry.pocket.zigzag import zigzag  # noqa: E402

STRATEGIES = {"p0": contour_parallel, "p1": one_way, "p2": zigzag, "p3": concentric}
RADIUS, STEP = 3.0, 3.6  # mm
SCALE = 8.0  # px per mm
CLEARANCE, FEED, OVERLAP = 0.2, 25.0, 0.3  # mm, mm/s, mm: of the links, over the seam
GREEN, RED = 'stroke="#2a2" stroke-dasharray="0.9 0.5"', 'stroke="#d33" stroke-dasharray="0.6 0.6"'
EARLY, LATE = (120, 180, 240), (10, 50, 130)


def demo_pocket():
    """Boundary and islands of the pocket in the pictures: a bay, a round and a square-cornered island."""

    def run(*steps):
        here, parts = steps[0], []
        for step in steps[1:]:
            parts.append(
                LineElement(here, step[:2], 1) if len(step) == 2 else ArcElement(here, step[:2], step[2:4], step[4], 1)
            )
            here = step[:2]
        return make_contour(parts)

    boundary = run(
        (8, 0),
        (92, 0),
        (100, 8, 92, 8, True),
        (100, 52),
        (92, 60, 92, 52, True),
        (66, 60),
        (62, 56, 66, 56, True),
        (62, 44),
        (54, 44, 58, 44, False),
        (54, 56),
        (50, 60, 50, 56, True),
        (8, 60),
        (0, 52, 8, 52, True),
        (0, 8),
        (8, 0, 8, 8, True),
    )
    round_island = run((36, 34), (36, 34, 28, 34, True))
    bar = run((58, 16), (82, 16), (82, 26), (58, 26), (58, 16))
    return boundary, [round_island, bar]


def path_of(run):
    """SVG path data of connected Elements; y points up."""
    data = [f"M{run.start[0][0]:.3f} {-run.start[0][1]:.3f}"]
    for k in range(len(run)):
        cuts = max(1, math.ceil(abs(run.sweep[k]) / 3.0))
        ends = elements.point_at(run, np.full(cuts, k), np.arange(1, cuts + 1) / cuts)
        for x, y in ends:
            r, turn = run.radius[k], int(run.sweep[k] < 0.0)
            data.append(f"A{r:.3f} {r:.3f} 0 0 {turn} {x:.3f} {-y:.3f}" if run.sweep[k] else f"L{x:.3f} {-y:.3f}")
    return " ".join(data)


def _runs(track):
    """Segments of a Track that are all cutting or all not: (elements, cutting)."""
    edges = [0, *(np.flatnonzero(np.diff(track.cutting.astype(int))) + 1), len(track.elements)]
    return [(elements.take(track.elements, np.arange(a, b)), bool(track.cutting[a])) for a, b in zip(edges, edges[1:])]


def tracks_svg(tracks, routes, radius):
    """Shapes of Tracks in their order, and of the links to them."""
    shapes, cut = [], []
    for k, (track, route) in enumerate(zip(tracks, routes)):
        share = k / max(1, len(tracks) - 1)
        color = "rgb({:.0f},{:.0f},{:.0f})".format(*(a + (b - a) * share for a, b in zip(EARLY, LATE)))
        for run, cutting in _runs(track):
            style = f'stroke="{color}"' if cutting else GREEN
            shapes.append(f'<path d="{path_of(run)}" fill="none" {style} stroke-width="0.3"/>')
        if k and route is None:
            route = [links.Piece(elements.make_lines(tracks[k - 1].end[None], track.start[None]), True)]
        for piece in route or ():
            style = f'{RED} stroke-width="0.15"' if piece.rapid else f'{GREEN} stroke-width="0.2"'
            shapes.append(f'<path d="{path_of(piece.elements)}" fill="none" {style}/>')
        if not cut or not track.cleared and _gap(cut, track.start) > 0.05 * radius:
            shapes.append(f'<circle cx="{track.start[0]:.3f}" cy="{-track.start[1]:.3f}" r="0.8" fill="#d33"/>')
        cut.append(track.elements)
    return shapes


def _gap(cut, point):
    """Distance (mm) of a point from what has been run."""
    return min(elements.distances(e, np.arange(len(e)), np.broadcast_to(point, (len(e), 2))).min() for e in cut)


def arrows_svg(tracks, every=40.0):
    """Small arrow heads along the Tracks, one about every so many mm."""
    shapes, since = [], 0.6 * every
    for track in tracks:
        e = track.elements
        for k, length in enumerate(elements.lengths(e)):
            since += length
            if since < every or length < 4.0:
                continue
            since = 0.0
            (x, y), (u, v) = (f(e, np.array([k]), np.array([0.5]))[0] for f in (elements.point_at, elements.tangent_at))
            points = ((x + u, y + v), (x - u - 0.6 * v, y - v + 0.6 * u), (x - u + 0.6 * v, y - v - 0.6 * u))
            shapes.append(
                '<polygon points="' + " ".join(f"{px:.2f},{-py:.2f}" for px, py in points) + '" fill="#136"/>'
            )
    return shapes


def picture(strategy, boundary, islands, radius=RADIUS, step=STEP, direction=0.0, climb=True):
    """SVG text of a pocket cleared by a strategy."""
    low, high = elements.boxes(boundary.elements)
    (x0, y0), (x1, y1) = low.min(axis=0) - 2.0, high.max(axis=0) + 2.0
    shapes = [f'<path d="{path_of(boundary.elements)}Z" fill="#eee" stroke="#555" stroke-width="0.3"/>']
    shapes += [f'<path d="{path_of(i.elements)}Z" fill="#bbb" stroke="#555" stroke-width="0.3"/>' for i in islands]
    for field in split(boundary, islands, radius):
        shapes += [f'<path d="{path_of(c)}" fill="none" stroke="#999" stroke-width="0.1"/>' for c in field.contours]
        tracks = strategy(field, radius, step, direction, climb, Walls(field, radius, climb, OVERLAP))
        routes = links.linked(field, tracks, radius, CLEARANCE, FEED)
        shapes += tracks_svg(tracks, routes, radius) + arrows_svg(tracks)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{(x1 - x0) * SCALE:.0f}" height="{(y1 - y0) * SCALE:.0f}" '
        f'viewBox="{x0:.3f} {-y1:.3f} {x1 - x0:.3f} {y1 - y0:.3f}">\n'
        f'<rect x="{x0:.3f}" y="{-y1:.3f}" width="{x1 - x0:.3f}" '
        f'height="{y1 - y0:.3f}" fill="white"/>\n' + "\n".join(shapes) + "\n</svg>\n"
    )


def main():
    boundary, islands = demo_pocket()
    for name, strategy in STRATEGIES.items():
        (DOCS / "user" / f"pocket_{name}.svg").write_text(picture(strategy, boundary, islands))


if __name__ == "__main__":
    main()
