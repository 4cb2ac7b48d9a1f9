# SPDX-License-Identifier: GPL-2.0-or-later
"""Side force, chip and power of the cutter in a run, edge by edge, from the servo-rate log, the blank and the tools
alone.

Called by bench/bench_force.py, bench/bench_limits.py, tests/oracles/test_judge_force.py, tests/core/test_force_rows.py
and tests/core/test_force_shapes.py.  How it computes: tests/support/judge_force.c; of the product it has nothing.

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
    """-> (m, 5): path of each place (mm), and there the longest and the mean sum of the edges (mm), the largest n . d
    and A_mc (mm2)."""
    room = int(np.linalg.norm(ends[:, 3:] - ends[:, :3], axis=1).sum() / step) + len(ends) + 16
    rows, sizes, box = np.zeros((room, 5)), judging.packed_tools(tools), blank.packed()
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


@dataclass
class Met:
    """What the edges meet at each sample of a run, (n,); 0 in air."""

    most: np.ndarray  # mm, longest sum of all edges
    chip: np.ndarray  # largest n . d
    work: np.ndarray  # mm2, A_mc
    fed: np.ndarray  # mm, since the edge before was there
    rate: np.ndarray  # edges a second


def met(run, blank, tools, edges, rps, mc, step=STEP):
    """Met of a run.  rps (n,): turns of the spindle, 1/s; edges: of each tool."""
    first, last, path = judging.chords(run.tips, run.apart)
    ends = np.ascontiguousarray(np.hstack([run.tips[first], run.tips[last]]))
    rows = places(blank, tools, edges, mc, ends, np.ascontiguousarray(run.tool[last], dtype=np.int32), step)
    clock, rate = np.cumsum(run.took), rps * np.asarray(edges)[run.tool]
    fed = np.maximum(path - np.interp(clock - 1.0 / np.maximum(rate, 1e-9), clock, path), 0.0)
    if len(rows) < 2:
        none = np.zeros(len(path))
        return Met(none, none, none, fed, rate)
    after = np.searchsorted(rows[:, 0], path).clip(1, len(rows) - 1)
    near = np.where(path - rows[after - 1, 0] < rows[after, 0] - path, after - 1, after)
    inside = np.abs(rows[near, 0] - path) <= step
    most, chip, work = (np.where(inside, rows[near, column], 0.0) for column in (1, 3, 4))
    return Met(most, chip, work, fed, rate)


def side_force(run, blank, tools, edges, rps, kc11, mc, step=STEP):
    """(n,) N at each sample: largest of a turn.  rps (n,): turns of the spindle, 1/s; edges: of each tool."""
    found = met(run, blank, tools, edges, rps, mc, step)
    return kc11 * found.most * found.fed ** (1.0 - mc)


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
