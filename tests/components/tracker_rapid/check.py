# SPDX-License-Identifier: GPL-2.0-or-later
"""rapid-contact: before the touch by the braking distance, and never without reason."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, always, load_module, near, require

scene = load_module(SCENES / "tracker_rapid/stimulus.py")
R = 0.5 * scene.DIAMETER
BRAKING_MM = scene.RAPID**2 / (2 * scene.ACCEL)
EARLY_MM = 1.5  # two samples of the path ahead, one period
NO_CONTACT = (
    "define",
    "down to the clearance plane",
    "across at the clearance plane",
    "away",
    "towards the side, braking in front of it",
    "feed",
    "back in the finished slot",
    "in the slot once more",
    "end",
)


def check(trace):
    always(trace, "fault-code", 0)
    for phase in NO_CONTACT:
        always(trace.only(phase), "rapid-contact", 0)
    part = trace.only("into the side at full speed")
    said = part["rapid-contact"] == 1
    to_touch = -R - part["pos-x"]
    require(
        part, "rapid-contact", said | (to_touch > BRAKING_MM), "(pin)", f"1 from {BRAKING_MM:g} mm before the touch on"
    )
    require(
        part,
        "rapid-contact",
        ~said | (to_touch < BRAKING_MM + EARLY_MM),
        "(pin)",
        f"0 until {BRAKING_MM + EARLY_MM:g} mm before the touch",
    )
    # a traverse into the stock is a cut like any other
    near(
        "removed-volume",
        part["removed-volume"][-1],
        -scene.BOTTOM * (2 * R * 10.0 + 0.5 * np.pi * R * R),
        0.003,
        "mm3",
        trace.phases["into the side at full speed"].stop * PERIOD_S,
    )


SABOTAGE = {
    "never": lambda t: t.but(rapid_contact=lambda c: 0 * c),
    "always": lambda t: t.but(rapid_contact=lambda c: 0 * c + 1),
    "2 mm late": lambda t: t.but(rapid_contact=lambda c: np.roll(c, 10)),
    "3 mm early": lambda t: t.but(rapid_contact=lambda c: np.roll(c, -15)),
    "at the clearance plane": lambda t: t.put("rapid-contact", "down to the clearance plane", 1, -9),
    "in its own slot": lambda t: t.put("rapid-contact", "back in the finished slot", 1, 40),
    "in a feed": lambda t: t.put("rapid-contact", "feed", 1, 40),
    "drops out once": lambda t: t.put("rapid-contact", "into the side at full speed", 0, -20),
    "traverse cuts nothing": lambda t: t.but(removed_volume=lambda v: 0 * v),
    "volume NaN": lambda t: t.but(removed_volume=lambda v: v * np.nan),
}
