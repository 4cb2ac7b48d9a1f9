# SPDX-License-Identifier: GPL-2.0-or-later
"""When a tool that is not known any more stops being used, and that nothing else does."""

import numpy as np

from support.halrig import SCENES, always, load_module, require, within

scene = load_module(SCENES / "tracker_watch/stimulus.py")
F = 20.0 / 50.0  # the programmed feed as an override
GRACE = 50  # periods, tool_watch.h
CHANGED, UNWATCHED, FALLBACK = 15, 16, 5


def well(part, after=0):
    """Ready, without a fault, cutting at the target from the row `after` on."""
    row = np.arange(len(part["ready"]))
    for name, value in (("ready", 1), ("fault", 0), ("fault-code", 0)):
        require(part, name, (part[name] == value) | (row < after), "(pin)", f"{value} from row {after} on")
    require(part, "limited-by", (part["limited-by"] != FALLBACK) | (row < after), "(pin)", "no fallback")


def falls_back(part, start, code, late):
    """From the row `start` on F and not ready; the fault at most `late` rows later."""
    row = np.arange(len(part["ready"]))
    require(part, "ready", part["ready"] == (row < start), "(pin)", f"1 before row {start}, 0 from it on")
    within(part, "adaptive-feed", np.where(row < start, 0.0, F - 1e-9), np.where(row < start, 1.0, F + 1e-9), "")
    require(part, "limited-by", (part["limited-by"] == FALLBACK) == (row >= start), "(pin)", f"5 from row {start} on")
    sharp = np.abs(row - start - late) <= 1  # times are sums of periods
    require(
        part,
        "fault-code",
        (part["fault-code"] == np.where(row < start + late, 0, code)) | sharp,
        "(pin)",
        f"{code} from row {start + late} on",
    )
    require(part, "fault", part["fault"] == (part["fault-code"] != 0), "(pin)", "1 just where there is a code")


def cut_per_period(part):
    return np.diff(part["removed-volume"])


def check(trace):
    slot = 6.0 * 3.0 * scene.SPEED  # mm3 a period, in the steady slot
    well(trace.only("cutting"))
    steady = cut_per_period(trace.only("cutting"))
    assert abs(steady.mean() - slot) < 0.03 * slot, (
        f"removed-volume: {steady.mean():.6g} mm3 a period, allowed: {slot:.6g} +- 3 %"
    )
    falls_back(trace.only("changed, late"), 0, CHANGED, GRACE)
    well(trace.only("followed"))
    dead = trace.only("changed, dead")
    falls_back(dead, 0, CHANGED, GRACE)
    left = cut_per_period(dead)[5:]  # what was queued before the change is cut by the old tool
    assert not left.any(), f"removed-volume: {left.sum():.6g} mm3 by a tool that is not known, allowed: 0"
    well(trace.only("followed at last"))
    silent = trace.only("no heartbeat")
    since = scene.LIMIT - (trace.phases["no heartbeat"].start % 20 or 20)
    falls_back(silent, int(np.argmin(silent["ready"])), UNWATCHED, 0)
    first = int(np.argmin(silent["ready"]))
    assert since <= first <= since + 1, f"ready: 0 from row {first} on, allowed: {since} .. {since + 1}"
    still = cut_per_period(silent)
    assert abs(still.mean() - slot) < 0.03 * slot, "removed-volume: a tool whose number is right cuts on"
    again = trace.only("heartbeat again")
    well(again, 20)
    awaited(trace)


def awaited(trace):
    """Traverses wait for a tool while it is unknown, from the change on for `monitor-timeout`, or for so long since the
    last heartbeat."""
    for phase in trace.phases:
        part = trace.only(phase)
        if phase in ("changed, late", "changed, dead"):
            always(part, "tool-awaited", 1)
        elif "changed" not in phase:
            always(part, "tool-awaited", 0)
    never, silent = (
        np.flatnonzero(trace.only(f"changed, {name}")["tool-awaited"]) for name in ("never followed", "silent")
    )
    assert never[0] == 0 and abs(len(never) - scene.LIMIT) <= 1, (
        f"tool-awaited: {len(never)} periods, allowed: {scene.LIMIT} +- 1"
    )
    last = scene.LIMIT - (trace.phases["changed, silent"].start % 20 or 20)
    assert silent[0] == 100 and abs(silent[-1] + 1 - last) <= 1, (
        f"tool-awaited: up to row {silent[-1]}, allowed: {last} +- 1"
    )
    for rows in (never, silent):
        assert len(rows) == rows[-1] - rows[0] + 1, "tool-awaited: with a gap"


SABOTAGE = {
    "old tool used on": lambda t: t.put("ready", "changed, dead", 1),
    "old tool used for 20 ms": lambda t: t.put("ready", "changed, late", 1, 3),
    "ceiling without a tool": lambda t: t.put("adaptive-feed", "changed, dead", 1.0, 30),
    "no fault": lambda t: t.put("fault-code", "changed, dead", 0),
    "fault for a monitor that is late": lambda t: t.put("fault-code", "changed, late", 15, 19),
    "fault stays": lambda t: t.put("fault", "followed", 1),
    "cuts with an unknown tool": lambda t: t.but(removed_volume=lambda v: v + 0.01 * np.arange(len(v))),
    "heartbeat not watched": lambda t: t.put("ready", "no heartbeat", 1),
    "alarm too early": lambda t: t.put("ready", "no heartbeat", 0, 100),
    "not awaited": lambda t: t.put("tool-awaited", "changed, late", 0, 1),
    "awaited for ever": lambda t: t.put("tool-awaited", "changed, never followed", 1),
    "a silent monitor awaited": lambda t: t.put("tool-awaited", "changed, silent", 1),
    "awaited though known": lambda t: t.put("tool-awaited", "followed", 1, 3),
    "alarm for ever": lambda t: t.put("fault-code", "heartbeat again", 16, -1),
}
