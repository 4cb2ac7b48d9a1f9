# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/design/chop.svg: chop lines, pieces and kerfs of contours, by the code that cuts.

/usr/bin/python3 tools/pictures/chop.py
"""

import math
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
sys.path.insert(0, str(DOCS.parent / "remap"))

import numpy as np  # noqa: E402

from chipwise.cycles import chop_lines, contour_chop  # noqa: E402
from chipwise.geometry.base import polygons
from chipwise.geometry.base.enclosing_circle import enclosing_circle  # noqa: E402
from chipwise.geometry.slug import slug  # noqa: E402
from chipwise.geometry.base.contour import ArcElement, LineElement, make_contour  # noqa: E402
from chipwise.geometry.base.elements import area  # noqa: E402
from chipwise.geometry.offset.kernel import offset_pocket  # noqa: E402

SCALE = 9.0  # px per mm
TOOL = 2.0  # mm


def loop(*steps):
    """A closed loop of steps (x, y) or (x, y, centre x, centre y): lines and counter-clockwise arcs to there."""
    made = []
    for k, step in enumerate(steps):
        start, end = steps[k - 1][:2], step[:2]
        made.append(ArcElement(start, end, step[2:], True, k + 1) if len(step) == 4 else LineElement(start, end, k + 1))
    return made


def turned(loops, degrees):
    """Loops turned about the origin."""
    a = math.radians(degrees)

    def at(p):
        return (p[0] * math.cos(a) - p[1] * math.sin(a), p[0] * math.sin(a) + p[1] * math.cos(a))

    return [
        [
            ArcElement(at(q.start), at(q.end), at(q.centre), q.ccw, q.line)
            if isinstance(q, ArcElement)
            else LineElement(at(q.start), at(q.end), q.line)
            for q in parts
        ]
        for parts in loops
    ]


BRACKET = loop((0, 0), (30, 0), (34, 4, 30, 4), (34, 12), (14, 12), (14, 24), (10, 28, 10, 24), (0, 28))
DUMBBELL = loop(
    (0, -8),
    (16, -8),
    (16, -1.5),
    (24, -1.5),
    (24, -8),
    (40, -8),
    (40, 8),
    (24, 8),
    (24, 1.5),
    (16, 1.5),
    (16, 8),
    (0, 8),
)
RING = [ArcElement((14, 0), (14, 0), (0, 0), True, 1)]
ISLAND = [ArcElement((9, 0), (9, 0), (2, 0), True, 2)]

SHAPES = (
    ("any direction", turned([BRACKET], 25), 9.0, (12, 0)),
    ("two slugs, the neck is cleared", [DUMBBELL], 9.0, (46, 14)),
    ("round an island", [RING, ISLAND], 9.0, (106, 14)),
)


def points(run):
    return slug.corners(run, 0.01)


def polygon(corners, dx, dy, style):
    return f'<polygon points="{" ".join(f"{x + dx:.3f},{-y - dy:.3f}" for x, y in corners)}" {style}/>'


def shape_svg(title, loops, chop_size, at):
    """One contour with its slug's lines and pieces, its origin at `at` (mm)."""
    contours = [make_contour(parts) for parts in loops]
    paths = [p.elements for p in offset_pocket(contours[0], contours[1:], TOOL / 2).paths]
    outer, inner = [p for p in paths if area(p) > 0], [p for p in paths if area(p) < 0]
    plan = contour_chop.chop_plan(outer, inner, TOOL / 2, chop_size)
    dx, dy = at
    shapes = [polygon(points(contours[0].elements), dx, dy, 'fill="#ddd" stroke="#333" stroke-width="0.15"')]
    shapes += [
        polygon(points(c.elements), dx, dy, 'fill="white" stroke="#333" stroke-width="0.15"') for c in contours[1:]
    ]
    for region in polygons.loop_regions([points(p) for p in outer], [points(p) for p in inner]):
        for piece in polygons.parts(
            polygons.without(polygons.shrink(region, TOOL / 2), [s for c in plan.chops for s in c.segments], TOOL / 2)
        ):
            shapes.append(polygon(polygons.outside_ring(piece), dx, dy, 'fill="#8ab6e6"'))
            x, y, size = enclosing_circle(polygons.hull(piece))
            if size > plan.largest_piece - 0.02:
                shapes.append(
                    f'<circle cx="{x + dx:.3f}" cy="{-y - dy:.3f}" r="{size / 2:.3f}" fill="none" stroke="#c33" '
                    'stroke-width="0.1"/>'
                )
    shapes += [polygon(points(p), dx, dy, 'fill="none" stroke="#06c" stroke-width="0.08"') for p in paths]
    ends = chop_lines.ends(TOOL / 2, 1)
    here = None
    for start, end in slug.order_chops(plan.chops, (0.0, 0.0), (0.0, 0.0), *ends):
        entry = ends[0]((start, end))
        if here:
            shapes.append(
                f'<line x1="{here[0] + dx:.3f}" y1="{-here[1] - dy:.3f}" x2="{entry[0] + dx:.3f}" '
                f'y2="{-entry[1] - dy:.3f}" stroke="#888" stroke-dasharray="0.5 0.4" stroke-width="0.1"/>'
            )
        shapes.append(
            f'<line x1="{start[0] + dx:.3f}" y1="{-start[1] - dy:.3f}" x2="{end[0] + dx:.3f}" '
            f'y2="{-end[1] - dy:.3f}" stroke="#06c" stroke-width="0.15"/>'
        )
        here = end
    edge = np.concatenate([points(c.elements) for c in contours[:1]])
    lines = sum(len(c.segments) for c in plan.chops)
    text = f"{title}: {lines} lines, {plan.pieces} pieces, largest {plan.largest_piece:.2f} mm"
    shapes.append(
        f'<text x="{edge[:, 0].mean() + dx:.2f}" y="{2.5 - (edge[:, 1].min() + dy):.2f}" font-size="1.5" '
        f'text-anchor="middle" font-family="sans-serif">{text}</text>'
    )
    return shapes


def main():
    shapes = [line for shape in SHAPES for line in shape_svg(*shape)]
    left, top, width, height = -4, -34, 130, 40
    (DOCS / "design" / "chop.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * SCALE:.0f}" height="{height * SCALE:.0f}" '
        f'viewBox="{left} {top} {width} {height}">\n'
        f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="white"/>\n'
        + "\n".join(shapes)
        + "\n</svg>\n"
    )


if __name__ == "__main__":
    main()
