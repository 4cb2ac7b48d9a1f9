# SPDX-License-Identifier: GPL-2.0-or-later
"""The feed with a sensor that fails is that without a sensor, no alarm holds; a broken tool slows down and holds."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, load_module, within

scene = load_module(SCENES / "feed_load/stimulus.py")
SHARE = 2e-6  # halsampler prints six decimals
UNUSABLE, BROKEN, SLOWER = 6, 1, 0.5
SAID = ("no number", "frozen", "negative")


def check(trace):
    end = trace.phases["broken"]
    within(trace, "plain-alarm", 0, 0, "(pin)")
    within(trace, "slow-feed", 0.0, trace["plain-feed"] + SHARE, "(override)")
    sound = slice(0, end.start)
    off = np.abs(trace["slow-feed"][sound] - trace["plain-feed"][sound])
    k = int(np.argmax(off))
    assert off[k] <= SHARE, f"slow-feed: {off[k]:.6f} off at {k * PERIOD_S:.3f} s, allowed: {SHARE:g}"
    assert not trace["stop"][sound].any(), "stop: 1 before the tool breaks, allowed: 0"
    for phase in scene.FAULTS:
        seen = set(trace["slow-alarm"][trace.phases[phase]])
        wanted = {UNUSABLE} if phase in SAID else {0.0}
        assert seen - {0.0} == wanted - {0.0}, f"slow-alarm: {seen} in phase '{phase}', allowed: {wanted} and 0"
    last = slice(end.stop - 200, end.stop)
    for name, value in (("stop", 1.0), ("slow-alarm", BROKEN)):
        assert (trace[name][last] == value).all(), f"{name} after the tool has broken, allowed: {value:g}"
    share = trace["slow-feed"][last] / trace["plain-feed"][last]
    assert np.abs(share - SLOWER).max() < 1e-4, f"slow-feed: {share.max():.4f} of the feed, allowed: {SLOWER:g}"


SABOTAGE = {
    "raised without a number": lambda t: t.put("slow-feed", "no number", 0.3, 5),
    "slowed by a frozen sensor": lambda t: t.put("slow-feed", "frozen", 0.125, 2500),
    "held by a negative load": lambda t: t.put("stop", "negative", 1.0, 20),
    "an alarm by spikes": lambda t: t.put("slow-alarm", "spikes", 2, 20),
    "a frozen sensor not said": lambda t: t.put("slow-alarm", "frozen", 0),
    "not slowed": lambda t: t.but(slow_feed=lambda f: np.maximum(f, 0.25 * (f > 0))),
    "not held": lambda t: t.put("stop", "broken", 0.0),
    "an alarm without a sensor": lambda t: t.put("plain-alarm", "cut", 1),
}
