# SPDX-License-Identifier: GPL-2.0-or-later
"""Each phase: off, on with a deflection of 0.3 mm, and what ends it in row AT of the phase."""
import math

from support.halrig import Stimulus

OFF, AT = 50, 350
LENGTHS = {"soft limit": 2000, "no contact": 1500}
# phase: (state, fault code)
PHASES = {"not finite": (8, 2), "jump": (8, 3), "over-range": (7, 8), "soft limit": (8, 6), "no contact": (8, 5)}


def stimulus():
    s = Stimulus({"enable": [], "direction": [], "deflection-x": [], "deflection-z": []})
    for name in PHASES:
        s.phase(name)
        for k in range(LENGTHS.get(name, 500)):
            z = 0.0 if k < OFF + 10 or name == "no contact" else 0.3
            if name == "not finite" and k == AT:
                z = math.nan
            if name == "jump" and k >= AT:
                z = 0.9
            if name == "over-range" and k >= AT:
                z = min(1.2, 0.3 + 0.02 * (k - AT))
            s.add({"enable": k >= OFF, "direction": -1 if name == "soft limit" else 1, "deflection-x": 0.0, "deflection-z": z})
    return s
