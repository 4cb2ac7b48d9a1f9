# SPDX-License-Identifier: GPL-2.0-or-later
"""Velocity, limited-by and the rate that counts of every case; easing step by step; hostile input."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, load_module, within

scene = load_module(SCENES / "feed_limits/stimulus.py")
SHARE = 2e-6  # halsampler prints six decimals


def check_cases(trace):
    rows = [row for row in range(len(trace["adaptive-feed"]) - scene.HOSTILE)]
    rows.remove(trace.phases["easing"].start)
    for k, (phase, pins, velocity, by, rate) in zip(rows, scene.CASES, strict=True):
        if velocity is None:
            continue
        where = f"at {k * PERIOD_S:.3f} s in phase '{phase}' with {pins}"
        factor = 1.0 if pins.get("mode") == 0 else velocity / scene.REQUESTED
        value = trace["adaptive-feed"][k]
        assert abs(value - factor) <= SHARE, f"adaptive-feed: {value:.6f} {where}, allowed: {factor:.6f} +- {SHARE:g}"
        assert trace["limited-by"][k] == by, f"limited-by: {trace['limited-by'][k]:.0f} {where}, allowed: {by}"
        counts = trace["mrr-effective"][k]
        assert abs(counts - rate) <= 1e-3, f"mrr-effective: {counts:.6g} mm3/min {where}, allowed: {rate:g}"


def check_easing(trace):
    rows = trace.phases["easing"]
    for k, velocity in enumerate(scene.eased(), rows.start + 1):
        value, factor = trace["eased-feed"][k], velocity / scene.REQUESTED
        assert abs(value - factor) <= SHARE, (
            f"eased-feed: {value:.6f} at {k * PERIOD_S:.3f} s, allowed: {factor:.6f} +- {SHARE:g}"
        )


def check_probing(trace):
    """override: F of the ceiling while probing and in mode 0, adaptive-feed in all other rows of the cases."""
    rows = trace.phases["probing"]
    given, law = trace["override"][: rows.stop], trace["adaptive-feed"][: rows.stop].copy()
    law[rows] = [0.5, 0.25, 1.0, 1.0, 1.0]
    for k, (_phase, pins, *_rest) in enumerate(scene.CASES):
        if pins.get("mode") == 0 and k < rows.stop:
            law[k] = pins.get("programmed-vel", scene.SOUND["programmed-vel"]) / scene.REQUESTED
    k = int(np.argmax(np.abs(given - law)))
    assert abs(given[k] - law[k]) <= SHARE, (
        f"override: {given[k]:.6f} at {k * PERIOD_S:.3f} s, allowed: {law[k]:.6f} +- {SHARE:g}"
    )


def check(trace):
    within(trace, "override", 0.0, 1.0, "(override)")
    within(trace, "adaptive-feed", 0.0, 1.0, "(override)")
    within(trace, "eased-feed", 0.0, 1.0, "(override)")
    within(trace, "limited-by", 0, 5, "(pin)")
    within(trace, "eased-by", 0, 5, "(pin)")
    check_cases(trace)
    check_easing(trace)
    check_probing(trace)


SABOTAGE = {
    "5 % too fast": lambda t: t.but(adaptive_feed=lambda f: np.minimum(1.0, 1.05 * f)),
    "tool rate ignored": lambda t: t.put("adaptive-feed", "tool rate", 0.25, 1),
    "tool rate not told": lambda t: t.put("mrr-effective", "tool rate", 6000.0),
    "no highest velocity": lambda t: t.put("adaptive-feed", "highest", 1.0),
    "no lowest velocity": lambda t: t.put("adaptive-feed", "lowest", 0.001),
    "air at the ceiling": lambda t: t.put("adaptive-feed", "air", 1.0),
    "plunge limits a rise": lambda t: t.put("adaptive-feed", "plunge", 0.125),
    "plunge not limited": lambda t: t.put("adaptive-feed", "plunge", 0.8),
    "chip not limited": lambda t: t.put("adaptive-feed", "chip", 0.8),
    "chip as if all were slots": lambda t: t.put("adaptive-feed", "chip", 0.05 * 100 * np.pi / 2 / 40),
    "rises at once": lambda t: t.put("eased-feed", "easing", 0.25, 5),
    "drops late": lambda t: t.but(eased_feed=lambda f: np.roll(f, 1)),
    "no deadband": lambda t: t.put("eased-feed", "easing", 5.5 / 40, 4),
    "probing at the ceiling": lambda t: t.put("override", "probing", 1.0),
    "override late": lambda t: t.but(override=lambda f: np.roll(f, 1)),
    "negative in hostile rows": lambda t: t.put("adaptive-feed", "hostile", -1e-6, 300),
    "NaN in hostile rows": lambda t: t.put("eased-feed", "hostile", np.nan, 33),
}
