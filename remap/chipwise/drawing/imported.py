# SPDX-License-Identifier: GPL-2.0-or-later
"""The picture of a drawing that was read: svg(found, title) -> text.  Called by cli/import_drawing.py.

Pockets are filled, islands are not; loops are blue, open chains red, a dot marks the start of each.  y points down in
SVG, so y is turned over.
"""

from xml.sax.saxutils import escape

import numpy as np

from chipwise.errors import printable
from chipwise.geometry.base.chains import flat
from chipwise.geometry.base.contour import make_contour
from chipwise.importing.run import extent

WIDTH, EDGE, HEAD = 900.0, 24.0, 40.0  # px
LOOP, OPEN, FILL = "#1f5fbf", "#d02020", "#dbe7f7"
SAG_PX = 0.2


def svg(found, title):
    """Text of the SVG file."""
    low_x, low_y, high_x, high_y = extent(found.layers)
    size = max(high_x - low_x, high_y - low_y, 1e-3)
    scale = (WIDTH - 2 * EDGE) / size
    height = (high_y - low_y) * scale + 2 * EDGE + HEAD

    def points(chain):
        flats = [
            flat(make_contour([part]).elements, SAG_PX / scale)
            if hasattr(part, "centre")
            else np.array([part.start, part.end])
            for part in chain
        ]
        every = np.concatenate(flats)
        return [(EDGE + (x - low_x) * scale, height - EDGE - (y - low_y) * scale) for x, y in every.tolist()]

    def outline(chain):
        return "M" + " L".join(f"{x:.2f} {y:.2f}" for x, y in points(chain))

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:.0f}" height="{height:.0f}" viewBox="0 0 {WIDTH:.0f} '
        f'{height:.0f}" '
        'font-family="DejaVu Sans, sans-serif" font-size="14">',
        f'<rect width="{WIDTH:.0f}" height="{height:.0f}" fill="#ffffff"/>',
        f'<text x="{EDGE:.0f}" y="26">{escape(printable(title))}: X{low_x:.3f} to {high_x:.3f}, Y{low_y:.3f} to '
        f"{high_y:.3f} mm</text>",
    ]
    for layer in found.layers:
        for boundary, islands in layer.pockets:
            shape = " ".join(outline(loop) + " Z" for loop in (boundary, *islands))
            lines.append(f'<path d="{shape}" fill="{FILL}" fill-rule="evenodd" stroke="{LOOP}" stroke-width="1.5"/>')
        lines += [
            f'<path d="{outline(chain)}" fill="none" stroke="{OPEN}" stroke-width="1.5"/>' for chain in layer.open
        ]
        for chain, colour in [(c, LOOP) for c in layer.loops] + [(c, OPEN) for c in layer.open]:
            x, y = points(chain[:1])[0]
            lines.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="3" fill="{colour}"/>')
    return "\n".join([*lines, "</svg>", ""])
