# SPDX-License-Identifier: GPL-2.0-or-later
"""Independent judge of a machine run: how much was removed per time, from the log alone.

Who calls it: tests/machine/, tests/oracles/test_rate_oracle.py.  It knows neither the C core
nor a height map:

1. What the tool has cut is the tool's own earlier path: a point is cut down to the lowest
   surface any earlier position of the tool had over it.  The log is that way.
2. Per window (10 ms) the volume is the integral, over lines along the heading and from one
   side of the tool to the other, of the height between the stock before the window and the
   tool after it.  Both ends of the strip that a window adds are known exactly (the tool's
   outline before and after), so nothing jumps with a grid.
3. Total volume is counted apart from that on a raster of needles (`removed_total`).

A rate trace is judged by `check_rate`, which looks for both faults: too fast, and sluggish
at which neither the stock nor the programmed feed is a reason to be slow.

Lengths mm, times s, volumes mm3, rates mm3/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

WINDOW_S = 0.010
KEEP_MM = 0.1  # an earlier position is kept when this far from the last, or at a corner;
# between two the wall is off by 0.1^2 / 8 R = 0.0004 mm
LINES = 96  # across the tool
FEEDS = (2, 3)  # motion.motion-type of feed and arc


@dataclass
class OracleTool:
    """flat: (); ball: radius is the corner; vee: half angle in rad."""

    radius: float
    kind: str = "flat"
    half_angle: float = math.pi / 4

    def height(self, r):
        """Surface above the tip at r; infinite beside the tool."""
        inside = np.minimum(r, self.radius)
        if self.kind == "flat":
            z = np.zeros_like(inside)
        elif self.kind == "ball":
            z = self.radius - np.sqrt(self.radius**2 - inside**2)
        else:
            z = inside / math.tan(self.half_angle)
        return np.where(r <= self.radius, z, np.inf)

    def reach(self, height):
        """Radius of the part of the tool that is at most `height` above its tip."""
        if self.kind == "flat" or height <= 0.0:
            return self.radius
        if self.kind == "vee":
            return min(self.radius, height * math.tan(self.half_angle))
        return math.sqrt(max(0.0, self.radius**2 - max(0.0, self.radius - height) ** 2))


class _Path:
    """Positions the tool has had, found by place: tiles of the tool's diameter."""

    def __init__(self, tool):
        self.tile = 2.0 * tool.radius
        self.tiles = {}
        self.last = None

    def add(self, tip, corner=False):
        if not corner and self.last is not None and math.dist(tip, self.last) < KEEP_MM:
            return
        self.last = tuple(tip)
        key = (math.floor(tip[0] / self.tile), math.floor(tip[1] / self.tile))
        self.tiles.setdefault(key, []).append(self.last)

    def near(self, x, y, reach):
        """Positions (n, 3) that may cover a point within `reach` of (x, y)."""
        lo = [math.floor((c - reach) / self.tile) for c in (x, y)]
        hi = [math.floor((c + reach) / self.tile) for c in (x, y)]
        found = [
            np.array(self.tiles[i, j])
            for i in range(lo[0], hi[0] + 1)
            for j in range(lo[1], hi[1] + 1)
            if (i, j) in self.tiles
        ]
        if not found:
            return np.zeros((0, 3))
        points = np.concatenate(found)
        return points[np.hypot(points[:, 0] - x, points[:, 1] - y) <= reach]


def _stock_height(path, now, tool, low, high, x, y):
    """Height of the stock at points (n,), cut by the path so far and by the position `now`."""
    inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
    z = np.where(inside, high[2], low[2])
    if not inside.any():
        return z
    reach = tool.radius + math.sqrt(((x - now[0]) ** 2 + (y - now[1]) ** 2).max())
    points = np.vstack([path.near(now[0], now[1], reach), now])
    for part in np.array_split(points, max(1, len(points) * len(x) // 400000)):
        r = np.hypot(x[:, None] - part[None, :, 0], y[:, None] - part[None, :, 1])
        z = np.minimum(z, (part[None, :, 2] + tool.height(r)).min(axis=1, initial=np.inf))
    return np.maximum(z, low[2])


_STRIP = np.polynomial.legendre.leggauss(2)  # along the strip a window adds
_BELOW = np.polynomial.legendre.leggauss(7)  # below one half of the tool


def _window_volume(path, start, end, tool, low, high):
    """Volume between the stock after `start` and the tool at `end` along the straight path [2]."""
    step = end - start
    across = math.hypot(step[0], step[1])
    heading = step[:2] / across if across > 1e-9 else np.array([1.0, 0.0])
    reach = tool.reach(high[2] - min(start[2], end[2]))  # what can meet stock at all
    width = 2.0 * reach / LINES
    u = (np.arange(LINES) + 0.5) * width - reach
    front = np.sqrt(np.maximum(0.0, reach**2 - u**2))
    # places w along each line and their weights: the strip the outline gains, and what lies
    # below the tool, denser towards its rim where a ball is steep
    half = 0.25 * math.pi * (_BELOW[0] + 1.0)
    pieces = [(front[:, None] + 0.5 * across * (_STRIP[0] + 1.0), 0.5 * across * _STRIP[1] * np.ones((LINES, 1)))]
    if tool.kind != "flat" or step[2] < 0.0:
        weights = front[:, None] * np.cos(half) * (0.25 * math.pi * _BELOW[1])
        pieces.append((front[:, None] * np.sin(half), weights))
        if step[2] < 0.0:
            pieces.append((-front[:, None] * np.sin(half), weights))
    volume = 0.0
    for w, weight in pieces:
        weight = (weight * width).ravel()
        side = np.broadcast_to(u[:, None], w.shape).ravel()
        w = w.ravel()
        x = start[0] + w * heading[0] - side * heading[1]
        y = start[1] + w * heading[1] + side * heading[0]
        before = _stock_height(path, start, tool, low, high, x, y)
        # lowest surface on the way from start to end: nearest place, and both ends of a slope
        cover = np.sqrt(tool.radius**2 - side**2) - 1e-9
        after = np.full(x.shape, np.inf)
        for at in (w, np.zeros_like(w), np.full_like(w, across), w - cover):
            part = np.clip(at / across, 0.0, 1.0) if across > 1e-9 else np.ones_like(w)
            r = np.hypot(w - part * across, side)
            after = np.minimum(after, start[2] + part * step[2] + tool.height(r))
        volume += float((np.maximum(0.0, before - np.maximum(after, low[2])) * weight).sum())
    return volume


@dataclass
class Rates:
    time: np.ndarray  # (n,) s, end of each window
    rate: np.ndarray  # (n,) mm3/s
    volume: np.ndarray  # (n,) mm3 removed in the window
    feeding: np.ndarray  # (n,) bool: feed or arc motion all through the window
    scale: np.ndarray  # (n,) largest adaptive feed in the window
    speed: np.ndarray  # (n,) mm/s of the tip

    @property
    def cutting(self):
        """Windows that feed and remove something."""
        return self.feeding & (self.volume > 1e-6)


def rates(t, x, y, z, motion, scale, box, tool, window=WINDOW_S):
    """Removal rate per window; arrays (n,), box ((x, y, z) low, (x, y, z) high)."""
    low, high = (np.array(corner, float) for corner in box)
    tips = np.column_stack([x, y, z]).astype(float)
    t = np.asarray(t, float)
    edges = np.searchsorted(t, np.arange(t[0], t[-1] + 0.5 * window, window))
    edges = np.unique(np.append(edges[edges < len(t)], len(t) - 1))
    path, last_unit = _Path(tool), np.zeros(3)
    out = {name: [] for name in ("time", "rate", "volume", "feeding", "scale", "speed")}
    for first, last in zip(edges[:-1], edges[1:]):
        inside = np.s_[first + 1 : last + 1]
        volume = 0.0
        # a corner within the window: straight pieces one by one
        for i, j in _straight_pieces(tips, first, last):
            unit = (tips[j] - tips[i]) / max(np.linalg.norm(tips[j] - tips[i]), 1e-9)
            path.add(tips[i], corner=unit @ last_unit < 0.9995)
            last_unit = unit
            if tips[j][2] < high[2] or tips[i][2] < high[2]:
                volume += _window_volume(path, tips[i], tips[j], tool, low, high)
            for k in range(i + 1, j + 1):
                path.add(tips[k])
        took = t[last] - t[first]
        out["time"].append(t[last])
        out["volume"].append(volume)
        out["rate"].append(volume / took)
        out["feeding"].append(np.isin(np.asarray(motion)[inside], FEEDS).all())
        out["scale"].append(np.asarray(scale)[inside].max())
        out["speed"].append(np.linalg.norm(np.diff(tips[first : last + 1], axis=0), axis=1).sum() / took)
    return Rates(**{name: np.array(values) for name, values in out.items()})


def _straight_pieces(tips, first, last):
    """Sample pairs (i, j) between which the path bends by less than 0.002 mm."""
    i = first
    while i < last:
        j = last
        while j > i + 1:
            chord = tips[j] - tips[i]
            length = np.linalg.norm(chord)
            inner = tips[i + 1 : j] - tips[i]
            if length < 1e-9:
                off = np.linalg.norm(inner, axis=1).max()
            else:
                unit = chord / length
                along = inner @ unit
                off = np.linalg.norm(inner - along[:, None] * unit, axis=1).max()
                off = max(off, -along.min(), (along - length).max())
            if off < 0.002:
                break
            j = i + (j - i) // 2
        yield i, j
        i = j


def removed_total(x, y, z, box, tool, spacing=0.1, seed=1):
    """Volume removed by the whole run, counted on needles `spacing` apart [3]."""
    low, high = (np.array(corner, float) for corner in box)
    random = np.random.default_rng(seed)
    nx, ny = (math.ceil((high[i] - low[i]) / spacing) for i in (0, 1))
    hx, hy = (high[0] - low[0]) / nx, (high[1] - low[1]) / ny
    px = low[0] + (np.arange(nx)[None, :] + random.random((ny, nx))) * hx
    py = low[1] + (np.arange(ny)[:, None] + random.random((ny, nx))) * hy
    top = np.full((ny, nx), high[2])
    last = None
    for tip in np.column_stack([x, y, z]):
        if tip[2] >= high[2] or (last is not None and math.dist(tip, last) < 0.02):
            continue
        last = tip
        i0, i1 = (max(0, int((tip[0] + s * tool.radius - low[0]) / hx) + s) for s in (-1, 1))
        j0, j1 = (max(0, int((tip[1] + s * tool.radius - low[1]) / hy) + s) for s in (-1, 1))
        part = np.s_[j0 : j1 + 1, i0 : i1 + 1]
        surface = tip[2] + tool.height(np.hypot(px[part] - tip[0], py[part] - tip[1]))
        np.minimum(top[part], np.maximum(surface, low[2]), out=top[part])
    return float((high[2] - top).sum() * hx * hy)


@dataclass
class Verdict:
    above: float  # share of the cutting time above target x (1 + within)
    below: float  # share below target x (1 - within) although the override was below 1
    held: float  # share within the band
    ceiling: float  # share at full override below the band: the feed is the limit
    peak: float  # highest rate over the target
    cutting_s: float

    def __str__(self):
        return (
            f"{100 * self.above:.1f} % above, {100 * self.below:.1f} % below, {100 * self.held:.1f} % "
            f"held, {100 * self.ceiling:.1f} % at the ceiling, peak {self.peak:.3f} x target, "
            f"{self.cutting_s:.2f} s of cutting"
        )


def check_rate(found, target, within=0.03, most_above=0.02, most_below=0.15):
    """Judges a run that should hold `target` (mm3/s): raises AssertionError when it is above the band
    for more than most_above of the cutting time, or below it for more than most_below although
    the override held it back (entering, leaving, braking and speeding up are such times), or
    when nothing was cut at all.  Returns the Verdict."""
    cutting = found.cutting
    spans = np.diff(found.time, prepend=found.time[0] - WINDOW_S)[cutting]
    whole = spans.sum()
    if whole <= 0.0:
        raise AssertionError("nothing was cut")
    ratio = found.rate[cutting] / target
    free = found.scale[cutting] >= 0.999
    low, high = ratio < 1.0 - within, ratio > 1.0 + within

    def share(mask):
        return float(spans[mask].sum() / whole)

    verdict = Verdict(
        share(high), share(low & ~free), share(~low & ~high), share(low & free), float(ratio.max()), float(whole)
    )
    if verdict.above > most_above:
        raise AssertionError(f"too fast: {verdict}")
    if verdict.below > most_below:
        raise AssertionError(f"sluggish: {verdict}")
    return verdict
