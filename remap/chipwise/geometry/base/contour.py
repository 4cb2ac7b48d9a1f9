# SPDX-License-Identifier: GPL-2.0-or-later
"""The finish shape: building, cleaning and refusing contours.

Called by the cycles (through glue that reads a contour sub) and by tests.  A contour is
one connected run of lines and arcs, open or closed, that neither crosses nor touches
itself.  What cannot be one is refused with a ContourError that names both elements by
their source lines.
"""

from dataclasses import dataclass, replace

import numpy as np

from chipwise.errors import fill

from chipwise.geometry.base import arcs, elements, search, spikes
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.intersect import meetings
from chipwise.geometry.base.lines import dot
from chipwise.geometry.base.tolerances import (
    ARC_RADII_MM,
    ARC_RADII_SHARE,
    CONNECT_MM,
    FULL_CIRCLE_MM,
    HALF_TURN_RAD,
    NEARLY_CLOSED_MM,
    NODE_MM,
    SELF_LOOP_MM,
    SHORT_MM,
)


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


def turned(part):
    """A LineElement or ArcElement in the other direction."""
    if isinstance(part, ArcElement):
        return ArcElement(part.end, part.start, part.centre, not part.ccw, part.line)
    return LineElement(part.end, part.start, part.line)


def backwards(parts):
    """A chain of parts in the other direction, as a tuple."""
    return tuple(turned(part) for part in reversed(parts))


@dataclass(frozen=True, eq=False)
class Contour:
    """elements: n lines and arcs, end to start; closed: the last end is the first start;
    line (n,) int source line of each element; length (n,) mm; gap: the widest gap that was
    closed, mm, and gap_line: the source line of the element that ends before it."""

    elements: Elements
    closed: bool
    line: np.ndarray
    length: np.ndarray
    gap: float = 0.0
    gap_line: int = 0


class ContourError(ValueError):
    """A shape that cannot be a contour.

    kind: "empty", "not finite", "impossible arc", "not connected", "no inside", "crosses itself" or, in
    a pocket, "misplaced island"; lines: source line numbers of the two elements concerned;
    point (x, y) mm or None; template, lengths: the text with {names} of lengths, mm.
    """

    def __init__(self, kind, lines, template, point=None, **lengths):
        super().__init__(fill(template, lengths, "mm"))
        self.template, self.lengths = template, lengths
        self.kind, self.lines, self.point = kind, tuple(int(k) for k in lines), point


@dataclass(frozen=True, eq=False)
class _Rows:
    """n parts as arrays: start, end, centre (n, 2) mm; arc, ccw (n,) bool; line (n,) int."""

    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    arc: np.ndarray
    ccw: np.ndarray
    line: np.ndarray


def make_contour(parts, close_mm=CONNECT_MM):
    """Contour of a list of LineElement and ArcElement, or a ContourError.

    close_mm  gaps up to this width, between neighbours and between the end and the start, are
              closed by moving the element's start or end; spikes up to this length are dropped
    """
    rows = _rows(parts)
    _refuse_not_finite(rows)
    rows = _without_short(rows)
    if len(rows.line):
        mask, start, end = spikes.without(rows, _lengths(rows), close_mm)
        rows = _pick(replace(rows, start=start, end=end), mask)
    if not len(rows.line):
        raise ContourError("empty", (), "the contour holds no element; use at least one G1, G2 or G3 in XY")
    _refuse_gaps(rows, close_mm)
    closed = _is_closed(rows, close_mm)
    gap, gap_line = _widest_gap(rows, closed)
    rows = _halved(_connected(rows, closed))
    e = _elements(rows)
    contour = Contour(e, closed, rows.line, elements.lengths(e), gap, gap_line)
    if closed and spikes.there_and_back(parts, close_mm):
        raise ContourError(
            "no inside",
            rows.line[[0, -1]],
            f"the loop of lines {rows.line[0]} to {rows.line[-1]} runs there and "
            "back on itself and has no inside; draw its outline",
            tuple(rows.start[0]),
        )
    refuse_crossings(contour)
    return contour


def reverse(contour):
    """The contour travelled the other way."""
    return replace(
        contour, elements=elements.reverse(contour.elements), line=contour.line[::-1], length=contour.length[::-1]
    )


def _rows(parts):
    table = [
        (*p.start, *p.end, *p.centre, True, p.ccw, p.line)
        if isinstance(p, ArcElement)
        else (*p.start, *p.end, 0.0, 0.0, False, False, p.line)
        for p in parts
    ]
    table = np.array(table, dtype=float).reshape(-1, 9)
    return _Rows(
        table[:, 0:2], table[:, 2:4], table[:, 4:6], table[:, 6] > 0.0, table[:, 7] > 0.0, table[:, 8].astype(int)
    )


def _pick(rows, index):
    return _Rows(*(getattr(rows, name)[index] for name in ("start", "end", "centre", "arc", "ccw", "line")))


def _distance(a, b):
    return np.hypot(a[:, 0] - b[:, 0], a[:, 1] - b[:, 1])


def _refuse_not_finite(rows):
    """NaN or infinity in any coordinate."""
    bad = np.flatnonzero(~np.isfinite(np.hstack((rows.start, rows.end, rows.centre))).all(axis=1))
    if len(bad):
        line, before = rows.line[bad[0]], rows.line[max(bad[0] - 1, 0)]
        raise ContourError(
            "not finite",
            (before, line),
            f"the element of line {line}, after line "
            f"{before}, has a coordinate that is not a finite number; give every "
            "coordinate a value",
        )


def _without_short(rows):
    """Rows without lines and arcs too short to have a direction; full circles stay."""
    return _pick(rows, _lengths(rows) > SHORT_MM)


def _lengths(rows):
    """mm; of an arc at least its chord."""
    along = np.where(rows.arc, _distance(rows.start, rows.centre) * np.abs(_sweeps(rows)), 0.0)
    return np.maximum(_distance(rows.start, rows.end), along)


def _refuse_gaps(rows, close_mm):
    """Neighbours that do not meet."""
    gap = _distance(rows.end[:-1], rows.start[1:])
    bad = np.flatnonzero(gap > close_mm)
    if len(bad):
        k = bad[0]
        raise ContourError(
            "not connected",
            rows.line[k : k + 2],
            "the contour is not connected: "
            f"line {rows.line[k]} ends {{gap}} from where line "
            f"{rows.line[k + 1]} starts; a gap may be {{most}}",
            tuple(rows.start[k + 1]),
            gap=gap[k],
            most=close_mm,
        )


def _widest_gap(rows, closed):
    """(mm, source line before it) of the widest gap between neighbours, and of a closed run
    between its end and its start."""
    gap = _distance(rows.end, np.roll(rows.start, -1, axis=0))[: len(rows.line) - (not closed)]
    return (float(gap.max()), int(rows.line[gap.argmax()])) if len(gap) else (0.0, 0)


def refuse_nearly_closed(contour, close_mm):
    """An open contour whose end misses its start by so little that it was meant to be closed."""
    e, (last, first) = contour.elements, contour.line[[-1, 0]]
    gap = float(np.hypot(*(e.end[-1] - e.start[0])))
    if not contour.closed and gap < NEARLY_CLOSED_MM < contour.length.sum() / 2:
        x, y = e.start[0].tolist()
        raise ContourError(
            "not connected",
            (last, first),
            f"the contour is open: line {last} ends "
            f"{{gap}} from where line {first} starts, more than the {{most}} that "
            f"are closed; end line {last} at X{{x}} Y{{y}}",
            (x, y),
            gap=gap,
            most=close_mm,
            x=x,
            y=y,
        )


def _full(rows):
    """Which rows are full circles."""
    return rows.arc & (_distance(rows.start, rows.end) <= FULL_CIRCLE_MM)


def _is_closed(rows, close_mm):
    """Whether the run returns to its start; a single element only as a full circle."""
    near = bool(_distance(rows.end[-1:], rows.start[:1])[0] <= close_mm)
    if len(rows.line) == 1:
        return bool(_full(rows)[0]) or near and bool(abs(_sweeps(rows)[0]) > HALF_TURN_RAD)
    return near


def _connected(rows, closed):
    """Rows with every start moved onto the end before it."""
    start, end = rows.start.copy(), rows.end.copy()
    start[1:] = end[:-1]
    if closed:
        end[-1] = start[0]
    full = _full(rows)
    end[full] = start[full]
    start[1:] = end[:-1]
    rows = _Rows(start, end, rows.centre, rows.arc, rows.ccw, rows.line)
    _refuse_impossible(rows)
    return rows


def _refuse_impossible(rows):
    """Arcs whose two radii differ by more than LinuxCNC allows."""
    first, last = _distance(rows.start, rows.centre), _distance(rows.end, rows.centre)
    differ, large = np.abs(first - last), np.maximum(first, last)
    bad = rows.arc & (
        (np.minimum(first, last) <= SHORT_MM) | (differ > ARC_RADII_MM) & (differ > ARC_RADII_SHARE * large)
    )
    for k in np.flatnonzero(bad)[:1]:
        line, before = rows.line[k], rows.line[max(k - 1, 0)]
        raise ContourError(
            "impossible arc",
            (before, line),
            f"the arc of line {line}, after line "
            f"{before}, has radius {{first}} at its start and {{last}} at its end; "
            f"they may differ by {{most}} or {100.0 * ARC_RADII_SHARE} %",
            tuple(rows.start[k]),
            first=first[k],
            last=last[k],
            most=ARC_RADII_MM,
        )


def _sweeps(rows):
    sweep = arcs.sweep_from_ends(rows.start, rows.end, rows.centre, rows.ccw, _full(rows))
    return np.where(rows.arc, sweep, 0.0)


def _halved(rows):
    """Rows with arcs beyond a half circle cut in two where their ends do not fit one
    circle exactly: only shorter arcs can be moved onto both ends (see _fitted)."""
    first, last = _distance(rows.start, rows.centre), _distance(rows.end, rows.centre)
    sweep = _sweeps(rows)
    cut = rows.arc & (np.abs(sweep) > HALF_TURN_RAD) & (np.abs(first - last) > NODE_MM)
    if not cut.any():
        return rows
    out = rows.start - rows.centre
    angle = np.arctan2(out[:, 1], out[:, 0]) + 0.5 * sweep
    half = rows.centre + np.stack((np.cos(angle), np.sin(angle)), axis=1) * (0.5 * (first + last))[:, None]
    index = np.repeat(np.arange(len(cut)), np.where(cut, 2, 1))
    again = np.concatenate(([False], index[1:] == index[:-1]))
    rows = _pick(rows, index)
    rows.start[again] = half[index[again]]
    rows.end[np.roll(again, -1)] = half[index[again]]
    return rows


def _elements(rows):
    """Elements of rows; arcs up to a half circle moved onto both of their ends."""
    sweep = _sweeps(rows)
    radius = 0.5 * (_distance(rows.start, rows.centre) + _distance(rows.end, rows.centre))
    centre = np.where(rows.arc[:, None], rows.centre, 0.0)
    radius = np.where(rows.arc, radius, 0.0)
    fit = np.flatnonzero(rows.arc & (np.abs(sweep) <= HALF_TURN_RAD))
    centre[fit], radius[fit], sweep[fit] = _fitted(rows.start[fit], rows.end[fit], centre[fit], radius[fit], sweep[fit])
    out = rows.start - centre
    angle = np.where(rows.arc, np.arctan2(out[:, 1], out[:, 0]), 0.0)
    return Elements(rows.start, rows.end, centre, radius, angle, sweep)


def _fitted(start, end, centre, radius, sweep):
    """Centre, radius and sweep of arcs (k,) of at most a half circle that run exactly
    through both ends, nearest to the given centre and radius."""
    chord = end - start
    length = np.hypot(chord[:, 0], chord[:, 1])
    left = np.stack((-chord[:, 1], chord[:, 0]), axis=1) / length[:, None]
    middle = 0.5 * (start + end)
    height = np.sqrt(np.maximum((radius - 0.5 * length) * (radius + 0.5 * length), 0.0))
    side = np.where(dot(centre - middle, left) >= 0.0, 1.0, -1.0)
    turned = 2.0 * np.arctan2(0.5 * length, height)
    turned = np.where(side * sweep < 0.0, 2.0 * np.pi - turned, turned)  # just past a half turn
    return (middle + (side * height)[:, None] * left, np.hypot(0.5 * length, height), np.copysign(turned, sweep))


def _apart_along(contour, met):
    """Length of contour (k,) mm between the two positions of each meeting."""
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
        first = bad[np.lexsort((np.maximum(met.a, met.b)[bad], np.minimum(met.a, met.b)[bad]))[0]]
        a, b = sorted((int(met.a[first]), int(met.b[first])))
        _refuse_overshoot(contour, a, b, met.point[first])
        refuse_meeting(contour.line[a], contour.line[b], met.point[first])


def _refuse_overshoot(contour, a, b, point):
    """Raise the error of an open contour whose last element b runs past the start of element a, the first."""
    e = contour.elements
    if (
        contour.closed
        or a != 0
        or b != len(contour.line) - 1
        or elements.distances(e, np.array([b]), e.start[:1])[0] >= NEARLY_CLOSED_MM
    ):
        return
    first, last = int(contour.line[a]), int(contour.line[b])
    (x, y), (mx, my) = e.start[0].tolist(), point.tolist()
    raise ContourError(
        "crosses itself",
        (first, last),
        f"the contour runs past its start: line {last} meets "
        f"line {first} at X{{mx}} Y{{my}}; end line {last} at X{{x}} Y{{y}}",
        (mx, my),
        x=x,
        y=y,
        mx=mx,
        my=my,
    )


def refuse_meeting(line_a, line_b, point):
    """Raise the error of two elements that meet where they must not."""
    line_a, line_b = sorted((int(line_a), int(line_b)))
    raise ContourError(
        "crosses itself",
        (line_a, line_b),
        f"the contour crosses or touches itself: line {line_a} meets line {line_b} at X{{x}} Y{{y}}; draw them apart",
        tuple(point),
        x=float(point[0]),
        y=float(point[1]),
    )
