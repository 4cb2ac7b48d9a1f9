# SPDX-License-Identifier: GPL-2.0-or-later
"""The picture of `chipwise contour` as SVG, written by hand: arcs stay arcs.

Called by cli/contour.py: svg(drawing) -> text.  y points down in SVG, so every point is turned over here and a
counter-clockwise arc has the sweep flag 0.  All numbers in the file are pixels.
"""

import math
from xml.sax.saxutils import escape

import numpy as np

from chipwise.errors import MM_PER_INCH, format_length
from chipwise.geometry.base import elements
from chipwise.geometry.offset.paths import PointContact

WIDTH, HEIGHT = 1000.0, 760.0  # px: the drawing at most; the legend goes below
EDGE = 40.0  # px round the drawing
LINE = 24.0  # px of a line of the legend
LETTER, LETTER_WIDTH = 13.0, 7.5  # px of a number in the drawing: its height, and the width of a digit
NUMBERED = 150  # regions that get a number in the picture; the printed list has all
LARGEST_ARC = 0.9 * math.pi  # rad of one arc command: beyond, its two flags get shaky
FINISH, PATH, ROUGH, LEFT_OVER, TOOL = "#202020", "#1666b0", "#f0a830", "#c4161c", "#5f8f3f"


def svg(drawing):
    """Text of the SVG file."""
    view = View(drawing)
    body = [
        *band(drawing, view),
        *regions(drawing, view),
        *tool(drawing, view),
        *paths(drawing, view),
        *finish(drawing, view),
        *numbers(drawing, view),
        *legend(drawing, view),
    ]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{view.width:.0f}" height="{view.height:.0f}" '
            f'viewBox="0 0 {view.width:.0f} {view.height:.0f}" font-family="DejaVu Sans, sans-serif" font-size="14">',
            f"<title>{escape(drawing.title)}</title>",
            DEFINITIONS,
            f'<rect width="{view.width:.0f}" height="{view.height:.0f}" fill="white"/>',
            *body,
            "</svg>",
            "",
        ]
    )


DEFINITIONS = f'''<defs>
<pattern id="hatch" width="5" height="5" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
<rect width="5" height="5" fill="{LEFT_OVER}" fill-opacity="0.18"/>
<line x1="0" y1="0" x2="0" y2="5" stroke="{LEFT_OVER}" stroke-width="2"/></pattern>
<marker id="finish-direction" viewBox="0 0 10 10" refX="5" refY="5" markerWidth="12" markerHeight="12"
 markerUnits="userSpaceOnUse" orient="auto"><path d="M0 1L10 5L0 9z" fill="{FINISH}"/></marker>
<marker id="path-direction" viewBox="0 0 10 10" refX="5" refY="5" markerWidth="12" markerHeight="12"
 markerUnits="userSpaceOnUse" orient="auto"><path d="M0 1L10 5L0 9z" fill="{PATH}"/></marker>
</defs>'''


class View:
    """From mm to pixels."""

    def __init__(self, drawing):
        every = [c.elements for c in drawing.contours]
        every += [run.elements for run in (*drawing.result.paths, *drawing.result.rough) if len(run.elements)]
        boxes = [elements.boxes(e) for e in every]
        starts = [path.elements.start[0] for path in drawing.result.paths]
        low = np.min([b[0].min(axis=0) for b in boxes] + [at - 0.5 * drawing.tool for at in starts], axis=0)
        high = np.max([b[1].max(axis=0) for b in boxes] + [at + 0.5 * drawing.tool for at in starts], axis=0)
        size = np.maximum(high - low, 1e-3 * max(float((high - low).max()), 1e-6))
        self.scale = float(min((WIDTH - 2 * EDGE) / size[0], (HEIGHT - 2 * EDGE) / size[1]))
        drawn = size * self.scale
        self.width = WIDTH
        self.left = 0.5 * (WIDTH - drawn[0]) - low[0] * self.scale
        self.bottom = EDGE + drawn[1] + low[1] * self.scale
        self.foot = 2 * EDGE + drawn[1]  # top of the legend
        self.height = self.foot + (2 + len(entries(drawing)) / 2) * LINE + 0.5 * EDGE

    def at(self, point):
        """(x, y) mm -> (x, y) px."""
        return self.left + self.scale * float(point[0]), self.bottom - self.scale * float(point[1])

    def data(self, e, closed=False):
        """Elements -> the d of a path."""
        words = ["M%.3f %.3f" % self.at(e.start[0])]
        for k in range(len(e)):
            if not e.is_arc[k]:
                words.append("L%.3f %.3f" % self.at(e.end[k]))
                continue
            parts = math.ceil(abs(e.sweep[k]) / LARGEST_ARC)
            t = np.arange(1, parts + 1) / parts
            for point in elements.point_at(e, np.full(parts, k), t):
                words.append(
                    "A%.3f %.3f 0 0 %d %.3f %.3f"
                    % (*(self.scale * e.radius[k],) * 2, e.sweep[k] < 0.0, *self.at(point))
                )
        return "".join(words) + ("Z" if closed else "")

    def arrow(self, e, marker, colour):
        """An arrow in the middle of the longest element."""
        longest = int(np.argmax(elements.lengths(e)))
        half = min(2.0 / (self.scale * max(float(elements.lengths(e)[longest]), 1e-9)), 0.4)
        a, b = elements.point_at(e, np.full(2, longest), np.array([0.5 - half, 0.5 + half]))
        if math.dist(a, b) * self.scale < 0.1:
            return ""
        return '<path d="M%.3f %.3fL%.3f %.3f" stroke="%s" stroke-width="1" marker-end="url(#%s)"/>' % (
            *self.at(a),
            *self.at(b),
            colour,
            marker,
        )


def stroke(data, colour, width, extra=""):
    return (
        f'<path d="{data}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" '
        f'stroke-linecap="round"{extra}/>'
    )


def band(drawing, view):
    """The rough shape, wide and below everything, because it runs along the finish shape."""
    return [stroke(view.data(r.elements, r.closed), ROUGH, 5) for r in drawing.result.rough if len(r.elements)]


def regions(drawing, view):
    made = []
    for region in drawing.regions:
        data = view.data(region.boundary, True) + "".join(view.data(hole, True) for hole in region.holes)
        made.append(f'<path d="{data}" fill="url(#hatch)" fill-rule="evenodd" stroke="{LEFT_OVER}" stroke-width="1"/>')
    return made + [stroke(view.data(s.elements), LEFT_OVER, 6, ' stroke-opacity="0.5"') for s in drawing.segments]


def tool(drawing, view):
    """The tool where each path starts, its centre marked."""
    made = []
    for path in drawing.result.paths:
        x, y = view.at(path.elements.start[0])
        made.append(
            f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{0.5 * drawing.tool * view.scale:.3f}" fill="{TOOL}" '
            f'fill-opacity="0.12" stroke="{TOOL}" stroke-width="1" stroke-dasharray="4 3"/>'
        )
        made.append(f'<circle cx="{x:.3f}" cy="{y:.3f}" r="3" fill="{PATH}"/>')
    return made


def paths(drawing, view):
    made = []
    for path in drawing.result.paths:
        if not isinstance(path, PointContact):
            made += [
                stroke(view.data(path.elements, path.closed), PATH, 1.6),
                view.arrow(path.elements, "path-direction", PATH),
            ]
    return made


def finish(drawing, view):
    made = []
    for contour in drawing.contours:
        made += [
            stroke(view.data(contour.elements, contour.closed), FINISH, 1.8),
            view.arrow(contour.elements, "finish-direction", FINISH),
        ]
    return made


def numbers(drawing, view):
    """The numbers of the largest regions, each beside its region and clear of the ones before."""
    taken: list = []
    made = []
    centres = np.array([view.at(p) for path in drawing.result.paths for p in points_of(path.elements)]).reshape(-1, 2)
    largest = sorted(range(len(drawing.middles)), key=lambda k: -drawing.regions[k].area)[:NUMBERED]
    for k in sorted(largest):
        text = str(k + 1)
        x, y = view.at(drawing.middles[k])
        size = (LETTER_WIDTH * len(text) + 4.0, LETTER + 2.0)
        cx, cy = free_position(x, y, away_from(centres, x, y), size, taken, view)
        taken.append((cx, cy, *size))
        made.append(f'<path d="M{x:.2f} {y:.2f}L{cx:.2f} {cy:.2f}" stroke="{LEFT_OVER}" stroke-width="0.8"/>')
        made.append(
            f'<rect x="{cx - size[0] / 2:.2f}" y="{cy - size[1] / 2:.2f}" width="{size[0]:.2f}" '
            f'height="{size[1]:.2f}" rx="3" fill="white" fill-opacity="0.85"/>'
        )
        made.append(
            f'<text x="{cx:.2f}" y="{cy + 0.36 * LETTER:.2f}" text-anchor="middle" font-size="{LETTER:g}" '
            f'font-weight="bold" fill="{LEFT_OVER}">{text}</text>'
        )
    return made


def points_of(e):
    """Starts and middles (2 n, 2) of elements."""
    return np.concatenate((e.start, elements.point_at(e, np.arange(len(e)), np.full(len(e), 0.5))))


def away_from(points, x, y):
    """Direction (rad, px) from the nearest of points to x, y; upwards if there is none."""
    if not len(points):
        return -0.5 * math.pi
    nearest = points[int(np.argmin(np.hypot(points[:, 0] - x, points[:, 1] - y)))]
    return math.atan2(y - nearest[1], x - nearest[0])


def free_position(x, y, direction, size, taken, view):
    """A position (px) near x, y for a number of that size which covers no other, in that direction first."""
    best = (math.inf, x, y)
    for reach in (20.0, 30.0, 42.0, 56.0):
        for k in range(12):
            turn = direction + math.radians(30.0 * ((k + 1) // 2) * (1 if k % 2 else -1))
            cx, cy = x + reach * math.cos(turn), y + reach * math.sin(turn)
            covered = sum(
                abs(cx - a) < 0.5 * (size[0] + w) and abs(cy - b) < 0.5 * (size[1] + h) for a, b, w, h in taken
            )
            covered += not (size[0] < cx < view.width - size[0] and size[1] < cy < view.foot - EDGE + size[1])
            if covered == 0:
                return cx, cy
            best = min(best, (covered, cx, cy))
    return best[1:]


# ---- legend --------------------------------------------------------------------------------------------------------


def entries(drawing):
    """[(sample, text)] of the legend, an even number."""
    count = len(drawing.regions)
    found = [
        (f'<path d="M0 0H34" stroke="{FINISH}" stroke-width="1.8"/>', "finish shape"),
        (f'<path d="M0 0H34" stroke="{PATH}" stroke-width="1.6"/>', "centre path"),
        *(
            [(f'<path d="M0 0H34" stroke="{ROUGH}" stroke-width="5"/>', "rough shape: the edge the tool leaves")]
            if drawing.result.rough
            else []
        ),
        (
            f'<circle cx="17" cy="0" r="8" fill="{TOOL}" fill-opacity="0.12" stroke="{TOOL}" stroke-dasharray="4 3"/>',
            f"tool, {format_length(drawing.tool, drawing.unit)}, start of a centre path",
        ),
        (
            f'<rect y="-8" width="34" height="16" fill="url(#hatch)" stroke="{LEFT_OVER}"/>',
            f"out of reach of this tool: {count} region{'' if count == 1 else 's'}"
            + (f", the largest {NUMBERED} numbered" if count > NUMBERED else ""),
        ),
    ]
    if drawing.segments:
        found.append(
            (
                f'<path d="M0 0H34" stroke="{LEFT_OVER}" stroke-opacity="0.5" stroke-width="6"/>',
                "contour without a centre path",
            )
        )
    return found + [("", "")] * (len(found) % 2)


def legend(drawing, view):
    top = view.foot
    made = [f'<path d="M{EDGE} {top - 0.5 * EDGE:.1f}H{view.width - EDGE:.1f}" stroke="#b0b0b0"/>']
    made.append(
        f'<text x="{EDGE}" y="{top + 5:.1f}" font-weight="bold">{escape(drawing.title)}, tool '
        f"{format_length(drawing.tool, drawing.unit)} {escape(drawing.where)}</text>"
    )
    made += scale_bar(drawing, view, top)
    for k, (sample, text) in enumerate(entries(drawing)):
        x, y = EDGE + (k % 2) * 0.5 * (view.width - EDGE), top + (1.2 + k // 2) * LINE
        made.append(
            f'<g transform="translate({x:.1f} {y:.1f})" fill="none">{sample}'
            f'<text x="46" y="5" fill="{FINISH}">{escape(text)}</text></g>'
        )
    return made


def scale_bar(drawing, view, y):
    """A round length of about 150 px."""
    unit = MM_PER_INCH if drawing.unit == "in" else 1.0
    wanted = 150.0 / (view.scale * unit)
    power = 10.0 ** math.floor(math.log10(wanted))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted)
    right, size = view.width - EDGE, length * unit * view.scale
    return [
        f'<path d="M{right - size:.2f} {y - 4:.1f}v8m0 -4H{right:.2f}m0 -4v8" stroke="{FINISH}" stroke-width="1.6" '
        'fill="none"/>',
        f'<text x="{right - size - 8:.2f}" y="{y + 5:.1f}" text-anchor="end">{length:g} {drawing.unit}</text>',
    ]
