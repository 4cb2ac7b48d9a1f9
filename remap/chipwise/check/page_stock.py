# SPDX-License-Identifier: GPL-2.0-or-later
"""The pictures of the stock in the report of a check: from above with axes, the path and the findings on it, and the
data of the one that turns.

Called by page.py.  Axes are those of the work coordinates of the first move; if these are turned, those of the machine.
A finding is a mark where its worst contact is, with its line.
"""

from __future__ import annotations

import base64
import html
import math
import struct
import zlib
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from chipwise.check.findings import LIMIT
from chipwise.errors import MM_PER_INCH, printable

if TYPE_CHECKING:
    from chipwise.check.drawing import Drawing
    from chipwise.check.result import Result
    from chipwise.clib.arrays import Floats, Ints

CELLS = 256  # of a picture of the stock along its longer side
SIDE, LEFT, TOP, UNDER = 440, 58, 12, 40  # px, of a picture and of what is around it
MARKS = 200  # findings that are marked
TICKS = 6  # of an axis, about


def coarser(heights: Floats, step: int) -> Floats:
    """The highest of each field of step by step."""
    if step == 1:
        return heights
    rows, columns = heights.shape
    return np.maximum.reduceat(
        np.maximum.reduceat(heights, np.arange(0, rows, step), axis=0), np.arange(0, columns, step), axis=1
    )


class Mark(NamedTuple):
    """A finding on a stock.  x, y, z: mm from the corner of the pictures; row: of the table of findings."""

    x: float
    y: float
    z: float
    label: str
    text: str
    row: int


def marks(result: Result, drawing: Drawing, rows: dict[int, int]) -> list[Mark]:
    """Those of the findings on this stock.  rows: {id of a finding: number of its row}."""
    found = [
        (one, one.machine)
        for one in result.findings.kept
        if one.machine is not None and one.at >= drawing.first and one.rule != LIMIT
    ][:MARKS]
    return [
        Mark(
            place[0] - drawing.low[0],
            place[1] - drawing.low[1],
            place[2] - drawing.low[2],
            f"{one.line}" if one.line else f"T{one.tool}" if one.tool else one.rule,
            printable(one.text(result.unit)),
            rows.get(id(one), 0),
        )
        for one, place in found
    ]


def stock_data(result: Result, drawing: Drawing, number: int, rows: dict[int, int]) -> dict[str, Any]:
    """{"js": what page.js draws, "html": flat pictures and the place of the viewer}."""
    step = -(-max(drawing.before.shape) // CELLS)
    before, after = coarser(drawing.before, step), coarser(drawing.after, step)
    cell, bottom = drawing.cell * step, drawing.low[2]
    high = max(float(before.max()), float(after.max()), bottom + 1e-6)
    view, found = View(result.unit, drawing, cell, before.shape), marks(result, drawing, rows)
    path = np.zeros((0, 4), np.float32)
    if drawing.path is not None:
        path = np.column_stack([drawing.path.points - np.array(drawing.low, np.float32), drawing.path.rapid]).astype(
            "<f4"
        )

    def packed(heights: Floats) -> str:
        return base64.b64encode(np.round((heights - bottom) / (high - bottom) * 65535).astype("<u2").tobytes()).decode()

    drawn = view.svg("stock after, from above", flat_picture(after, cell), view.path(path) + view.marks(found, number))
    figures = (
        f"<figure>{view.svg('stock before, from above', flat_picture(before, cell))}<figcaption>before</figcaption>"
        f"</figure>"
        f"<figure>{drawn}"
        f"<figcaption>after, with the path (traverses "
        f"dashed){' and the lines of findings' if found else ''}</figcaption></figure>"
    )
    return {
        "js": {
            "rows": before.shape[0],
            "columns": before.shape[1],
            "cell": cell,
            "high": high - bottom,
            "before": packed(before),
            "after": packed(after),
            "path": base64.b64encode(path.tobytes()).decode(),
            "marks": [[*(round(v, 3) for v in m[:3]), *m[3:5], f"p{number}f{m[5]}"] for m in found],
        },
        "html": f'<h3>Stock</h3>\n<p>{view.said()}</p>\n<div class="stock">{figures}</div>\n',
    }


class View:
    """The picture from above: mm from its corner -> px."""

    def __init__(self, unit: str, drawing: Drawing, cell: float, shape: tuple[int, ...]) -> None:
        rows, columns = shape
        self.wide, self.deep = columns * cell, rows * cell
        self.k = SIDE / max(self.wide, self.deep)
        self.unit, self.per = ("in", MM_PER_INCH) if unit != "mm" else ("mm", 1.0)
        frame, low = drawing.frame, drawing.low
        self.is_work = frame is not None and not frame.turn
        self.corner = frame.to_work(low) if frame is not None and self.is_work else low

    def at(self, x: float, y: float) -> tuple[float, float]:
        return LEFT + x * self.k, TOP + (self.deep - y) * self.k

    def said(self) -> str:
        """Whose coordinates the axes have."""
        if self.is_work:
            return f"Axes in {self.unit}, in the work coordinates of the first move."
        return f"Axes in {self.unit}, in machine coordinates: the work coordinates are turned."

    def svg(self, name: str, png: str, over: str = "") -> str:
        """One picture; over: what is drawn on it."""
        width, height = self.wide * self.k, self.deep * self.k
        return (
            f'<svg class="above" role="img" aria-label="{name}" width="{LEFT + width + 20:.0f}" viewBox="0 0 '
            f'{LEFT + width + 20:.0f} {TOP + height + UNDER:.0f}">'
            f'<image href="data:image/png;base64,{png}" x="{LEFT}" y="{TOP}" width="{width:.1f}" height="{height:.1f}" '
            f'preserveAspectRatio="none"/>'
            f"{self.axes()}{over}</svg>"
        )

    def axes(self) -> str:
        """Ticks with numbers along X and Y."""
        parts = []
        x0, y0 = LEFT, TOP + self.deep * self.k
        for value in ticks(self.corner[0] / self.per, (self.corner[0] + self.wide) / self.per):
            x, _y = self.at(value * self.per - self.corner[0], 0.0)
            parts.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y0:.1f}" y2="{y0 + 5:.1f}"/><text x="{x:.1f}" y="{y0 + 18:.1f}" '
                f'text-anchor="middle">{value:g}</text>'
            )
        for value in ticks(self.corner[1] / self.per, (self.corner[1] + self.deep) / self.per):
            _x, y = self.at(0.0, value * self.per - self.corner[1])
            parts.append(
                f'<line x1="{x0 - 5}" x2="{x0}" y1="{y:.1f}" y2="{y:.1f}"/><text x="{x0 - 8}" y="{y + 4:.1f}" '
                f'text-anchor="end">{value:g}</text>'
            )
        parts.append(
            f'<text x="{x0 + self.wide * self.k / 2:.1f}" y="{y0 + 34:.1f}" text-anchor="middle">X, {self.unit}</text>'
        )
        middle = TOP + self.deep * self.k / 2
        parts.append(
            f'<text x="12" y="{middle:.1f}" text-anchor="middle" transform="rotate(-90 12 {middle:.1f})">Y, '
            f"{self.unit}</text>"
        )
        return '<g class="axes">' + "".join(parts) + "</g>"

    def path(self, path: Floats) -> str:
        """Feeds as lines, traverses dashed; path: (n, 4), the last whether the segment that ends there is a
        traverse."""
        found = []
        rapid = path[:, 3] > 0.5
        starts: list[int] = []
        if len(path) > 1:
            starts = (np.flatnonzero(np.diff(rapid[1:].astype(int), prepend=-1)) + 1).tolist()
        for first, end in zip(starts, [*starts[1:], len(path)]):
            points = " ".join("{:.1f},{:.1f}".format(*self.at(x, y)) for x, y in path[first - 1 : end, :2].tolist())
            found.append(f'<polyline class="{"rapid" if rapid[first] else "feed"}" points="{points}"/>')
        box = f"{LEFT} {TOP} {self.wide * self.k:.1f} {self.deep * self.k:.1f}"  # what is beside the stock is cut off
        x, y, width, height = box.split()
        return f'<svg x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{box}">{"".join(found)}</svg>'

    def marks(self, found: list[Mark], number: int) -> str:
        """A circle with the line of each finding; it leads to its row."""
        parts = []
        for x, y, _z, label, text, row in found:
            px, py = self.at(x, y)
            parts.append(
                f'<a href="#p{number}f{row}"><g class="mark"><title>{html.escape(text)}</title><circle cx="{px:.1f}" '
                f'cy="{py:.1f}" r="5"/>'
                f'<text x="{px + 8:.1f}" y="{py - 5:.1f}">{html.escape(label)}</text></g></a>'
            )
        return "".join(parts)


def ticks(low: float, high: float) -> list[float]:
    """Round numbers from low to high, about TICKS of them."""
    rough = max(high - low, 1e-6) / TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * digits for digits in (1, 2, 5, 10) if power * digits >= rough)
    return [round(k * step, 9) + 0.0 for k in range(math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6) + 1)]


def flat_picture(heights: Floats, cell: float) -> str:
    """Base64 of a PNG of a height map from above, Y upwards: lit from the upper left, darker where deeper."""
    z = heights[::-1].astype(float)
    padded = np.pad(z, 1, mode="edge")
    slope_x, slope_y = (
        (padded[1:-1, 2:] - padded[1:-1, :-2]) / (2 * cell),
        (padded[2:, 1:-1] - padded[:-2, 1:-1]) / (2 * cell),
    )
    light = (0.5 * slope_x + 0.5 * slope_y + 1.0) / (np.sqrt(1.5) * np.sqrt(slope_x**2 + slope_y**2 + 1.0))
    deep = (z - z.min()) / np.ptp(z) if np.ptp(z) > 1e-9 else np.ones_like(z)
    return base64.b64encode(
        png(np.clip(255 * np.maximum(light, 0.05) * (0.55 + 0.45 * deep), 0, 255).astype(np.uint8))
    ).decode()


def png(grey: Ints) -> bytes:
    """(rows, columns) uint8 -> PNG."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows, columns = grey.shape
    raw = b"".join(b"\0" + row.tobytes() for row in grey)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(raw, 9))
        + chunk(b"IEND", b"")
    )
