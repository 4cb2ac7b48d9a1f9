# SPDX-License-Identifier: GPL-2.0-or-later
"""Independent judge of offset results, for tests and benches only.

Written apart from remap/chipwise/geometry and by another method: brute force over all
elements, arcs by their angle intervals (the kernel uses half planes), completeness by
cutting every parallel curve with every widened element in closed form (the kernel cuts the
raw offset with itself), inside and outside by winding angles.  Nothing is imported from
the kernel; it takes plain tuples
    ("L", x0, y0, x1, y1)   and   ("A", x0, y0, x1, y1, cx, cy, sweep).
"""

import math

import numpy as np

TAU = 2.0 * math.pi


def from_elements(e):
    """Plain tuples of a kernel Elements run."""
    return [
        ("A", *e.start[k], *e.end[k], *e.centre[k], e.sweep[k]) if e.sweep[k] != 0.0 else ("L", *e.start[k], *e.end[k])
        for k in range(len(e.radius))
    ]


def radius_of(el):
    return math.hypot(el[1] - el[5], el[2] - el[6])


def distance(el, p):
    """Exact distance of points p (m, 2) to one element."""
    ends = np.minimum(np.hypot(p[:, 0] - el[1], p[:, 1] - el[2]), np.hypot(p[:, 0] - el[3], p[:, 1] - el[4]))
    if el[0] == "L":
        ux, uy = el[3] - el[1], el[4] - el[2]
        length = math.hypot(ux, uy)
        if length == 0.0:
            return ends
        ux, uy = ux / length, uy / length
        along = (p[:, 0] - el[1]) * ux + (p[:, 1] - el[2]) * uy
        off = np.abs((p[:, 0] - el[1]) * uy - (p[:, 1] - el[2]) * ux)
        return np.where((along > 0.0) & (along < length), off, ends)
    turn = np.arctan2(p[:, 1] - el[6], p[:, 0] - el[5]) - math.atan2(el[2] - el[6], el[1] - el[5])
    turn = np.mod(turn if el[7] > 0.0 else -turn, TAU)
    off = np.abs(np.hypot(p[:, 0] - el[5], p[:, 1] - el[6]) - radius_of(el))
    return np.where(turn <= abs(el[7]), np.minimum(off, ends), ends)


def nearest(shape, p):
    """Distance of points p (m, 2) to the whole shape."""
    result = np.full(len(p), np.inf)
    for el in shape:
        np.minimum(result, distance(el, p), out=result)
    return result


def point(el, t):
    """Points (m, 2) at parameters t (m,)."""
    t = np.asarray(t, float)
    if el[0] == "L":
        return np.stack((el[1] + (el[3] - el[1]) * t, el[2] + (el[4] - el[2]) * t), axis=1)
    a = math.atan2(el[2] - el[6], el[1] - el[5]) + el[7] * t
    r = radius_of(el)
    return np.stack((el[5] + r * np.cos(a), el[6] + r * np.sin(a)), axis=1)


def length(el):
    return math.hypot(el[3] - el[1], el[4] - el[2]) if el[0] == "L" else radius_of(el) * abs(el[7])


def samples(shape, step, least=9):
    """Points along every element, ends included."""
    return np.concatenate([point(el, np.linspace(0.0, 1.0, least + int(length(el) / step))) for el in shape])


def winding(shape, p):
    """Winding number (m,) of a closed shape about points p (m, 2) not on it."""
    total = np.zeros(len(p))
    for el in shape:
        a = np.arctan2(el[2] - p[:, 1], el[1] - p[:, 0])
        b = np.arctan2(el[4] - p[:, 1], el[3] - p[:, 0])
        turn = np.mod(b - a + math.pi, TAU) - math.pi
        if el[0] == "A":
            turn = _arc_turn(el, p, turn)
        total += turn
    return np.round(total / TAU).astype(int)


def _arc_turn(el, p, chord_turn):
    """Angle an arc spans seen from p: in thirds or finer, each below a half turn as seen
    from outside its chord's segment, corrected by whole turns inside it."""
    pieces = max(1, math.ceil(abs(el[7]) / (math.pi / 4)))
    cut = point(el, np.linspace(0.0, 1.0, pieces + 1))
    cut[0], cut[-1] = el[1:3], el[3:5]
    r, total = radius_of(el), np.zeros(len(p))
    for a, b in zip(cut, cut[1:]):
        cross = (a[0] - p[:, 0]) * (b[1] - p[:, 1]) - (a[1] - p[:, 1]) * (b[0] - p[:, 0])
        dot = (a[0] - p[:, 0]) * (b[0] - p[:, 0]) + (a[1] - p[:, 1]) * (b[1] - p[:, 1])
        turn = np.arctan2(cross, dot)
        side = (b[0] - a[0]) * (p[:, 1] - a[1]) - (b[1] - a[1]) * (p[:, 0] - a[0])
        in_disc = np.hypot(p[:, 0] - el[5], p[:, 1] - el[6]) < r
        if el[7] > 0.0:
            turn = np.where(in_disc & (side < 0.0), turn + TAU, turn)
        else:
            turn = np.where(in_disc & (side > 0.0), turn - TAU, turn)
        total += turn
    return total


def area(shape):
    total = 0.0
    for el in shape:
        total += 0.5 * (el[1] * el[4] - el[3] * el[2])
        if el[0] == "A":
            total += 0.5 * radius_of(el) ** 2 * (el[7] - math.sin(el[7]))
    return total


def _unit(x, y):
    n = math.hypot(x, y)
    return x / n, y / n


def _direction(el, at_end):
    """Unit tangent at the start or end of an element."""
    if el[0] == "L":
        return _unit(el[3] - el[1], el[4] - el[2])
    x, y = (el[3] - el[5], el[4] - el[6]) if at_end else (el[1] - el[5], el[2] - el[6])
    return _unit(-y, x) if el[7] > 0.0 else _unit(y, -x)


def parallels(shape, closed, side, r):
    """Curves on which the edge of the reachable centres can lie: (curve, own indices).

    side +1: right of travel.  Parallels of every element, and circles of radius r about
    convex corners from one normal to the next.
    """
    n, found = len(shape), []
    for k, el in enumerate(shape):
        if el[0] == "L":
            ux, uy = _direction(el, False)
            dx, dy = side * r * uy, -side * r * ux
            found.append((("L", el[1] + dx, el[2] + dy, el[3] + dx, el[4] + dy), (k,)))
        else:
            new = radius_of(el) + side * r * math.copysign(1.0, el[7])
            if new > 1e-6:
                f = new / radius_of(el)
                found.append(
                    (
                        (
                            "A",
                            el[5] + f * (el[1] - el[5]),
                            el[6] + f * (el[2] - el[6]),
                            el[5] + f * (el[3] - el[5]),
                            el[6] + f * (el[4] - el[6]),
                            el[5],
                            el[6],
                            el[7],
                        ),
                        (k,),
                    )
                )
    for k in range(n if closed else n - 1):
        a, b = shape[k], shape[(k + 1) % n]
        u, v = _direction(a, True), _direction(b, False)
        turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
        if side * turn > 1e-5 and abs(turn) < math.pi - 1e-3:
            s = side * r
            found.append(
                (
                    ("A", a[3] + s * u[1], a[4] - s * u[0], a[3] + s * v[1], a[4] - s * v[0], a[3], a[4], turn),
                    (k, (k + 1) % n),
                )
            )
    return found


def _cuts(curve, shape, reach):
    """Parameters on a curve where its distance from some element may pass `reach`."""
    found = [0.0, 1.0]
    for el in shape:
        circles = [(el[1], el[2], reach), (el[3], el[4], reach)]
        if el[0] == "A":
            circles += [(el[5], el[6], radius_of(el) + reach), (el[5], el[6], abs(radius_of(el) - reach))]
        else:
            ux, uy = _direction(el, False)
            for s in (reach, -reach):
                found += _on_line(curve, el[1] - s * uy, el[2] + s * ux, ux, uy)
        for circle in circles:
            found += _on_circle(curve, *circle)
    return np.array(sorted(t for t in found if 0.0 <= t <= 1.0))


def _parameter(curve, x, y):
    if curve[0] == "L":
        dx, dy = curve[3] - curve[1], curve[4] - curve[2]
        return ((x - curve[1]) * dx + (y - curve[2]) * dy) / (dx * dx + dy * dy)
    turn = math.atan2(y - curve[6], x - curve[5]) - math.atan2(curve[2] - curve[6], curve[1] - curve[5])
    return (turn % TAU if curve[7] > 0.0 else -((-turn) % TAU)) / curve[7]


def _on_line(curve, x, y, ux, uy):
    """Parameters where a curve meets the line through x, y along unit u."""
    if curve[0] == "L":
        dx, dy = curve[3] - curve[1], curve[4] - curve[2]
        det = dx * uy - dy * ux
        return [] if abs(det) < 1e-14 else [((x - curve[1]) * uy - (y - curve[2]) * ux) / det]
    foot = (curve[5] - x) * ux + (curve[6] - y) * uy
    fx, fy = x + foot * ux, y + foot * uy
    square = radius_of(curve) ** 2 - (fx - curve[5]) ** 2 - (fy - curve[6]) ** 2
    if square < 0.0:
        return []
    h = math.sqrt(square)
    return [_parameter(curve, fx + s * ux, fy + s * uy) for s in (h, -h)]


def _on_circle(curve, cx, cy, r):
    """Parameters where a curve meets a circle."""
    if curve[0] == "L":
        length_ = math.hypot(curve[3] - curve[1], curve[4] - curve[2])
        if length_ < 1e-12:
            return []
        ux, uy = (curve[3] - curve[1]) / length_, (curve[4] - curve[2]) / length_
        mid = (cx - curve[1]) * ux + (cy - curve[2]) * uy
        square = r * r - ((cx - curve[1]) * uy - (cy - curve[2]) * ux) ** 2
        if square < 0.0:
            return []
        h = math.sqrt(square)
        return [(mid + h) / length_, (mid - h) / length_]
    d = math.hypot(cx - curve[5], cy - curve[6])
    if d < 1e-9:
        return []
    own = radius_of(curve)
    mid = (d * d + own * own - r * r) / (2.0 * d)
    square = own * own - mid * mid
    if square < 0.0:
        return []
    h, ux, uy = math.sqrt(square), (cx - curve[5]) / d, (cy - curve[6]) / d
    return [_parameter(curve, curve[5] + mid * ux - s * h * uy, curve[6] + mid * uy + s * h * ux) for s in (1.0, -1.0)]


def missing(shape, closed, side, r, path, slack=1e-6, tolerance=1e-5):
    """Pieces of the true edge of the reachable centres that no path runs along.

    A piece is certain where its distance from all other elements is at least r + slack.
    Returns [(length mm, middle point)].
    """
    return missing_of_loops([(shape, closed)], side, r, path, slack, tolerance)


def missing_of_loops(loops, side, r, path, slack=1e-6, tolerance=1e-5):
    """The same for several contours at once, loops = [(shape, closed)]."""
    shape = [el for loop, _ in loops for el in loop]
    found, curves, first = [], [], 0
    for loop, closed in loops:
        curves += [(curve, tuple(first + k for k in own)) for curve, own in parallels(loop, closed, side, r)]
        first += len(loop)
    for curve, own in curves:
        if length(curve) < 1e-9:
            continue
        others = [el for k, el in enumerate(shape) if k not in own]
        cuts = _cuts(curve, shape, r + slack)
        if len(own) == 2:
            cuts = np.sort(np.concatenate((cuts, _cuts(curve, [shape[k] for k in own], r - slack))))
        middle = 0.5 * (cuts[1:] + cuts[:-1])
        size = np.diff(cuts) * length(curve)
        middle, size = middle[size > 1e-7], size[size > 1e-7]
        p = point(curve, middle)
        certain = nearest(shape, p) >= r - slack
        if others:
            certain &= nearest(others, p) >= r + slack
        p, size = p[certain], size[certain]
        if len(p):
            lost = nearest(path, p) > tolerance if path else np.ones(len(p), bool)
            found += [(float(s), tuple(q)) for s, q in zip(size[lost], p[lost])]
    return found


def gouge(shape, r, path, step=0.05):
    """Largest depth (mm) of a tool of radius r on the path into the shape's line."""
    if not path:
        return 0.0
    p = samples(path, step)
    return float(np.max(r - nearest(shape, p)))


def worst_gap(path, closed):
    """Largest distance between the end of one path element and the start of the next."""
    pairs = zip(path, path[1:] + path[:1]) if closed else zip(path, path[1:])
    return max((math.hypot(a[3] - b[1], a[4] - b[2]) for a, b in pairs), default=0.0)


def inside_material(finish, side, rough, step=0.05):
    """Largest depth (mm) of a rough shape in the material of a closed finish shape."""
    p = samples(rough, step)
    depth = nearest(finish, p)
    far = np.flatnonzero(depth > 1e-8)
    if not len(far):
        return 0.0
    ccw = area(finish) > 0.0
    inner = winding(finish, p[far]) != 0
    free = inner if (side < 0) == ccw else ~inner
    return float(np.max(np.where(free, 0.0, depth[far])))


def reached(finish, side, r, loops, p):
    """Which points p (m, 2) a tool of radius r on the closed loops reaches: nearer than r to
    a path, or within the region of centres that the paths bound."""
    path = [el for loop in loops for el in loop]
    gap = nearest(path, p)
    turns = sum(winding(loop, p) for loop in loops)
    ccw = area(finish) > 0.0
    if (side < 0) != ccw:  # tool outside: far away counts as reached
        turns = turns - 1 if ccw else turns + 1
    return (gap < r) | (turns != 0), gap


def wrongly_named(finish, side, r, loops, regions, p, margin=1e-5):
    """Points of the free side that are both or neither: reached, and in just one region."""
    free_turns = winding(finish, p) != 0
    ccw = area(finish) > 0.0
    free = free_turns if (side < 0) == ccw else ~free_turns
    edges = [el for region in regions for el in region] + finish
    clear = nearest(edges, p) > margin
    clear &= np.abs(nearest([el for loop in loops for el in loop], p) - r) > margin
    p = p[free & clear]
    within = sum((winding(region, p) != 0).astype(int) for region in regions) if regions else np.zeros(len(p), int)
    return p[reached(finish, side, r, loops, p)[0] == (within != 0)], int(np.max(within, initial=0))
