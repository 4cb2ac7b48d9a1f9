# SPDX-License-Identifier: GPL-2.0-or-later
"""What is true of an ordinary program in a stock: an interpreter of its own for the words that such programs have, and
needles that flat tools cut in closed form.

Called by bench/bench_any_program.py and tests/check/test_check_ordinary.py; knows nothing of chipwise/check.  mm,
mm/min.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
_COMMENT = re.compile(r"\([^()]*\)|;.*")
PIECE, WINDOW = 0.25, 2.0  # mm: of a feed that is cut at once, and what a rate is the mean of
ACCEL = 500.0  # mm/s2, of configs/mill.ini
SPACING = 0.1  # mm between needles
SAGITTA = 0.002  # mm, of chords of arcs


@dataclass
class Move:
    rapid: bool
    line: int
    start: tuple
    end: tuple
    feed: float


def moves_of(text):
    """[Move] of a program."""
    scale, feed, code, relative, at = 1.0, 0.0, 0, False, [0.0, 0.0, 0.0]
    cycle, found, known = {}, [], set()
    for number, raw in enumerate(text.splitlines(), 1):
        words = _WORD.findall(_COMMENT.sub("", raw).upper())
        values = {letter: float(value) for letter, value in words if letter not in "GMN"}
        codes = [float(value) for letter, value in words if letter == "G"]
        scale = 25.4 if 20 in codes else 1.0 if 21 in codes else scale
        relative = True if 91 in codes else False if 90 in codes else relative
        feed = values["F"] * scale if "F" in values else feed
        motion = [c for c in codes if c in (0, 1, 2, 3, 80, 81, 83)]
        code = motion[-1] if motion else code
        if motion and code in (81, 83):
            cycle = {}
        to = {axis: values[axis] * scale for axis in "XYZR" if axis in values}
        if 28 in codes:
            at = [0.0, 0.0, 0.0]
            known = set()
            continue
        if not any(axis in to for axis in "XYZ") or code == 80:
            continue
        if code in (81, 83):
            cycle.update({k: to[k] for k in "ZR" if k in to})
            cycle["Q"] = values.get("Q", 0.0) * scale or cycle.get("Q", 0.0)
            high = max(at[2], cycle["R"])
            places = [(at[0], at[1], high), (to.get("X", at[0]), to.get("Y", at[1]), high)]
            for k, place in enumerate([*places, *_strokes(places[1][:2], cycle, code == 83, high)]):
                found.append(Move(k < 2 or place[3], number, tuple(at), place[:3], feed))
                at = list(place[:3])
            continue
        end = [(at[k] if relative else 0.0) + to[a] if a in to else at[k] for k, a in enumerate("XYZ")]
        known |= set(to) & set("XYZ")
        if code in (2, 3):
            for place in _arc(at, end, values, scale, code == 2):
                found.append(Move(False, number, tuple(at), place, feed))
                at = list(place)
        elif known == set("XYZ"):
            found.append(Move(code == 0, number, tuple(at), tuple(end), feed))
        at = end
    return found


def _strokes(place, cycle, pecks, high):
    """(x, y, z, is a traverse) of a hole, from above it."""
    yield *place, cycle["R"], True
    depth, peck = cycle["R"], cycle["Q"]
    while pecks and depth - peck > cycle["Z"] + 1e-9:
        depth -= peck
        yield *place, depth, False
        yield *place, cycle["R"], True
        yield *place, depth + 0.254, True  # what LinuxCNC leaves to the bottom
    yield *place, cycle["Z"], False
    yield *place, high, True


def _arc(start, end, values, scale, clockwise):
    if "R" in values:
        radius, dx, dy = values["R"] * scale, end[0] - start[0], end[1] - start[1]
        half = math.hypot(dx, dy) / 2
        rise = math.sqrt(max(radius * radius - half * half, 0.0)) / (2 * half) * (1 if clockwise else -1)
        cx, cy = start[0] + dx / 2 + dy * rise, start[1] + dy / 2 - dx * rise
    else:
        cx, cy = start[0] + values.get("I", 0.0) * scale, start[1] + values.get("J", 0.0) * scale
    radius = math.hypot(start[0] - cx, start[1] - cy)
    first, last = math.atan2(start[1] - cy, start[0] - cx), math.atan2(end[1] - cy, end[0] - cx)
    sweep = (last - first) % (2 * math.pi) or 2 * math.pi
    sweep = sweep - 2 * math.pi if clockwise and sweep < 2 * math.pi - 1e-9 else sweep
    count = max(2, math.ceil(abs(sweep) / (2 * math.acos(1 - SAGITTA / radius))))
    for k in range(1, count):
        angle = first + sweep * k / count
        yield cx + radius * math.cos(angle), cy + radius * math.sin(angle), start[2] + (end[2] - start[2]) * k / count
    yield tuple(end)


class Stock:
    """A box of needles."""

    def __init__(self, low, high):
        axes = [np.arange(low[k] + SPACING / 2, high[k], SPACING) for k in (0, 1)]
        self.x, self.y = np.meshgrid(*axes)
        self.z, self.low, self.high = np.full(self.x.shape, float(high[2])), low, high

    def _near(self, start, end, reach):
        cut = []
        for k in (1, 0):
            a, b = min(start[k], end[k]) - reach, max(start[k], end[k]) + reach
            cut.append(
                slice(
                    max(0, math.floor((a - self.low[k]) / SPACING)), max(0, math.ceil((b - self.low[k]) / SPACING) + 1)
                )
            )
        return tuple(cut)

    def _met(self, start, end, radius, where):
        """(first, last) share of the move with each needle below the tool; nan: never."""
        x, y = self.x[where] - start[0], self.y[where] - start[1]
        dx, dy = end[0] - start[0], end[1] - start[1]
        square = dx * dx + dy * dy
        if square < 1e-12:
            inside = x * x + y * y <= radius * radius
            return np.where(inside, 0.0, np.nan), np.where(inside, 1.0, np.nan)
        along, root = (x * dx + y * dy) / square, radius * radius / square - (x * dy - y * dx) ** 2 / square**2
        half = np.sqrt(np.where(root >= 0, root, np.nan))
        first, last = np.clip(along - half, 0, 1), np.clip(along + half, 0, 1)
        out = (along + half < 0) | (along - half > 1)
        return np.where(out, np.nan, first), np.where(out, np.nan, last)

    def beside(self, start, end, radius, clearance=0.2):
        """Whether stock is within the clearance of the tool's side, or below it."""
        where = self._near(start, end, radius + clearance)
        first, last = self._met(start, end, radius + clearance, where)
        rise = end[2] - start[2]
        lowest = start[2] + rise * np.where(rise < 0, last, first)
        return bool(np.nanmax(np.where(np.isnan(lowest), -np.inf, self.z[where] - lowest), initial=-np.inf) > 0.01)

    def cut(self, start, end, radius):
        """-> (depth, volume) of a straight move of a flat tool."""
        where = self._near(start, end, radius)
        first, last = self._met(start, end, radius, where)
        if not first.size:
            return 0.0, 0.0
        rise, z = end[2] - start[2], self.z[where]
        lowest = np.where(np.isnan(first), np.inf, start[2] + rise * np.where(rise < 0, last, first))
        entry = np.where(np.isnan(first), np.inf, start[2] + rise * first)
        met = (z > np.maximum(lowest, self.low[2]) + 1e-9) & (z > self.low[2])
        depth = float(np.max(np.where(met, z - np.minimum(entry, z), 0.0), initial=0.0))
        after = np.where(met, np.maximum(lowest, self.low[2]), z)
        volume = float((z - after).sum()) * SPACING**2
        self.z[where] = after
        return depth, volume


@dataclass
class Truth:
    """By line: the largest depth and rate of feeds, mm and cm3/min; depth of traverses; lines whose traverses are
    beside stock."""

    depth: dict
    rate: dict
    rapid: dict
    beside: set
    volume: float = 0.0
    inner: dict = field(default_factory=dict)  # rates of windows that lie in one line, where F is reached
    heights: Optional[np.ndarray] = None  # of the needles at the end


class _Window:
    """The last pieces of feed that follow one another, WINDOW long."""

    def __init__(self, found):
        self._found, self._pieces, self._length = found, [], 0.0

    def add(self, line, length, volume, feed, at_f):
        self._pieces.append((line, length, volume, length / feed if feed else 0.0))
        self._length += length
        while self._length - self._pieces[0][1] > WINDOW:
            self._length -= self._pieces.pop(0)[1]
        seconds = sum(piece[3] for piece in self._pieces)
        if self._length < WINDOW or not seconds:
            return
        rate, lines = sum(piece[2] for piece in self._pieces) / seconds / 1000.0, {piece[0] for piece in self._pieces}
        for one in lines:
            self._found.rate[one] = max(self._found.rate.get(one, 0.0), rate)
        if len(lines) == 1 and at_f:
            self._found.inner[line] = max(self._found.inner.get(line, 0.0), rate)


def truth(text, low, high, diameter):
    """Truth of a program with one tool in a stock."""
    stock, found, area = Stock(low, high), Truth({}, {}, {}, set()), math.pi * diameter**2 / 4
    window = _Window(found)
    for move in moves_of(text):
        length = math.dist(move.start, move.end)
        if length < 1e-9:
            continue
        if move.rapid and stock.beside(move.start, move.end, diameter / 2) and move.end[2] < move.start[2] + 1e-9:
            found.beside.add(move.line)
        count = 1 if move.rapid else max(1, math.ceil(length / PIECE))
        ends = [tuple(a + (b - a) * k / count for a, b in zip(move.start, move.end)) for k in range(count + 1)]
        near = (
            move.feed / 60.0
        ) ** 2 / ACCEL  # from an end: where F is not reached, if the planner has half of the acceleration
        for k, (a, b) in enumerate(zip(ends, ends[1:]), 1):
            depth, volume = stock.cut(a, b, diameter / 2)
            found.volume += volume
            if move.rapid:
                found.rapid[move.line] = max(
                    found.rapid.get(move.line, 0.0), depth, volume / area if math.dist(a[:2], b[:2]) < 1e-6 else 0.0
                )
            else:
                found.depth[move.line] = max(found.depth.get(move.line, 0.0), depth)
                window.add(
                    move.line,
                    length / count,
                    volume,
                    move.feed,
                    near < k * length / count - WINDOW < length - near - WINDOW,
                )
        if move.rapid:
            window = _Window(found)
    found.heights = stock.z
    return found
