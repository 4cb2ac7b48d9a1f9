# SPDX-License-Identifier: GPL-2.0-or-later
"""Ready, fault code and volume through every definition."""

import numpy as np

from chipwise.clib.layout import CELLS_PER_PERIOD
from support.halrig import PERIOD_S, SCENES, always, load_module, near, within

scene = load_module(SCENES / "tracker_define/stimulus.py")
R, H = 0.5 * scene.DIAMETER, scene.DEPTH
CELL_MM = 0.25
DISC_MM3 = H * np.pi * R * R


def periods_to_ready(part, what):
    """Rows from the first one of `part` until ready; not ready before, ready after."""
    ready = part["ready"]
    assert ready.any(), f"ready: never in phase '{what}', allowed: within {len(ready)} periods"
    first = int(np.argmax(ready))
    rest = part["ready"][first:]
    assert rest.all(), (
        f"ready: FALSE again at {(part.start + first) * PERIOD_S:.3f} s in phase '{what}', allowed: only 1"
    )
    return first


def expected_periods(box):
    """Whole rows, the empty ring included, at least CELLS_PER_PERIOD cells a period."""
    columns, rows = (round((box[1][i] - box[0][i]) / CELL_MM) + 2 for i in (0, 1))
    return np.ceil(rows / np.ceil(CELLS_PER_PERIOD / columns))


def check_filling(part, box, what):
    took, wanted = periods_to_ready(part, what) + 1, expected_periods(box)
    assert abs(took - wanted) <= 2, f"periods to fill in phase '{what}': {took}, allowed: {wanted:g} +- 2"
    # the middle period: whatever else the computer does, half of the periods are not interrupted
    filling, rest = np.median(part["clocks"][:took]), np.median(part["clocks"][took:])
    assert took < 20 or filling > 2 * rest, (
        f"a middle period of filling '{what}' takes {filling:.0f} clocks, one at rest "
        f"{rest:.0f}: some do it all, allowed: more than {2 * rest:.0f} clocks"
    )
    within(
        part,
        "removed-volume",
        0.0,
        0.0,
        "mm3",
        np.where(np.arange(len(part["ready"])) < took - 1, part["removed-volume"], 0.0),
    )


def check(trace):
    nothing = trace.only("nothing defined")
    always(nothing, "ready", 0)
    always(nothing, "fault", 0)
    check_filling(trace.only("big"), scene.BIG, "big")
    always(trace.only("big"), "fault-code", 0)

    cut = trace.only("cut")["removed-volume"][-1]
    near(
        "removed-volume of the first cut",
        cut,
        DISC_MM3 + H * 2 * R * 20,
        0.003,
        "mm3",
        trace.phases["cut"].stop * PERIOD_S,
    )
    for name, (code, _box) in scene.IMPOSSIBLE.items():
        part = trace.only(name)
        always(part, "fault-code", code)
        always(part, "fault", 1)
        always(part, "ready", 1)
        always(part, "stock-defined", 1)
        within(part, "removed-volume", cut, cut, "mm3")
    on = trace.only("cut on")
    near(
        "removed-volume with the old stock",
        on["removed-volume"][-1],
        DISC_MM3 + H * 2 * R * 40,
        0.003,
        "mm3",
        trace.phases["cut on"].stop * PERIOD_S,
    )

    check_fresh(trace)
    check_twice(trace.only("twice"))


def check_fresh(trace):
    """The tool cuts in a stock that is defined afresh, and in the old one as long as define is held."""
    check_filling(trace.only("small"), scene.SMALL, "small")
    after = trace.only("small")
    always(after, "fault-code", 0)
    # the tool is in the fresh stock and cuts its own disc
    near(
        "removed-volume of a fresh stock",
        after["removed-volume"][-1],
        DISC_MM3,
        0.003,
        "mm3",
        trace.phases["small"].stop * PERIOD_S,
    )

    held = trace.only("cut after held")
    always(held, "ready", 1)
    near(
        "removed-volume where define is held",
        held["removed-volume"][-1],
        DISC_MM3 + H * 2 * R * 20,
        0.003,
        "mm3",
        trace.phases["cut after held"].stop * PERIOD_S,
    )


def check_twice(twice):
    """A second define, while the map is being filled."""
    second = twice["ready"][22:]  # 1 + 1 + 20 rows, then the second pulse
    always(twice, "fault-code", 0)
    assert not second[0] and not twice["ready"][1:22].any(), "ready: 1 while the map is being filled, allowed: 0"
    took = int(np.argmax(second)) + 1
    assert abs(took - expected_periods(scene.BIG)) <= 2, (
        f"periods to fill after a second define: {took}, allowed: {expected_periods(scene.BIG):g} +- 2"
    )


def filled_at_once(t):
    start = t.phases["big"].start
    return t.but(ready=lambda r: np.where(np.arange(len(r)) > start, 1, r))


def all_in_one_period(t):
    rest = np.median(t.only("big")["clocks"][-50:])
    return t.put("clocks", "big", rest).put("clocks", "big", 2e9, 3)


SABOTAGE = {
    "filled in one period": filled_at_once,
    "ready shifted by 5 periods": lambda t: t.but(ready=lambda r: np.roll(r, 5)),
    "ready stuck FALSE": lambda t: t.but(ready=lambda r: 0 * r),
    "ready from the start": lambda t: t.but(ready=lambda r: 0 * r + 1),
    "one period does it all": all_in_one_period,
    "impossible box taken": lambda t: t.put("fault-code", "upside down", 0),
    "wrong code": lambda t: t.put("fault-code", "huge", 2),
    "NaN not noticed": lambda t: t.put("fault-code", "nan", 0),
    "code without fault": lambda t: t.put("fault", "swapped", 0),
    "old stock lost": lambda t: t.put("stock-defined", "infinite", 0),
    "volume reset by an impossible box": lambda t: t.put("removed-volume", "no width", 0.0),
    "fault never cleared": lambda t: t.put("fault-code", "small", 3),
    "volume kept by a new stock": lambda t: t.but(removed_volume=np.maximum.accumulate),
    "volume NaN": lambda t: t.put("removed-volume", "cut on", np.nan, -1),
    "volume 5 % wrong": lambda t: t.but(removed_volume=lambda v: 1.05 * v),
    "held define defines again": lambda t: t.put("ready", "cut after held", 0, 100),
}
