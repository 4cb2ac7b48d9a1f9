# SPDX-License-Identifier: GPL-2.0-or-later
"""Override and limited-by of every case; hostile input never leaves [0, 1]."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, load_module, within

scene = load_module(SCENES / "feed_law/stimulus.py")
SHARE = 1e-6 + 5e-7  # halsampler prints six decimals


def expected_ahead(pins, before):
    """Override where only places ahead limit; `before`: that of the period before."""
    row = dict(scene.SOUND, **pins)
    limits = [
        scene.braking(100 / row["area-" + which], row["distance-" + which], scale=before)
        for which in ("first", "last")
        if row["area-" + which] > 0
    ]
    return min(limits) / row["requested-vel"]


def check(trace):
    within(trace, "adaptive-feed", 0.0, 1.0, "(override)")
    within(trace, "limited-by", 0, 5, "(pin)")
    for k, (phase, pins, factor, by) in enumerate(scene.CASES):
        value = trace["adaptive-feed"][k]
        if factor is None:
            factor = expected_ahead(pins, trace["adaptive-feed"][k - 1])
        where = f"at {k * PERIOD_S:.3f} s in phase '{phase}' with {pins}"
        assert abs(value - factor) <= SHARE, f"adaptive-feed: {value:.6f} {where}, allowed: {factor:.6f} +- {SHARE:g}"
        assert trace["limited-by"][k] == by, f"limited-by: {trace['limited-by'][k]:.0f} {where}, allowed: {by}"
    assert len(trace["adaptive-feed"]) == len(scene.CASES) + scene.HOSTILE, "rows missing, allowed: all"


SABOTAGE = {
    "5 % too fast": lambda t: t.but(adaptive_feed=lambda f: np.minimum(1.0, 1.05 * f)),
    "stuck at 1": lambda t: t.but(adaptive_feed=lambda f: 0 * f + 1.0),
    "stuck at 0": lambda t: t.but(adaptive_feed=lambda f: 0 * f),
    "NaN in hostile rows": lambda t: t.put("adaptive-feed", "hostile", np.nan, 33),
    "negative in hostile rows": lambda t: t.put("adaptive-feed", "hostile", -1e-6, 600),
    "above 1 in hostile rows": lambda t: t.put("adaptive-feed", "hostile", 1.2, 600),
    "code out of range": lambda t: t.put("limited-by", "hostile", 6, 1),
    "a period late": lambda t: t.but(adaptive_feed=lambda f: np.roll(f, 1)),
    "no code": lambda t: t.but(limited_by=lambda b: 0 * b),
    "traverses slowed": lambda t: t.put("adaptive-feed", "other motion", 0.5, 7),
    "no look-ahead": lambda t: t.put("adaptive-feed", "ahead", 1.0),
    "brakes with the whole acceleration": lambda t: t.put("adaptive-feed", "ahead", 0.52, 0),
    "no floor": lambda t: t.put("adaptive-feed", "floor", 0.05, 0),
    "fallback stops": lambda t: t.put("adaptive-feed", "fallback", 0.0, 0),
    "fallback not said": lambda t: t.put("limited-by", "fallback", 0, 5),
}
