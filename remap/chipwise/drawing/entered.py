# SPDX-License-Identifier: GPL-2.0-or-later
"""The picture of a typed line, as SVG: svg(planned, words, ..) -> text.  Called by cli/enter.py and the panel.

From above: the contour of the sub, cuts, chop lines, traverses, where the tool plunges, the tool, the stock, the
origin; beside it each word with its name, which shows how the line was understood.  The colours are those of the
display items (panel/colours.py).  y points down in SVG, so y is turned over.  All numbers in the file are pixels.
"""

import math
from xml.sax.saxutils import escape

import numpy as np

from chipwise.errors import MM_PER_INCH, format_length, printable

DRAWN_WIDTH, DRAWN_HEIGHT = 620.0, 560.0  # px of the drawing
EDGE, HEAD, LINE = 24.0, 56.0, 19.0  # px round the drawing, of the title, of a line of text
WORDS_WIDTH = 330.0  # px of the words beside it
NAME_LETTERS, TITLE_LETTERS = 40, 96
LEAST_STEP = 0.5  # px between two points of a run that are drawn
MOST_POINTS = 200_000  # of a picture
FAR = 2.0  # the origin is drawn if the drawing gets no larger by it than so many times
ORIGIN = 7.0  # px, half of its cross


def svg(planned, title, words, items, mode="light", translate=str):
    """Text of the SVG file.

    planned  entry/planned.py; title: of the code; words: ((letter, name, value as text), ..) of the line
    items    panel/colours.py: load(); mode: "light" or "dark"; translate: text -> text of the user's language
    """

    def colour(item):
        return items[item].colour(mode)

    view = _View(planned)
    width = EDGE + DRAWN_WIDTH + EDGE + WORDS_WIDTH
    height = HEAD + max(view.height, LINE * (len(words) + 10)) + 2 * EDGE
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} '
        f'{height:.0f}" '
        'font-family="DejaVu Sans, sans-serif" font-size="13">',
        f"<title>{escape(printable(planned.line))}</title>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="{colour("background")}"/>',
        _text(
            EDGE, 26, _clip(planned.line, TITLE_LETTERS), f'font-size="17" font-weight="bold" fill="{colour("text")}"'
        ),
        _text(EDGE, 46, f"{translate(title)}; {_tool(planned, translate)}", f'fill="{colour("text")}"'),
    ]
    lines += [
        f'<clipPath id="drawing"><rect x="{EDGE / 2:.0f}" y="{HEAD:.0f}" width="{DRAWN_WIDTH + EDGE:.0f}" '
        f'height="{height - HEAD:.0f}"/>'
        '</clipPath><g clip-path="url(#drawing)">',
        *_drawing(planned, view, colour),
        "</g>",
    ]
    lines += _words(planned, words, colour, items, translate)
    return "\n".join([*lines, "</svg>", ""])


def _tool(planned, translate):
    return f"{translate('tool')} {planned.tool}, {format_length(round(planned.diameter, 4), planned.scene.unit)}"


class _View:
    """From mm to pixels."""

    def __init__(self, planned):
        points = [*(run.points[:, :2] for run in planned.runs if run.kind != "rapid"), *planned.loops]
        points += [np.array([corner[:2] for corner in planned.stock])] if planned.stock else []
        points = points or [run.points[:, :2] for run in planned.runs] or [np.zeros((1, 2))]
        every = np.concatenate(points)
        size = every.max(axis=0) - every.min(axis=0)
        self.origin = bool(
            (np.maximum(every.max(axis=0), 0.0) - np.minimum(every.min(axis=0), 0.0)).max() <= FAR * size.max()
        )
        every = np.concatenate((every, np.zeros((1, 2)))) if self.origin else every
        radius = planned.diameter / 2
        self.low, self.high = every.min(axis=0) - radius, every.max(axis=0) + radius
        size = np.maximum(self.high - self.low, 1e-3 * max(float((self.high - self.low).max()), 1e-3))
        self.scale = float((np.array([DRAWN_WIDTH, DRAWN_HEIGHT]) / size).min())
        self.left = EDGE + (DRAWN_WIDTH - size[0] * self.scale) / 2
        self.height = size[1] * self.scale

    def at(self, points):
        """(n, 2) or (n, 3) mm -> (n, 2) px."""
        xy = np.asarray(points, float)[:, :2]
        return np.stack(
            (
                self.left + (xy[:, 0] - self.low[0]) * self.scale,
                HEAD + EDGE / 2 + (self.high[1] - xy[:, 1]) * self.scale,
            ),
            axis=1,
        )

    def data(self, points, closed=False):
        """The d of a path, without points that nobody could see."""
        drawn = self.at(points)
        kept = [drawn[0]]
        for point in drawn[1:-1]:
            if math.dist(point, kept[-1]) >= LEAST_STEP:
                kept.append(point)
        kept.append(drawn[-1])
        return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in kept) + ("Z" if closed else "")


def _drawing(planned, view, colour):
    """Lines of the picture itself."""
    if planned.stock:
        (x0, y0), (x1, y1) = view.at([corner[:2] for corner in planned.stock])
        yield (
            f'<rect x="{min(x0, x1):.2f}" y="{min(y0, y1):.2f}" width="{abs(x1 - x0):.2f}" height="{abs(y1 - y0):.2f}" '
            f'fill="{colour("stock")}" fill-opacity="0.25" stroke="{colour("stock")}" stroke-width="1.5"/>'
        )
    if sum(len(run.points) for run in planned.runs) > MOST_POINTS:
        yield _text(EDGE, HEAD + LINE, f"more than {MOST_POINTS} points, not drawn", f'fill="{colour("text")}"')
        return
    for kind, item, style in (
        ("rapid", "rapid", 'stroke-width="1" stroke-dasharray="4 4"'),
        ("cut", "path_ahead", 'stroke-width="1.6"'),
        ("chop", "chop", 'stroke-width="2"'),
    ):
        for run in planned.runs:
            if run.kind == kind:
                yield (
                    f'<path d="{view.data(run.points)}" fill="none" stroke="{colour(item)}" stroke-linejoin="round" '
                    f"{style}/>"
                )
    for points in planned.loops:
        closed = math.dist(points[0], points[-1]) < 1e-3
        yield f'<path d="{view.data(points, closed)}" fill="none" stroke="{colour("target")}" stroke-width="2.2"/>'
    yield from _tools(planned, view, colour)
    if view.origin:
        ((x, y),) = view.at([(0.0, 0.0)])
        yield (
            f'<path d="M{x - ORIGIN:.1f} {y:.1f}h{2 * ORIGIN}M{x:.1f} {y - ORIGIN:.1f}v{2 * ORIGIN}" '
            f'stroke="{colour("text")}" stroke-width="1.2"/>'
        )


def _tools(planned, view, colour):
    """The tool where it first plunges, and a dot where it plunges straight."""
    plunges = []
    for run in planned.runs:
        if run.kind != "rapid":
            step = np.diff(run.points, axis=0)
            plunges += list(run.points[1:][(np.hypot(step[:, 0], step[:, 1]) < 1e-9) & (step[:, 2] < 0)])
    first = plunges or [run.points[0] for run in planned.runs if run.kind != "rapid"]
    for x, y in view.at(np.array(plunges).reshape(-1, 3)).tolist():
        yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="2.5" fill="{colour("path_done")}"/>'
    if first:
        ((x, y),) = view.at([first[0]])
        yield (
            f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{planned.diameter / 2 * view.scale:.2f}" fill="{colour("tool")}" '
            f'fill-opacity="0.15" '
            f'stroke="{colour("tool")}" stroke-width="1.5"/>'
        )


def _words(planned, words, colour, items, translate):
    """Each word with its name, figures, and the colours that were used."""
    x, y = EDGE + DRAWN_WIDTH + EDGE, HEAD + EDGE / 2
    for letter, name, value in words:
        yield _text(x, y, letter, f'font-weight="bold" fill="{colour("text")}"')
        yield _text(x + 22, y, _clip(f"{name}: {value}", NAME_LETTERS), f'fill="{colour("text")}"')
        y += LINE
    y += LINE / 2
    for text in figures(planned, translate):
        yield _text(x, y, _clip(text, NAME_LETTERS), f'fill="{colour("text")}"')
        y += LINE
    y += LINE / 2
    kinds = {run.kind for run in planned.runs}
    shown = [
        ("target", bool(planned.loops)),
        ("path_ahead", "cut" in kinds),
        ("chop", "chop" in kinds),
        ("rapid", "rapid" in kinds),
        ("tool", bool(kinds - {"rapid"})),
        ("stock", planned.stock is not None),
    ]
    names = {"path_ahead": "path", "tool": "tool at the first plunge"}
    for item in [item for item, there in shown if there]:
        yield f'<path d="M{x:.0f} {y - 4:.1f}h16" stroke="{colour(item)}" stroke-width="3"/>'
        yield _text(x + 22, y, translate(names.get(item, items[item].name)), f'fill="{colour("text")}"')
        y += LINE


def figures(planned, translate=str):
    """Lines of text: cuts, chop lines, depth, size of the stock."""
    unit = planned.scene.unit
    cutting = [run for run in planned.runs if run.kind != "rapid"]
    if cutting:
        low = min(float(run.points[:, 2].min()) for run in cutting)
        yield (
            f"{translate('cuts')}: {_length(planned.length('cut', 'chop'), unit)}, {translate('down to')} "
            f"Z{_length(low, unit)}"
        )
    chops = sum(len(run.points) - 1 for run in planned.runs if run.kind == "chop")
    if chops:
        yield f"{translate('chop lines')}: {_length(planned.length('chop'), unit)}"
    if planned.stock:
        corner, opposite = planned.stock
        yield f"{translate('stock')}: {' x '.join(_length(b - a, unit) for a, b in zip(corner, opposite))}"


def _length(value, unit):
    """To a hundredth of a mm: arcs are measured by chords."""
    return format_length(
        round(float(value), 2) if unit == "mm" else MM_PER_INCH * round(float(value) / MM_PER_INCH, 3), unit
    )


def _clip(text, most):
    return text if len(text) <= most else text[: most - 2] + ".."


def _text(x, y, text, style):
    return f'<text x="{x:g}" y="{y:g}" {style}>{escape(printable(text))}</text>'
