# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/pocket_p4.svg: the pocket of pockets.py cleared at constant engagement.

    /usr/bin/python3 tools/pictures/pocket_engage.py

Colours as there; the helix is red.
"""

from pockets import DOCS, EARLY, LATE, RADIUS, SCALE, demo_pocket, elements, path_of, split

from chipwise.geometry.pocket import engage

STEP = 2.4  # mm


def segments_svg(segments):
    """Shapes of segments in their order."""
    shapes = []
    for k, segment in enumerate(segments):
        color = "rgb({:.0f},{:.0f},{:.0f})".format(*(a + (b - a) * k / len(segments) for a, b in zip(EARLY, LATE)))
        style = {
            "cut": f'stroke="{color}" stroke-width="0.25"',
            "feed": 'stroke="#2a2" stroke-width="0.2"',
            "entry": 'stroke="#d33" stroke-width="0.5"',
        }.get(segment.kind, 'stroke="#d33" stroke-width="0.15" stroke-dasharray="0.6 0.6"')
        shapes.append(f'<path d="{path_of(segment.elements)}" fill="none" {style}/>')
    return shapes


def main():
    boundary, islands = demo_pocket()
    low, high = elements.boxes(boundary.elements)
    (x0, y0), (x1, y1) = low.min(axis=0) - 2.0, high.max(axis=0) + 2.0
    shapes = [f'<path d="{path_of(boundary.elements)}Z" fill="#eee" stroke="#555" stroke-width="0.3"/>']
    shapes += [f'<path d="{path_of(i.elements)}Z" fill="#bbb" stroke="#555" stroke-width="0.3"/>' for i in islands]
    for region in split(boundary, islands, RADIUS):
        shapes += segments_svg(engage.planned(region, engage.Cut(RADIUS, STEP, 25.0, 0.2)))
    (DOCS / "user" / "pocket_p4.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{(x1 - x0) * SCALE:.0f}" height="{(y1 - y0) * SCALE:.0f}" '
        f'viewBox="{x0:.3f} {-y1:.3f} {x1 - x0:.3f} {y1 - y0:.3f}">\n'
        f'<rect x="{x0:.3f}" y="{-y1:.3f}" width="{x1 - x0:.3f}" '
        f'height="{y1 - y0:.3f}" fill="white"/>\n' + "\n".join(shapes) + "\n</svg>\n"
    )


if __name__ == "__main__":
    main()
