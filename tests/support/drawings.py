# SPDX-License-Identifier: GPL-2.0-or-later
"""Drawings as CAD programs write them, by ezdxf, each with what is to be cut of it: {name: (function of a modelspace,
truth)}.

A truth is {layer: [(area mm2, islands), ..]} of the pockets, the larger first; areas by closed forms.
"""

import math

import ezdxf

QUARTER = math.tan(math.pi / 8)  # bulge of a quarter of a circle
BOX = {"0": [(1200.0, 0)]}


def document(version="R2010", unit=4):
    """A new document; unit: $INSUNITS."""
    made = ezdxf.new(version)
    made.header["$INSUNITS"] = unit
    return made


def lines(space, points, **attributes):
    """Lines from point to point."""
    for a, b in zip(points, points[1:]):
        space.add_line(a, b, dxfattribs=attributes)


def rectangle(space, x, y, w, h, **attributes):
    lines(space, [(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)], **attributes)


def shuffled(doc, m):
    """Lines in any order and direction."""
    for a, b in (((40, 30), (40, 0)), ((0, 0), (40, 0)), ((0, 30), (40, 30)), ((0, 0), (0, 30))):
        m.add_line(a, b)


def gaps(doc, m):
    e = 0.004
    for a, b in (((0, 0), (40, 0)), ((40 + e, 0), (40, 30)), ((40, 30 - e), (0, 30)), ((0, 30), (0, e))):
        m.add_line(a, b)


def doubled(doc, m):
    rectangle(m, 0, 0, 40, 30)
    rectangle(m, 0, 0, 40, 30)


def bulge(doc, m):
    m.add_lwpolyline([(0, 0, 0), (40, 0, QUARTER), (50, 10, 0), (50, 30, 0), (0, 30, 0)], format="xyb", close=True)


def closed_by_points(doc, m):
    m.add_lwpolyline([(0, 0), (40, 0), (40, 30), (0, 30), (0, 0)])


def arcs_over_zero(doc, m):
    m.add_circle((20, 20), 10)
    m.add_arc((60, 20), 10, 350, 10)
    m.add_arc((60, 20), 10, 10, 350)


def ellipse(doc, m):
    m.add_ellipse((20, 20), major_axis=(15, 0), ratio=0.5)


def nurbs_circle(doc, m):
    """A circle of radius 10 as a rational spline of degree 2."""
    w = math.sqrt(0.5)
    points = [(10, 0), (10, 10), (0, 10), (-10, 10), (-10, 0), (-10, -10), (0, -10), (10, -10), (10, 0)]
    m.add_rational_spline(points, [1, w, 1, w, 1, w, 1, w, 1], degree=2, knots=[0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4])


def blocks(doc, m):
    b = doc.blocks.new("B")
    rectangle(b, 0, 0, 10, 6)
    b.add_arc((5, 3), 2, 0, 180)
    b.add_line((3, 3), (7, 3))
    m.add_blockref("B", (10, 10))
    m.add_blockref("B", (60, 10), dxfattribs={"xscale": -1})
    m.add_blockref("B", (10, 40), dxfattribs={"xscale": 2, "yscale": 1, "rotation": 30})


def array_of_blocks(doc, m):
    inner, outer = doc.blocks.new("I"), doc.blocks.new("O")
    rectangle(inner, 0, 0, 10, 6)
    outer.add_blockref("I", (5, 5), dxfattribs={"rotation": 90})
    m.add_blockref("O", (0, 0), dxfattribs={"row_count": 2, "column_count": 3, "row_spacing": 20, "column_spacing": 30})


def small_rectangle(doc, m):
    rectangle(m, 0, 0, 2, 1.5)


def imperial(doc, m):
    doc.header["$MEASUREMENT"] = 0
    rectangle(m, 0, 0, 2, 1.5)


def downward(doc, m):
    """An arc drawn from below: it lies at x = -20."""
    m.add_arc((20, 20), 10, 0, 90, dxfattribs={"extrusion": (0, 0, -1)})
    m.add_line((-20, 20), (-30, 20))
    m.add_line((-20, 20), (-20, 30))


def hidden_layers(doc, m):
    doc.layers.new("DIM")
    doc.layers.new("OFF").off()
    doc.layers.new("FROZEN").freeze()
    rectangle(m, 0, 0, 40, 30, layer="CUT")
    m.add_line((0, -5), (40, -5), dxfattribs={"layer": "DIM"})
    rectangle(m, 5, 5, 5, 5, layer="OFF")
    rectangle(m, 15, 5, 5, 5, layer="FROZEN")
    m.add_text("PART 1", dxfattribs={"layer": "DIM"})
    m.add_point((3, 3))
    m.add_linear_dim(base=(0, -10), p1=(0, 0), p2=(40, 0)).render()


def old_polyline(doc, m):
    m.add_polyline2d([(0, 0), (40, 0), (40, 30), (0, 30)], close=True)


def overlap(doc, m):
    rectangle(m, 0, 0, 40, 30)
    m.add_line((40, 0), (40.0000001, 0))
    m.add_line((20, 0), (30, 0))


def junction(doc, m):
    for a, b in (((0, 0), (60, 0)), ((30, 0), (30, 20)), ((60, 0), (60, 20)), ((60, 20), (0, 20)), ((0, 20), (0, 0))):
        m.add_line(a, b)


def elevations(doc, m):
    m.add_lwpolyline([(0, 0), (40, 0), (40, 30), (0, 30)], close=True, dxfattribs={"elevation": 25})
    m.add_circle((20, 15, 10), 3)


def areas_only(doc, m):
    m.add_hatch().paths.add_polyline_path([(0, 0), (40, 0), (40, 30), (0, 30)], is_closed=True)
    m.add_mline([(0, 50), (40, 50)])
    m.add_solid([(0, 60), (10, 60), (0, 70), (10, 70)])


def fit_points(doc, m):
    m.add_spline(fit_points=[(0, 0), (20, 10), (40, 0), (40, 30), (0, 30), (0, 0)])


CIRCLE, HALF = math.pi * 100, math.pi * 2
TRUTHS = {  # name: (draws, version, $INSUNITS, truth, words that must be said)
    "shuffled": (shuffled, "R2010", 4, BOX, "unit mm, as its header says"),
    "gaps": (gaps, "R2010", 4, BOX, "3 gaps up to 0.0040 mm are joined (tolerance 0.01 mm)"),
    "doubled": (doubled, "R2010", 4, BOX, "4 lines or arcs that are drawn twice count once"),
    "bulge": (bulge, "R2010", 4, {"0": [(1500 - (100 - 25 * math.pi), 0)]}, ""),
    "closed_by_points": (closed_by_points, "R2010", 4, BOX, ""),
    "arcs_over_zero": (arcs_over_zero, "R2010", 4, {"0": [(CIRCLE, 0), (CIRCLE, 0)]}, ""),
    "ellipse": (ellipse, "R2010", 4, {"0": [(math.pi * 15 * 7.5, 0)]}, "curves are drawn with arcs within"),
    "nurbs_circle": (nurbs_circle, "R2010", 4, {"0": [(CIRCLE, 0)]}, ""),
    "blocks": (blocks, "R2010", 4, {"0": [(120 - 2 * HALF, 1), (60 - HALF, 1), (60 - HALF, 1)]}, ""),
    "array_of_blocks": (array_of_blocks, "R2010", 4, {"0": [(60.0, 0)] * 6}, ""),
    "inch": (small_rectangle, "R2010", 1, {"0": [(50.8 * 38.1, 0)]}, "unit inch, as its header says"),
    "imperial": (
        imperial,
        "R2010",
        0,
        {"0": [(50.8 * 38.1, 0)]},
        "its header names no unit; inch is taken, as $MEASUREMENT is 0",
    ),
    "downward": (downward, "R2010", 4, {"0": [(math.pi * 25, 0)]}, ""),
    "hidden_layers": (
        hidden_layers,
        "R2010",
        4,
        {"CUT": [(1200.0, 0)], "DIM": []},
        "8 elements on layers that are off, frozen or not plotted are left out",
    ),
    "old_polyline": (old_polyline, "R12", 4, BOX, ""),
    "overlap": (overlap, "R2010", 4, BOX, ""),
    "junction": (junction, "R2010", 4, BOX, "1 chains are open: X30.000 Y0.000 to X30.000 Y20.000"),
    "elevations": (elevations, "R2010", 4, {"0": [(1200 - math.pi * 9, 1)]}, "taken as drawn in the plane"),
}


def write(name, folder):
    """Path of a drawing of TRUTHS."""
    draw, version, unit, _, _ = TRUTHS[name]
    return save(draw, folder, name, version, unit)


def save(draw, folder, name, version="R2010", unit=4):
    made = document(version, unit)
    draw(made, made.modelspace())
    path = folder / f"{name}.dxf"
    made.saveas(path)
    return path
