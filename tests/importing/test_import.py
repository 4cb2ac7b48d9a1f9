# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import: drawings with known truths, what is said, what is refused, and that G79 takes what is written."""

import json
import math

import pytest
from shapely.geometry import LineString, Point

from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import contours, read_shape
from chipwise.cli import main
from chipwise.geometry.base import elements
from chipwise.geometry.pocket import nesting
from chipwise.importing import fit, join
from chipwise.importing.drawn import Unreadable, line
from chipwise.importing.run import imported
from support import drawings
from support.nesting_random import arc_points, loop_points

SHARE = 1e-3  # of the area: the target


def areas(found):
    return {
        layer.name: sorted(
            ((area, len(islands)) for area, (_, islands) in zip(layer.areas, layer.pockets)), reverse=True
        )
        for layer in found.layers
    }


def run_import(path, *options):
    """(exit status, figures of --json, text of the program)."""
    out, figures = path.with_suffix(".ngc"), path.with_suffix(".json")
    status = main(["import", str(path), "-o", str(out), "--json", str(figures), *options])
    return (
        status,
        json.loads(figures.read_text()) if figures.exists() else None,
        out.read_text() if out.exists() else "",
    )


@pytest.mark.parametrize("name", drawings.TRUTHS)
def test_what_is_drawn_is_read(name, tmp_path):
    """Areas within 0.1 %, islands in their pockets, and the word that belongs to it."""
    truth, words = drawings.TRUTHS[name][3:]
    found = imported(str(drawings.write(name, tmp_path)), 0.01, 1.0)
    got = areas(found)
    assert set(got) == set(truth)
    for layer, meant in truth.items():
        assert [n for _, n in got[layer]] == [n for _, n in meant]
        assert [a for a, _ in got[layer]] == pytest.approx([a for a, _ in meant], rel=SHARE)
    assert not words or any(words in said for said in found.words), found.words


@pytest.mark.parametrize("name, arcs", [("bulge", 1), ("arcs_over_zero", 3)])
def test_arcs_stay_arcs(name, arcs, tmp_path):
    loops = imported(str(drawings.write(name, tmp_path)), 0.01, 1.0).layers[0].loops
    assert sum(hasattr(part, "centre") for loop in loops for part in loop) == arcs


def test_a_spline_of_fit_points_runs_through_them(tmp_path):
    path = drawings.save(drawings.fit_points, tmp_path, "fit")
    curve = LineString(loop_points(imported(str(path), 0.01, 1.0).layers[0].loops[0]))
    for point in ((20, 10), (40, 0), (40, 30), (0, 30)):
        assert curve.distance(Point(point)) < 0.02
    assert 1000 < areas(imported(str(path), 0.01, 1.0))["0"][0][0] < 1900


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.001])
def test_arcs_for_curves_keep_the_tolerance(tolerance):
    """An ellipse by its exact equation: every point of the arcs is that near to it."""
    points = [(15 * math.cos(t), 7.5 * math.sin(t)) for t in (2 * math.pi * k / 4000 for k in range(4001))]
    parts, worst = fit.fitted(points, tolerance)
    on_parts = [
        p
        for part in parts
        for p in (arc_points(part.start, part.end, part.centre, part.ccw) if hasattr(part, "centre") else [part.start])
    ]
    off = max(min(math.dist(p, q) for q in points) for p in on_parts[:: max(1, len(on_parts) // 200)])
    assert worst <= tolerance and off <= tolerance + 0.012 and len(parts) < 150  # the points are 0.02 mm apart
    assert sum(hasattr(part, "centre") for part in parts) > len(parts) / 2


def test_the_program_holds_what_g79_takes(tmp_path):
    status, figures, text = run_import(drawings.write("blocks", tmp_path))
    assert status == 0 and figures["layers"][0]["subs"][0] == {"what": "pocket", "number": 100}
    assert "(pocket: G79 Q100 Z-1 R1 F500)" in text and "o99 if [#<_task> EQ 0]" in text
    shape = read_shape(Job(program=str(tmp_path / "blocks.ngc"), sub=100, close_gap=0.01))
    pockets = nesting.sort(contours(shape), 0.01).pockets
    left = sorted(
        abs(elements.area(b.elements)) - sum(abs(elements.area(i.elements)) for i in islands) for b, islands in pockets
    )
    assert left == pytest.approx(sorted(p["area_mm2"] for p in figures["layers"][0]["pockets"]), rel=1e-6)


def test_layers_are_subs(tmp_path):
    path = drawings.write("hidden_layers", tmp_path)
    status, figures, text = run_import(path)
    assert status == 1 and {layer["layer"]: layer["subs"][0]["number"] for layer in figures["layers"]} == {
        "CUT": 100,
        "DIM": 201,
    }
    assert figures["left_out"] == {"TEXT": 1, "POINT": 1, "DIMENSION": 1}
    status, figures, _ = run_import(path, "--layer", "cut")
    assert status == 0 and [layer["layer"] for layer in figures["layers"]] == ["CUT"]


def test_scale_multiplies(tmp_path):
    found = imported(str(drawings.write("imperial", tmp_path)), 0.01, 1 / 25.4)
    assert areas(found)["0"][0][0] == pytest.approx(3.0, rel=SHARE)


def test_ends_that_more_than_two_share_are_named(tmp_path):
    def three(doc, m):
        drawings.rectangle(m, 0, 0, 40, 30)
        m.add_line((40, 30), (60, 50))

    found = imported(str(drawings.save(three, tmp_path, "three")), 0.01, 1.0)
    assert found.doubtful and any("more than two ends meet at X40.000 Y30.000" in said for said in found.words)


def test_gaps_beyond_the_tolerance_stay_open(tmp_path):
    path = drawings.write("gaps", tmp_path)
    assert imported(str(path), 0.001, 1.0).doubtful and not imported(str(path), 0.01, 1.0).doubtful
    parts = [[line((0, 0), (10, 0))], [line((10.004, 0), (10, 10))], [line((10, 10), (0, 0.003))]]
    one = join.joined(parts, 0.01)
    assert len(one.closed) == 1 and one.gaps == 2 and one.widest == pytest.approx(0.004)


def test_texts_become_outlines(tmp_path):
    path = drawings.save(lambda doc, m: m.add_text("O", dxfattribs={"height": 10}), tmp_path, "text")
    (layer,) = imported(str(path), 0.01, 1.0, text=True).layers
    assert [len(islands) for _, islands in layer.pockets] == [1] and 5 < layer.areas[0] < 80


SVG = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
 width="100mm" height="80mm" viewBox="0 0 100 80"><g inkscape:groupmode="layer" inkscape:label="CUT" id="g1">
 <rect x="10" y="10" width="40" height="30"/><circle cx="30" cy="25" r="5"/>
 <path transform="translate(60 10) scale(2 1)" d="M0 0 h10 v20 h-10 z"/><ellipse cx="30" cy="60" rx="15" ry="7.5"/></g>
 <text x="1" y="1">no</text></svg>"""


def test_svg(tmp_path):
    path = tmp_path / "part.svg"
    path.write_text(SVG)
    found = imported(str(path), 0.01, 1.0)
    (layer,) = found.layers
    assert layer.name == "CUT" and found.words[0] == "unit mm, by the size of its page" and found.left == {"Text": 1}
    meant = [(1200 - math.pi * 25, 1), (400.0, 0), (math.pi * 15 * 7.5, 0)]
    assert areas(found)["CUT"] == [(pytest.approx(area, rel=SHARE), n) for area, n in meant]
    xs = [p[0] for loop in layer.loops for part in loop for p in (part.start, part.end)]
    ys = [p[1] for loop in layer.loops for part in loop for p in (part.start, part.end)]
    assert min(xs) == pytest.approx(10, abs=0.02) and max(ys) == pytest.approx(
        70, abs=0.02
    )  # y upward from the lower edge


@pytest.mark.parametrize(
    "content, ending, text",
    [
        ("no drawing", "dxf", "the file cannot be read as a DXF drawing"),
        ("", "dxf", "the file cannot be read as a DXF drawing"),
        ("AC1027\0\0", "dxf", "the file cannot be read as a DXF drawing"),
        ("<svg", "svg", "the file cannot be read as a SVG drawing"),
        ("G0", "ngc", ".ngc is not a kind of drawing that can be read; save it as .dxf or .svg"),
    ],
)
def test_what_is_no_drawing_gets_a_sentence(content, ending, text, tmp_path):
    path = tmp_path / f"x.{ending}"
    path.write_text(content)
    with pytest.raises(Unreadable) as error:
        imported(str(path), 0.01, 1.0)
    assert text in str(error.value)


def test_empty_flat_and_solid_drawings_get_a_sentence(tmp_path):
    empty = drawings.save(lambda doc, m: None, tmp_path, "empty")
    solid = drawings.save(drawings.areas_only, tmp_path, "solid")
    body = drawings.save(lambda doc, m: m.add_3dface([(0, 0, 0), (1, 0, 5), (1, 1, 5)]), tmp_path, "body")
    slope = drawings.save(lambda doc, m: m.add_line((0, 0, 0), (1, 1, 5)), tmp_path, "slope")
    for path, left in (
        (empty, ""),
        (solid, "; 1 HATCH, 1 MLINE, 1 SOLID are left out"),
        (body, "; 1 3DFACE are left out"),
        (slope, "; 1 LINE that leaves its height are left out"),
    ):
        with pytest.raises(Unreadable) as error:
            imported(str(path), 0.01, 1.0)
        assert (
            str(error.value)
            == f"chipwise: the drawing holds no line, arc or curve that can be cut{left}; draw the outline, or explode "
            f"what holds it"
        )


def test_a_drawing_of_100_mb_is_refused_unread(tmp_path):
    path = tmp_path / "large.dxf"
    with open(path, "wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(Unreadable, match="it has 100 MB, more than 34; export what is to be cut"):
        imported(str(path), 0.01, 1.0)


def test_blocks_without_end_are_refused(tmp_path):
    def many(doc, m):
        doc.blocks.new("A").add_line((0, 0), (1, 0))
        for name, inner in zip("BCDEF", "ABCDE"):
            doc.blocks.new(name).add_blockref(
                inner, (0, 0), dxfattribs={"row_count": 40, "column_count": 40, "row_spacing": 1, "column_spacing": 2}
            )
        m.add_blockref("F", (0, 0))

    with pytest.raises(Unreadable, match="the drawing has more than"):
        imported(str(drawings.save(many, tmp_path, "many")), 0.01, 1.0)


def test_the_command_says_what_it_did(tmp_path, capsys):
    path = drawings.write("gaps", tmp_path)
    picture = tmp_path / "p.svg"
    assert main(["import", str(path), "-o", str(tmp_path / "o.ngc"), "--picture", str(picture)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert (
        said[0] == "unit mm, as its header says"
        and said[-1] == f"program: {tmp_path}/o.ngc"
        and "<path" in picture.read_text()
    )
    assert main(["import", str(path), "-o", str(tmp_path / "o.ngc"), "--tolerance", "5"]) == 2
    assert (
        capsys.readouterr().err
        == "chipwise: import: --tolerance 5 is not from 0.0001 to 1; see chipwise import --help\n"
    )


@pytest.mark.parametrize("size", [1e6, 1e15, 1e300])
@pytest.mark.parametrize("kind", ["spline", "ellipse", "circle"])
def test_curves_far_out_are_refused_before_they_are_divided(kind, size, tmp_path):
    """An ellipse of 1 km took minutes."""
    draw = {
        "spline": lambda doc, m: m.add_spline(fit_points=[(0, 0), (size, size / 2), (size, 0)]),
        "ellipse": lambda doc, m: m.add_ellipse((0, 0), (size, 0), 0.5),
        "circle": lambda doc, m: m.add_circle((0, 0), size),
    }[kind]
    with pytest.raises(
        Unreadable, match="a coordinate on layer 0 is not within 100 m of the origin; correct the drawing"
    ):
        imported(str(drawings.save(draw, tmp_path, "far")), 0.01, 1.0)


@pytest.mark.parametrize(
    "centres, said",
    [(((15, 12), (17.5, 12)), "cross or touch one another or it"), (((15, 12), (0, 12)), "crosses the one at")],
)
def test_islands_that_overlap_count_once(tmp_path, centres, said):
    """Two circles of 1.5 mm in one another, and one over the boundary: the area is without what they cover together,
    and a sentence says so."""

    def draw(_made, msp):
        msp.add_lwpolyline([(0, 0), (40, 0), (40, 30), (0, 30)], close=True)
        for centre in centres:
            msp.add_circle(centre, 1.5)

    found = imported(str(drawings.save(draw, tmp_path, "overlap")), 0.01, 1.0)
    covered = Point(centres[0]).buffer(1.5, 256).union(Point(centres[1]).buffer(1.5, 256))
    meant = LineString([(0, 0), (40, 0), (40, 30), (0, 30), (0, 0)]).convex_hull.difference(covered).area
    assert found.layers[0].areas == [pytest.approx(meant, rel=1e-5)]
    assert found.doubtful and any(said in words for words in found.words), found.words
