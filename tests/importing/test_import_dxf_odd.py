# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import of DXF that few programs write: arcs with a bulge of nearly nothing, curves of R12 with their frame,
references to a block that is not there, rare units, polylines with a width.  Areas are by closed forms."""

import math

import ezdxf
import pytest

from chipwise.errors import CycleError
from chipwise.importing.run import imported

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
SHARE = 1e-3  # of the area: the target


def read(draw, folder, version="R2010", unit=4):
    """Imported of what draw(document, modelspace) draws."""
    document = ezdxf.new(version)
    document.header["$INSUNITS"] = unit
    draw(document, document.modelspace())
    path = folder / "part.dxf"
    document.saveas(path)
    return imported(str(path), 0.01, 1.0)


def area(found):
    return sum(one for layer in found.layers for one in layer.areas)


@pytest.mark.parametrize("version", ["R12", "R2010"])
@pytest.mark.parametrize("bulge", [1e-7, 1e-9, -1e-11, 1e-13])
def test_bulges_of_nearly_nothing_are_lines(version, bulge, tmp_path):
    """The ends of an arc of 2e12 mm could not be computed: the loop was open, or gone."""

    def draw(_document, msp):
        points = [(*point, bulge) for point in SQUARE]
        if version == "R12":
            msp.add_polyline2d(points, format="xyb", close=True)
        else:
            msp.add_lwpolyline(points, format="xyb", close=True)

    found = read(draw, tmp_path, version)
    assert area(found) == pytest.approx(100.0, rel=1e-6)
    assert not found.doubtful


def test_a_small_bulge_stays(tmp_path):
    """0.01 mm high along 10 mm."""
    found = read(
        lambda _document, msp: msp.add_lwpolyline([(*p, 0.002) for p in SQUARE], format="xyb", close=True), tmp_path
    )
    assert area(found) == pytest.approx(100.0 + 4 * 2 / 3 * 10 * 0.01, abs=1e-3)


def test_the_frame_of_a_fitted_polyline_is_not_drawn(tmp_path):
    """PEDIT, Spline writes the corners that were drawn, too."""

    def draw(_document, msp):
        made = msp.add_polyline2d([])
        made.close(True)
        made.dxf.flags |= 4
        for corner in ((0, 0), (20, 0), (20, 20), (0, 20)):
            made.append_vertex(corner, dxfattribs={"flags": 16})
        for k in range(40):
            angle = 2 * math.pi * k / 40
            made.append_vertex((10 + 8 * math.cos(angle), 10 + 8 * math.sin(angle)), dxfattribs={"flags": 8})

    assert area(read(draw, tmp_path, "R12")) == pytest.approx(20 * 64 * math.sin(2 * math.pi / 40), rel=SHARE)


def test_a_block_that_is_missing_is_counted(tmp_path):
    def draw(_document, msp):
        msp.add_blockref("NOTHING", (0, 0))
        msp.add_circle((0, 0), 5)

    found = read(draw, tmp_path)
    assert area(found) == pytest.approx(25 * math.pi)
    assert found.left == {"INSERT of a block that is missing": 1}


def test_a_spline_that_cannot_be_computed_is_counted(tmp_path):
    def draw(_document, msp):
        spline = msp.add_spline(degree=3)
        spline.control_points = [(*point, 0.0) for point in SQUARE]
        spline.knots = [0, 0, 1]
        msp.add_circle((0, 0), 5)

    assert read(draw, tmp_path).left == {"SPLINE that cannot be computed": 1}


@pytest.mark.parametrize("unit, mm", [(21, 304.8006096), (22, 25.4000508), (23, 914.4018288), (7, 1e6), (15, 1e4)])
def test_rare_units(unit, mm, tmp_path):
    """They came in mm, and it was said that the header names no unit."""
    found = read(lambda _document, msp: msp.add_circle((0, 0), 5.0 / mm), tmp_path, unit=unit)
    assert area(found) == pytest.approx(25 * math.pi, rel=1e-6)
    assert found.words[0].endswith("as its header says")


def test_an_unknown_unit_is_named_as_such(tmp_path):
    found = read(lambda _document, msp: msp.add_circle((0, 0), 5), tmp_path, unit=19)
    assert found.words[0] == "its header names a unit that is not known; mm is taken"


@pytest.mark.parametrize(
    "points, said",
    [
        ([(0, 0, 4, 4, 1), (10, 0, 4, 4, 1)], True),
        ([(0, 0, 0, 4, 1), (10, 0, 0, 0, 1)], True),
        ([(0, 0, 0, 0, 1), (10, 0, 0, 0, 1)], False),
    ],
)
@pytest.mark.parametrize("version", ["R12", "R2010"])
def test_a_width_gets_a_sentence(points, said, version, tmp_path):
    """A donut is drawn by its middle circle and a width."""

    def draw(_document, msp):
        (msp.add_polyline2d if version == "R12" else msp.add_lwpolyline)(points, format="xyseb", close=True)

    found = read(draw, tmp_path, version)
    assert area(found) == pytest.approx(25 * math.pi)
    assert ("1 polylines are drawn with a width; the middle of each is taken" in found.words) == said


def test_a_drawing_of_one_crossing_loop_says_so(tmp_path):
    """It said that nothing was drawn."""
    with pytest.raises(
        CycleError,
        match=r"nothing of the drawing can be cut: layer 0: a closed line is left out, it crosses .* at X5.000 Y5.000",
    ):
        read(lambda _document, msp: msp.add_lwpolyline([SQUARE[k] for k in (0, 2, 1, 3)], close=True), tmp_path)
