# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/holes.svg: the pieces of a chopped hole with the patent's n, and with the n that keeps the promise.

/usr/bin/python3 tools/pictures/holes.py
"""

import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
sys.path.insert(0, str(DOCS.parent / "remap"))

from chipwise.cycles import hole  # noqa: E402
from chipwise.geometry.base import polygons
from chipwise.geometry.base.enclosing_circle import enclosing_circle  # noqa: E402
from chipwise.geometry.slug import disc  # noqa: E402
from chipwise.moves import Arc, Line  # noqa: E402

DIAMETER, TOOL, CHOP_SIZE = 30.0, 1.0, 8.0  # mm
SCALE = 12.0  # px per mm


def pieces_svg(parts, dx):
    """Hole, kerfs and pieces for a number of parts, the hole's centre at dx (mm)."""
    lines = disc.flat_segments(disc.disc_lines(dx, 0, DIAMETER / 2, TOOL / 2, parts))
    slug = polygons.outer_disc(dx, 0, DIAMETER / 2 - TOOL, 0.01)
    shapes = [f'<circle cx="{dx}" cy="0" r="{DIAMETER / 2}" fill="#ddd" stroke="#333" stroke-width="0.15"/>']
    largest = 0.0
    for outline in polygons.pieces(slug, lines, TOOL / 2):
        x, y, size = enclosing_circle(outline)
        largest = max(largest, size)
        corners = " ".join(f"{px:.3f},{-py:.3f}" for px, py in outline)
        fill = "#8ab6e6" if size < CHOP_SIZE else "#e68a8a"
        shapes.append(f'<polygon points="{corners}" fill="{fill}"/>')
        if size >= CHOP_SIZE:
            shapes.append(
                f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{size / 2:.3f}" fill="none" stroke="#c33" stroke-width="0.1"/>'
            )
    shapes.append(
        f'<text x="{dx}" y="{DIAMETER / 2 + 2.5}" font-size="1.6" text-anchor="middle" font-family="sans-serif">'
        f"n = {parts}: largest piece {largest:.2f} mm, H = {CHOP_SIZE:g} mm</text>"
    )
    return shapes


def path_svg(dx):
    """The tool's path of the cycle, rapids dashed."""
    request = hole.HoleRequest(
        x=dx,
        y=0,
        bottom=-1,
        clearance=1,
        radius=DIAMETER / 2,
        ccw=True,
        tool_radius=TOOL / 2,
        feed=1,
        plunge_feed=1,
        start=(dx, 0, 1),
        chop_size=CHOP_SIZE,
    )
    shapes, here = [], (dx, 0.0)
    for move in hole.hole_plan(request).moves:
        if move.x is None:
            continue
        there = (move.x, move.y)
        if isinstance(move, Arc):
            radius = ((there[0] - move.cx) ** 2 + (there[1] - move.cy) ** 2) ** 0.5
            shapes.append(
                f'<circle cx="{move.cx}" cy="{-move.cy}" r="{radius}" fill="none" stroke="#06c" stroke-width="0.1"/>'
            )
        else:
            style = 'stroke="#06c"' if isinstance(move, Line) else 'stroke="#888" stroke-dasharray="0.5 0.4"'
            shapes.append(
                f'<line x1="{here[0]}" y1="{-here[1]}" x2="{there[0]}" y2="{-there[1]}" {style} stroke-width="0.1"/>'
            )
        here = there
    return shapes


def main():
    half, right = DIAMETER / 2 + 2, DIAMETER + 5
    shapes = pieces_svg(disc.patent_parts(DIAMETER, CHOP_SIZE), 0.0)
    shapes += pieces_svg(disc.choose_parts(DIAMETER, TOOL / 2, CHOP_SIZE), right) + path_svg(right)
    width, height = right + 2 * half, 2 * half + 2
    (DOCS / "user" / "holes.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * SCALE:.0f}" height="{height * SCALE:.0f}" '
        f'viewBox="{-half} {-half} {width} {height}">\n'
        f'<rect x="{-half}" y="{-half}" width="{width}" height="{height}" fill="white"/>\n'
        + "\n".join(shapes)
        + "\n</svg>\n"
    )


if __name__ == "__main__":
    main()
