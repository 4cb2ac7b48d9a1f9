# SPDX-License-Identifier: GPL-2.0-or-later
"""How near the traverses of a program come to stock at their side, written apart: no map, no product code, numpy only.

Needles are put where a traverse may be too near, thousands round each.  The height of a needle is asked of every move
before: the lowest that the tool's profile comes over it.  So a needle is exactly as high as the stock is there, and
none is between two others that the stock has cut.  Programs are plain: G0 to G3 in G17 with I J or R, G90, mm, one box
of M250, tools by T.. M6.

A traverse goes straight up (free), straight down, or across.  Stock higher than its tip that is nearer than the
clearance to the tool's side at that height is a violation, wherever it is.
"""

import math
import re
from dataclasses import dataclass

import numpy as np

CHORD = 0.0005  # mm, of arcs
UP = 1e-6  # mm across the axis: a shorter traverse is vertical
LEVEL = 0.02  # mm: stock that is no higher above the tip is under the tool
SAMPLES = 3000  # needles round a traverse, at least
APART = 0.05  # mm between those along its edges
SEARCH = 60  # steps of a search along a sloped move


@dataclass
class Move:
    """a, b (3,): from, to; tool; traverse: G0; line of the program."""

    a: np.ndarray
    b: np.ndarray
    tool: int
    traverse: bool
    line: int


def read(text):
    """(box ((3,), (3,)), [Move]) of a plain program; arcs in chords."""
    box, moves, at, tool, waiting, mode = None, [], np.full(3, np.nan), 0, 0, 0
    for number, line in enumerate(text.splitlines(), 1):
        line = re.sub(r"\(.*?\)|;.*", "", line).upper()
        words = [(letter, float(value)) for letter, value in re.findall(r"([A-Z])\s*([-+]?[\d.]+)", line)]
        given = dict(words)
        if ("M", 250.0) in words:
            low = np.array([given[k] for k in "PQR"])
            box = low, low + [given[k] for k in "IJK"]
            continue
        waiting = int(given.get("T", waiting))
        if ("M", 6.0) in words:
            tool = waiting
        for letter, value in words:
            assert letter != "G" or value in (0, 1, 2, 3, 17, 21, 40, 49, 54, 80, 90, 94, 64), line
            if letter == "G" and value <= 3:
                mode = int(value)
        if not set("XYZ") & set(given):
            continue
        to = np.array([given.get(letter, old) for letter, old in zip("XYZ", at)])
        places = _arc(at, to, given, mode == 2) if mode >= 2 else [to]
        for place in places:
            if not np.isnan(at).any():
                moves.append(Move(at, place, tool, mode == 0, number))
            at = place
    return box, moves


def _arc(a, b, given, clockwise):
    """Ends of the chords of an arc."""
    if "R" in given:
        middle, half, r = (a[:2] + b[:2]) / 2, (b[:2] - a[:2]) / 2, given["R"]
        off = math.sqrt(max(r * r - half @ half, 0.0)) / math.hypot(*half)
        side = (1 if clockwise else -1) * (1 if r > 0 else -1)
        centre = middle + side * off * np.array([half[1], -half[0]])
    else:
        centre = a[:2] + [given.get("I", 0.0), given.get("J", 0.0)]
    u, v = a[:2] - centre, b[:2] - centre
    begin, radius = math.atan2(u[1], u[0]), math.hypot(*u)
    sweep = (math.atan2(v[1], v[0]) - begin) % (2 * math.pi)
    if sweep < 1e-9:
        sweep = 2 * math.pi
    if clockwise:
        sweep -= 2 * math.pi
    count = max(2, math.ceil(abs(sweep) / (2 * math.acos(1 - min(1.0, CHORD / radius)))))
    t = np.arange(1, count + 1) / count
    angle = begin + sweep * t
    places = np.column_stack(
        (centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), a[2] + (b[2] - a[2]) * t)
    )
    places[-1] = b
    return list(places)


def profile(tool, r):
    """Height of a tool (diameter, corner radius) above its tip at a distance from its axis."""
    out = np.maximum(r - (tool[0] / 2 - tool[1]), 0.0)
    return tool[1] - np.sqrt(np.maximum(tool[1] ** 2 - out**2, 0.0))


def half_width(tool, above):
    """Radius of the tool at a height above its tip."""
    under = np.clip(tool[1] - above, 0.0, None)
    return tool[0] / 2 - tool[1] + np.sqrt(np.maximum(tool[1] ** 2 - under**2, 0.0))


def _left_by(move, tool, x, y):
    """What a move leaves of needles: the lowest of the tool over each; inf where it does not come."""
    radius, d = tool[0] / 2, move.b - move.a
    u, v = x - move.a[0], y - move.a[1]
    length2 = d[0] ** 2 + d[1] ** 2
    near = (u * d[0] + v * d[1]) / length2 if length2 > 1e-18 else np.zeros(len(x))
    off2 = (u - near * d[0]) ** 2 + (v - near * d[1]) ** 2
    half = np.sqrt(np.maximum(radius**2 - off2, 0.0) / length2) if length2 > 1e-18 else np.ones(len(x))
    first, last = np.clip(near - half, 0.0, 1.0), np.clip(near + half, 0.0, 1.0)

    def height(t):
        r = np.hypot(u - t * d[0], v - t * d[1])
        return np.where(r <= radius + 1e-9, move.a[2] + t * d[2] + profile(tool, np.minimum(r, radius)), np.inf)

    reached = off2 <= radius**2
    if d[2] == 0.0 or not tool[1]:
        best = np.minimum(np.minimum(height(first), height(last)), height(np.clip(near, first, last)))
        return np.where(reached, best, np.inf)
    a, b = first.copy(), last.copy()
    for _ in range(SEARCH):
        one, two = b - 0.618034 * (b - a), a + 0.618034 * (b - a)
        lower = height(one) < height(two)
        a, b = np.where(lower, a, one), np.where(lower, two, b)
    best = np.minimum(np.minimum(height(first), height(last)), height((a + b) / 2))
    return np.where(reached, best, np.inf)


def heights(box, moves, tools, x, y):
    """Z of the stock at places after moves; the box's bottom where there is none."""
    inside = (x >= box[0][0]) & (x <= box[1][0]) & (y >= box[0][1]) & (y <= box[1][1])
    z = np.where(inside, box[1][2], box[0][2])
    low, high = (x.min(), y.min()), (x.max(), y.max())
    for move in moves:
        radius = tools[move.tool][0] / 2
        if any(
            max(move.a[k], move.b[k]) + radius < low[k] or min(move.a[k], move.b[k]) - radius > high[k] for k in (0, 1)
        ):
            continue
        z = np.minimum(z, _left_by(move, tools[move.tool], x, y))
    return np.maximum(z, box[0][2])


def _round(move, reach, rng):
    """Places (x, y) round a traverse, within `reach` of it: along its edges, and anywhere."""
    d = (move.b - move.a)[:2]
    length = math.hypot(*d)
    along = np.array(d) / length if length > UP else np.array([1.0, 0.0])
    across = np.array([-along[1], along[0]])
    s = rng.uniform(-reach, length + reach, SAMPLES + int(length / APART) * 20)
    # most of them where a wall is: as far as the tool's side, or a little more or less
    w = np.where(
        rng.random(len(s)) < 0.7,
        rng.choice([-1, 1], len(s)) * (reach - rng.exponential(0.15, len(s))),
        rng.uniform(-reach, reach, len(s)),
    )
    end = rng.random(len(s)) < 0.25  # round both ends
    angle, r = rng.uniform(0, 2 * math.pi, len(s)), reach - rng.exponential(0.2, len(s))
    middle = np.where(rng.random(len(s)) < 0.5, 0.0, length)
    s = np.where(end, middle + r * np.cos(angle), s)
    w = np.where(end, r * np.sin(angle), w)
    out = np.hypot(s - np.clip(s, 0.0, length), w) <= reach
    place = move.a[:2] + s[out, None] * along + w[out, None] * across
    return place[:, 0], place[:, 1]


def nearest(box, moves, tools, number, clearance, seed=0):
    """mm from the side of a traverse to stock, the clearance if none is nearer.  tools: {number: (diameter, corner
    radius)}."""
    move, tool = moves[number], tools[moves[number].tool]
    d = move.b - move.a
    if math.hypot(*d[:2]) <= UP and d[2] >= 0 or min(move.a[2], move.b[2]) >= box[1][2] - LEVEL:
        return clearance
    x, y = _round(move, tool[0] / 2 + clearance, np.random.default_rng([seed, number]))
    z = heights(box, moves[:number], tools, x, y)
    best = clearance
    for t in [1.0] if math.hypot(*d[:2]) <= UP else [None] if d[2] == 0.0 else np.linspace(0, 1, 200):
        if t is None:
            length2 = d[0] ** 2 + d[1] ** 2
            t = np.clip(((x - move.a[0]) * d[0] + (y - move.a[1]) * d[1]) / length2, 0.0, 1.0)
        above = z - move.a[2] - t * d[2]
        side = np.hypot(x - move.a[0] - t * d[0], y - move.a[1] - t * d[1]) - half_width(tool, above)
        here = (above > LEVEL) & (z > box[0][2] + LEVEL)
        best = min(best, float(side[here].min(initial=clearance)))
    return max(best, 0.0)


def violations(text, tools, clearance, seed=0, within=0.0):
    """[(line, begin and end (6,), mm)] of the traverses that are nearer to stock than the clearance less `within`."""
    box, moves = read(text)
    found = []
    for number, move in enumerate(moves):
        if move.traverse:
            side = nearest(box, moves, tools, number, clearance, seed)
            if side < clearance - within:
                found.append((move.line, np.concatenate((move.a, move.b)), side))
    return found


def new_violations(before, after, tools, clearance, seed=0, within=0.005):
    """Those of a rewritten program that are not the first one's own."""
    found = violations(after, tools, clearance, seed, within)
    if not found:
        return []
    own = [ends for _, ends, _ in violations(before, tools, clearance, seed)]
    return [one for one in found if not any(np.abs(one[1] - ends).max() < 2e-3 for ends in own)]
