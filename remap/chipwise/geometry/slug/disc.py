# SPDX-License-Identifier: GPL-2.0-or-later
"""Chopping a slug: straight kerfs that divide waste into pieces below a given size, before the contour frees it.

Called by cycles/hole.py: the lines of a circular hole.  slug.py has those of any other shape, line_order.py their
order.  Pure; mm.

Source: JP H05-7134 B2 (1988), description of fig. 4 and 5.  With its symbols: d the diameter of the hole, H the
reference size, n = floor((d + H) / H) parts along X and along Y, n - 1 lines parallel to each axis.

Where this departs from the patent:
 1. n is where the search starts, not where it ends.  A piece is a cell of about d/n - kerf each way, and fits a
    circle of diameter H only if its DIAGONAL does, so a thin cutter breaks the patent's promise, as do some pieces
    at the rim.  The pieces are computed from the kerfs and n is raised until each fits (choose_parts).
 2. A line ends where the tool touches the wall from inside, that is on the circle of radius R - r.  The patent's
    drawing shortens it by r along the line, which would gouge the wall everywhere but on a diameter.
 3. Lines outside that circle do not exist, and where no slug is left by the tool (d <= 4 r) there is nothing to cut.
 4. The order of the lines is chosen for the shortest travel, among the orders in which no piece that is still too
    large comes loose (line_order.py).
"""

import math

from chipwise.geometry.base import polygons
from chipwise.geometry.base.enclosing_circle import piece_size

# The promise is kept with this to spare: what the circle's polygon, rounded words and the machine's own following
# may add to a piece. mm
PIECE_MARGIN = 0.01

# How far a circle's polygon may reach beyond it. mm, well inside PIECE_MARGIN
SAGITTA = 0.002

# The patent's n is cut back to this, unless more is needed before kerfs overlap: it bounds the preview's time.
MAX_PARTS = 200

# Shorter paths are ignored. mm
MIN_LINE = 1e-3

# Lengths closer than this are equal. mm, rounding only
EQUAL = 1e-9


def largest_piece(region, segments, tool_radius):
    """Size (mm) of the largest piece that kerfs leave of a region; 0.0 where they leave nothing."""
    largest = 0.0
    outlines = [(_diagonal(outline), outline) for outline in polygons.pieces(region, segments, tool_radius)]
    for diagonal, outline in sorted(outlines, key=lambda item: -item[0]):
        if diagonal <= largest:  # no circle round a piece is wider than its bounding box's own
            break
        largest = max(largest, piece_size(outline))
    return largest


def _diagonal(outline):
    """Diagonal (mm) of the bounding box of points [(x, y)]."""
    x, y = zip(*outline)
    return math.hypot(max(x) - min(x), max(y) - min(y))


def patent_parts(diameter, chop_size):
    """n of the patent: parts along each axis; 1 means not to chop.  Both mm."""
    if chop_size <= 0 or diameter < chop_size:
        return 1
    return math.floor((diameter + chop_size) / chop_size)


def disc_scan_lines(cx, cy, path_radius, extent, parts, axis):
    """The lines parallel to one axis, in rising order.

    path_radius  R - r: the tool's centre stays inside this circle (mm)
    extent       R, half the width that is divided into equal parts (mm)
    axis         0: lines parallel to X; 1: parallel to Y
    Returns [[((x0, y0), (x1, y1))], ...]: scan lines, each a list of segments; here one each.
    """
    scan_lines = []
    for k in range(1, parts):
        offset = extent * (2 * k / parts - 1)
        half = math.sqrt(max(path_radius**2 - offset**2, 0.0))
        if 2 * half > MIN_LINE:
            if axis == 0:
                scan_lines.append([((cx - half, cy + offset), (cx + half, cy + offset))])
            else:
                scan_lines.append([((cx + offset, cy - half), (cx + offset, cy + half))])
    return scan_lines


def disc_lines(cx, cy, radius, tool_radius, parts):
    """Both groups of scan lines of a hole divided into `parts`: (parallel to X, parallel to Y)."""
    return tuple(disc_scan_lines(cx, cy, radius - tool_radius, radius, parts, axis) for axis in (0, 1))


def flat_segments(groups):
    """All segments of groups of scan lines, in the patent's order: along X bottom up, then along Y left to right."""
    return [segment for group in groups for scan_line in group for segment in scan_line]


def disc_piece(diameter, tool_radius, parts):
    """Size (mm) of the largest piece of a circular hole's slug divided into `parts` (1: the slug itself)."""
    radius = diameter / 2
    slug = polygons.outer_disc(0.0, 0.0, radius - 2 * tool_radius, SAGITTA)
    return largest_piece(slug, flat_segments(disc_lines(0.0, 0.0, radius, tool_radius, parts)), tool_radius)


def all_pieces_fit(region, segments, tool_radius, size):
    """Whether every piece that kerfs leave of a region fits inside a circle of diameter < size (mm)."""
    return all(piece_size(outline) < size for outline in polygons.pieces(region, segments, tool_radius, reaching=size))


def choose_parts(diameter, tool_radius, chop_size):
    """How many parts a circular hole must be divided into along each axis.

    diameter of the hole, tool_radius, chop_size: mm.  Returns n >= 1; 1: no lines.
    Starts with the patent's n and goes up until every loose piece fits a circle of diameter below chop_size.  It ends:
    from n = R / r on, the kerfs overlap and nothing is left.
    """
    parts = patent_parts(diameter, chop_size)
    radius = diameter / 2
    if parts == 1 or radius <= 2 * tool_radius:
        return 1
    size = chop_size - PIECE_MARGIN
    cleared = math.ceil(radius / tool_radius) + 1
    parts = min(max(parts, _parts_for_full_cells(diameter, tool_radius, size)), max(cleared, MAX_PARTS))
    while parts < cleared and not _disc_pieces_fit(radius, tool_radius, size, parts):
        parts += 1
    return parts


def _parts_for_full_cells(diameter, tool_radius, size):
    """Smallest n whose full cells, squares of d/n - 2r, have a diagonal below size (mm).

    A bound for the search: from n = 4 on, such a cell lies at the hole's centre.
    """
    if size <= 0:
        return MAX_PARTS
    n = math.floor(diameter / (size / math.sqrt(2) + 2 * tool_radius)) + 1
    return n if n > 4 else 1


def _disc_pieces_fit(radius, tool_radius, size, parts):
    """all_pieces_fit for a hole (mm), looking at a quarter: the lines are symmetric about both axes.

    The quarter is cut off along a line's middle (the axis for even n, the line beside it for odd), so pieces stay
    whole.
    """
    edge = -radius / parts if parts % 2 else 0.0
    quarter = polygons.box(edge, edge, radius, radius)
    slug = polygons.outer_disc(0.0, 0.0, radius - 2 * tool_radius, SAGITTA).intersection(quarter)
    lines = [
        (start, end)
        for start, end in flat_segments(disc_lines(0.0, 0.0, radius, tool_radius, parts))
        if max(start[0], end[0]) >= edge - EQUAL and max(start[1], end[1]) >= edge - EQUAL
    ]
    return all_pieces_fit(slug, lines, tool_radius, size)
