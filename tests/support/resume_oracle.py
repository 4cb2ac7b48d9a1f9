# SPDX-License-Identifier: GPL-2.0-or-later
"""A program that is stopped at a moment, as the machine would have cut and saved it.  Used by tests/resume/.

It knows neither segments nor evidence of the product: the path is followed in steps of the servo thread, arcs on their
circles, and the core cuts.
"""

import math
import random
import shutil

import numpy as np

from chipwise.geometry.base.arc_sweep import arc_sweep
from chipwise.program import records
from chipwise.clib.height_map import Shape
from chipwise.resume import stocks
from chipwise.stock import journal
from chipwise.clib.core import Cutter, Tool
from chipwise.tool_data.geometry import ToolGeometry
from support import ROOT

PERIOD_S = 0.004  # four servo periods
RAPID_MM_S = 100.0
_AXES = {1: (0, 1, 2), 2: (1, 2, 0), 3: (2, 0, 1)}


def make_machine(folder, tools=None, table=None):
    """INI file of a mill whose stocks are kept in a folder of its own."""
    folder.mkdir(exist_ok=True)
    (folder / "subs").mkdir(exist_ok=True)
    (folder / "stock").mkdir(exist_ok=True)
    shutil.copy(ROOT / "configs" / "tools.toml", folder / "tools.toml")
    shutil.copy(ROOT / "configs" / "mill.tbl", folder / "mill.tbl")
    if table:
        (folder / "mill.tbl").write_text(table)
    if tools:
        (folder / "tools.toml").write_text(tools)
    text = (ROOT / "configs" / "mill.ini").read_text()
    text = (
        text.replace("TOPLEVEL = remap/toplevel.py", f"TOPLEVEL = {ROOT}/remap/toplevel.py")
        .replace("PATH_PREPEND = remap", f"PATH_PREPEND = {ROOT}/remap")
        .replace(
            "SUBROUTINE_PATH = nc_files:../nc_files:../nc_files/patterns",
            f"SUBROUTINE_PATH = subs:{ROOT}/nc_files:{ROOT}/nc_files/patterns",
        )
        .replace("KEEP_STOCK = no", "KEEP_STOCK = yes")
    )
    (folder / "mill.ini").write_text(text)
    return folder / "mill.ini"


class Run:
    """A program as the machine runs it: points (n, 3) of its path, one a period, the move that each is of, and the time
    to it."""

    def __init__(self, program, geometry, cell=0.4):
        self.program = program
        first = max(
            next(e.at for e in program.events if e.kind == records.STOCK), program.known_from, program.lead.named_from
        )
        points, moves, seconds = [program.start(first)[None]], [np.array([first])], [np.zeros(1)]
        for step in range(int(program.step[first]), program.steps):
            own, took = self._step(step)
            points.append(own)
            seconds.append(np.full(len(own), took / len(own)))
            moves.append(np.full(len(own), int(program.first[step])))
        self.points, self.move = np.concatenate(points), np.concatenate(moves)
        self.seconds = np.concatenate(seconds)
        self.tool = np.zeros(len(self.points), int)
        self.tools = [None]
        for event in program.events:
            if event.kind == records.TOOL:
                shape = Shape.of_tool(event.values[1], geometry.get(int(event.values[0])) or ToolGeometry())
                self.tools.append(
                    Tool(shape.diameter, shape.corner_radius, shape.tip_angle) if event.values[1] > 0 else None
                )
                self.tool[self.move >= event.at] = len(self.tools) - 1
        self.blank = next(e for e in program.events if e.kind == records.STOCK)
        self.cell = cell

    def _step(self, step):
        """((n, 3): the points of a step but for its start, s)."""
        p = self.program
        a, b = int(p.first[step]), int(p.first[step + 1])
        start, end = p.start(a), p.end[b - 1]
        speed = RAPID_MM_S if p.kind[a] == records.RAPID else min(p.feed[a] / 60, RAPID_MM_S)
        if p.kind[a] != records.ARC:
            n = max(1, math.ceil(np.linalg.norm(end - start) / (speed * PERIOD_S)))
            share = np.arange(1, n + 1)[:, None] / n
            return start + (end - start) * share, np.linalg.norm(end - start) / speed
        circle = p.circles[p.circle[step]]
        u, v, w = _AXES[circle.plane]
        c = circle.centre
        sweep = arc_sweep((start[u], start[v], start[w]), (end[u], end[v]), (c[u], c[v]), circle.turns, 1.0)
        angle, radius = math.atan2(start[v] - c[v], start[u] - c[u]), math.hypot(start[u] - c[u], start[v] - c[v])
        last = math.hypot(end[u] - c[u], end[v] - c[v])
        took = math.hypot(abs(sweep) * radius, end[w] - start[w]) / speed
        n = max(1, math.ceil(took / PERIOD_S))
        share = np.arange(1, n + 1) / n
        r, t = radius + (last - radius) * share, angle + sweep * share
        out = np.empty((n, 3))
        out[:, u], out[:, v], out[:, w] = (
            c[u] + r * np.cos(t),
            c[v] + r * np.sin(t),
            start[w] + (end[w] - start[w]) * share,
        )
        return out, took

    def new_stock(self):
        return stocks.of_record(self.blank, self.cell, None)

    def cut(self, stock, first, end):
        """Cut by the points first .. end; -> mm3."""
        removed, cutter, had = 0.0, None, None
        for k in range(first + 1, end + 1):
            if self.tool[k] != had:
                had = self.tool[k]
                cutter = Cutter(stock, self.tools[had], self.points[k - 1]) if self.tools[had] else None
            if cutter:
                removed += cutter.to(self.points[k])
        return removed


def write_journal(path, stock, removed, tip, line, program, when):
    """What the machine saves while it works."""
    writer = journal.Writer(str(path), stocks.head_of(stock, 0.0))
    cells = np.ascontiguousarray(stock.cells_and_ring).view(np.uint64).reshape(-1)
    note = journal.Note(when, removed, tuple(map(float, tip)), line, str(program))
    for first in range(0, cells.size, journal.BAND_CELLS):
        writer.band(first, cells[first : first + journal.BAND_CELLS], note)
    writer.publish()
    writer.close()


def neighbours(z, pick):
    padded = np.pad(z, 1, mode="edge")
    return pick(np.stack([padded[i : i + z.shape[0], j : j + z.shape[1]] for i in range(3) for j in range(3)]), axis=0)


def apart(one, two):
    """mm that heights of `two` are outside of those of `one` and the cells beside it: (higher, lower)."""
    return outside(stocks.heights(one), stocks.heights(two))


def outside(a, b):
    """The same of heights (ny, nx)."""
    return float((b - neighbours(a, np.max)).max()), float((neighbours(a, np.min) - b).max())


def moments(run, count, seed):
    """Random indices of points, rising, of feed moves and traverses behind the first cut."""
    rng = random.Random(seed)
    return sorted(rng.randrange(len(run.points) // 50, len(run.points) - 2) for _ in range(count))
