# SPDX-License-Identifier: GPL-2.0-or-later
"""Alarms for the page of `chipwise panel`: what, line, tool and remedy, and the last of them.

Called by watch.py.  The words are those of chipwise-monitor (monitor/messages.py).  An alarm is active as long as its
cause is there; after that it stays on the page until the operator clears it, and in the history then.
"""

from typing import NotRequired, TypedDict

from chipwise.monitor.messages import FAULTS, Stop, clamp_text, guard_text, override_text
from chipwise.monitor.spindle_load import LOAD_ALARMS
from chipwise.clib.layout import Fault, GuardReason, LoadAlarm
from chipwise.panel.machine import Pins

HISTORY = 200  # alarms that are kept
MM_PER_INCH = 25.4
NEEDED_IN_CUT = range(Fault.TOOL_DIAMETER, Fault.TURNED + 1)  # an alarm while M251 is on


class StillActive(Exception):
    """The cause of an alarm that was to be cleared is still there."""


def guard_words(pins: Pins, inch: bool, auto: bool = True) -> str:
    """The sentence of chipwise-monitor for a stop by a guard; auto: LinuxCNC is in the mode of programs, and a line is
    one of the program."""
    per = 1 / MM_PER_INCH if inch else 1.0
    if int(pins["guard_reason"]) == GuardReason.CLAMP_CONTACT:
        return clamp_text(
            f"clamp {int(pins['guard_clamp'])} of the set-up in force",
            int(pins["guard_part"]),
            pins["guard_distance"] * per,
            int(pins["guard_line"]) if auto else 0,
            int(pins["tool"]),
            "in" if inch else "mm",
        )
    stop = Stop(
        int(pins["guard_reason"]),
        int(pins["guard_line"]) if auto else 0,
        pins["guard_distance"] * per,
        pins["guard_depth"] * per,
        int(pins["tool"]),
        pins["tool_diameter"] * per,
        pins["tool_flute_length"] * per,
    )
    return guard_text(stop, "in" if inch else "mm")


ITEMS = {
    f"guard {GuardReason.RAPID_CONTACT}": "alarm_rapid",
    f"guard {GuardReason.CLAMP_CONTACT}": "alarm_rapid",
    f"guard {GuardReason.FLUTE_EXCESS}": "alarm_flute",
}  # display items; else:
OTHER = "alarm_fault"
LOAD = "load "  # kinds of alarms of the measured load: line and ratio are those of its beginning


def load_words(pins: Pins, auto: bool = True) -> str:
    """The sentence of chipwise-monitor for an alarm of the measured load."""
    line = int(pins["line"]) if auto else 0
    ratio = pins["load_ratio"] / pins["load_factor"] if pins["load_factor"] > 0 else 0.0
    return LOAD_ALARMS[LoadAlarm(int(pins["load_alarm"]))].format(
        where=f"{f'line {line}' if line > 0 else 'MDI'}, tool {int(pins['tool'])}", ratio=ratio
    )


def _fault_words(code: int) -> str:
    """The sentence of a fault; of one that this page does not know, its number."""
    return FAULTS[Fault(code)] if code in FAULTS else f"fault {code} of the stock tracker"


def causes(pins: Pins, inch: bool, auto: bool = True) -> dict[str, str]:
    """{kind: sentence} of what is wrong now."""
    found: dict[str, str] = {}
    reason, code = int(pins["guard_reason"]), int(pins["fault_code"]) if pins["fault"] else 0
    if reason in (GuardReason.RAPID_CONTACT, GuardReason.FLUTE_EXCESS, GuardReason.CLAMP_CONTACT):
        found[f"guard {reason}"] = guard_words(pins, inch, auto)
    if reason == GuardReason.OVERRIDE_IGNORED or pins["override_ignored"]:
        found["override"] = override_text()
    if int(pins["load_alarm"]) in LOAD_ALARMS:
        found[f"{LOAD}{int(pins['load_alarm'])}"] = load_words(pins, auto)
    if code and (code not in NEEDED_IN_CUT or pins["mode"]):
        found[f"fault {code}"] = _fault_words(code)
    return found


class Entry(TypedDict):
    """One alarm as a page gets it; time: s since 1970; remedy is there as soon as what is."""

    id: int
    time: float
    active: bool
    cleared: bool
    what: str
    remedy: NotRequired[str]
    line: int
    tool: int
    item: str


class Alarms:
    """All alarms of this server, the newest last."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._active: dict[str, Entry] = {}  # kind: its entry
        self._count = 0

    def step(self, pins: Pins, inch: bool, now: float, auto: bool = True) -> bool:
        """pins: Machine.pins(); now: s since 1970; auto: the mode of programs.  A move of MDI has no line: motion
        counts on from the program before.
        -> whether anything has changed."""
        found, changed = causes(pins, inch, auto), False
        for kind in [kind for kind in self._active if kind not in found]:
            self._active.pop(kind)["active"] = False
            changed = True
        for kind, sentence in found.items():
            what, _, remedy = sentence.partition("; ")
            entry = self._active.get(kind)
            if entry is None:
                self._count += 1
                entry = self._active[kind] = {
                    "id": self._count,
                    "time": round(now, 1),
                    "active": True,
                    "cleared": False,
                    "what": "",
                    "line": 0 if not auto else int(pins["guard_line"] if kind.startswith("guard") else pins["line"]),
                    "tool": int(pins["tool"]),
                    "item": ITEMS.get(kind, OTHER),
                }
                self.entries = [*self.entries, entry][-HISTORY:]
            if (
                not entry["what"] or entry["what"] != what and not kind.startswith(LOAD)
            ):  # the depth of a flute excess grows while the tool stops
                entry["what"], entry["remedy"] = what, remedy
                changed = True
        return changed

    def clear(self, number: int | None = None) -> None:
        """Clear one alarm, or all whose cause has gone.  Raises StillActive, KeyError."""
        chosen = [entry for entry in self.entries if number in (None, entry["id"])]
        if number is not None:
            if not chosen:
                raise KeyError(number)
            if chosen[0]["active"]:
                raise StillActive(chosen[0]["what"])
        for entry in chosen:
            entry["cleared"] = entry["cleared"] or not entry["active"]
