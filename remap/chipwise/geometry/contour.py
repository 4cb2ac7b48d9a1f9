"""The finish shape: building, cleaning and refusing contours.

Called by the cycles (through glue that reads a contour sub) and by tests.  A contour is
one connected run of lines and arcs, open or closed, that neither crosses nor touches
itself.  What cannot be one is refused with a ContourError that names both elements by
their source lines.
"""
from dataclasses import dataclass

import numpy as np

from . import arcs, elements, search
from .elements import Elements
from .intersect import meetings
from .tolerances import (ARC_RADII_MM, ARC_RADII_SHARE, CONNECT_MM, FULL_CIRCLE_MM, NODE_MM,
                         SELF_LOOP_MM, SHORT_MM)


@dataclass(frozen=True)
class LineElement:
    """A straight element of the finish shape: points (x, y) mm, source line number."""
    start: tuple
    end: tuple
    line: int


@dataclass(frozen=True)
class ArcElement:
    """An arc of the finish shape; start == end is a full circle."""
    start: tuple
    end: tuple
    centre: tuple
    ccw: bool
    line: int


@dataclass(frozen=True)
class Contour:
    """elements: n lines and arcs, end to start; closed: the last end is the first start;
    line (n,) int source line of each element; length (n,) mm."""
    elements: Elements
    closed: bool
    line: np.ndarray
    length: np.ndarray


class ContourError(ValueError):
    """A shape that is no contour.

    kind: "empty", "not finite", "impossible arc", "not connected" or "crosses itself";
    lines: source line numbers of the two elements concerned; point (x, y) mm or None.
    """

    def __init__(self, kind, lines, text, point=None):
        super().__init__(text)
        self.kind, self.lines, self.point = kind, tuple(int(k) for k in lines), point


def make_contour(parts):
    """Contour of a list of LineElement and ArcElement, or a ContourError."""
    parts = list(parts)
    _refuse_not_finite(parts)
    parts = _without_short(parts)
    if not parts:
        raise ContourError("empty", (), "the contour holds no element; use at least one G1, G2 "
                           "or G3 in XY")
    closed = _refuse_gaps(parts)
    parts = _connected(parts, closed)
    rows, line = _arc_rows(parts)
    e = _elements(rows)
    contour = Contour(e, closed, np.array(line), elements.lengths(e))
    refuse_crossings(contour)
    return contour


def reverse(contour):
    """The contour travelled the other way."""
    return Contour(elements.reverse(contour.elements), contour.closed, contour.line[::-1],
                   contour.length[::-1])


def _is_arc(part):
    return isinstance(part, ArcElement)


def _refuse_not_finite(parts):
    """NaN or infinity in any coordinate."""
    for before, part in zip([None] + parts, parts):
        values = (*part.start, *part.end, *(part.centre if _is_arc(part) else ()))
        if not np.all(np.isfinite(np.asarray(values, dtype=float))):
            lines = (before.line if before else part.line, part.line)
            raise ContourError("not finite", lines, f"the element of line {part.line}, after "
                               f"line {lines[0]}, has a coordinate that is not a finite number; "
                               "give every coordinate a value")


def _distance(a, b):
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def _without_short(parts):
    """Parts without lines and open arcs too short to have a direction."""
    return [p for p in parts if _is_arc(p) and _distance(p.start, p.centre) > SHORT_MM
            or _distance(p.start, p.end) > SHORT_MM]


def _refuse_gaps(parts):
    """Neighbours that do not meet; returns whether the run is closed."""
    for before, part in zip(parts, parts[1:]):
        gap = _distance(before.end, part.start)
        if gap > CONNECT_MM:
            raise ContourError("not connected", (before.line, part.line), "the contour is not "
                               f"connected: line {before.line} ends {gap:.4f} mm from where line "
                               f"{part.line} starts; a gap may be {CONNECT_MM} mm", part.start)
    only_line = len(parts) == 1 and not _is_arc(parts[0])
    return _distance(parts[-1].end, parts[0].start) <= CONNECT_MM and not only_line \
        and (len(parts) > 1 or _full_circle(parts[0]))


def _full_circle(part):
    return _is_arc(part) and _distance(part.start, part.end) <= FULL_CIRCLE_MM


def _connected(parts, closed):
    """Parts as dicts, every start moved onto the end before it."""
    rows = [dict(start=np.array(p.start, float), end=np.array(p.end, float), line=p.line,
                 centre=np.array(p.centre, float) if _is_arc(p) else None,
                 ccw=_is_arc(p) and p.ccw, full=_full_circle(p)) for p in parts]
    for before, row in zip(rows, rows[1:]):
        row["start"] = before["end"]
    if closed:
        rows[-1]["end"] = rows[0]["start"]
    for row in rows:
        if row["full"]:
            row["end"] = row["start"]
    return rows


def _arc_rows(rows):
    """Rows (start, end, centre, radius, sweep) of every element and their source lines.

    An arc whose radii at start and end differ is moved onto both of its ends: its centre
    along the chord where it is at most a half circle, else in two halves.
    """
    result, lines, previous = [], [], None
    for row in rows:
        made = [(row["start"], row["end"], (0.0, 0.0), 0.0, 0.0)]
        if row["centre"] is not None:
            _refuse_impossible(row, previous or row)
            made = _arc(row)
        result += made
        lines += [row["line"]] * len(made)
        previous = row
    return result, lines


def _refuse_impossible(row, previous):
    """Arcs whose two radii differ by more than LinuxCNC allows."""
    first, last = _distance(row["start"], row["centre"]), _distance(row["end"], row["centre"])
    differ = abs(first - last)
    if min(first, last) <= SHORT_MM or (differ > ARC_RADII_MM
                                        and differ > ARC_RADII_SHARE * max(first, last)):
        raise ContourError("impossible arc", (previous["line"], row["line"]), "the arc of line "
                           f"{row['line']}, after line {previous['line']}, has radius "
                           f"{first:.4f} mm at its start and {last:.4f} mm at its end; they may "
                           f"differ by {ARC_RADII_MM:.4f} mm", tuple(row["start"]))


def _arc(row):
    """One row of an arc, or two where its ends do not fit one circle exactly."""
    start, end, centre = row["start"], row["end"], row["centre"]
    first, last = _distance(start, centre), _distance(end, centre)
    radius = 0.5 * (first + last)
    sweep = float(arcs.sweep_from_ends(start[None], end[None], centre[None],
                                       np.array([row["ccw"]]), np.array([row["full"]]))[0])
    if abs(sweep) <= np.pi * (1.0 + 1e-9):
        return [_fitted(start, end, centre, radius, sweep)]
    if abs(first - last) <= NODE_MM:
        return [(start, end, centre, radius, sweep)]
    angle = np.arctan2(start[1] - centre[1], start[0] - centre[0]) + 0.5 * sweep
    half = centre + radius * np.array((np.cos(angle), np.sin(angle)))
    return [_fitted(start, half, centre, radius, 0.5 * sweep),
            _fitted(half, end, centre, radius, 0.5 * sweep)]


def _fitted(start, end, centre, radius, sweep):
    """Arc of at most a half circle through both ends exactly, near the given centre."""
    chord = end - start
    length = float(np.hypot(*chord))
    along = chord / length
    middle = 0.5 * (start + end)
    left = np.array((-along[1], along[0]))
    height = np.sqrt(max(radius * radius - 0.25 * length * length, 0.0))
    side = 1.0 if float(np.dot(centre - middle, left)) >= 0.0 else -1.0
    centre = middle + side * height * left
    radius = float(np.hypot(0.5 * length, height))
    turned = 2.0 * np.arctan2(0.5 * length, height)
    if side * sweep < 0.0:                       # a hair more than a half circle
        turned = 2.0 * np.pi - turned
    return (start, end, centre, radius, float(np.copysign(turned, sweep)))


def _elements(rows):
    start, end, centre, radius, sweep = (np.array(part, dtype=float) for part in zip(*rows))
    v = start - centre
    angle = np.where(sweep != 0.0, np.arctan2(v[:, 1], v[:, 0]), 0.0)
    return Elements(start, end, centre, radius, angle, sweep)


def _apart_along(contour, met):
    """Length of contour (k,) mm between the two places of each meeting."""
    upto = np.cumsum(contour.length) - contour.length
    s_a = upto[met.a] + met.t_a * contour.length[met.a]
    s_b = upto[met.b] + met.t_b * contour.length[met.b]
    apart = np.abs(s_a - s_b)
    return np.minimum(apart, np.sum(contour.length) - apart) if contour.closed else apart


def refuse_crossings(contour):
    """A contour that crosses or touches itself."""
    e = contour.elements
    tree = search.build(*elements.boxes(e))
    met = meetings(e, contour.length, *search.pairs(tree, NODE_MM))
    bad = np.flatnonzero(_apart_along(contour, met) > SELF_LOOP_MM)
    if len(bad):
        first = bad[np.argmin(np.minimum(met.a, met.b)[bad])]
        refuse_meeting(contour.line[met.a[first]], contour.line[met.b[first]], met.point[first])


def refuse_meeting(line_a, line_b, point):
    """Raise the error of two elements that meet where they must not."""
    line_a, line_b = sorted((int(line_a), int(line_b)))
    raise ContourError("crosses itself", (line_a, line_b), "the contour crosses or touches "
                       f"itself: line {line_a} meets line {line_b} at X{point[0]:.4f} "
                       f"Y{point[1]:.4f}; draw them apart", tuple(point))
