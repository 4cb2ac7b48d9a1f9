# SPDX-License-Identifier: GPL-2.0-or-later
"""A drawing -> the layers that can be cut.  Called by cli/import_drawing.py and filter/model.py.

found = imported("part.dxf", 0.01, 1.0)
found.layers        [Layer, ..]; found.words: sentences for the user; found.doubtful: whether something was left out
"""

import os
from dataclasses import dataclass, field

from chipwise.errors import braceless
from chipwise.host.files import TooLong, open_regular
from chipwise.geometry.base import elements
from chipwise.geometry.base import loops as chain_loops
from chipwise.geometry.base.contour import ContourError, backwards, make_contour
from chipwise.geometry.offset.kernel import make_pocket
from chipwise.geometry.pocket import nesting
from chipwise.geometry.pocket.machinable import machinable_regions
from chipwise.importing import dxf, join, svg
from chipwise.importing.drawn import Unreadable

MAX_BYTES = 32 << 20
READERS = {".dxf": dxf.read, ".svg": svg.read}
WITHIN_MM = 1e-3
SHOWN = 3  # places that a sentence names


@dataclass
class Layer:
    """name; pockets: [(loop, [island, ..]), ..] as chains of parts, boundaries counter-clockwise, islands clockwise;
    areas: mm2 of each pocket less its islands; open: chains."""

    name: str
    pockets: list = field(default_factory=list)
    areas: list = field(default_factory=list)
    open: list = field(default_factory=list)

    @property
    def loops(self):
        return [loop for boundary, islands in self.pockets for loop in (boundary, *islands)]


@dataclass
class Imported:
    """layers; words: sentences; doubtful: something of the drawing cannot be cut as it is; figures of json."""

    layers: list = field(default_factory=list)
    words: list = field(default_factory=list)
    doubtful: bool = False
    left: dict = field(default_factory=dict)
    gaps: int = 0
    widest: float = 0.0


def imported(path, tolerance, scale, text=False, layer=None):
    """Imported.  Raises Unreadable."""
    kind = os.path.splitext(path)[1].lower()
    if kind not in READERS:
        raise Unreadable(
            f"{braceless(kind or 'a file without an ending')} is not a kind of drawing that can be read",
            "save it as .dxf or .svg",
        )
    try:
        open_regular(path, MAX_BYTES).close()
    except TooLong as error:
        raise Unreadable(
            braceless(f"{os.path.basename(path)}: it has {error.found / 1e6:.0f} MB, more than {error.most / 1e6:.0f}"),
            "export what is to be cut, a layer or a part of it",
        ) from error
    except OSError as error:
        raise Unreadable(
            braceless(f"{os.path.basename(path)}: {error.strerror}"), "name a DXF or SVG file that can be read"
        ) from error
    drawn = READERS[kind](path, tolerance, scale, text, layer)
    found = Imported(words=list(drawn.words), left=dict(drawn.left))
    doubled = 0
    for name, curves in drawn.curves.items():
        one = join.joined(curves, tolerance)
        doubled += one.doubled
        found.gaps, found.widest = found.gaps + one.gaps, max(found.widest, one.widest)
        made = _layer(name, one, tolerance, found)
        if made.pockets or made.open:
            found.layers.append(made)
    if not found.layers and found.doubtful:
        raise Unreadable(
            f"nothing of the drawing can be cut: {braceless(found.words[-1])}", "correct the outline in the drawing"
        )
    _say(found, drawn, doubled, tolerance)
    if not found.layers:
        raise Unreadable(
            "the drawing holds no line, arc or curve that can be cut"
            + (f"; {braceless(_counted(found.left))} are left out" if found.left else ""),
            "draw the outline, or explode what holds it",
        )
    return found


def _say(found, drawn, doubled, tolerance):
    """Sentences about joining, fitting and leaving out."""
    if found.gaps:
        found.words.append(f"{found.gaps} gaps up to {found.widest:.4f} mm are joined (tolerance {tolerance:g} mm)")
    if doubled:
        found.words.append(f"{doubled} lines or arcs that are drawn twice count once")
    if drawn.deviation:
        found.words.append(
            f"curves are drawn with arcs within {max(drawn.deviation, 1e-4):.4f} mm (tolerance {tolerance:g} mm)"
        )
    if found.left:
        found.words.append(
            "left out: "
            + _counted(found.left)
            + ("; --text makes outlines of texts" if {"TEXT", "MTEXT"} & set(found.left) else "")
        )


def _counted(left):
    """What was left out, as text."""
    return ", ".join(f"{count} {kind}" for kind, count in sorted(left.items()))


def _layer(name, joined, tolerance, found):
    """Layer of a Joined; what cannot be a loop is said."""
    layer, contours = Layer(name), []
    for chain in joined.closed:
        try:
            contours += [(make_contour(list(loop), tolerance), loop) for loop in chain_loops.split(chain, tolerance)[0]]
        except ContourError as error:
            found.doubtful = True
            at = error.point or chain[0].start
            found.words.append(
                f"layer {name}: a closed line is left out, it crosses or touches itself, or has no inside, at "
                f"X{at[0]:.3f} Y{at[1]:.3f}"
            )
    if contours:
        _nest(layer, contours, tolerance, found)
    layer.open = joined.open
    if joined.open:
        found.doubtful = True
        ends = ", ".join(
            f"X{c[0].start[0]:.3f} Y{c[0].start[1]:.3f} to X{c[-1].end[0]:.3f} Y{c[-1].end[1]:.3f}"
            for c in joined.open[:SHOWN]
        )
        found.words.append(
            f"layer {name}: {len(joined.open)} chains are open: {ends}{' ..' if joined.open[SHOWN:] else ''}"
        )
    if joined.branches:
        places = ", ".join(f"X{x:.3f} Y{y:.3f}" for x, y in joined.branches[:SHOWN])
        found.words.append(
            f"layer {name}: more than two ends meet at {places}{' ..' if joined.branches[SHOWN:] else ''}; which "
            f"belong together is not clear"
        )
    return layer


def _nest(layer, contours, tolerance, found):
    """The closed loops of a layer, sorted into pockets."""
    nested = nesting.sort([contour for contour, _ in contours], tolerance)
    parts = {id(contour): loop for contour, loop in contours}
    for boundary, islands in nested.pockets:
        area, meeting = _free_area(boundary, islands)
        if meeting and not any(boundary is crossed for _, crossed in nested.crossing):
            found.doubtful = True
            (x, y) = boundary.elements.start[0]
            found.words.append(
                f"layer {layer.name}: islands of the loop at X{x:.3f} Y{y:.3f} cross or touch one another or it, and "
                f"stay as one"
            )
        layer.pockets.append(
            (_directed(parts[id(boundary)], boundary, True), [_directed(parts[id(i)], i, False) for i in islands])
        )
        layer.areas.append(area)
    if nested.doubled:
        found.words.append(f"layer {layer.name}: {len(nested.doubled)} loops that are drawn twice count once")
    for island, boundary in nested.crossing[:SHOWN]:
        (x, y), (bx, by) = island.elements.start[0], boundary.elements.start[0]
        found.doubtful = True
        found.words.append(
            f"layer {layer.name}: the loop at X{x:.3f} Y{y:.3f} crosses the one at X{bx:.3f} Y{by:.3f} and counts as "
            f"an island of it"
        )


def _free_area(boundary, islands):
    """(mm2 of a boundary without its islands, whether any of the loops meet): by what is WITHIN_MM within it where they
    do."""
    pocket = make_pocket(boundary, islands)
    if not pocket.meeting:
        return abs(elements.area(boundary.elements)) - sum(
            abs(elements.area(island.elements)) for island in islands
        ), False
    regions = machinable_regions(pocket, WITHIN_MM)
    return sum(
        region.area + WITHIN_MM * sum(float(elements.lengths(c).sum()) for c in region.contours) for region in regions
    ), True


def _directed(loop, contour, ccw):
    return list(loop if (elements.area(contour.elements) > 0.0) == ccw else backwards(loop))


def extent(layers):
    """(min x, min y, max x, max y) of layers, by ends and arcs' extremes, mm."""
    boxes = [
        elements.boxes(make_contour([part]).elements) if hasattr(part, "centre") else None
        for layer in layers
        for chain in (*layer.loops, *layer.open)
        for part in chain
    ]
    ends = [
        p for layer in layers for chain in (*layer.loops, *layer.open) for part in chain for p in (part.start, part.end)
    ]
    ends += [tuple(corner) for box in boxes if box is not None for corner in (box[0].min(axis=0), box[1].max(axis=0))]
    xs, ys = zip(*ends)
    return min(xs), min(ys), max(xs), max(ys)
