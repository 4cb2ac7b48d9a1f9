# SPDX-License-Identifier: GPL-2.0-or-later
"""Stop and reason in every phase; what was noted at the stop stays."""

import numpy as np

from support.halrig import SCENES, always, load_module

scene = load_module(SCENES / "guard/stimulus.py")


def check(trace):
    for phase, (_inputs, stop, reason) in scene.PHASES.items():
        always(trace.only(phase), "stop", stop)
        always(trace.only(phase), "reason", reason)
        waits = "waits" in phase and "none" not in phase and "aborted" not in phase
        always(trace.only(phase), "waits", int(waits))
        always(trace.only(phase), "inhibit", int(stop or waits or phase == "others inhibit"))
        always(trace.only(phase), "hold", int(stop or waits or phase.startswith("others hold")))
    for phases, values in (
        (("contact", "contact gone, standing", "flute while stopped"), (7, 12.5, 3.0)),
        (("flute",), (9, 0.0, 4.5)),
        (("deeper", "less deep", "released"), (9, 0.0, 4.75)),
        (("a feed to a clamp", "at rest before it"), (30, 5.5, 4.25)),
        (("the next clamp",), (30, 2.5, 4.25)),
    ):
        for phase in phases:
            for name, value in zip(("line", "distance", "deepest"), values):
                always(trace.only(phase), name, value)
    for phase in ("a feed to a clamp", "at rest before it"):
        always(trace.only(phase), "clamp", 3)
        always(trace.only(phase), "part", 1)


SABOTAGE = {
    "others not passed on": lambda t: t.but(hold=lambda h: t["stop"]),
    "one for both": lambda t: t.but(inhibit=lambda i: np.maximum(i, t["hold"])),
    "stop not passed on": lambda t: t.put("inhibit", "contact", 0),
    "never stops": lambda t: t.but(stop=lambda s: 0 * s),
    "never lets go": lambda t: t.but(stop=lambda s: np.maximum.accumulate(s)),
    "a period late": lambda t: t.but(stop=lambda s: np.roll(s, 1)),
    "no latch": lambda t: t.put("stop", "contact gone, standing", 0),
    "stops a jog": lambda t: t.put("stop", "contact while jogging", 1, 2),
    "another reason": lambda t: t.but(reason=lambda r: 3 - r),
    "line of later": lambda t: t.put("line", "flute while stopped", 8, 3),
    "depth of the first touch": lambda t: t.put("deepest", "deeper", 4.5),
    "distance NaN": lambda t: t.put("distance", "contact", np.nan),
    "a third of the way each time": lambda t: t.put("stop", "the same stock again", 1, 2),
    "load not guarded": lambda t: t.put("stop", "no load", 0),
    "the clamp of later": lambda t: t.put("clamp", "at rest before it", 2, 2),
    "stops no feed": lambda t: t.put("stop", "a feed to a clamp", 0),
    "never stops again": lambda t: t.put("stop", "the next stock", 0),
    "waits for no tool": lambda t: t.put("hold", "a traverse waits for it", 0, 1),
    "waits on": lambda t: t.put("waits", "and goes on", 1, 2),
    "a feed waits": lambda t: t.put("waits", "a feed waits for none", 1),
    "waits for a stock that is assumed": lambda t: t.put("inhibit", "no stock is certain", 1),
    "stops again after the release": lambda t: t.put("stop", "release kept down", 1, 2),
}
