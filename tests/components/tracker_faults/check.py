# SPDX-License-Identifier: GPL-2.0-or-later
"""Fault codes, and what must not be a fault."""

import numpy as np

from support.halrig import PERIOD_S, SCENES, always, load_module, near, require, within

scene = load_module(SCENES / "tracker_faults/stimulus.py")
R = 0.5 * scene.TOOL["tool_diameter"]
JUMP, NO_POSITION = 21, 20


def check_tools(trace):
    for name, (code, _pins) in scene.BAD_TOOLS.items():
        part, after = trace.only(name), trace.only("after " + name)
        always(part, "fault-code", code)
        always(part, "fault", 1)
        always(part, "ready", 0)
        always(part, "stock-defined", 1)
        within(part, "removed-volume", 0.0, 0.0, "mm3")  # an unknown tool cuts nothing
        within(part, "section-area", 0.0, 0.0, "mm2")
        always(after, "fault-code", 0)
        always(after, "ready", 1)
    idle = trace.only("no tool, not cutting")
    always(idle, "fault", 0)  # a tool change raises no fault
    always(idle, "ready", 0)


def check_positions(trace):
    always(trace.only("jump while not cutting"), "fault-code", 0)
    jump = trace.only("jump")
    row = np.arange(len(jump["fault-code"]))
    require(
        jump,
        "fault-code",
        jump["fault-code"] == np.where(row < 3, 0, JUMP),
        "(pin)",
        f"0 before the jump, {JUMP} from it on, also when positions are sound again",
    )
    always(trace.only("no position"), "fault-code", NO_POSITION)
    always(trace.only("no position"), "ready", 0)
    always(trace.only("position back"), "fault-code", NO_POSITION)
    for phase in ("defined after the jump", "defined after no position"):
        part = trace.only(phase)
        always(part, "fault-code", 0)
        assert part["ready"][-1] == 1, (
            f"ready: 0 at {trace.phases[phase].stop * PERIOD_S:.3f} s, allowed: 1 after a new stock"
        )
    for phase in ("jump while not cutting", "jump", "no position", "position back"):
        within(trace.only(phase), "removed-volume", 0.0, 0.0, "mm3")


def check_flute(trace):
    for phase in ("within the flute", "beside the stock, deeper than the flute", "out of the stock again", "all clear"):
        always(trace.only(phase), "flute-excess", 0)
    part = trace.only("deeper than the flute")
    row = np.argmax(part["pos-y"] < 40.0 + R - 0.15)  # the tool is in the box, a period or two
    said = part["flute-excess"] == 1
    index = np.arange(len(said))
    require(part, "flute-excess", said | (index < row), "(pin)", "1 from 0.15 mm after the touch on")
    require(part, "flute-excess", ~said | (part["pos-y"] <= 40.0 + R), "(pin)", "0 until the touch")
    volume = trace["removed-volume"][trace.phases["all clear"].stop - 1]
    slot = 2 * R * 10.0 + 0.5 * np.pi * R * R  # 10 mm past the edge, twice
    near("removed-volume", volume, (2.9 + 4.0) * slot, 0.003, "mm3", trace.t[-1])


def check(trace):
    check_tools(trace)
    check_positions(trace)
    check_flute(trace)
    end = trace.only("all clear")
    for name in ("fault", "fault-code", "flute-excess", "rapid-contact"):
        always(end, name, 0)
    always(end, "ready", 1)
    require(
        trace, "fault", (trace["fault"] == 1) == (trace["fault-code"] != 0), "(pin)", "1 just where fault-code is not 0"
    )
    for name in ("removed-volume", "mrr", "section-area", "depth"):
        within(trace, name, 0.0, 1e7, "(pin)")


SABOTAGE = {
    "zero diameter not noticed": lambda t: t.put("fault-code", "no tool", 0, 5),
    "corner called diameter": lambda t: t.put("fault-code", "corner too large", 11),
    "angle taken": lambda t: t.put("fault-code", "angle 180", 0),
    "unknown tool cuts": lambda t: t.put("removed-volume", "diameter NaN", 1.0, 3),
    "unknown tool is ready": lambda t: t.put("ready", "flute negative", 1),
    "fault sticks to a sound tool": lambda t: t.put("fault-code", "after angle NaN", 13),
    "tool change is a fault": lambda t: t.put("fault", "no tool, not cutting", 1),
    "jump not noticed": lambda t: t.put("fault-code", "jump", 0),
    "jump forgotten": lambda t: t.put("fault-code", "jump", 0, -1),
    "jump while switched off": lambda t: t.put("fault-code", "jump while not cutting", 21, 5),
    "NaN position not noticed": lambda t: t.put("fault-code", "no position", 0, 0),
    "not clear after define": lambda t: t.put("fault-code", "defined after the jump", 21),
    "flute excess stuck": lambda t: t.but(flute_excess=lambda f: 0 * f + 1),
    "no flute excess": lambda t: t.but(flute_excess=lambda f: 0 * f),
    "flute excess 2 mm late": lambda t: t.but(flute_excess=lambda f: np.roll(f, 20)),
    "flute excess 3 mm early": lambda t: t.but(flute_excess=lambda f: np.roll(f, -30)),
    "rate NaN": lambda t: t.put("mrr", "no position", np.nan, 0),
    "volume 5 % wrong": lambda t: t.but(removed_volume=lambda v: 1.05 * v),
    "fault without code": lambda t: t.put("fault", "all clear", 1, 0),
}
