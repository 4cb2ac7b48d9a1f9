# SPDX-License-Identifier: GPL-2.0-or-later
"""Each phase: five rows of the inputs named; what is not named keeps its value."""
from support.halrig import Stimulus

NAMES = ("rapid-contact", "flute-excess", "override-ignored", "rapid-distance", "depth", "motion-type", "coord-mode",
         "program-line", "release", "inhibit-in", "hold-in", "load-stop",
         "clamp-contact", "clamp-distance", "clamp-number", "clamp-part",
         "tool-awaited", "certain", "clamp-count")
PHASES = {      # phase: (inputs, stop, reason)
    "idle": (dict(), 0, 0),
    "moving": ({"motion-type": 1, "coord-mode": 1, "program-line": 7}, 0, 0),
    "contact": ({"rapid-contact": 1, "rapid-distance": 12.5, "depth": 3.0}, 1, 1),
    "contact gone, standing": ({"rapid-contact": 0, "rapid-distance": 0.0, "program-line": 8}, 1, 1),
    "flute while stopped": ({"flute-excess": 1}, 1, 1),
    "aborted": ({"motion-type": 0, "flute-excess": 0}, 0, 0),
    "feed": ({"motion-type": 2, "program-line": 9}, 0, 0),
    "flute": ({"flute-excess": 1, "depth": 4.5}, 1, 2),
    "deeper": ({"depth": 4.75}, 1, 2),
    "less deep": ({"depth": 4.25}, 1, 2),
    "released": ({"release": 1}, 0, 0),
    "release kept down": ({}, 0, 0),
    "excess over": ({"flute-excess": 0, "release": 0}, 0, 0),
    "excess again": ({"flute-excess": 1}, 1, 2),
    "to manual": ({"coord-mode": 0}, 0, 0),
    "contact while jogging": ({"rapid-contact": 1}, 0, 0),
    "back": ({"rapid-contact": 0, "flute-excess": 0, "coord-mode": 1}, 0, 0),
    "override-ignored, not guarded": ({"override-ignored": 1}, 0, 0),
    "others inhibit": ({"inhibit-in": 1}, 0, 0),
    "others hold": ({"inhibit-in": 0, "hold-in": 1}, 0, 0),
    "others hold and so does the guard": ({"rapid-contact": 1}, 1, 1),
    "ended": ({"motion-type": 0, "rapid-contact": 0, "hold-in": 0, "override-ignored": 0}, 0, 0),
    "traverse": ({"motion-type": 1, "program-line": 20}, 0, 0),
    "stock ahead": ({"rapid-contact": 1, "rapid-distance": 9.0}, 1, 1),
    "stands before it": ({"rapid-contact": 0, "rapid-distance": 2.0}, 1, 1),
    "let past": ({"release": 1}, 0, 0),
    "slow yet": ({"release": 0}, 0, 0),
    "the same stock again": ({"rapid-contact": 1, "rapid-distance": 1.0}, 0, 0),
    "braking for another reason": ({"rapid-contact": 0}, 0, 0),
    "nearer": ({"rapid-contact": 1, "rapid-distance": 0.25}, 0, 0),
    "in the stock": ({"rapid-contact": 1, "rapid-distance": 0.0}, 0, 0),
    "out of it": ({"rapid-contact": 0}, 0, 0),
    "the next stock": ({"rapid-contact": 1, "rapid-distance": 6.0}, 1, 1),
    "let past, too": ({"release": 1}, 0, 0),
    "another line": ({"release": 0, "program-line": 21, "rapid-contact": 0}, 0, 0),
    "stock of another line": ({"rapid-contact": 1, "rapid-distance": 3.0}, 1, 1),
    "let past again": ({"release": 1}, 0, 0),
    "a feed between": ({"release": 0, "motion-type": 2, "rapid-contact": 0}, 0, 0),
    "another traverse": ({"motion-type": 1}, 0, 0),
    "its stock": ({"rapid-contact": 1, "rapid-distance": 3.0}, 1, 1),
    "at rest": ({"motion-type": 0, "rapid-contact": 0}, 0, 0),
    "in stock": ({"motion-type": 2, "program-line": 30}, 0, 0),
    "no load": ({"load-stop": 1}, 1, 4),
    "load again": ({"load-stop": 0}, 1, 4),
    "at rest again": ({"motion-type": 0}, 0, 0),
    "a feed to a clamp": ({"motion-type": 2, "program-line": 30, "clamp-contact": 1, "clamp-distance": 5.5, "clamp-number": 3, "clamp-part": 1, "rapid-contact": 1}, 1, 5),
    "at rest before it": ({"clamp-distance": 0.5, "clamp-number": 2, "clamp-part": 0}, 1, 5),
    "let past the clamp": ({"release": 1}, 0, 0),
    "in its clearance": ({"release": 0, "rapid-contact": 0}, 0, 0),
    "beyond it": ({"clamp-contact": 0}, 0, 0),
    "the next clamp": ({"clamp-contact": 1, "clamp-distance": 2.5}, 1, 5),
    "aborted there": ({"motion-type": 0, "clamp-contact": 0, "certain": 1}, 0, 0),
    "another tool": ({"tool-awaited": 1}, 0, 0),
    "a traverse waits for it": ({"motion-type": 1, "program-line": 40}, 0, 0),
    "and goes on": ({"tool-awaited": 0}, 0, 0),
    "a feed waits for none": ({"tool-awaited": 1, "motion-type": 2}, 0, 0),
    "nor does a probe": ({"motion-type": 5}, 0, 0),
    "nor a jog": ({"motion-type": 1, "coord-mode": 0}, 0, 0),
    "a stop beside it waits": ({"coord-mode": 1, "rapid-contact": 1}, 1, 1),
    "aborted while it waits": ({"motion-type": 0, "rapid-contact": 0}, 0, 0),
    "no stock is certain": ({"motion-type": 1, "certain": 0}, 0, 0),
    "but there are clamps: it waits": ({"clamp-count": 2}, 0, 0),
    "known at last": ({"tool-awaited": 0}, 0, 0),
}
ROWS = 5


def stimulus():
    rows = Stimulus({name: [] for name in NAMES})
    for name, (inputs, _stop, _reason) in PHASES.items():
        rows.phase(name)
        for _ in range(ROWS):
            rows.add(inputs)
    return rows
