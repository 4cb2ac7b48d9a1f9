# SPDX-License-Identifier: GPL-2.0-or-later
"""DXF -> Drawn, by ezdxf (0.18 of Debian 12 and later).  Called by run.py.

Model space only.  Blocks are taken apart here, so that what lies on layer 0 of a block gets the layer of its reference,
and a drawing of blocks in blocks ends with a sentence.  z is dropped: what is drawn at a height counts as drawn in the
plane, what leaves its height is left out.
"""

import math

from chipwise.errors import braceless
from chipwise.geometry.base.contour import turned
from chipwise.importing import fit
from chipwise.importing.drawn import MAX_PARTS, Drawn, Unreadable, arc, check_near, line

UNITS = {
    1: ("inch", 25.4),
    2: ("feet", 304.8),
    3: ("mile", 1609344.0),
    4: ("mm", 1.0),
    5: ("cm", 10.0),
    6: ("m", 1000.0),
    7: ("km", 1e6),
    8: ("microinch", 25.4e-6),
    9: ("mil", 0.0254),
    10: ("yard", 914.4),
    11: ("angstrom", 1e-7),
    12: ("nanometre", 1e-6),
    13: ("micrometre", 1e-3),
    14: ("dm", 100.0),
    15: ("decametre", 1e4),
    16: ("hectometre", 1e5),
    21: ("US survey foot", 1.2e6 / 3937),
    22: ("US survey inch", 1e5 / 3937),
    23: ("US survey yard", 3.6e6 / 3937),
}
DEPTH = 16  # of blocks in blocks
FLAT = 1e-9  # cosine by which an extrusion may differ from the z axis
TEXTS = ("TEXT", "MTEXT")
FLAT_MM = 1e-5  # an arc of a polyline that bows out less is a line: its centre is too far away to be computed
SPLINE_FIT, FRAME = 4, 16  # flags of an old polyline, and of its vertices that are only the frame of the curve


def read(path, tolerance, scale, text=False, layer=None):
    """Drawn of a file; scale multiplies; text: as outlines; layer: only this one."""
    try:
        import ezdxf
    except ImportError:
        raise Unreadable(
            "a DXF drawing needs the Python package ezdxf, which is not installed", "apt-get install python3-ezdxf"
        ) from None
    document = _document(ezdxf, path)
    drawn = Drawn()
    unit = _unit(document, drawn) * scale
    reader = _Reader(document, drawn, tolerance, unit, text, layer)
    for entity in document.modelspace():
        reader.entity(entity, None, 0)
    reader.say()
    return drawn


def _document(ezdxf, path):
    """ezdxf's document, of a damaged file what can be recovered."""
    from ezdxf import recover

    try:
        try:
            return ezdxf.readfile(path)
        except (ezdxf.DXFError, UnicodeDecodeError):
            return recover.readfile(path)[0]
    except MemoryError:
        raise
    except Exception as error:  # whatever a damaged file makes of a library
        said = braceless(" ".join(str(error).split())[:80])
        raise Unreadable(
            f"the file cannot be read as a DXF drawing ({said or type(error).__name__})",
            "save it again as DXF R2010; a DWG file has to be saved as DXF",
        ) from None


def _unit(document, drawn):
    """mm of a drawing unit."""
    code = document.header.get("$INSUNITS", 0)
    if code in UNITS:
        name, mm = UNITS[code]
        drawn.words.append(f"unit {name}, as its header says")
        return mm
    inch = document.header.get("$MEASUREMENT", 1) == 0
    name, mm = UNITS[1 if inch else 4]
    drawn.words.append(
        f"its header names {'a unit that is not known' if code else 'no unit'}; {name} is taken"
        + (", as $MEASUREMENT is 0 (--scale 0.0393701 makes it mm)" if inch else "")
    )
    return mm


class _Reader:
    """Entities of one document -> Drawn."""

    def __init__(self, document, drawn, tolerance, unit, text, layer):
        self.drawn, self.tolerance, self.unit, self.text, self.layer = drawn, tolerance, unit, text, layer
        self._hidden = {
            entry.dxf.name.lower()
            for entry in document.layers
            if entry.is_off() or entry.is_frozen() or not entry.dxf.get("plot", 1)
        }
        self._hidden_count, self._raised, self._wide, self._visited, self._others = 0, 0, 0, 0, set()

    def entity(self, entity, parent, depth):
        """One entity; parent: layer of the block reference that holds it."""
        self._visit()
        kind, layer = entity.dxftype(), entity.dxf.get("layer", "0")
        layer = parent if layer == "0" and parent is not None else layer
        if layer.lower() in self._hidden or layer.lower() == "defpoints" or entity.dxf.get("invisible", 0):
            self._hidden_count += 1
        elif kind == "INSERT":
            self._insert(entity, layer, depth)
        elif self.layer is not None and layer.lower() != self.layer.lower():
            self._others.add(layer)
        elif kind in TEXTS and self.text:
            self._outlines(entity, layer)
        else:
            self._curve(entity, kind, layer)

    def _visit(self):
        """Count an entity or a block reference."""
        self._visited += 1
        if self._visited > 4 * MAX_PARTS:
            raise Unreadable(f"the drawing has more than {4 * MAX_PARTS} elements", "export the part that is to be cut")

    def say(self):
        """Sentences about what was dropped on the way."""
        if self._hidden_count:
            self.drawn.words.append(
                f"{self._hidden_count} elements on layers that are off, frozen or not plotted are left out"
            )
        if self._raised:
            self.drawn.words.append(
                f"{self._raised} elements are drawn at a height; they are taken as drawn in the plane"
            )
        if self._wide:
            self.drawn.words.append(f"{self._wide} polylines are drawn with a width; the middle of each is taken")
        self.drawn.refuse_other_layers(self.layer, self._others)

    def _insert(self, insert, layer, depth):
        if depth >= DEPTH:
            raise Unreadable(f"blocks are nested deeper than {DEPTH}", "explode them in the CAD program")
        if insert.block() is None:
            self.drawn.left["INSERT of a block that is missing"] += 1
            return
        for one in insert.multi_insert() if insert.mcount > 1 else (insert,):
            self._visit()
            for entity in one.virtual_entities():
                self.entity(entity, layer, depth + 1)

    def _curve(self, entity, kind, layer):
        make = _MAKERS.get(kind)
        if make is None or not _is_flat(entity):
            self.drawn.left[kind + " that is tilted" if make else kind] += 1
            return
        try:
            found = make(self, entity)
        except (
            ArithmeticError,
            ValueError,
            TypeError,
            AttributeError,
            IndexError,
        ):  # of an entity that its library cannot compute
            self.drawn.left[kind + " that cannot be computed"] += 1
            return
        if found is None:
            self.drawn.left[kind + " that leaves its height" if kind in _MAKERS else kind] += 1
            return
        for parts in found:
            self.drawn.add(layer, parts)

    def _height(self, *points):
        """Whether points keep one height; counts those that are not at zero."""
        z = [p[2] if len(p) > 2 else 0.0 for p in points]
        if max(z) - min(z) > 1e-6 * max(1.0, *(abs(one) for one in z)):
            return False
        self._raised += abs(z[0]) > 1e-9
        return True

    def at(self, point):
        """(x, y) mm"""
        return point[0] * self.unit, point[1] * self.unit

    def fitted(self, points):
        """Parts of points (x, y, z)."""
        points = [tuple(p) for p in points]
        if not self._height(*points):
            return None
        parts, off = fit.fitted([self.at(p) for p in points], self.tolerance)
        self.drawn.deviation = max(self.drawn.deviation, off)
        return [parts]

    def line(self, entity):
        a, b = entity.dxf.start, entity.dxf.end
        return [[line(self.at(a), self.at(b))]] if self._height(a, b) else None

    def arc(self, entity):
        """An arc or a circle."""
        ocs = entity.ocs()
        centre = ocs.to_wcs(entity.dxf.center)
        ccw, radius = entity.dxf.extrusion.z > 0, entity.dxf.radius
        turns = (0.0, 0.0) if entity.dxftype() == "CIRCLE" else (entity.dxf.start_angle, entity.dxf.end_angle)
        ends = [
            ocs.to_wcs(
                (
                    entity.dxf.center[0] + radius * math.cos(math.radians(a)),
                    entity.dxf.center[1] + radius * math.sin(math.radians(a)),
                    entity.dxf.center[2],
                )
            )
            for a in turns
        ]
        self._height(centre)
        if radius <= 0.0:
            return []
        full = abs((turns[1] - turns[0]) % 360.0) < 1e-9
        return [[arc(self.at(ends[0]), self.at(ends[0] if full else ends[1]), self.at(centre), ccw)]]

    def polyline(self, entity):
        """LWPOLYLINE and 2D or 3D POLYLINE: bulges are arcs."""
        if entity.dxftype() == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
            return None
        found = []
        self._wide += _prepared(entity, self.unit)
        for part in entity.virtual_entities():
            made = (self.line if part.dxftype() == "LINE" else self.arc)(part)
            if made is None:
                return None
            found += [p for parts in made for p in parts]
        return [_in_order(found)]

    def ellipse(self, entity):
        centre, axis = entity.dxf.center, entity.dxf.major_axis
        check_near(entity.dxf.layer, [self.at(centre + axis), self.at(centre - axis)])
        points = list(entity.flattening(self._sag(), segments=16))
        if entity.dxf.ratio > 0.9999999:
            return self._circular(entity, points)
        return self.fitted(points)

    def _circular(self, entity, points):
        """An ellipse that is a circle."""
        if not self._height(*points):
            return None
        ccw = entity.dxf.extrusion.z > 0
        return [
            [
                arc(
                    self.at(points[0]),
                    self.at(points[0] if (points[0] - points[-1]).magnitude < 1e-9 else points[-1]),
                    self.at(entity.dxf.center),
                    ccw,
                )
            ]
        ]

    def spline(self, entity):
        check_near(entity.dxf.layer, [self.at(point) for point in (*entity.control_points, *entity.fit_points)])
        points = list(entity.construction_tool().flattening(self._sag(), segments=8))
        if entity.closed and math.dist(points[0], points[-1]) * self.unit > self.tolerance:
            self.drawn.words.append("a spline that its drawing calls closed has ends apart; a line closes it")
            points.append(points[0])
        return self.fitted(points)

    def _sag(self):
        """Of the chords between points of a curve, drawing units."""
        return 0.1 * self.tolerance / self.unit

    def _outlines(self, entity, layer):
        """A text as the outlines of its letters."""
        try:
            from ezdxf.addons import text2path

            paths = (
                text2path.make_paths_from_entity(entity)
                if entity.dxftype() == "TEXT"
                else [path for part in _lines_of(entity) for path in text2path.make_paths_from_entity(part)]
            )
        except ImportError:
            raise Unreadable(
                "--text needs the Python package matplotlib, which is not installed",
                "apt-get install python3-matplotlib",
            ) from None
        except Exception:
            self.drawn.left[entity.dxftype()] += 1
            return
        for path in paths:
            for one in path.sub_paths() if path.has_sub_paths else (path,):
                points = list(one.flattening(self._sag()))
                if len(points) > 2:
                    for parts in self.fitted(points + points[:1]) or ():
                        self.drawn.add(layer, parts)


def _prepared(entity, unit):
    """Takes out of a polyline what is not drawn: arcs flatter than FLAT_MM, and the frame of a fitted curve.  Whether
    it is drawn with a width."""
    if entity.dxftype() == "LWPOLYLINE":
        rows = entity.get_points("xyseb")
        after = rows[1:] + rows[:1]
        entity.set_points(
            [(*a[:4], _bulge(a[4], math.dist(a[:2], b[:2]) * unit)) for a, b in zip(rows, after)], "xyseb"
        )
        return entity.dxf.get("const_width", 0.0) > 0.0 or any(row[2] > 0.0 or row[3] > 0.0 for row in rows)
    if entity.dxf.flags & SPLINE_FIT:
        entity.vertices[:] = [vertex for vertex in entity.vertices if not vertex.dxf.flags & FRAME]
    rows = entity.vertices
    for a, b in zip(rows, rows[1:] + rows[:1]):
        a.dxf.bulge = _bulge(a.dxf.get("bulge", 0.0), a.dxf.location.distance(b.dxf.location) * unit)
    widths = [one.dxf.get(f"{place}_width", 0.0) for one in rows for place in ("start", "end")]
    widths += [entity.dxf.get(f"default_{place}_width", 0.0) for place in ("start", "end")]
    return any(width > 0.0 for width in widths)


def _bulge(bulge, chord):
    """The bulge of an element with a chord (mm)."""
    return bulge if 0.5 * abs(bulge) * chord > FLAT_MM else 0.0


def _lines_of(mtext):
    """The lines of an MTEXT as texts."""
    from ezdxf.addons import MTextExplode

    layout = mtext.doc.blocks.new_anonymous_block()
    with MTextExplode(layout) as explode:
        explode.explode(mtext, destroy=False)
    return [entity for entity in layout if entity.dxftype() == "TEXT"]


def _is_flat(entity):
    """Whether what is drawn lies parallel to the plane."""
    extrusion = entity.dxf.get("extrusion")
    return extrusion is None or abs(extrusion.normalize().z) > 1.0 - FLAT


def _in_order(parts):
    """Parts of a polyline, each from the end of the one before: arcs of a negative bulge come the other way round."""
    found: list = []
    for k, part in enumerate(parts):
        end = found[-1].end if found else None
        if end is None and len(parts) > 1:
            after = parts[1]
            gaps = [min(math.dist(tip, p) for p in (after.start, after.end)) for tip in (part.end, part.start)]
            part = turned(part) if gaps[1] < gaps[0] - 1e-9 else part
        elif end is not None and math.dist(part.end, end) < math.dist(part.start, end) - 1e-9:
            part = turned(part)
        found.append(part)
    return found


_MAKERS = {
    "LINE": _Reader.line,
    "ARC": _Reader.arc,
    "CIRCLE": _Reader.arc,
    "LWPOLYLINE": _Reader.polyline,
    "POLYLINE": _Reader.polyline,
    "ELLIPSE": _Reader.ellipse,
    "SPLINE": _Reader.spline,
    "HELIX": _Reader.spline,
}
