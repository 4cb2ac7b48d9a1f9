# SPDX-License-Identifier: GPL-2.0-or-later
"""Deflection errors of profiling control against the model of its stylus; the targets beside them.

Called by bench/run.py (prints JSON rows). The cost of a period: tracer_cost.c.
"""

import json
import math
import sys

import roots  # noqa: F401

import numpy as np

from chipwise.digitise import height_map
from support.tracer_rig import FAR, MODE, STATE, SURFACE, Rig, error, tracing

SLOPE = math.sqrt(0.5)


def row(name, value, target, note=""):
    verdict = f"{'meets' if value <= target else 'MISSES'} {target:g}" if target else ""
    print(
        json.dumps(
            {
                "name": name,
                "value": round(float(value), 5),
                "unit": "mm",
                "target": target,
                "note": "; ".join(part for part in (verdict, note) if part),
            }
        )
    )


def p99(values):
    return np.percentile(values, 99)


def slope(gain, friction, name, target):
    rig = Rig((-15, 0, -12), {"normal": (-SLOPE, 0, SLOPE), "noise_mm": 0.0005}, gain_hz=gain, friction_share=friction)
    rows = rig.until(STATE.DONE)
    row(f"45 degrees, 1000 mm/min, {name}: p99", p99(error(tracing(rows))), target, "landing included")
    row(f"45 degrees, 1000 mm/min, {name}: p99 from 0.2 s on", p99(error(tracing(rows, 0.2))), None)


def ball(radius, feed, periods, hollow, target):
    """Lines over a ball; without and with the first 0.05 s of a line, in which the ball of the stylus sticks and then
    slides."""
    width, name = 0.75 * radius, f"{'hollow ' if hollow else ''}ball R{radius}, {feed} mm/s, {periods} periods late"
    rig = Rig(
        (-width, -0.3 * radius, -0.4 * radius if hollow else radius + 2),
        {
            "surface_number": SURFACE.BOWL if hollow else SURFACE.BALL,
            "size_mm": radius + (1 if hollow else -1),
            "delay_periods": periods,
            "noise_mm": 0.0005,
        },
        feed_mm_s=feed,
        dead_time_s=0.001 * periods,
        pick_mm=0.3,
        window_min_mm=(-width, -0.3 * radius, -FAR),
        window_max_mm=(width, 0.3 * radius, FAR),
    )
    rows = rig.until(STATE.DONE)
    trace = rows["state"] == STATE.TRACE
    trace[: np.argmax(trace) + 200] = False
    settled = np.convolve(trace, np.ones(50))[: len(rows)] == 50
    row(f"{name}: p99", p99(error(rows[settled])), target, f"{settled.sum()} periods")
    row(f"{name}: p99 with the beginning of each line", p99(error(rows[trace])), target, f"{trace.sum()} periods")


def corner():
    """Largest share of range - eps0 used against a wall, over accelerations, ranges and dead times."""
    worst = 0.0
    for accel in (300, 2000, 8000):
        for reach in (0.5, 1.5, 5.0):
            for periods in (0, 3, 10):
                rig = Rig(
                    (-15, 0, 5),
                    {"surface_number": SURFACE.CORNER, "delay_periods": periods},
                    feed_mm_s=1e5,
                    max_vel_mm_s=1e5,
                    acceleration_mm_s2=accel,
                    range_mm=reach,
                    dead_time_s=0.001 * periods,
                    max_jump_mm=2.0,
                    approach_vel_mm_s=5.0,
                    soft_max_mm=(FAR, FAR, 15.0),
                )
                rows = rig.until(STATE.DONE, STATE.FAULT, STATE.OVER_RANGE)
                worst = max(worst, (rows["measured_mm"].max() - 0.3) / (reach - 0.3))
    print(
        json.dumps(
            {
                "name": "inside corner, feed at its limit: share of range - eps0 used",
                "value": round(float(worst), 3),
                "unit": "",
                "target": 1,
                "note": f"{'meets' if worst < 1 else 'MISSES'} 1; 27 cases",
            }
        )
    )


def digitised():
    """Height map of a ball R9, traced with a stylus R1 in lines 0.1 mm apart, at the cells' middles."""
    rig = Rig(
        (-2.5, -2.5, 12),
        {"surface_number": SURFACE.BALL, "size_mm": 9, "noise_mm": 0.0005, "delay_periods": 2},
        feed_mm_s=25.0,
        pick_mm=0.1,
        dead_time_s=0.002,
        window_min_mm=(-2.5, -2.5, -FAR),
        window_max_mm=(2.5, 2.5, FAR),
    )
    rows = rig.until(STATE.DONE)
    model = height_map.envelope(rows["seen_ball_mm"][rows["state"] == STATE.TRACE], 1.0, 0.1)
    ny, nx = model.heights.shape
    x, y = np.meshgrid(model.x0 + (np.arange(nx) + 0.5) * 0.1, model.y0 + (np.arange(ny) + 0.5) * 0.1)
    inside = (np.abs(x) < 2.2) & (np.abs(y) < 2.2)
    off = np.abs(model.heights - np.sqrt(81.0 - x**2 - y**2))[inside]
    row("digitised ball R9: p99", p99(off), 0.005, f"{len(off)} cells, worst {off.max():.4f}")


def contour():
    rig = Rig(
        (-15, 0, 0),
        {"surface_number": SURFACE.CYLINDER, "size_mm": 9, "noise_mm": 0.0005},
        mode_number=MODE.CONTOUR,
        approach_dir=(1, 0, 0),
    )
    row(
        "contour of a cylinder R10, 1000 mm/min: p99",
        p99(error(tracing(rig.until(STATE.DONE)))),
        None,
        "landing included",
    )


def main():
    slope(1000.0, 0.0, "gain 750", 0.005)
    slope(100.0, 0.0, "gain 100", None)
    slope(100.0, 0.148, "gain 100, friction known", None)
    for hollow in (False, True):
        ball(10, 50, 0, hollow, 0.005)
        ball(3, 20, 3, hollow, 0.003)
    corner()
    contour()
    digitised()


if __name__ == "__main__":
    sys.exit(main())
