# SPDX-License-Identifier: GPL-2.0-or-later
"""Letters of the fonts that this computer has, as loops of lines and arcs: foreign shapes for pockets.

Nothing is drawn twice the same way by two fonts: thin serifs, cusps, curves that meet at no angle, islands.  Lengths
mm.
"""

import math
from pathlib import Path

import numpy as np

from chipwise.geometry.base.contour import LineElement
from chipwise.importing.fit import fitted

FOLDERS = ("/usr/share/fonts/truetype", "/usr/share/matplotlib/mpl-data/fonts/ttf")
TOLERANCE = 0.005  # mm, of arcs
POINTS = 40  # of a curve
CORNER = math.radians(8)  # a joint that turns by more ends an arc
CLOSED = 1e-6


def fonts():
    """Paths by name; of two of one name the first."""
    found = {}
    for folder in FOLDERS:
        for path in sorted(Path(folder).rglob("*.ttf")):
            found.setdefault(path.stem, path)
    return found


class Font:
    """Outlines of a font file."""

    def __init__(self, path):
        from fontTools.ttLib import TTFont

        self.font = TTFont(path)
        self.glyphs, self.names = self.font.getGlyphSet(), self.font.getBestCmap() or {}
        self.unit = self.font["head"].unitsPerEm

    def characters(self):
        """Those that have an outline."""
        return [code for code in sorted(self.names) if self._curves(self.names[code])]

    def loops(self, code, size):
        """Loops of parts of a character, `size` mm to the em; outermost first."""
        found = [_parts(curves, size / self.unit) for curves in self._curves(self.names[code])]
        return tuple(tuple(parts) for parts in sorted((p for p in found if len(p) > 1), key=_extent, reverse=True))

    def _curves(self, name):
        from fontTools.pens.recordingPen import DecomposingRecordingPen

        pen, contours, here = DecomposingRecordingPen(self.glyphs), [], None
        self.glyphs[name].draw(pen)
        for what, points in pen.value:
            if what == "moveTo":
                contours.append([])
                first = here = points[0]
            elif what == "lineTo":
                contours[-1].append((here, points[0]))
                here = points[0]
            elif what == "qCurveTo":
                if points[-1] is None:  # a contour without a point on the curve
                    points = (*points[:-1], _middle(points[-2], points[0]))
                    contours.append([])
                    first = here = points[-1]
                for k, control in enumerate(points[:-1]):
                    end = points[-1] if k == len(points) - 2 else _middle(control, points[k + 1])
                    contours[-1].append((here, control, end))
                    here = end
            elif what == "curveTo":
                contours[-1].append((here, *points))
                here = points[-1]
            if what == "closePath" and here != first:
                contours[-1].append((here, first))
        return [contour for contour in contours if contour]


def _middle(a, b):
    return ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)


def _points(curve, scale):
    p = np.array(curve, float) * scale
    if len(p) == 2:
        return p
    t = np.linspace(0.0, 1.0, POINTS + 1)[:, None]
    n = len(p) - 1
    return sum(math.comb(n, k) * t**k * (1 - t) ** (n - k) * p[k] for k in range(n + 1))


def _parts(curves, scale):
    """Lines and arcs of a contour; smooth curves that follow one another share them."""
    runs = []
    for curve in curves:
        points = _points(curve, scale)
        if np.hypot(*np.ptp(points, axis=0)) < CLOSED:
            continue
        if runs and len(curve) > 2 and runs[-1][0] and _turn(runs[-1][1], points) < CORNER:
            runs[-1][1] = np.vstack((runs[-1][1], points[1:]))
        else:
            runs.append([len(curve) > 2, points])
    parts = []
    for curved, points in runs:
        parts += (
            fitted(points, TOLERANCE)[0]
            if curved
            else [LineElement(tuple(points[0].tolist()), tuple(points[-1].tolist()), len(parts))]
        )
    return parts


def _turn(before, after):
    a, b = before[-1] - before[-2], after[1] - after[0]
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _extent(parts):
    x, y = zip(*(part.start for part in parts))
    return (max(x) - min(x)) * (max(y) - min(y))
