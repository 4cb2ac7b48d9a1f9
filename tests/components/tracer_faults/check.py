# SPDX-License-Identifier: GPL-2.0-or-later
"""The fault of each phase, when it comes, and that the head brakes with its acceleration and rests."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, load_module

scene = load_module(SCENES / "tracer_faults/stimulus.py")
BRAKING = 1000.0 * PERIOD_S * 1.0001  # mm/s in a period


def check_phase(trace, phase):
    part, (state, code) = trace.only(phase), scene.PHASES[phase]
    ended = part["fault-code"] != 0
    ended[:5] = False  # the fault of the phase before
    assert ended.any(), f"{phase}: no fault, allowed: fault-code {code}"
    first = int(np.argmax(ended))
    assert phase in ("soft limit", "no contact") or scene.AT <= first <= scene.AT + 40, (
        f"{phase}: fault in row {first}, allowed: {scene.AT} .. {scene.AT + 40}"
    )
    for name, wanted in (("state", state), ("fault-code", code), ("fault", 1)):
        assert (part[name][first:] == wanted).all(), (
            f"{phase}: {name} {part[name][first]:g}, allowed: {wanted} to the end"
        )
    speed = np.hypot(part["vel-x"], part["vel-z"])
    assert phase == "no contact" or part["state"][first - 1] == 2, (
        f"{phase}: state {part['state'][first - 1]:g} before, allowed: 2"
    )
    least = 0.3 if phase == "soft limit" else 1.0  # it brakes before a limit
    assert speed[first - 1] > least, (
        f"{phase}: {speed[first - 1]:g} mm/s before the fault, allowed: more than {least} mm/s"
    )
    assert np.isfinite(speed).all(), f"{phase}: a velocity is not finite, allowed: finite"
    step = np.hypot(np.diff(part["vel-x"]), np.diff(part["vel-z"]))
    assert step.max() <= BRAKING, f"{phase}: {step.max() / PERIOD_S:.0f} mm/s2, allowed: 1000 mm/s2"
    assert speed[first + 60 :].max() == 0.0, f"{phase}: moves after the fault, allowed: at rest after 60 ms"
    assert part["pos-x"].min() > -5.0, f"{phase}: {part['pos-x'].min():.3f} mm, allowed: above -5 mm"


def check(trace):
    for phase in scene.PHASES:
        check_phase(trace, phase)


SABOTAGE = {
    "no fault": lambda t: t.but(fault_code=lambda d: 0 * d),
    "another fault": lambda t: t.but(fault_code=lambda d: np.where(d == 3, 4, d)),
    "fault 50 ms late": lambda t: t.but(fault_code=lambda d: np.roll(d, 50)),
    "goes on": lambda t: t.but(vel_x=lambda d: d + 1.0),
    "NaN": lambda t: t.put("vel-z", "not finite", np.nan, 360),
    "stops at once": lambda t: t.but(vel_x=lambda d: np.where(np.abs(d) < 15.0, 0.0, d)),
    "fault forgotten": lambda t: t.put("state", "jump", 0, -1),
    "limit passed": lambda t: t.but(pos_x=lambda d: d - 1.0),
}
