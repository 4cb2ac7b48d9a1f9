# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import of SVG that few programs write: pages of which one side is given, units in capitals, arcs that are
sheared, style sheets with more than a class, lengths in percent.  Areas are by closed forms."""

import math

import pytest

from chipwise.importing import svg_lengths, svg_style
from chipwise.importing.run import Layer, extent, imported

SHARE = 1e-3  # of the area: the target
BOX = '<rect width="10" height="10"/>'
PX = 25.4 / 96.0  # mm


def read(page, body, folder):
    path = folder / "part.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {page}>{body}</svg>')
    return imported(str(path), 0.01, 1.0)


def area(found):
    return sum(one for layer in found.layers for one in layer.areas)


@pytest.mark.parametrize(
    "page, mm2",
    [
        ('width="50mm" viewBox="0 0 50 80"', 100.0),
        ('height="80mm" viewBox="0 0 50 80"', 100.0),
        ('width="50mm" height="auto" viewBox="0 0 50 80"', 100.0),
        ('width="100MM" height="100MM" viewBox="0 0 100 100"', 100.0),
        ('width=" 100mm " height=" 100 mm" viewBox=" 0  0,100 , 100 "', 100.0),
        ('width="400Q" height="400Q" viewBox="0 0 100 100"', 100.0),
        ('width="1e2mm" height="10e1mm" viewBox="0,0,1e2,1e2"', 100.0),
        ('width="10pc" height="10pc" viewBox="0 0 100 100"', (25.4 / 6) ** 2),
        ('width="100%" height="100%" viewBox="0 0 50 80"', 100 * PX**2),
        ('viewBox="0 0 50 80"', 100 * PX**2),
        ("", 100 * PX**2),
    ],
)
def test_pages(page, mm2, tmp_path):
    """A page of which one side was given, or whose unit was in capitals, came in px of any size, and `unit mm` was
    said."""
    assert area(read(page, BOX, tmp_path)) == pytest.approx(mm2, rel=SHARE)


def test_a_page_of_one_side_keeps_its_lower_edge(tmp_path):
    (layer,) = read('width="50mm" viewBox="0 0 50 80"', BOX, tmp_path).layers
    assert extent([Layer("", layer.pockets)]) == pytest.approx((0.0, 70.0, 10.0, 80.0), abs=1e-6)


ARCS = "M10 20A5 {ry} 0 0 1 20 20A5 {ry} 0 0 1 10 20z"


@pytest.mark.parametrize(
    "body, mm2",
    [
        ('<circle transform="skewX(30)" cx="20" cy="20" r="5"/>', 25 * math.pi),
        ('<circle transform="matrix(1 .5 .2 1.3 0 0)" cx="20" cy="20" r="5"/>', 25 * math.pi * 1.2),
        (f'<path transform="skewX(30)" d="{ARCS.format(ry=5)}"/>', 25 * math.pi),
        (f'<g transform="scale(2,1)"><path transform="rotate(30)" d="{ARCS.format(ry=3)}"/></g>', 30 * math.pi),
        (f'<g transform="scale(2,1)"><path transform="rotate(30)" d="{ARCS.format(ry=5)}"/></g>', 50 * math.pi),
        (
            '<g transform="scale(2,1)"><rect transform="rotate(30)" x="20" y="20" width="20" height="20" rx="5"/></g>',
            800 - 50 * (4 - math.pi),
        ),
    ],
)
def test_arcs_that_are_sheared(body, mm2, tmp_path):
    """svgelements makes another ellipse of them, up to 19 % larger, and drops circles and rounded boxes."""
    assert area(read('width="100mm" height="100mm" viewBox="0 0 100 100"', body, tmp_path)) == pytest.approx(
        mm2, rel=SHARE
    )


def test_a_mirrored_circle_stays_two_arcs(tmp_path):
    body = f'<path transform="matrix(0 -1 -1 0 50 50)" d="{ARCS.format(ry=5)}"/>'
    (layer,) = read('width="100mm" height="100mm" viewBox="0 0 100 100"', body, tmp_path).layers
    (loop,) = layer.loops
    assert [hasattr(part, "centre") for part in loop] == [True, True]
    assert layer.areas == [pytest.approx(25 * math.pi, rel=1e-9)]


@pytest.mark.parametrize(
    "sheet, first",
    [
        ("rect {display:none !important}", '<rect style="display:inline" SIZE/>'),
        ('@import url("x.css"); .a{display:none}', '<rect class="a" SIZE/>'),
        ("g rect {fill:none; stroke:none}", "<g><rect SIZE/></g>"),
        ("g > .a.b {display:none}", '<g><rect class="b a" SIZE/></g>'),
        ("@media screen { #q {display:none} }", '<rect id="q" SIZE/>'),
        ("[data-k='1'] {visibility:collapse}", '<rect data-k="1" SIZE/>'),
        ("#q {display:none} rect {display:inline}", '<rect id="q" SIZE/>'),
    ],
)
def test_style_sheets_hide(sheet, first, tmp_path):
    body = f"<style>{sheet}</style>" + first.replace("SIZE", 'width="5" height="5"')
    found = read(
        'width="100mm" height="100mm" viewBox="0 0 100 100"', body + '<circle cx="50" cy="50" r="5"/>', tmp_path
    )
    assert area(found) == pytest.approx(25 * math.pi, rel=SHARE)


@pytest.mark.parametrize(
    "sheet",
    [
        "@media print {rect {display:none}}",
        "g > rect {display:none}",
        "circle rect, rect:hover {display:none}",
        "/* rect {display:none} */",
        "rect {display:none} .a {display:inline}",
        ".b {display:none}",
    ],
)
def test_style_sheets_leave(sheet, tmp_path):
    body = f'<style>{sheet}</style><g><g id="x"/><svg><rect class="a" width="5" height="5"/></svg></g>'
    assert area(read('width="100mm" height="100mm" viewBox="0 0 100 100"', body, tmp_path)) == pytest.approx(25.0)


@pytest.mark.parametrize(
    "body, mm2",
    [
        ('<circle cx="50%" cy="50%" r="10%"/>', math.pi * 0.01 * (100**2 + 50**2) / 2),
        ('<svg x="10" y="10" width="50" height="20"><rect width="10%" height="50%"/></svg>', 50.0),
        ('<rect width="20" height="10" rx="2" ry="auto"/>', 200 - 4 * (4 - math.pi)),
        ('<rect width="7"/>' + BOX, 100.0),
        ('<ellipse cx="20" cy="20" rx="5" ry="auto"/>', 25 * math.pi),
        ('<rect width="1CM" height="1 In"/>', 96**2 / 2.54),
    ],
)
def test_lengths(body, mm2, tmp_path):
    page = 'width="100mm" height="50mm" viewBox="0 0 100 50"'
    assert area(read(page, body, tmp_path)) == pytest.approx(mm2, rel=SHARE)


@pytest.mark.parametrize(
    "body, left",
    [
        ('<rect width="1em" height="1em"/>', "rect with a length in a unit that is not known"),
        ('<path d="M0 0L10 0L10 10z Lfoo"/>', "path that cannot be read"),
        ('<use href="other.svg#a"/>', "copy of another file"),
    ],
)
def test_what_cannot_be_read_is_counted(body, left, tmp_path):
    """A size in em ended with a traceback, the others without a word."""
    found = read('width="100mm" height="50mm" viewBox="0 0 100 50"', body + BOX, tmp_path)
    assert area(found) == pytest.approx(100.0)
    assert found.left == {left: 1}


def test_a_length_needs_a_number():
    assert [svg_lengths.length(text, 50.0) for text in ("auto", "", "5vw", "1.5.2", "10%", "-.5e1Px")] == [
        None,
        None,
        None,
        None,
        5.0,
        -5.0,
    ]
    assert svg_lengths.length("10%") is None


def test_a_sheet_without_an_end_is_read_to_its_end():
    assert svg_style.rules(".a{fill:none") == [((0, 1, 0), [(" ", [(".", "a", "", "")])], {"fill": ("none", False)})]
