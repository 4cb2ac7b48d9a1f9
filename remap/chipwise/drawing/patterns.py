# SPDX-License-Identifier: GPL-2.0-or-later
"""A sheet with the patterns of a library, as SVG: svg(entries) -> text.  Called by cli/patterns.py.

Each pattern has a tile: number and name, its path from above, its size.  Blue: cuts; dots: straight plunges; grey
dashes:  traverses; red cross: the pattern's origin.  y points down in SVG, so y is turned over.  All numbers in the
file are pixels.
"""

import textwrap
from xml.sax.saxutils import escape

import numpy as np

from chipwise.errors import format_length, printable

WIDTH, HEIGHT, HEAD, EDGE = 340, 340, 66, 14  # px of a tile, of its text, round its drawing
COLUMNS = 3
MOST_POINTS = 50_000  # of a pattern that is drawn
NAME_LETTERS, TEXT_LETTERS, TEXT_LINES = 34, 54, 2
CUT, TRAVERSE, ORIGIN = "#0a4fa0", "#999", "#c03"


def svg(entries, unit="mm"):
    """Text of the SVG file.  entries: of pattern/library.py; unit: of the sizes."""
    columns = min(COLUMNS, max(1, len(entries)))
    width, height = columns * WIDTH, max(1, -(-len(entries) // columns)) * HEIGHT
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="DejaVu Sans, sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for k, entry in enumerate(entries):
        lines += [
            f'<g transform="translate({k % columns * WIDTH} {k // columns * HEIGHT})">',
            *_tile(entry, unit),
            "</g>",
        ]
    return "\n".join([*lines, "</svg>", ""])


def _tile(entry, unit):
    """Lines of one pattern."""
    yield f'<rect x="4" y="4" width="{WIDTH - 8}" height="{HEIGHT - 8}" fill="#fbfcfd" stroke="#ccd"/>'
    yield _text(EDGE, 24, _clip(f"O{entry.number} {entry.name}", NAME_LETTERS), 'font-size="14" font-weight="bold"')
    for k, line in enumerate(_wrapped(entry.text)):
        yield _text(EDGE, 42 + 15 * k, line, 'font-size="10.5" fill="#444"')
    paths = entry.paths()
    if sum(len(points) for _rapid, points in paths) > MOST_POINTS:
        yield _text(EDGE, HEIGHT / 2, f"more than {MOST_POINTS} points, not drawn", 'fill="#444"')
        return
    yield from _drawn(paths, entry.box(), unit)


def _drawn(paths, box, unit):
    """Lines of a path and its size."""
    every = np.concatenate([np.zeros((1, 3)), *(points for _rapid, points in paths)])
    low, high = every.min(axis=0)[:2], every.max(axis=0)[:2]
    room = np.array([WIDTH - 2 * EDGE - 8, HEIGHT - HEAD - 2 * EDGE - 26])
    scale = float((room / np.maximum(high - low, 1e-3)).min())
    middle = np.array([WIDTH / 2, HEAD + EDGE + room[1] / 2])

    def at(points):
        return (np.asarray(points)[:, :2] - (low + high) / 2) * (scale, -scale) + middle

    for rapid, points in sorted(paths, key=lambda path: not path[0]):
        style = (
            f'stroke="{TRAVERSE}" stroke-dasharray="4 4"'
            if rapid
            else f'stroke="{CUT}" stroke-width="2" stroke-linejoin="round"'
        )
        yield f'<polyline fill="none" {style} points="' + " ".join(f"{x:.1f},{y:.1f}" for x, y in at(points)) + '"/>'
        if not rapid:
            down = np.hypot(*np.diff(points[:, :2], axis=0).T) < 1e-9
            yield from (
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{CUT}"/>'
                for x, y in at(points[1:][down & (np.diff(points[:, 2]) < 0)])
            )
    ((x, y),) = at(np.zeros((1, 3)))
    yield f'<path d="M{x - 7:.1f} {y:.1f}h14M{x:.1f} {y - 7:.1f}v14" stroke="{ORIGIN}" stroke-width="1.5"/>'
    size = " x ".join(format_length(round(b - a, 2), unit) for a, b in zip(*(corner[:2] for corner in box)))
    yield _text(
        EDGE, HEIGHT - EDGE - 2, f"path {size}, down to Z{format_length(box[0][2], unit)}", 'font-size="11" fill="#444"'
    )


def _wrapped(text):
    """At most TEXT_LINES lines."""
    lines = textwrap.wrap(printable(text), TEXT_LETTERS)
    return (
        lines[: TEXT_LINES - 1] + [_clip(" ".join(lines[TEXT_LINES - 1 :]), TEXT_LETTERS)]
        if len(lines) >= TEXT_LINES
        else lines
    )


def _clip(text, most):
    return text if len(text) <= most else text[: most - 2] + ".."


def _text(x, y, text, style):
    return f'<text x="{x}" y="{y:g}" {style}>{escape(printable(text))}</text>'
