# SPDX-License-Identifier: GPL-2.0-or-later
"""Results of a check as one HTML page that needs no network.

Called by cli/check.py.  Load over time is an SVG, the stock a PNG seen from above; if the browser has WebGL the stock can
be turned and zoomed instead (page.js, page.css beside this file, drawing/height_shaders.js and height_view.js, put into the page).
"""

import base64
import html
import json
import math
import os
import struct
import zlib

import numpy as np

from chipwise.check.findings import grouped
from chipwise.errors import format_length, printable
from chipwise.rates import MM3_PER_CM3

PICTURES = 40               # programs with a picture of the stock, so that the page stays small
CELLS = 256                 # of such a picture along its longer side
WIDE, HIGH, LEFT, BOTTOM = 900, 200, 70, 30     # px, of a chart
FOLDER = os.path.dirname(os.path.abspath(__file__))
VIEW = [os.path.join(os.pardir, "drawing", name) for name in ("height_shaders.js", "height_view.js")]


def page(results):
    """HTML text."""
    shown = [number for number, r in enumerate(results) if r.pictures is not None][:PICTURES]
    stocks = {number: stock_data(results[number]) for number in shown}
    body = "".join(section(number, r, stocks.get(number)) for number, r in enumerate(results))
    data = json.dumps([stocks[number]["js"] for number in shown])
    title = "chipwise check: " + ("1 program" if len(results) == 1 else f"{len(results)} programs")
    return (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
            "script-src 'unsafe-inline'; img-src data:\">\n"
            f'<style>\n{_part("page.css")}</style></head>\n<body>\n<h1>{title}</h1>\n{contents(results)}{body}'
            f'<script type="application/json" id="stocks">{data}</script>\n<script>\n{"".join(map(_part, VIEW))}{_part("page.js")}</script>\n'
            "</body></html>\n")


def _part(name):
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return file.read()


def text(value):
    """Text for HTML."""
    return html.escape(printable(str(value)))


def contents(results):
    """One line a program."""
    def verdict(r):
        if r.error:
            return "bad", "cannot be checked"
        count = r.findings.count
        return ("some", f"{count} finding{'s' * (count != 1)}") if count else ("none", "no findings")
    rows = "".join(f'<li class="{verdict(r)[0]}"><a href="#p{n}">{text(os.path.basename(r.program))}</a>: {verdict(r)[1]}</li>'
                   for n, r in enumerate(results))
    return f"<ul>{rows}</ul>\n" if len(results) > 1 else ""


def section(number, result, stock):
    """One program."""
    head = f'<section id="p{number}"><h2>{text(result.program)}</h2>\n'
    if result.error:
        said, line = result.error
        where = f" (line {line})" if line and "(line " not in said else ""
        return f'{head}<p class="bad">{text(said)}{where}</p></section>\n'
    unit = result.unit
    note = f"<p>{result.moves} moves, cells of {text(format_length(result.cell, unit))}. Lengths in {unit}.</p>\n"
    return (head + note + tools_table(result) + findings_table(result) + load_chart(result)
            + (stock["html"] if stock else "") + "</section>\n")


def table(heads, rows):
    """Rows of texts -> HTML."""
    def row(tag, cells):
        return "<tr>" + "".join(f"<{tag}>{text(c)}</{tag}>" for c in cells) + "</tr>\n"
    return "<table>" + row("th", heads) + "".join(row("td", cells) for cells in rows) + "</table>\n"


def tools_table(result):
    """Figures of each tool."""
    def length(v):
        return "not known" if v is None else format_length(round(v, 3), result.unit).split()[0]
    rows = []
    for tool in result.tools.values():
        f = tool.json()
        rows.append((f["tool"], length(f["diameter_mm"]), f["shape"] or "not known", f'{f["feed_s"]:.1f}', f'{f["planned_s"]:.1f}',
                     f'{f["volumetric_planned_s"]:.1f}' if result.load_volumetric else "-", f'{f["volume_mm3"]:.0f}',
                     *(f"{rate / MM3_PER_CM3:.4g}" for rate in (f["mean_rate_mm3_min"], f["peak_rate_mm3_min"])),
                     f'{length(f["depth_mm"])} (line {f["depth_line"]})' if f["depth_mm"] else "-", length(f["flute_length_mm"]),
                     length(f["least_flute_length_mm"]), length(f["least_stick_out_mm"])))
    return "<h3>Tools</h3>\n" + table(
        ("tool", "diameter", "shape", "s at F", "s with acceleration", "s with M251", "mm3", "mean cm3/min", "peak cm3/min at F",
         "largest depth", "flute length", "smallest flute length", "smallest stick-out"), rows)


def findings_table(result):
    """All findings that were kept, those of one cause in one row."""
    found = result.findings
    if not found.count:
        return "<h3>No findings</h3>\n"
    rows = []
    for group in grouped(found.kept):
        (first, last), worst = group.lines, group.worst
        place = " ".join(format_length(round(v, 3), result.unit).split()[0] for v in worst.position) if worst.position else "-"
        rows.append((worst.rule, first if first == last else f"{first} to {last}", worst.tool, place, group.said(result.unit),
                     *(["assumed" if result.is_assumed(worst) else ""] if result.guessed else [])))
    more = f"<p>and {found.dropped} more</p>\n" if found.dropped else ""
    return "<h3>Findings</h3>\n" + table(("rule", "line", "tool", "X Y Z", "what", *(["depends on"] if result.guessed else [])), rows) + more


# ---- load over time ------------------------------------------------------------------------------------------------


def round_above(value):
    """A number with one or two digits that is not below the value, for the top of an axis; its half is round, too."""
    power = 10.0 ** math.floor(math.log10(max(value, 1e-9)))
    return next(digits * power for digits in (1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10) if digits * power >= value)


def load_chart(result):
    """SVG of the removal rate over time, at F and with M251."""
    curves = [("at F", "#888", result.load)] + ([("with M251", "#06c", result.load_volumetric)] if result.load_volumetric else [])
    end = max(width * len(rates) for _, _, (width, rates) in curves)
    top = round_above(max(float(rates.max()) for _, _, (_, rates) in curves))
    lines = "".join(curve(colour, width, rates, end, top) for _, colour, (width, rates) in curves)
    keys = "".join(f'<text x="{LEFT + 10 + 110 * k}" y="14" fill="{colour}">{name}</text>' for k, (name, colour, _) in enumerate(curves))
    marks = "".join(f'<text x="{LEFT + WIDE * k / 4:.0f}" y="{HIGH + 20}" text-anchor="middle">{end * k / 4:.1f} s</text>'
                    for k in range(5))
    marks += "".join(f'<text x="{LEFT - 5}" y="{HIGH - (HIGH - 20) * k / 2 + 4:.0f}" text-anchor="end">{top * k / 2 / MM3_PER_CM3:g}</text>'
                     f'<line x1="{LEFT}" x2="{LEFT + WIDE}" y1="{HIGH - (HIGH - 20) * k / 2:.0f}" y2="{HIGH - (HIGH - 20) * k / 2:.0f}" '
                     'stroke="#ddd"/>' for k in range(3))
    return (f'<h3>Removal rate, cm3/min, over time</h3>\n<svg class="load" viewBox="0 0 {LEFT + WIDE + 30} {HIGH + BOTTOM}" '
            f'role="img" aria-label="removal rate over time">{marks}{lines}{keys}</svg>\n')


def curve(colour, width, rates, end, top):
    """Steps of one load."""
    x = LEFT + np.repeat(np.arange(len(rates) + 1) * width * WIDE / end, 2)[1:-1]
    y = HIGH - np.repeat(np.asarray(rates, float), 2) * (HIGH - 20) / top
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x.tolist(), y.tolist()))
    return f'<polyline fill="none" stroke="{colour}" points="{points}"/>'


# ---- the stock -----------------------------------------------------------------------------------------------------


def stock_data(result):
    """{"js": heights for page.js, "html": flat pictures and the place of the viewer}."""
    cell, _x0, _y0, z_min, before, after = result.pictures
    step = -(-max(before.shape) // CELLS)
    before, after = coarser(before, step), coarser(after, step)
    high = max(float(before.max()), float(after.max()), z_min + 1e-6)

    def packed(heights):
        return base64.b64encode(np.round((heights - z_min) / (high - z_min) * 65535).astype("<u2").tobytes()).decode()

    rows, columns = before.shape
    pictures = "".join(f'<figure><img alt="stock {name}, from above" src="data:image/png;base64,{png}" width="{columns}">'
                       f"<figcaption>{name}</figcaption></figure>"
                       for name, png in (("before", flat_picture(before, cell * step)), ("after", flat_picture(after, cell * step))))
    return {"js": {"rows": rows, "columns": columns, "cell": cell * step, "high": high - z_min, "before": packed(before),
                   "after": packed(after)},
            "html": f'<h3>Stock</h3>\n<div class="stock">{pictures}</div>\n'}


def coarser(heights, step):
    """The highest of each field of step by step."""
    if step == 1:
        return heights
    rows, columns = heights.shape
    return np.maximum.reduceat(np.maximum.reduceat(heights, np.arange(0, rows, step), axis=0), np.arange(0, columns, step), axis=1)


def flat_picture(heights, cell):
    """Base64 of a PNG of a height map from above, Y upwards: lit from the upper left, darker where deeper."""
    z = heights[::-1].astype(float)
    padded = np.pad(z, 1, mode="edge")
    slope_x, slope_y = (padded[1:-1, 2:] - padded[1:-1, :-2]) / (2 * cell), (padded[2:, 1:-1] - padded[:-2, 1:-1]) / (2 * cell)
    light = (0.5 * slope_x + 0.5 * slope_y + 1.0) / (np.sqrt(1.5) * np.sqrt(slope_x ** 2 + slope_y ** 2 + 1.0))
    deep = (z - z.min()) / np.ptp(z) if np.ptp(z) > 1e-9 else np.ones_like(z)
    return base64.b64encode(png(np.clip(255 * np.maximum(light, 0.05) * (0.55 + 0.45 * deep), 0, 255).astype(np.uint8))).decode()


def png(grey):
    """(rows, columns) uint8 -> PNG."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows, columns = grey.shape
    raw = b"".join(b"\0" + row.tobytes() for row in grey)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))
