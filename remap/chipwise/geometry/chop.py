"""Chopping a slug: straight kerfs that divide waste into pieces below a given size, before the contour frees it.

Called by cycles/hole.py: the lines of a circular hole; and by slug.py, which has those of any other shape: the size of a
piece and the order of the lines.  Pure; mm.

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
    large comes loose (order_lines).
"""

import math
import random

from chipwise.geometry import regions

# The promise is kept with this to spare: what the circle's polygon, rounded words and the machine's own following
# may add to a piece. mm
PIECE_MARGIN = 0.01

# How far a circle's polygon may reach beyond it. mm, well inside PIECE_MARGIN
SAGITTA = 0.002

# The patent's n is cut back to this, unless more is needed before kerfs overlap: it bounds the preview's time.
MAX_PARTS = 200

# A path shorter than this is no line. mm
MIN_LINE = 1e-3

# Lengths closer than this are equal. mm, rounding only
EQUAL = 1e-9


def enclosing_circle(points):
    """Smallest circle around points [(x, y)], mm -> (x, y, diameter).  Welzl's algorithm, iterative, exact.

    The order of the points is shuffled with a fixed seed: expected linear time, same answer every time.
    """
    points = list(dict.fromkeys((float(x), float(y)) for x, y in points))
    if not points:
        return 0.0, 0.0, 0.0
    random.Random(1988).shuffle(points)
    circle = (*points[0], 0.0)
    for i, p in enumerate(points):
        if _inside(circle, p):
            continue
        circle = (*p, 0.0)
        for j, q in enumerate(points[:i]):
            if _inside(circle, q):
                continue
            circle = _circle_of_two(p, q)
            for s in points[:j]:
                if not _inside(circle, s):
                    circle = _circle_of_three(p, q, s)
    return circle[0], circle[1], 2 * circle[2]


def _inside(circle, point):
    """Whether a point lies in (x, y, radius), with room for rounding only."""
    return math.hypot(point[0] - circle[0], point[1] - circle[1]) <= circle[2] * (1 + 1e-12) + 1e-12


def _circle_of_two(p, q):
    """The circle with pq as diameter, (x, y, radius)."""
    return (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, math.hypot(p[0] - q[0], p[1] - q[1]) / 2


def _circle_of_three(p, q, s):
    """The circle through three points, (x, y, radius); of points in line the one around all three."""
    bx, by, cx, cy = q[0] - p[0], q[1] - p[1], s[0] - p[0], s[1] - p[1]
    twice_area = 2 * (bx * cy - by * cx)
    if abs(twice_area) < 1e-14 * (abs(bx) + abs(by)) * (abs(cx) + abs(cy)):
        return max((_circle_of_two(a, b) for a, b in ((p, q), (p, s), (q, s))), key=lambda c: c[2])
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    ux, uy = (cy * b2 - by * c2) / twice_area, (bx * c2 - cx * b2) / twice_area
    return p[0] + ux, p[1] + uy, math.hypot(ux, uy)


def piece_size(outline):
    """Diameter (mm) of the smallest circle a piece fits into."""
    return enclosing_circle(outline)[2]


def largest_piece(region, segments, tool_radius):
    """Size (mm) of the largest piece that kerfs leave of a region; 0.0 where they leave nothing."""
    largest = 0.0
    outlines = [(_diagonal(outline), outline) for outline in regions.pieces(region, segments, tool_radius)]
    for diagonal, outline in sorted(outlines, key=lambda item: -item[0]):
        if diagonal <= largest:     # no circle round a piece is wider than its bounding box's own
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
        half = math.sqrt(max(path_radius ** 2 - offset ** 2, 0.0))
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
    slug = regions.outer_disc(0.0, 0.0, radius - 2 * tool_radius, SAGITTA)
    return largest_piece(slug, flat_segments(disc_lines(0.0, 0.0, radius, tool_radius, parts)), tool_radius)


def all_pieces_fit(region, segments, tool_radius, size):
    """Whether every piece that kerfs leave of a region fits inside a circle of diameter < size (mm)."""
    return all(piece_size(outline) < size for outline in regions.pieces(region, segments, tool_radius, reaching=size))


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

    The quarter is cut off along a line's middle (the axis for even n, the line beside it for odd), so pieces stay whole.
    """
    edge = -radius / parts if parts % 2 else 0.0
    quarter = regions.box(edge, edge, radius, radius)
    slug = regions.outer_disc(0.0, 0.0, radius - 2 * tool_radius, SAGITTA).intersection(quarter)
    lines = [(start, end) for start, end in flat_segments(disc_lines(0.0, 0.0, radius, tool_radius, parts))
             if max(start[0], end[0]) >= edge - EQUAL and max(start[1], end[1]) >= edge - EQUAL]
    return all_pieces_fit(slug, lines, tool_radius, size)


def travel(path, start, end, entry_of, exit_of):
    """Length (mm) of the rapid moves that directed segments need, from start over all of them to end."""
    length, here = 0.0, start
    for segment in path:
        length += math.dist(here, entry_of(segment))
        here = exit_of(segment)
    return length + math.dist(here, end)


def _group_stages(group, downwards):
    """One group as stages: per scan line the ways to cut it, each a tuple of directed segments."""
    stages = []
    for scan_line in (reversed(group) if downwards else group):
        forward = tuple(scan_line)
        backward = tuple((b, a) for a, b in reversed(scan_line))
        stages.append((forward, backward))
    return stages


def _best_chain(stages, start, end, entry_of, exit_of):
    """Cheapest way through stages, by dynamic programming over the way each scan line is cut: (length, path)."""
    best = [(0.0, (), start)]
    for ways in stages:
        reached = []
        for way in ways:
            first = entry_of(way[0])
            inner = sum(math.dist(exit_of(a), entry_of(b)) for a, b in zip(way, way[1:]))
            length, path, _ = min(((cost + math.dist(here, first) + inner, path, here) for cost, path, here in best),
                                  key=lambda item: item[0])
            reached.append((length, path + (way,), exit_of(way[-1])))
        best = reached
    length, path, _ = min(((cost + math.dist(here, end), path, here) for cost, path, here in best),
                          key=lambda item: item[0])
    return length, [segment for way in path for segment in way]


def order_lines(groups, start, end, entry_of=lambda s: s[0], exit_of=lambda s: s[1]):
    """Directed segments in the order of shortest travel that frees no large piece on the way.

    groups    (parallel to X, parallel to Y), each a list of scan lines in rising order
    start     where the tool comes from, end: where it goes afterwards, (x, y) mm
    entry_of, exit_of   where a directed segment is entered from above and left (mm)

    While the first group is cut, all strips stay joined to the stock at their ends.  The second group frees a column of
    cells with each scan line; taken in rising or falling order, a column is one cell wide, never two.  So the second
    group must be monotone; the first is too, because no other order of parallel lines is shorter.  What is left open
    is which group comes first, each group's sense and each line's sense: at most 8 chains, each solved exactly.
    """
    groups = [group for group in groups if group]
    if not groups:
        return []
    sequences = [groups] if len(groups) == 1 else [groups, groups[::-1]]
    candidates = []
    for sequence in sequences:
        for senses in range(2 ** len(sequence)):
            stages = [stage for i, group in enumerate(sequence) for stage in _group_stages(group, senses >> i & 1)]
            candidates.append(_best_chain(stages, start, end, entry_of, exit_of))
    return min(candidates, key=lambda item: round(item[0], 6))[1]
