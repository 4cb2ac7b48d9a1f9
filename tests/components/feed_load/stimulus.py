# SPDX-License-Identifier: GPL-2.0-or-later
"""Air, then a cut of 535 W whose load the sensor shows 0.1 s late, with noise; each fault of the sensor in between."""

import math
import random

from support.halrig import PERIOD_S, Stimulus

SEED, NOISE, LAG_S = 11, 0.05, 0.1
IDLE_W, FACTOR, TURNS = 110.0, 1.2, 100.0  # 1/s
AREA, ROOT = 10.0, 100.0
POWER_W = 0.8 * 2 * TURNS * (10.0 / (2 * TURNS) * ROOT) ** 0.75  # kc11 800, 2 edges, 10 mm/s
SOUND_S = 1.8
FAULTS = {"no number": 1.5, "frozen": 3.5, "negative": 1.5, "spikes": 0.8, "no speed": 0.8}  # s


def stimulus():
    rows = Stimulus({"section-area": [], "power-root": [], "spindle-speed": [], "spindle-load": []})
    rng, load = random.Random(SEED), IDLE_W

    def stay(seconds, goal=IDLE_W + FACTOR * POWER_W, area=AREA, speed=TURNS, shown=None):
        nonlocal load
        for k in range(round(seconds / PERIOD_S)):
            load += (goal - load) * PERIOD_S / LAG_S
            seen = load * (1.0 + rng.uniform(-NOISE, NOISE))
            rows.add(
                {
                    "section-area": area,
                    "power-root": ROOT if area else 0.0,
                    "spindle-speed": speed,
                    "spindle-load": shown(k, seen) if shown else seen,
                }
            )

    rows.phase("air")
    stay(3.0, IDLE_W, 0.0)
    rows.phase("cut")
    stay(3.0)
    for fault, seconds in FAULTS.items():
        rows.phase(fault)
        if fault == "no speed":
            stay(seconds, IDLE_W, speed=0.0)
        else:
            stay(
                seconds,
                shown={
                    "no number": lambda k, seen: (math.nan, math.inf, seen)[k % 3],
                    "frozen": lambda _k, _seen: 700.0,
                    "negative": lambda _k, seen: -seen,
                    "spikes": lambda k, seen: seen if k % 97 else 20.0 * seen,
                }[fault],
            )
        rows.phase(f"after {fault}")
        stay(SOUND_S)
    rows.phase("between")
    stay(3.0, IDLE_W, 0.0)
    rows.phase("cut again")
    stay(3.0)
    rows.phase("broken")
    stay(1.0, IDLE_W)
    return rows
