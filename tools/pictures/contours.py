# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/contours.svg: the bracket of nc_files/contour.ngc, roughed (left) and finished (right) by the code
that cuts.

/usr/bin/python3 tools/pictures/contours.py
"""

import math
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
sys.path.insert(0, str(DOCS.parent / "remap"))

from chipwise.contour_sub.job import Job  # noqa: E402
from chipwise.contour_sub.read import read_shape  # noqa: E402
from chipwise.cycles.contour import ContourRequest, contour_plan  # noqa: E402
from chipwise.moves import Arc, Rapid  # noqa: E402

PROGRAM = str(DOCS.parent / "nc_files" / "contour.ngc")
STOCK = (-10.0, -10.0, 140.0, 100.0)  # x, y, width, height, mm
SCALE = 4.0  # px per mm
APART = 165.0  # mm between the two pictures


def outline(sub):
    """The finish shape as SVG path data."""
    (loop,) = read_shape(Job(PROGRAM, sub)).loops
    parts = ["M{:.3f} {:.3f}".format(*loop[0].start)]
    for e in loop:
        if hasattr(e, "centre"):
            parts.append(arc(e.start, e.end, e.centre, e.ccw))
        else:
            parts.append("L{:.3f} {:.3f}".format(*e.end))
    return loop, " ".join(parts) + "Z"


def arc(start, end, centre, ccw):
    """SVG path data of an arc; a full circle in two halves."""
    radius = math.dist(start, centre)
    turn = math.atan2(end[1] - centre[1], end[0] - centre[0]) - math.atan2(start[1] - centre[1], start[0] - centre[0])
    turn = turn % (2 * math.pi) if ccw else -turn % (2 * math.pi)
    if math.dist(start, end) < 1e-9:
        across = tuple(2 * c - s for c, s in zip(centre, start))
        return arc(start, across, centre, ccw) + arc(across, end, centre, ccw)
    large = int(turn > math.pi + 1e-9)
    return f"A{radius:.3f} {radius:.3f} 0 {large} {int(ccw)} {end[0]:.3f} {end[1]:.3f}"


def offset_paths(loop, **words):
    """(path data of the feed moves, of the rapids) of one line of the program."""
    request = ContourRequest(
        shape=loop, side=41, bottom=-8.0, clearance=1.0, feed=1.0, plunge_feed=1.0, start=(0.0, 0.0, 10.0), **words
    )
    feeds, rapids, here = [], [], request.start[:2]
    for move in contour_plan(request).moves:
        if move.x is None:
            continue
        there = (move.x, move.y)
        text = (
            arc(here, there, (move.cx, move.cy), move.ccw) if isinstance(move, Arc) else "L{:.3f} {:.3f}".format(*there)
        )
        (rapids if isinstance(move, Rapid) else feeds).append("M{:.3f} {:.3f}".format(*here) + text)
        here = there
    return " ".join(feeds), " ".join(rapids)


def picture(dx, tool, lines, title):
    """One half: stock, what the tool sweeps, its path, the finish shapes."""
    shapes = [
        f'<g transform="translate({dx} 0)">',
        '<rect x="{}" y="{}" width="{}" height="{}" fill="#e4d9c4" stroke="#998" stroke-width="0.2"/>'.format(*STOCK),
    ]
    drawn = [outline(sub) for sub, _ in lines]
    paths = [offset_paths(loop, tool_radius=tool / 2, **words) for (loop, _), (_, words) in zip(drawn, lines)]
    for feeds, _ in paths:
        shapes.append(
            f'<path d="{feeds}" fill="none" stroke="white" stroke-width="{tool}" stroke-linecap="round" '
            'stroke-linejoin="round"/>'
        )
    for (_, data), (feeds, rapids) in zip(drawn, paths):
        shapes.append(f'<path d="{data}" fill="none" stroke="#222" stroke-width="0.35"/>')
        shapes.append(f'<path d="{feeds}" fill="none" stroke="#06c" stroke-width="0.35"/>')
        shapes.append(f'<path d="{rapids}" fill="none" stroke="#c60" stroke-width="0.2" stroke-dasharray="1.2 0.9"/>')
    shapes.append(
        f'<text x="60" y="-95" transform="scale(1 -1)" font-size="5" text-anchor="middle" '
        f'font-family="sans-serif">{title}</text></g>'
    )
    return shapes


def main():
    inside = dict(allowance=0.3)
    shapes = picture(0.0, 12.0, [(200, inside), (100, dict(allowance=0.3, approach=6.0))], "G77, 12 mm tool, I0.3")
    shapes += picture(
        APART, 6.0, [(200, dict(finish=True, chop_size=25.0)), (100, dict(finish=True, approach=3.0))], "G78, 6 mm tool"
    )
    width, height = APART + 160.0, 124.0
    (DOCS / "user" / "contours.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * SCALE:.0f}" height="{height * SCALE:.0f}" '
        f'viewBox="-20 -104 {width} {height}">\n'
        f'<rect x="-20" y="-104" width="{width}" height="{height}" fill="white"/>\n'
        '<g transform="scale(1 -1)">\n' + "\n".join(shapes) + "\n</g>\n</svg>\n"
    )


if __name__ == "__main__":
    main()
