# SPDX-License-Identifier: GPL-2.0-or-later
"""The findings on the pictures of the report: where they are by the axes beside them, with their line, on the path; and
what the report says of a program that is not judged."""

import html
import re
import time

import pytest

from chipwise.check.page import minutes
from chipwise.check.page_stock import ticks
from support import panel_browser
from support.check_runs import HEAD, chipwise_check, mill_with_tools

# Too deep in line 9 at X15 Y20 (the tool is in the stock to its axis), and a traverse through it in line 10 along Y, up
# to Y35.
MOVES = "T1 M6\nS1000 M3\nF600\nG0 X{0} Y{1} Z{2}\nG1 Z{3}\nG1 X{4}\nG0 Y{5}\nG0 Z{2}\nM2\n"
OFFSET = "G10 L2 P1 X5 Y-7 Z3 R{}\nG54\n"
PX = 1.5  # of the axes' rounding and of the mark


def program(scale=1.0, offset=""):
    """-> text; lengths in the unit."""
    places = [f"{v / scale:.6f}" for v in (-10, 20, 5, -12, 50, 35)]
    size = [f"{v / scale:.6f}" for v in (0, 0, -20, 60, 40, 20)]
    head = HEAD if scale == 1.0 else HEAD.replace("G21", "G20")
    return (
        head
        + offset
        + "M250 P{} Q{} R{} I{} J{} K{}\n".format(*size)
        + MOVES.format(*places).replace("F600", f"F{600 / scale:g}")
    )


def reported(tmp_path, text, *options, status=1):
    """-> (report, results of --json)."""
    found = chipwise_check(
        tmp_path, {"part.ngc": text}, "--report", str(tmp_path / "r.html"), *options, machine=mill_with_tools(tmp_path)
    )
    assert found[0] == status, found
    return (tmp_path / "r.html").read_text(), found[3]["programs"][0]


def axis(svg, anchor, where):
    """px -> number, from the ticks of an axis."""
    pattern = r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="%s">([-\d.e]+)</text>' % anchor
    marks = [((float(x), float(y) - 4)[where], float(value)) for x, y, value in re.findall(pattern, svg)]
    (p0, v0), (p1, v1) = marks[0], marks[-1]
    return lambda px: v0 + (px - p0) * (v1 - v0) / (p1 - p0)


def picture(text):
    """The second picture of a report -> (svg, [(x, y as by its axes, label, row, title)], mm or in per px)."""
    svg = re.findall(r'<svg class="above".*?</figcaption>', text, re.S)[1]
    x, y = axis(svg, "middle", 0), axis(svg, "end", 1)
    marks = re.findall(
        r'<a href="#(\w+)"><g class="mark"><title>(.*?)</title><circle cx="([\d.]+)" cy="([\d.]+)" r="5"/><text '
        r"[^>]*>(\w+)</text>",
        svg,
    )
    return (
        svg,
        [(x(float(cx)), y(float(cy)), label, row, html.unescape(title)) for row, title, cx, cy, label in marks],
        abs(x(1.0) - x(0.0)),
        (x, y),
    )


@pytest.mark.parametrize(
    "scale, offset", [(1.0, ""), (1.0, OFFSET.format(0)), (25.4, "")], ids=["mm", "offset", "inch program"]
)
def test_findings_are_marked_where_they_are(tmp_path, scale, offset):
    text, result = reported(tmp_path, program(scale, offset))
    _svg, marks, per, _axes = picture(text)
    assert len(marks) == len(result["findings"]) >= 2
    for found, (x, y, label, row, title) in zip(result["findings"], marks):
        assert (x, y) == pytest.approx((found["x"], found["y"]), abs=PX * per)
        assert label == str(found["line"]) and title == found["text"] and f'<tr id="{row}">' in text
    assert "in the work coordinates of the first move" in text


def test_turned_work_coordinates(tmp_path):
    """The axes are those of the machine, and say so; the mark is where the machine is."""
    text, result = reported(tmp_path, program(1.0, OFFSET.format(90)))
    _svg, marks, per, _axes = picture(text)
    found = result["findings"][0]
    assert "in machine coordinates" in text
    assert marks[0][:2] == pytest.approx((5 - found["y"], -7 + found["x"]), abs=PX * per)


def test_the_path_goes_through_the_marks(tmp_path):
    text, _result = reported(tmp_path, program())
    svg, _marks, per, (x, y) = picture(text)
    lines = {
        kind: [(x(float(a)), y(float(b))) for a, b in (p.split(",") for p in points.split())]
        for kind, points in re.findall(r'<polyline class="(\w+)" points="([^"]*)"', svg)
    }
    assert (
        lines["feed"][-1] == pytest.approx((50, 20), abs=PX * per)
        and ("rapid" in lines)
        and lines["rapid"][0] == pytest.approx((50, 20), abs=PX * per)
    )


def test_a_stock_that_is_defined_again_begins_anew(tmp_path):
    """Findings of the stock before are in the table, not on the picture of the last one."""
    first = program().replace("M2\n", "")
    text, result = reported(tmp_path, first + "M250 P0 Q0 R-20 I60 J40 K20\nG0 X10 Y-10\nG1 Z-13\nG1 Y30\nG0 Z5\nM2\n")
    _svg, marks, _per, _axes = picture(text)
    last = result["findings"][-1]
    assert [mark[4] for mark in marks] == [last["text"]] and len(result["findings"]) > 1


def test_a_program_that_is_not_judged(tmp_path):
    """Extents, deepest tip, tools and times, in the text and in the report."""
    moves = HEAD + "T4 M6\nS1000 M3\nF600\nG0 X0 Y0 Z5\nG1 Z-3.5\nG1 X90\nG1 Y40\nG0 Z5\nM2\n"  # T4 has no diameter
    text, result = reported(tmp_path, moves, status=2)
    assert result["extents_mm"]["min"][2] == -3.5
    assert "It feeds from X0 Y0 Z-3.5 to X90 Y40 Z" in text and "the deepest tip is at Z-3.5" in text
    assert re.search(r"<td>4</td><td>not known</td><td>0:1\d\.\d</td>", text)


@pytest.mark.parametrize(
    "seconds, said",
    [(0, "0:00.0"), (12.44, "0:12.4"), (59.97, "1:00.0"), (599.94, "9:59.9"), (599.96, "10:00"), (4502.6, "75:03")],
)
def test_minutes(seconds, said):
    assert minutes(seconds) == said


@pytest.mark.parametrize("low, high", [(0, 60), (-13, 88), (-0.02, 0.07), (1e5, 1e5 + 3), (-2.5, -2.4), (0, 1e-9)])
def test_ticks(low, high):
    found = ticks(low, high)
    assert len(found) <= 13 and all(low - 1e-9 <= one <= high + 1e-6 for one in found) and len(set(found)) == len(found)
    assert high - low < 1e-6 or len(found) >= 2


@pytest.mark.skipif(panel_browser.missing() != "", reason=panel_browser.missing() or "a browser")
def test_the_stock_that_turns_has_the_marks(tmp_path):
    """A link with the line of each finding; it goes with its place when the stock is turned."""
    _text, result = reported(tmp_path, program())
    driver = panel_browser.browser(tmp_path / "browser", (1200, 1900))
    try:
        driver.get(f"file://{tmp_path}/r.html")
        end = time.monotonic() + panel_browser.WAIT_S
        script = (
            "return Array.from(document.querySelectorAll('.turned a'), (a) => [a.textContent, a.title, "
            "a.style.left, a.style.top, a.hidden])"
        )
        while not (links := driver.execute_script(script)) and time.monotonic() < end:
            time.sleep(0.1)
        assert [link[1] for link in links] == [found["text"] for found in result["findings"]]
        assert all(link[0].endswith(f" {found['line']}") for link, found in zip(links, result["findings"]))
        driver.execute_script(
            "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowLeft'}))"
        )
        turned = driver.execute_script(script)
        assert all(a[2:4] != b[2:4] for a, b in zip(links, turned)) and not any(link[4] for link in turned)
        assert [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"] == []
    finally:
        driver.quit()
