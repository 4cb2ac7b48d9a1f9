# SPDX-License-Identifier: GPL-2.0-or-later
"""Each phase: off, on, and what ends the trace in row AT of the phase: the reading is share x deflection + added."""

import math

from support.halrig import Stimulus

OFF, AT = 50, 350
LENGTHS = {"soft limit": 2000, "no contact": 1500}
# phase: (state, fault code)
PHASES = {
    "not finite": (8, 2),
    "jump": (8, 3),
    "broken cable": (8, 3),
    "over-range": (7, 8),
    "soft limit": (8, 6),
    "no contact": (8, 5),
}
ADDED = {"not finite": math.nan, "jump": 1.5, "over-range": 0.9}
SHARE = {"broken cable": 0.0}


def stimulus():
    s = Stimulus({"enable": [], "direction": [], "share": [], "added": []})
    for name in PHASES:
        s.phase(name)
        for k in range(LENGTHS.get(name, 500)):
            share = 0.0 if name == "no contact" else SHARE.get(name, 1.0) if k >= AT else 1.0
            added = 0.0 if k < AT or (name == "not finite" and k > AT) else ADDED.get(name, 0.0)
            s.add({"enable": k >= OFF, "direction": -1 if name == "soft limit" else 1, "share": share, "added": added})
    return s
