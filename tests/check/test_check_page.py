# SPDX-License-Identifier: GPL-2.0-or-later
"""The HTML page of chipwise check: self-contained, everything in it is text, figures and pictures are those of the
result."""

import base64
import html.parser
import json
import os
import re
import shutil
import subprocess
import zlib

import numpy as np
import pytest

from chipwise.check import page, page_stock
from chipwise.check.drawing import Drawing
from chipwise.check.findings import FLUTE, Finding, Findings
from chipwise.check.result import Result, ToolFigures
from chipwise.tool_data.geometry import ToolGeometry


class Parser(html.parser.HTMLParser):
    """Checks that tags match; collects cells, scripts and addresses."""

    VOID = {"meta", "img", "line", "polyline"}

    def __init__(self):
        super().__init__()
        self.open, self.cells, self.addresses, self.data, self.images = [], [], [], "", []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        self.addresses += [value for key, value in attrs if key in ("src", "href", "action")]
        if tag == "td":
            self.cells.append("")

    def handle_startendtag(self, tag, attrs):
        self.addresses += [value for key, value in attrs if key in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "td":
            self.cells[-1] += data
        if self.open and self.open[-1] == "script" and data.strip().startswith("["):
            self.data = data


def make_result(program="a.ngc"):
    result = Result(program, cell=0.5, moves=10)
    result.tools[3] = ToolFigures(
        3,
        6.0,
        ToolGeometry("ball", flute_length=12.0),
        feed_s=10,
        planned_s=11,
        volume=600.0,
        feed_volume=650.0,
        cutting_s=6.0,
        depth=14.25,
        depth_line=7,
        reach=15.0,
    )
    result.findings = Findings()
    result.findings.add(Finding(FLUTE, 7, 9, 3, (1.0, 2.0, -3.0), 14.25, 12.0))
    result.load = (0.5, np.array([0.0, 6000.0, 3000.0]))
    before = np.full((30, 40), 0.0, np.float32)
    after = before.copy()
    after[10:20, 5:15] = -4.0
    result.drawing = Drawing(0.5, (0.0, 0.0, -10.0), before, after)
    return result


def parse(results):
    text = page.page(results)
    parser = Parser()
    parser.feed(text)
    assert not parser.open
    return text, parser


def test_figures_and_pictures():
    text, parser = parse([make_result()])
    for cell in ("600", "6.5", "14.25 (line 7)", "12", "14.3", "15", "7 to 9", "1 2 -3"):
        assert cell in parser.cells
    assert "mean cm3/min" in text and "Removal rate, cm3/min" in text and ">6</text>" in text and "mm3/min" not in text
    (stock,) = json.loads(parser.data)
    heights = np.frombuffer(base64.b64decode(stock["after"]), "<u2").reshape(stock["rows"], stock["columns"])
    expected = make_result().drawing.after + 10.0
    assert stock["cell"] == 0.5 and np.allclose(heights / 65535 * stock["high"], expected, atol=1e-3)
    pictures = [a.partition(",")[2] for a in parser.addresses if a.startswith("data:image/png")]
    assert len(pictures) == 2
    before, after = (decode(base64.b64decode(p)) for p in pictures)
    assert before.shape == (30, 40) and np.ptp(before.astype(int)) == 0
    # Y points up: the rows of the picture are those of the map from the last to the first
    assert after[29 - 15, 10] < after[29 - 25, 10] == before[0, 0]


def decode(data):
    """PNG of page.png() -> (rows, columns)."""
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    columns, rows = np.frombuffer(data[16:24], ">u4").tolist()
    start = data.index(b"IDAT") + 4
    raw = np.frombuffer(zlib.decompressobj().decompress(data[start:]), np.uint8).reshape(rows, columns + 1)
    assert not raw[:, 0].any()
    return raw[:, 1:]


def test_nothing_outside_and_nothing_executed():
    hostile = "<script>alert(1)</script>\"'&</section>.ngc"
    bad = Result(hostile, error=("<img src=x onerror=alert(1)>", 3))
    text, parser = parse([make_result(hostile), bad])
    assert not re.search(r"https?:|url\(|@import|<link|<iframe", text)
    assert all(a.startswith(("data:image/png;base64,", "#p")) for a in parser.addresses)
    assert "<script>alert" not in text and "<img src=x" not in text
    assert "default-src 'none'" in text


def test_many_programs_keep_the_page_small():
    results = [make_result(f"{k}.ngc") for k in range(page.PICTURES + 5)]
    _text, parser = parse(results)
    assert len(json.loads(parser.data)) == page.PICTURES
    large = make_result()
    large.drawing = Drawing(
        0.1, (0.0, 0.0, -10.0), np.zeros((900, 1200), np.float32), np.zeros((900, 1200), np.float32)
    )
    (stock,) = json.loads(parse([large])[1].data)
    assert max(stock["rows"], stock["columns"]) <= page_stock.CELLS and stock["cell"] == pytest.approx(0.5)


@pytest.mark.skipif(shutil.which("node") is None, reason="no node to read JavaScript with")
def test_the_script_is_one():
    done = subprocess.run(["node", "--check", os.path.join(page.FOLDER, "page.js")], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_axis_ends_at_a_round_number():
    """At most a half above the largest value, whatever it is; ends and middle have at most two digits."""
    for value in [*np.geomspace(1e-3, 1e7, 400), 1.0, 10.0, 44288.0, 1.6e4]:
        top = page.round_above(float(value))
        assert value <= top * (1 + 1e-12) <= 1.5 * value + 1e-9, (value, top)
        assert all(
            len(f"{mark:.6e}".partition("e")[0].rstrip("0").rstrip(".").replace(".", "")) <= 2
            for mark in (top, top / 2)
        ), top
    assert page.round_above(44288.0) == 50000 and page.round_above(0.0) > 0
