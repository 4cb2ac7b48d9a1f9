# SPDX-License-Identifier: GPL-2.0-or-later
"""The side force on the cutter in a run, edge by edge, from the servo-rate log, the blank and the tools alone.

Called by bench/bench_force.py, tests/oracles/test_judge_force.py and tests/core/test_force_shapes.py.  How it computes:
tests/support/judge_force.c; of the product it has nothing.

    force = side_force(Run(log), blank, [Tool(6.0)], [2], rps, kc11=800.0, mc=0.25)

The chip of an edge is what the tool has gone in 1 / (n z), since the edge before was at that angle.  The force of a
period is the largest of all angles of the cutter, so a turn has none that is larger.
"""

import ctypes as C
from dataclasses import dataclass

import numpy as np

from support import judge as judging

STEP = 0.04  # mm between places
CARBIDE = 580000.0  # N/mm2


def places(blank, tools, edges, mc, ends, tool_of, step=STEP):
    """-> (m, 3): path of each place (mm), longest and mean sum of the edges there (mm)."""
    room = int(np.linalg.norm(ends[:, 3:] - ends[:, :3], axis=1).sum() / step) + len(ends) + 16
    rows, sizes, box = np.zeros((room, 3)), judging.packed_tools(tools), blank.packed()
    flutes = np.asarray(edges, dtype=np.int32)
    if (360 % flutes).any():
        raise ValueError(f"judge: edges {edges} do not divide 360")
    made = judging.library().judge_force(
        judging.pointer(box),
        C.c_long(len(sizes)),
        judging.pointer(sizes),
        judging.pointer(flutes),
        C.c_double(mc),
        C.c_long(len(ends)),
        judging.pointer(ends),
        judging.pointer(tool_of),
        C.c_double(step),
        C.c_long(room),
        judging.pointer(rows),
    )
    if made < 0:
        raise RuntimeError("judge: no room for the places")
    return rows[:made]


def side_force(run, blank, tools, edges, rps, kc11, mc, step=STEP):
    """(n,) N at each sample: largest of a turn.  rps (n,): turns of the spindle, 1/s; edges: of each tool."""
    first, last, path = judging.chords(run.tips, run.apart)
    ends = np.ascontiguousarray(np.hstack([run.tips[first], run.tips[last]]))
    rows = places(blank, tools, edges, mc, ends, np.ascontiguousarray(run.tool[last], dtype=np.int32), step)
    clock = np.cumsum(run.took)
    before = np.interp(clock - 1.0 / (np.maximum(rps, 1e-9) * np.asarray(edges)[run.tool]), clock, path)
    if len(rows) < 2:
        return np.zeros(len(path))
    after = np.searchsorted(rows[:, 0], path).clip(1, len(rows) - 1)
    near = np.where(path - rows[after - 1, 0] < rows[after, 0] - path, after - 1, after)
    inside = np.abs(rows[near, 0] - path) <= step
    return np.where(inside, kc11 * rows[near, 1] * np.maximum(path - before, 0.0) ** (1.0 - mc), 0.0)


def stiffness(diameter, stick_out, modulus=CARBIDE):
    """N that bend the tip of a round beam by 1 mm."""
    return 3.0 * modulus * np.pi * diameter**4 / 64.0 / stick_out**3


@dataclass
class ForceVerdict:
    peak: float  # of the limit, in one period
    over_share: float  # of the time with a force, above PEAK
    used: float  # of the limit: median of the time in which `limits` is said
    limits_share: float  # of the time with a force, in which it is said
    worst: tuple  # (line, x, y, z) of the peak


PEAK = 1.05
LEAST = 1e-3  # of the limit: less is air


def judge(run, force, limit, held, limits):
    """force, limit (n,) N; held (n,): the limit holds there; limits (n,): the product says that it does."""
    rows = np.flatnonzero(held & run.feeding & ~run.apart & (limit > 0.0) & (force > LEAST * limit))
    if not len(rows):
        return ForceVerdict(0.0, 0.0, 0.0, 0.0, ())
    load = force[rows] / limit[rows]
    said, top = limits[rows], rows[int(np.argmax(load))]
    return ForceVerdict(
        float(load.max()),
        float((load > PEAK).mean()),
        float(np.median(load[said])) if said.any() else 0.0,
        float(said.mean()),
        (int(run.line[top]), *np.round(run.tips[top], 3).tolist()),
    )
