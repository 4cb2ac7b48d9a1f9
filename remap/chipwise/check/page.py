# SPDX-License-Identifier: GPL-2.0-or-later
"""Results of a check as one HTML page that needs no network.

Called by cli/check.py.  Load over time is an SVG, the stock one seen from above (page_stock.py); if the browser has
WebGL the stock can be turned and zoomed besides (page.js, page.css beside this file, drawing/height_shaders.js and
height_view.js, put into the page).
"""

from __future__ import annotations

import html
import json
import math
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from chipwise.check.findings import Group, grouped
from chipwise.check.page_stock import stock_data
from chipwise.errors import format_length, printable
from chipwise.rates import MM3_PER_CM3

if TYPE_CHECKING:
    from chipwise.check.result import Result
    from chipwise.clib.arrays import Floats

PICTURES = 40  # programs with a picture of the stock, so that the page stays small
WIDE, HIGH, LEFT, BOTTOM = 900, 200, 70, 45  # px, of a chart
FOLDER = os.path.dirname(os.path.abspath(__file__))
VIEW = [os.path.join(os.pardir, "drawing", name) for name in ("height_shaders.js", "height_view.js")]


def page(results: Sequence[Result]) -> str:
    """HTML text."""
    shown = [(number, r.drawing) for number, r in enumerate(results) if r.drawing is not None][:PICTURES]
    groups = [grouped(r.findings.kept) for r in results]
    stocks = {
        number: stock_data(
            results[number],
            drawing,
            number,
            {id(one): row for row, group in enumerate(groups[number]) for one in group},
        )
        for number, drawing in shown
    }
    body = "".join(section(number, r, stocks.get(number), groups[number]) for number, r in enumerate(results))
    data = json.dumps([stocks[number]["js"] for number, _drawing in shown])
    title = "chipwise check: " + ("1 program" if len(results) == 1 else f"{len(results)} programs")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
        "script-src 'unsafe-inline'; img-src data:\">\n"
        f"<style>\n{_part('page.css')}</style></head>\n<body>\n<h1>{title}</h1>\n{contents(results)}{body}"
        f'<script type="application/json" id="stocks">{data}</script>\n<script>\n'
        f"{''.join(map(_part, VIEW))}{_part('page.js')}</script>\n"
        "</body></html>\n"
    )


def _part(name: str) -> str:
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return file.read()


def text(value: object) -> str:
    """Text for HTML."""
    return html.escape(printable(str(value)))


def contents(results: Sequence[Result]) -> str:
    """One line a program."""

    def verdict(r: Result) -> tuple[str, str]:
        if r.error:
            return "bad", "cannot be checked"
        count = r.findings.count
        return ("some", f"{count} finding{'s' * (count != 1)}") if count else ("none", "no findings")

    rows = "".join(
        f'<li class="{verdict(r)[0]}"><a href="#p{n}">{text(os.path.basename(r.program))}</a>: {verdict(r)[1]}</li>'
        for n, r in enumerate(results)
    )
    return f"<ul>{rows}</ul>\n" if len(results) > 1 else ""


def minutes(seconds: float) -> str:
    """ "0:12.4", "75:02", of minutes and seconds."""
    tenths = round(seconds * 10)
    if tenths < 6000:
        return f"{tenths // 600}:{tenths % 600 / 10:04.1f}"
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02}"


def section(number: int, result: Result, stock: dict[str, Any] | None, groups: list[Group]) -> str:
    """One program."""
    head = f'<section id="p{number}"><h2>{text(result.program)}</h2>\n'
    if result.error:
        said, line = result.error
        where = f" (line {line})" if line and "(line " not in said else ""
        return f'{head}<p class="bad">{text(said)}{where}</p>\n{surveyed(result)}</section>\n'
    unit = result.unit
    note = (
        f"<p>{result.moves} moves, cells of {text(format_length(result.cell, unit))}. Lengths in {unit}, times in "
        f"minutes and seconds.</p>\n"
    )
    note += f"<p>{text(result.part.said(unit))}</p>\n" if result.part else ""
    return (
        head
        + note
        + tools_table(result)
        + findings_table(result, number, groups)
        + load_chart(result)
        + (stock["html"] if stock else "")
        + "</section>\n"
    )


def table(heads: Iterable[object], rows: Iterable[Iterable[object]], prefix: str = "") -> str:
    """Rows of texts -> HTML; prefix: of the ids of the rows, "" for none."""

    def row(tag: str, cells: Iterable[object], name: str = "") -> str:
        return f"<tr{name}>" + "".join(f"<{tag}>{text(c)}</{tag}>" for c in cells) + "</tr>\n"

    return (
        "<table>"
        + row("th", heads)
        + "".join(row("td", cells, f' id="{prefix}{k}"' if prefix else "") for k, cells in enumerate(rows))
        + "</table>\n"
    )


def surveyed(result: Result) -> str:
    """What is known of a program that is not judged."""
    if not result.tools:
        return ""
    unit, said = result.unit, ""
    if result.extents:
        low, high = (
            " ".join(f"{axis}{format_length(round(v, 3), unit).split()[0]}" for axis, v in zip("XYZ", corner))
            for corner in result.extents
        )
        said = f"<p>It feeds from {low} to {high} ({unit}); the deepest tip is at Z{low.rpartition('Z')[2]}.</p>\n"
    rows = [
        (
            tool.number,
            format_length(tool.diameter, unit).split()[0] if tool.diameter else "not known",
            minutes(tool.planned_s),
        )
        for tool in result.tools.values()
    ]
    return said + table(("tool", "diameter", "time with acceleration, min"), rows)


def tools_table(result: Result) -> str:
    """Figures of each tool."""

    def length(v: float | None) -> str:
        return "not known" if v is None else format_length(round(v, 3), result.unit).split()[0]

    rows = []
    for tool in result.tools.values():
        f = tool.json()
        rows.append(
            (
                f["tool"],
                length(f["diameter_mm"]),
                f["shape"] or "not known",
                minutes(f["feed_s"]),
                minutes(f["planned_s"]),
                minutes(f["volumetric_planned_s"]) if result.load_volumetric else "-",
                f"{f['volume_mm3']:.0f}",
                *(f"{rate / MM3_PER_CM3:.4g}" for rate in (f["mean_rate_mm3_min"], f["peak_rate_mm3_min"])),
                f"{length(f['depth_mm'])} (line {f['depth_line']})" if f["depth_mm"] else "-",
                length(f["flute_length_mm"]),
                length(f["least_flute_length_mm"]),
                length(f["least_stick_out_mm"]),
            )
        )
    return "<h3>Tools</h3>\n" + table(
        (
            "tool",
            "diameter",
            "shape",
            "min at F",
            "min with acceleration",
            "min with M251",
            "mm3",
            "mean cm3/min",
            "peak cm3/min at F",
            "largest depth",
            "flute length",
            "smallest flute length",
            "smallest stick-out",
        ),
        rows,
    )


def findings_table(result: Result, number: int, groups: list[Group]) -> str:
    """All findings that were kept, those of one cause in one row."""
    found = result.findings
    if not found.count:
        return "<h3>No findings</h3>\n"
    rows = []
    for group in groups:
        (first, last), worst = group.lines, group.worst
        place = (
            " ".join(format_length(round(v, 3), result.unit).split()[0] for v in worst.position)
            if worst.position
            else "-"
        )
        rows.append(
            (
                worst.rule,
                first or "-" if first == last else f"{first} to {last}",
                worst.tool or "-",
                place,
                group.said(result.unit),
                *(["assumed" if result.is_assumed(worst) else ""] if result.guessed else []),
            )
        )
    more = f"<p>and {found.dropped} more</p>\n" if found.dropped else ""
    return (
        "<h3>Findings</h3>\n"
        + table(
            ("rule", "line", "tool", "X Y Z", "what", *(["depends on"] if result.guessed else [])), rows, f"p{number}f"
        )
        + more
    )


# ---- load over time ------------------------------------------------------------------------------------------------


def round_above(value: float) -> float:
    """A number with one or two digits that is not below the value, for the top of an axis; its half is round, too."""
    power = 10.0 ** math.floor(math.log10(max(value, 1e-9)))
    return next(digits * power for digits in (1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10) if digits * power >= value)


def load_chart(result: Result) -> str:
    """SVG of the removal rate over time, at F and with M251."""
    both = ("at F", "#888", result.load), ("with M251", "#06c", result.load_volumetric)
    curves = [(name, colour, load) for name, colour, load in both if load]
    end = max(width * len(rates) for _, _, (width, rates) in curves)
    top = round_above(max(float(rates.max()) for _, _, (_, rates) in curves))
    lines = "".join(curve(colour, width, rates, end, top) for _, colour, (width, rates) in curves)
    keys = "".join(
        f'<text x="{LEFT + 10 + 110 * k}" y="14" fill="{colour}">{name}</text>'
        for k, (name, colour, _) in enumerate(curves)
    )
    marks = "".join(
        f'<text x="{LEFT + WIDE * k / 4:.0f}" y="{HIGH + 20}" text-anchor="middle">{minutes(end * k / 4)}</text>'
        for k in range(5)
    )
    marks += "".join(
        f'<text x="{LEFT - 5}" y="{HIGH - (HIGH - 20) * k / 2 + 4:.0f}" '
        f'text-anchor="end">{top * k / 2 / MM3_PER_CM3:g}</text>'
        f'<line x1="{LEFT}" x2="{LEFT + WIDE}" y1="{HIGH - (HIGH - 20) * k / 2:.0f}" '
        f'y2="{HIGH - (HIGH - 20) * k / 2:.0f}" '
        'stroke="#ddd"/>'
        for k in range(3)
    )
    marks += (
        f'<text x="{LEFT + WIDE / 2:.0f}" y="{HIGH + 38}" text-anchor="middle">time, min</text>'
        f'<text x="14" y="{HIGH / 2:.0f}" text-anchor="middle" transform="rotate(-90 14 {HIGH / 2:.0f})">cm3/min</text>'
    )
    return (
        f"<h3>Removal rate, cm3/min, over time</h3>\n"
        f'<svg class="load" viewBox="0 0 {LEFT + WIDE + 30} {HIGH + BOTTOM}" '
        f'role="img" aria-label="removal rate over time">{marks}{lines}{keys}</svg>\n'
    )


def curve(colour: str, width: float, rates: Floats, end: float, top: float) -> str:
    """Steps of one load."""
    x = LEFT + np.repeat(np.arange(len(rates) + 1) * width * WIDE / end, 2)[1:-1]
    y = HIGH - np.repeat(np.asarray(rates, float), 2) * (HIGH - 20) / top
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x.tolist(), y.tolist()))
    return f'<polyline fill="none" stroke="{colour}" points="{points}"/>'
