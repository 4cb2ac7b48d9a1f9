# SPDX-License-Identifier: GPL-2.0-or-later
"""SVG -> Drawn, by svgelements.  Called by run.py.

Shapes and paths that are filled or have a stroke; svg_tree.py chooses what is shown, transforms, viewBox and units are
svgelements' work.  y points down in SVG and is turned over, so that the lower edge of the page is Y0.  A layer is a
group that Inkscape calls one, else the id of the outermost group.
"""

import math

from chipwise.errors import MM_PER_INCH, braceless
from chipwise.importing import fit, svg_tree
from chipwise.importing.drawn import Drawn, Unreadable, arc, line

PPI = 96.0  # of CSS, Inkscape since 0.92
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
POINTS = 24  # least number on a curve
MOST_POINTS = 3000
ROUND = 1e-9  # share by which the axes of a circle may differ


def read(path, tolerance, scale, text=False, layer=None):
    """Drawn of a file; scale multiplies; layer: only this one.  text: SVG text has no outlines."""
    try:
        import svgelements
    except ImportError:
        raise Unreadable(
            "an SVG drawing needs the Python package svgelements, which is not installed",
            "apt-get install python3-svgelements",
        ) from None
    try:
        found = svg_tree.prepared(path)
        page = svgelements.SVG.parse(found.stream, reify=False, ppi=PPI)
    except (MemoryError, Unreadable):
        raise
    except Exception as error:  # whatever a damaged file makes of a library
        said = braceless(" ".join(str(error).split())[:80])
        raise Unreadable(
            f"the file cannot be read as a SVG drawing ({said or type(error).__name__})", "save it again as plain SVG"
        ) from None
    drawn, unit = Drawn(left=found.left), MM_PER_INCH / PPI * scale
    drawn.words.append(
        "unit mm, by the size of its page" if found.real else "its page has no size in mm; 96 px are taken as an inch"
    )
    reader = _Reader(svgelements, drawn, tolerance, unit, float(page.height or 0.0), layer)
    reader.group(page, None)
    if found.clipped:
        drawn.words.append(
            f"{found.clipped} elements are clipped or masked in the drawing; here their whole outlines count"
        )
    drawn.refuse_other_layers(layer, reader.others)
    return drawn


class _Reader:
    """Elements of one page -> Drawn."""

    def __init__(self, svgelements, drawn, tolerance, unit, height, layer):
        self.svg, self.drawn, self.tolerance, self.unit, self.height, self.layer, self.others = (
            svgelements,
            drawn,
            tolerance,
            unit,
            height,
            layer,
            set(),
        )

    def group(self, group, name):
        """All elements of a group; name: of the layer it is in."""
        for element in group:
            if isinstance(element, self.svg.Group):
                self.group(element, name or self._name(element))
            elif isinstance(element, self.svg.Shape):
                self._shape(element, name or "0")
            else:
                self.drawn.left[type(element).__name__.replace("SVG", "")] += 1

    @staticmethod
    def _name(group):
        own = group.values.get("attributes", {})
        return own.get(INKSCAPE + "label") or group.values.get(INKSCAPE + "label") or group.id

    def _shape(self, shape, layer):
        if self.layer is not None and layer.lower() != self.layer.lower():
            self.others.add(layer)
            return
        if str(shape.values.get("display", "")) == "none" or str(shape.values.get("visibility", "")) in (
            "hidden",
            "collapse",
        ):
            return
        if all(str(shape.values.get(key, "")).strip() == "none" for key in ("fill", "stroke")):
            self.drawn.left["with neither fill nor stroke"] += 1
            return
        matrix = shape.transform
        parts: list = []
        for segment in shape.segments(False):
            if isinstance(segment, self.svg.Move):
                self.drawn.add(layer, parts)
                parts = []
            else:
                parts += self._segment(segment, matrix)
        self.drawn.add(layer, parts)

    def at(self, point, matrix):
        """(x, y) mm, y upward, of a point of a shape."""
        x = matrix.a * point.x + matrix.c * point.y + matrix.e
        y = matrix.b * point.x + matrix.d * point.y + matrix.f
        return x * self.unit, (self.height - y) * self.unit

    def _segment(self, segment, matrix):
        """Parts of one segment of a path, in the coordinates of its shape."""
        if segment.start is None or segment.end is None:
            return []
        start, end = self.at(segment.start, matrix), self.at(segment.end, matrix)
        if isinstance(segment, (self.svg.Line, self.svg.Close)):
            return [line(start, end)]
        if isinstance(segment, self.svg.Arc) and _is_round(segment, matrix) and abs(segment.sweep) > 0.0:
            ccw = (segment.sweep < 0.0) != (matrix.determinant < 0.0)
            return [arc(start, end, self.at(segment.center, matrix), ccw)]
        size = segment.length(error=1e-2) * _largest(matrix) * self.unit
        count = min(MOST_POINTS, max(POINTS, int(2.0 * (size / self.tolerance) ** 0.5) + 1))
        points = [self.at(segment.point(k / count), matrix) for k in range(count + 1)]
        parts, off = fit.fitted(points, self.tolerance)
        self.drawn.deviation = max(self.drawn.deviation, off)
        return parts


def _is_round(arc, matrix):
    """Whether an arc is a circle's and stays one: svgelements turns those that a matrix shears into others."""
    size = max(abs(one) for one in (matrix.a, matrix.b, matrix.c, matrix.d)) * ROUND
    return (
        abs(arc.rx - arc.ry) < ROUND * max(arc.rx, ROUND)
        and abs(matrix.a * matrix.c + matrix.b * matrix.d) <= size * _largest(matrix)
        and abs(math.hypot(matrix.a, matrix.b) - math.hypot(matrix.c, matrix.d)) <= size
    )


def _largest(matrix):
    """The largest factor of a matrix for lengths, nearly."""
    return max(math.hypot(matrix.a, matrix.b), math.hypot(matrix.c, matrix.d))
