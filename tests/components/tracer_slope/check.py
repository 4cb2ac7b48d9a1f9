# SPDX-License-Identifier: GPL-2.0-or-later
"""States in their order, deflection, window, the ball on the slope, the slave one with the master."""

import numpy as np

from support.halrig import always, require, within

TRACE, DONE = 2, 9
COUNT = 0.001  # mm


def order(trace, phase):
    """The states of a phase, each once."""
    states = trace.only(phase)["state"]
    return [int(states[0]), *(int(b) for a, b in zip(states, states[1:]) if a != b)]


def expect_order(trace, phase, wanted):
    found = order(trace, phase)
    assert found == wanted, f"{phase}: states {found}, allowed: {wanted}"


def check(trace):
    always(trace.only("off"), "state", 0)
    expect_order(trace, "line", [1, 2, 4, 9])
    expect_order(trace, "left", [1, 2, 4, 9])
    expect_order(trace, "held", [1, 2])
    always(trace.only("switched off"), "state", 0)

    line = trace.only("line")
    in_line = line["state"] == TRACE
    begin = int(np.argmax(in_line))
    late = in_line & (np.arange(len(in_line)) > begin + 100)
    require(line, "true-deflection", ~late | (np.abs(line["true-deflection"] - 0.3) < 0.005), "mm", "0.295 .. 0.305 mm")
    within(line, "pos-x", -1.0, 10.0, "mm")
    # the sampler prints six decimals, in inch 0.000025 mm; ball-x is of this period's deflection; the ball (radius 1)
    # lies on z = x - 3 with its centre 1 mm off
    off = (line["ball-z"] - line["ball-x"] + 3.0) / np.sqrt(2.0) - 1.0
    require(line, "ball-z", ~in_line | (np.abs(off) < 5e-5), "mm", "the ball on the slope", off)
    assert line["pos-x"][late].max() > 9.9, f"pos-x: {line['pos-x'][late].max():.3f} mm, allowed: 9.9 mm and more"

    rest = trace.only("held")["pos-x"][-100:]
    assert np.ptp(rest) < 0.01, f"held: moves by {np.ptp(rest):.4f} mm, allowed: 0.01 mm"
    rest = trace.only("switched off")["pos-x"][-50:]
    assert np.ptp(rest) == 0.0, f"switched off: moves by {np.ptp(rest):.4f} mm, allowed: 0 mm"

    # where the master is at its first packet counts as the zero; both are rounded to counts
    assert (line["slave-state"] == 2).all(), f"slave-state: {np.unique(line['slave-state'])}, allowed: 2"
    for name, sign in (("x", -1), ("z", 1)):
        moved, done = (line[f"{who}-{name}"] - line[f"{who}-{name}"][0] for who in ("pos", "slave"))
        within(line, f"slave-{name}", sign * moved - 1.01 * COUNT, sign * moved + 1.01 * COUNT, "mm", done)


SABOTAGE = {
    "never traces": lambda t: t.put("state", "line", 1),
    "ends too soon": lambda t: t.put("state", "line", 9, 700),
    "deflection off": lambda t: t.but(true_deflection=lambda d: d * 1.03),
    "window passed": lambda t: t.but(pos_x=lambda d: d + 0.2),
    "window not reached": lambda t: t.but(pos_x=lambda d: d * 0.95),
    "ball in the air": lambda t: t.but(ball_z=lambda d: d + 0.01),
    "slave not mirrored": lambda t: t.but(slave_x=lambda d: -d),
    "slave two counts off": lambda t: t.put("slave-z", "line", 1.0, 900),
    "slave a period late": lambda t: t.but(slave_x=lambda d: np.roll(d, 1)),
    "moves when held": lambda t: t.put("pos-x", "held", 9.0, -1),
    "moves when switched off": lambda t: t.put("pos-x", "switched off", 9.0, -1),
}
