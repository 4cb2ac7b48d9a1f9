# SPDX-License-Identifier: GPL-2.0-or-later
"""How hard each pocket strategy works the tool: engagement, section, length, entries, planning time.

    /usr/bin/python3 bench/pocket_engagement.py [--count 20] [--step 0.8] [--json FILE]

The stock is a fine raster (one cell a 12th of the tool radius).  The tool goes along every Track in steps of a
cell; before each step the front half circle of its edge is probed just outside the tool.  The share of the
half circle in stock times 180 degrees is the engagement angle; the sum of stock across the path of the tool is
the radial engagement in mm, which times the depth of cut is the section area.  Then the disc is cleared.

Not counted: the first tool diameter of every Track that begins in solid stock (the entry: ramp or helix).
Full width: engagement beyond FULL_DEGREES.
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path

import numpy as np

from roots import ROOT
from chipwise.geometry.base import elements
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.pocket.machinable import split
from support.island_random import random_islands

sys.path.append(str(ROOT / "tools" / "pictures"))  # the drawing of the pictures

from pockets import STRATEGIES, demo_pocket  # noqa: E402

CELLS_PER_RADIUS = 12
PROBES = 90  # on the front half circle
FULL_DEGREES = 150.0
SEED = 5000


class Raster:
    """Stock as cells around machinable regions; tool of `radius` mm."""

    def __init__(self, fields, radius):
        self.radius, self.cell = radius, radius / CELLS_PER_RADIUS
        low, high = (
            np.array([corner(part, axis=0) for part in (elements.boxes(f.boundary)[k] for f in fields)])
            for k, corner in ((0, np.min), (1, np.max))
        )
        self.low = low.min(axis=0) - 2.0 * radius
        self.stock = np.ones(np.ceil((high.max(axis=0) + 2.0 * radius - self.low) / self.cell).astype(int) + 1, bool)
        n = CELLS_PER_RADIUS + 2
        i, j = np.mgrid[-n : n + 1, -n : n + 1]
        self.offset = np.stack((i.ravel(), j.ravel()), axis=1)
        angle = (np.arange(PROBES) + 0.5) * math.pi / PROBES - 0.5 * math.pi
        self.ahead = np.stack((np.cos(angle), np.sin(angle)), axis=1)

    def in_stock(self, place, direction):
        """(engagement degrees, radial engagement mm) of the tool at a place going in a direction."""
        side = np.stack((direction, (-direction[1], direction[0])))
        index = ((place + (self.radius + 0.7 * self.cell) * self.ahead @ side - self.low) / self.cell + 0.5).astype(int)
        met = self.stock[index[:, 0], index[:, 1]]
        return 180.0 * met.mean(), float((met * self.ahead[:, 0]).sum() * self.radius * math.pi / PROBES)

    def clear(self, place):
        at = ((place - self.low) / self.cell + 0.5).astype(int)
        index = at + self.offset
        gone = index[np.hypot(*(index * self.cell + self.low - place).T) <= self.radius]
        self.stock[gone[:, 0], gone[:, 1]] = False

    def solid(self, place):
        """Whether any stock stands under the tool."""
        at = ((place - self.low) / self.cell + 0.5).astype(int)
        index = at + self.offset
        under = index[np.hypot(*(index * self.cell + self.low - place).T) <= self.radius - self.cell]
        return bool(self.stock[under[:, 0], under[:, 1]].any())


def steps(track, step):
    """Places and directions along a Track."""
    e = track.elements
    for k, size in enumerate(elements.lengths(e)):
        n = max(1, math.ceil(size / step))
        index, t = np.full(n, k), (np.arange(n) + 0.5) / n
        yield from zip(elements.point_at(e, index, t), elements.tangent_at(e, index, t), np.full(n, size / n))


def measure(strategy, fields, radius, step, direction=0.0, climb=True):
    """Figures of one strategy on all regions of a pocket."""
    start = time.process_time()
    tracks = [t for field in fields for t in strategy(field, radius, step, direction, climb)]
    seconds = time.process_time() - start
    raster, rows, entries, lifted = Raster(fields, radius), [], 0, 0.0
    for k, track in enumerate(tracks):
        entry = 0.0
        if raster.solid(track.start):
            entries, entry = entries + 1, 2.0 * radius
            raster.clear(track.start)
        if k:
            lifted += float(np.hypot(*(track.start - tracks[k - 1].end)))
        for place, along, size in steps(track, raster.cell):
            if entry <= 0.0:
                rows.append((*raster.in_stock(place, along), size))
            entry -= size
            raster.clear(place)
    degrees, width, size = np.array(rows).T if rows else np.zeros((3, 1))
    cutting = size * (degrees > 2.0)
    return {
        "plan_ms": 1e3 * seconds,
        "tracks": len(tracks),
        "entries": entries,
        "lifted_mm": lifted,
        "length_mm": float(sum(t.length for t in tracks)),
        "cutting_mm": float(cutting.sum()),
        "mean_degrees": _mean(degrees, cutting),
        "most_degrees": float(degrees.max()),
        "mean_width_mm": _mean(width, cutting),
        "most_width_mm": float(width.max()),
        "full_share": float((size * (degrees > FULL_DEGREES)).sum() / max(cutting.sum(), 1e-9)),
        "ratio": float(sum(t.length for t in tracks)) * step / max(_reach(fields, radius), 1e-9),
    }


def _mean(value, weight):
    return float((value * weight).sum() / max(weight.sum(), 1e-9))


def _reach(fields, radius):
    """Area (mm2) the tool reaches, nearly: region, a band of radius along its contours, and its corners."""
    return sum(
        f.area + radius * sum(elements.lengths(c).sum() for c in f.contours) + math.pi * radius**2 for f in fields
    )


def pockets(count):
    """(fields, radius) of random pockets with islands."""
    seed, found = SEED, 0
    while found < count:
        seed += 1
        loops, radius = random_islands(seed)
        radius = min(max(radius, 1.5), 3.0)
        contours = [make_contour(parts) for parts in loops]
        fields = split(contours[0], contours[1:], radius)
        if sum(f.area for f in fields) > 40.0 * radius**2:
            found += 1
            yield fields, radius


COLUMNS = (
    ("length_mm", "length", "%.0f"),
    ("ratio", "x area/D", "%.2f"),
    ("entries", "entries", "%.1f"),
    ("tracks", "tracks", "%.1f"),
    ("mean_degrees", "mean deg", "%.0f"),
    ("most_degrees", "most deg", "%.0f"),
    ("mean_width_mm", "mean ae", "%.2f"),
    ("most_width_mm", "most ae", "%.2f"),
    ("full_share", "full width", "%.3f"),
    ("plan_ms", "plan ms", "%.0f"),
)


def show(title, figures):
    print("\n" + title)
    print("".join("%11s" % name for name in ("", *(c[1] for c in COLUMNS))))
    for name, row in figures.items():
        print("%11s" % name + "".join("%11s" % (form % row[key]) for key, _, form in COLUMNS))


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("--count", type=int, default=20)
    ask.add_argument("--step", type=float, default=0.8, help="step-over in tool radii")
    ask.add_argument("--json")
    args = ask.parse_args()
    boundary, islands = demo_pocket()
    fields = split(boundary, islands, 3.0)
    demo = {name: measure(strategy, fields, 3.0, args.step * 3.0) for name, strategy in STRATEGIES.items()}
    show(f"demo pocket, tool radius 3 mm, step-over {args.step * 3.0:g} mm", demo)
    many = {name: [] for name in STRATEGIES}
    for fields, radius in pockets(args.count):
        for name, strategy in STRATEGIES.items():
            many[name].append(measure(strategy, fields, radius, args.step * radius))
    medians = {
        name: {key: float(np.median([row[key] for row in rows])) for key in rows[0]} for name, rows in many.items()
    }
    show(f"{args.count} random pockets with islands, step-over {args.step:g} tool radii, medians", medians)
    if args.json:
        Path(args.json).write_text(
            json.dumps({"step_radii": args.step, "demo": demo, "random_medians": medians}, indent=1)
        )


if __name__ == "__main__":
    main()
