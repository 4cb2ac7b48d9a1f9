# SPDX-License-Identifier: GPL-2.0-or-later
"""Volume, load, rate, depth and warning of a slot, against closed forms."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, load_module, near, require, within

slot = load_module(SCENES / "tracker_slot/stimulus.py")
R = 0.5 * slot.DIAMETER
COS = np.cos(slot.ANGLE)
FULL_MM2 = slot.DIAMETER * slot.DEPTH
LATE_MM = 0.051  # of the path ahead: one period, for the pins are read a period apart
EARLY_MM = 1.0


def volume_mm3(inside_mm):
    """Slot whose axis is `inside_mm` past the edge: a band across it and half a disc."""
    return slot.DEPTH * (slot.DIAMETER * inside_mm + 0.5 * np.pi * R * R)


def check(trace, scale=1.0):
    """`scale`: machine units per mm; the clock of the slot is the same in any."""
    cut = trace.only("cut")
    x = cut["pos-x"] / scale
    inside = x / COS  # mm of the axis past the edge
    to_contact = (-R - x) / COS  # mm until the tool touches the edge

    always_ready = trace.only("cut")
    require(always_ready, "ready", always_ready["ready"] == 1, "(pin)", "only 1")
    require(trace, "fault-code", trace["fault-code"] == 0, "(pin)", "only 0")

    within(cut, "removed-volume", -1e-9, 1e-9, "mm3", np.where(to_contact > 0, cut["removed-volume"], 0.0))
    deep = x > 5.0
    within(
        cut,
        "removed-volume",
        0.997,
        1.003,
        "of the closed form",
        np.where(deep, cut["removed-volume"] / volume_mm3(inside), 1.0),
    )
    stand = trace.only("stand")
    near("removed-volume at the end", stand["removed-volume"][-1], volume_mm3(inside[-1]), 0.003, "mm3", trace.t[-1])

    steady = cut["section-area"][x > 2.0]
    near("section-area, mean", steady.mean(), FULL_MM2, 0.01, "mm2", cut.start * PERIOD_S)
    assert steady.std() <= 0.02 * FULL_MM2, (
        f"section-area: standard deviation {steady.std():.4g} mm2, allowed {0.02 * FULL_MM2:g} mm2"
    )
    within(cut, "section-area", -1e-9, 1e-9, "mm2", np.where(to_contact > EARLY_MM, cut["section-area"], 0.0))

    speed = np.hypot(np.gradient(x), np.gradient(cut["pos-y"] / scale)) / PERIOD_S
    rate = cut["section-area"] * speed * 60.0
    within(
        cut,
        "mrr",
        0.98,
        1.02,
        "of section-area x velocity",
        np.where(inside > 2.0 / COS + 5.0, cut["mrr"] / np.maximum(rate, 1e-9), 1.0),
    )
    near("mrr when the tool stands", stand["mrr"][-1] + 1.0, 1.0, 1e-6, "mm3/min", trace.t[-1])

    within(
        cut, "depth", 0.999 * slot.DEPTH, 1.001 * slot.DEPTH, "mm", np.where(x > 0.0, cut["depth"] / scale, slot.DEPTH)
    )
    check_warning(cut, to_contact, scale)


def check_warning(cut, to_contact, scale):
    """From 4.5 mm before the touch on it is announced: never late, at most EARLY_MM early."""
    said, full = [np.full(len(to_contact), np.inf) for _ in range(2)]
    for i in range(7, -1, -1):
        area, distance = cut[f"load-step-area-{i}"], cut[f"load-step-distance-{i}"] / scale
        said = np.where(area > 0.0, distance, said)
        full = np.where(area >= 0.98 * FULL_MM2, distance, full)
    near_it = (to_contact > 0.0) & (to_contact < 4.5)
    within(
        cut,
        "load-step-distance of the first stock",
        -EARLY_MM,
        LATE_MM,
        "mm after the true one",
        np.where(near_it, said - to_contact, 0.0),
    )
    to_full = (R * np.sin(slot.ANGLE) - cut["pos-x"] / scale) / COS
    close = (to_full > 0.0) & (to_full < 4.5)
    within(
        cut,
        "load-step-distance of the full slot",
        -4.0,
        LATE_MM,
        "mm after the true one",
        np.where(close, full - to_full, 0.0),
    )


def late(cut):
    """The whole record of the path ahead half a millimetre late."""
    return cut.but(**{f"load_step_distance_{i}": lambda d: d + 0.5 for i in range(8)})


SABOTAGE = {
    "volume 5 % too large": lambda t: t.but(removed_volume=lambda v: 1.05 * v),
    "volume 1 % too small": lambda t: t.but(removed_volume=lambda v: 0.99 * v),
    "volume a millimetre late": lambda t: t.but(removed_volume=lambda v: np.roll(v, 20)),
    "volume NaN once": lambda t: t.put("removed-volume", "cut", np.nan, 900),
    "load 5 % too large": lambda t: t.but(section_area=lambda v: 1.05 * v),
    "load noisy": lambda t: t.but(section_area=lambda v: v * (1 + 0.05 * np.cos(np.arange(len(v))))),
    "load NaN once": lambda t: t.put("section-area", "cut", np.nan, 500),
    "load seen from 3 mm away": lambda t: t.but(section_area=lambda v: np.roll(v, -60)),
    "rate 5 % too large": lambda t: t.but(mrr=lambda v: 1.05 * v),
    "rate stuck": lambda t: t.put("mrr", "stand", 54000.0),
    "depth in the wrong unit": lambda t: t.but(depth=lambda v: 25.4 * v),
    "no depth": lambda t: t.but(depth=lambda v: 0 * v),
    "warning late": late,
    "warning far too early": lambda t: t.but(**{f"load_step_distance_{i}": lambda d: d - 1.5 for i in range(8)}),
    "no warning": lambda t: t.but(**{f"load_step_area_{i}": lambda a: 0 * a for i in range(8)}),
    "not ready once": lambda t: t.put("ready", "cut", 0, 700),
    "a fault": lambda t: t.put("fault-code", "cut", 21, 700),
}
