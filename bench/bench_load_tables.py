# SPDX-License-Identifier: GPL-2.0-or-later
"""The predicted power from materials.toml alone, nothing taught, against the true power of a cut in the same material.

Called by hand: bench_load_tables.py [--count N] prints a row for each material, N of them spread over the table; 20 s
of computing for all.

True is the edge-by-edge model in an exact stock (tests/support/tooth_oracle.py). Its power goes through the simulated
spindle (spindle_sim: factor 1, noise 10 %, lag 0.3 s), and the core finds the factor of the cut as on the machine. So a
factor that is not 1 is the error of chipwise's map, of its prediction and of its teaching. What the figures of a table
are off for the batch, the edge and the coolant at hand comes on top, and no simulation knows it.
"""

import argparse
import ctypes as C
import math
import tomllib

import numpy as np
import roots  # noqa: F401  sys.path

from chipwise.clib import core, layout
from chipwise.clib.library import library
from chipwise.tool_data import materials
from support.tooth_oracle import PERIOD, Drive, Limits, Plane

Z, DIAMETER, FLUTES, RPS = -3.0, 10.0, 3, 100.0  # mm, 1/s
FEEDS, SHARES = (8.0, 11.0, 6.0), (0.1, 0.25, 0.5, 0.75, 1.2)  # mm/s; widths over the diameter, 1.2: a slot
AIR_S, LENGTH = 3.0, 45.0  # s, mm
IDLE_W, TARGET = (60.0, 0.5, 0.001), 0.15


def cut(material, number):
    """(predicted W, true W) in each period of a pass."""
    plane, angle = Plane(), 0.3 + 0.1 * number
    along = np.array([math.cos(angle), math.sin(angle)])
    plane.cut([-80.0 * along, 80.0 * along], 0.5 * DIAMETER, Z)
    begin = np.array([-along[1], along[0]]) * DIAMETER * SHARES[number % len(SHARES)] - 0.5 * LENGTH * along
    limits = Limits(power=1e6, rps=RPS, flutes=FLUTES, kc11=material.kc11, mc=material.mc)
    drive = Drive(plane, DIAMETER, Z, limits, ceiling=FEEDS[number % len(FEEDS)])
    seen = drive.go([core.line((*begin, Z), (*(begin + LENGTH * along), Z))])
    return seen[:, 5], seen[:, 1] * 2.0 * math.pi * RPS


def taught(predicted, true, seed):
    """The factor that the core finds when the spindle takes `true`."""
    step, sense = library().chip_spindle_sim_step, library().chip_spindle_load_step
    step.restype, step.argtypes = (
        layout.SpindleShown,
        [C.c_void_p, C.c_void_p, C.c_double, C.c_double, C.c_int, C.c_int],
    )
    sense.restype, sense.argtypes = C.c_int, [C.c_void_p, C.c_void_p]
    sim, load = layout.SpindleSim(), layout.SpindleLoad()
    spindle = layout.SpindleSettings(
        idle_w=IDLE_W, factor_share=1.0, lag_s=0.3, noise_share=0.1, sample_s=0.01, period_s=PERIOD, seed_number=seed
    )
    seen = layout.LoadIn(
        spindle_speed_rps=RPS, period_s=PERIOD, specific_force_n_mm2=1.0, is_known=1, feeds=1, moves=1, tool_number=1
    )
    air = np.zeros(round(AIR_S / PERIOD))
    for told, real in zip(np.concatenate((air, predicted, air)), np.concatenate((air, true, air))):
        seen.spindle_load_w = step(C.byref(sim), C.byref(spindle), RPS, float(real), 0, 0).load_w
        seen.power_w, seen.section_area_mm2 = float(told), 1.0 if told > 0.0 else 0.0
        sense(C.byref(load), C.byref(seen))
    return load.cut_factor if load.cuts else math.nan


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--count", type=int, default=1000)
    options = parser.parse_args()
    with open(materials.TABLE, "rb") as file:
        names = list(tomllib.load(file))
    names = names[:: max(1, len(names) // options.count)]
    print("| material | kc11 | mc | mean power, W | predicted / true | factor found |\n|---|---|---|---|---|---|")
    worst = 0.0
    for number, name in enumerate(names):
        material = materials.find_material(name)
        predicted, true = cut(material, number)
        factor = taught(predicted, true, number + 1)
        ratio = predicted.sum() / true.sum()
        worst = max(worst, abs(factor - 1.0), abs(ratio - 1.0))
        print(
            f"| {name} | {material.kc11:g} | {material.mc:g} | {true.mean():.0f} | {ratio:.3f} | {factor:.3f} |",
            flush=True,
        )
    print(f"largest error {100 * worst:.1f} %, {'meets' if worst <= TARGET else 'MISSES'} {100 * TARGET:g} %")


if __name__ == "__main__":
    main()
