# SPDX-License-Identifier: GPL-2.0-or-later
"""Counts of each phase, when they are done, the scaled axis, the states, and what an encoder has counted in the end."""

import numpy as np

from support.halrig import SCENES, always, load_module

STEP = load_module(SCENES / "tracer_packets/stimulus.py").STEP
LONGEST_DEAD = 20


def expect(what, found, wanted):
    assert found == wanted, f"{what}: {found}, allowed: {wanted}"


def check(trace):
    steps = {phase: [int(v) for v in trace.only(phase)["step-out"]] for phase in trace.phases}
    always(trace.only("off"), "state", 0)
    expect("even: counts", steps["even"], [0] + [STEP] * 100)
    always(trace.only("even"), "state", 2)
    expect("lost: counts", steps["lost"], [0, STEP + 3, STEP + 3, STEP + 2] + [STEP] * 27)
    expect("lost: packets", int(trace.only("lost")["lost"][-1]), 1)
    expect("doubled and old: counts", steps["doubled and old"], [STEP] * 5 + [0] * 8 + [STEP] * 5)
    expect("being written: counts", steps["being written"], [0, STEP] + [0] * 20)
    dead = trace.only("dead")
    expect("dead: counts", sum(steps["dead"]), 0)
    expect("dead: periods", int(np.argmax(dead["state"] == 4)), LONGEST_DEAD - 1)
    expect("dead: fault", int(dead["fault-code"][-1]), 4)
    expect("again: counts", steps["again"], [0, 0] + [-STEP] * 29)
    expect("corrupt: counts", sum(steps["corrupt"]), 0)
    expect("corrupt: fault", int(trace.only("corrupt")["fault-code"][-1]), 2)
    counts = np.cumsum(trace["step-out"])
    expect("pos-x", float(np.abs(trace["pos-x"] - counts / 1000).max() < 1e-9), 1.0)
    first = counts[trace.phases["again"].start - 1]
    scaled = np.floor(-2 * np.array([first, counts[-1]]) / 3)
    expect(
        "pos-y",
        [round(float(v) * 1000) for v in (trace["pos-y"][trace.phases["again"].start - 1], trace["pos-y"][-1])],
        [int(v) for v in scaled],
    )
    expect("counted by the encoder", int(trace["counted"][-1]), int(counts[-1]))


SABOTAGE = {
    "a lost packet forgotten": lambda t: t.put("step-out", "lost", STEP, 2),
    "caught up at once": lambda t: t.put("step-out", "lost", 2 * STEP, 1),
    "doubled ones done": lambda t: t.put("step-out", "doubled and old", STEP, 6),
    "half of a packet done": lambda t: t.put("step-out", "being written", STEP, 0),
    "dead too late": lambda t: t.put("state", "dead", 2, 19),
    "goes on when dead": lambda t: t.put("step-out", "dead", 1, 30),
    "corrupt one done": lambda t: t.put("step-out", "corrupt", STEP, 0),
    "a count off": lambda t: t.but(pos_x=lambda d: d + 0.001),
    "scaled wrongly": lambda t: t.but(pos_y=lambda d: -d),
    "a pulse missing": lambda t: t.but(counted=lambda d: d - 1),
}
