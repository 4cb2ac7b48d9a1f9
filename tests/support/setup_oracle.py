# SPDX-License-Identifier: GPL-2.0-or-later
"""The largest mean over 1 s of what a program's tools cut sideways at its own F, found apart from the product.

Called by tests/setup.  The path is that of the preview's interpreter (canon.py), the clock a motion profile of its own
(nodes a tenth of a millimetre apart, forward and backward), the removal that of the judge of machine runs (judge.c:
exact chords and steps of 0.03 mm, no height map).  mm, s, mm3/min.
"""

import cmath
import math
import re

import numpy as np

from support import judge as judging

NODE = 0.1  # mm
PERIOD = 0.004  # s between rows
ACCEL, SPEED = 500.0, 100.0  # mm/s2, mm/s: configs/mill.ini
ROUNDED = 0.01  # mm: a corner is cut by so much
FALL = 1e-4  # of the length: going down
WINDOW_S = 1.0
AIR_S = 0.1  # a pause in the cutting longer than this is air
LEAST = 1e-4  # mm2


def nodes_of(element):
    """(n, 3) along an element, without its start."""
    a, b = np.array(element.a), np.array(element.b)
    if element.kind != "arc":
        count = max(1, math.ceil(math.dist(element.a, element.b) / NODE))
        return a + (b - a) * (np.arange(1, count + 1) / count)[:, None]
    first, turn = element.sweep
    count = max(2, math.ceil(math.hypot(element.radius * turn, element.b[2] - element.a[2]) / NODE))
    share = np.arange(1, count + 1) / count
    at = [complex(*element.centre) + element.radius * cmath.exp(1j * (first + turn * s)) for s in share]
    return np.column_stack(([p.real for p in at], [p.imag for p in at], a[2] + (b[2] - a[2]) * share))


def called_tools(text):
    """Number of the tool in the spindle at each line of a program, from 1 on."""
    found, now = [0], 0
    for line in text.splitlines():
        match = re.search(r"T(\d+)\s*M0?6", line) or re.search(r"M0?6\s*T(\d+)", line)
        now = int(match.group(1)) if match else now
        found.append(now)
    return found


def profile(points, speed, stops):
    """Seconds at each node: the highest speeds that bends, stops and the acceleration allow.  speed (n,): of the step
    that ends at a node."""
    step = np.diff(points, axis=0)
    length = np.maximum(np.linalg.norm(step, axis=1), 1e-9)
    unit = step / length[:, None]
    half = np.sqrt(np.clip((1 + (unit[1:] * unit[:-1]).sum(axis=1)) / 2, 0, 1))
    with np.errstate(divide="ignore"):
        bend = np.sqrt(ACCEL * ROUNDED * half / np.maximum(1 - half, 1e-12))
    most = np.concatenate(([0.0], np.minimum(bend, np.minimum(speed[2:], speed[1:-1])), [0.0]))
    most[stops] = 0.0
    now = most.tolist()
    for k in range(1, len(now)):
        now[k] = min(now[k], math.sqrt(now[k - 1] ** 2 + 2 * ACCEL * length[k - 1]))
    for k in range(len(now) - 2, -1, -1):
        now[k] = min(now[k], math.sqrt(now[k + 1] ** 2 + 2 * ACCEL * length[k]))
    now = np.array(now)
    top = np.minimum(speed[1:], np.sqrt((now[:-1] ** 2 + now[1:] ** 2) / 2 + ACCEL * length))
    ramps = (2 * top - now[:-1] - now[1:]) / ACCEL
    rest = length - (2 * top**2 - now[:-1] ** 2 - now[1:] ** 2) / (2 * ACCEL)
    return np.concatenate(([0.0], np.cumsum(ramps + rest / top)))


def rows_of(trace, text):
    """(log for judge.Run, tool at each row, whether each row goes down) at every PERIOD."""
    tools, points, speed, line, kind, down, stops = (
        called_tools(text),
        [np.array(trace.elements[0].a)[None]],
        [0.0],
        [0],
        [1],
        [False],
        [],
    )
    for element, feed, number in zip(trace.elements, trace.feeds, trace.lines):
        part = nodes_of(element)
        if np.linalg.norm(part[-1] - points[-1][-1]) < 1e-9 and element.kind != "arc":
            continue
        before = np.vstack((points[-1][-1:], part))
        fall = np.diff(before[:, 2])
        if kind[-1] == 1 or element.kind == "rapid":
            stops.append(len(speed) - 1)
        points.append(part)
        speed += [min((feed or 1e9) / 60, SPEED)] * len(part)
        line += [number] * len(part)
        kind += [1 if element.kind == "rapid" else 2] * len(part)
        down += (fall < -FALL * np.linalg.norm(np.diff(before, axis=0), axis=1)).tolist()
    points = np.vstack(points)
    clock = profile(points, np.array(speed), stops)
    times = np.arange(0.0, clock[-1], PERIOD)
    node = np.minimum(np.searchsorted(clock, times, side="left"), len(clock) - 1)
    x, y, z = (np.interp(times, clock, points[:, k]) for k in range(3))
    lines = np.array(line)[node]
    log = {
        "period": PERIOD,
        "units_per_mm": 1.0,
        "sample": np.arange(len(times)),
        "x": x,
        "y": y,
        "z": z,
        "tool_offset_z": np.zeros(len(times)),
        "motion_type": np.array(kind)[node],
        "line": lines,
    }
    return log, np.array(tools)[lines], np.array(down)[node]


def largest_means(trace, text, blank, tools, cell=0.03):
    """{number: mm3/min} of tools {number: judge.Tool}; 0 for one that removes next to nothing sideways."""
    log, number, down = rows_of(trace, text)
    order = sorted(tools)
    index = np.searchsorted(order, np.where(np.isin(number, order), number, order[0]))
    run = judging.Run(log, index, int(np.flatnonzero(log["motion_type"] == 2)[0]) - 1)
    swept = judging.sweep(run, blank, [tools[n] for n in order], cell=cell)
    gone = np.diff(swept.volume, prepend=0.0)
    moved = np.diff(swept.path, prepend=0.0)
    result = {}
    for k, n in enumerate(order):
        mine = (run.tool == k) & run.feeding
        cuts = np.flatnonzero(mine & (gone > LEAST * moved))
        near = np.zeros(len(gone), bool)
        for a, b in zip(cuts[:-1], cuts[1:]):
            near[a : b + 1 if (b - a) * PERIOD <= AIR_S else a + 1] = True
        near[cuts] = True
        work = gone[near & mine & ~down]
        if work.sum() < 0.01 * gone[mine].sum() or not len(work):
            result[n] = 0.0
            continue
        span = min(len(work), round(WINDOW_S / PERIOD))
        total = np.concatenate(([0.0], np.cumsum(work)))
        result[n] = float((total[span:] - total[:-span]).max()) / (span * PERIOD) * 60
    return result
