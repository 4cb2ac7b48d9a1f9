# SPDX-License-Identifier: GPL-2.0-or-later
"""Plans or runs one typed line, switches a guard, begins a new part, or changes a tool, for the page of `chipwise
panel`, in a process of its own: an order as JSON on standard input, the answer as JSON on standard output.  Called by
entry.py; a plan may compute for long, and the looks at the machine go on meanwhile.

    {"do": "plan", "ini", "code", "text", "chop", "mode", "language"}     chop: size in the unit of MDI, "" for that of
        the INI file
        -> {"line", "unit", "svg", "figures", "messages", "refused", "state"}   refused: why it may not be run now, ""
        if it may
    {"do": "run", "code", "line", "unit", "state"}      state: of the plan; -> {}
    {"do": "guard", "name", "on"}                       name: one of GUARDS; -> {}
    {"do": "part"}                                      a whole stock in place of an assumed one (monitor/shadow.py); ->
                                                        {}
    {"do": "tool", "ini", "number", "values", "seen"}   of tool_editor.change(); -> its listed()
    {"do": "clamps", "number"}                          a set-up of M256, 0: none; -> {}
    {"do": "measure"}, {"do": "corner"}, {"do": "confirm"}          set_up.py has them
    {"do": "resume"}, {"do": "go-on"}                   resume.py has them
    any of them -> {"error", "number"}                  number: of the field that is wrong, from 1; 0: not of a field

The rules are those of `chipwise enter --run`: entry/typed.py, entry/planned.py, entry/mdi.py.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Protocol, cast

from chipwise import entry
from chipwise.host import language
from chipwise.tool_data import editor
from chipwise.host.clock import patience
from chipwise.errors import CycleError, printable, unnamed
from chipwise.host.halcmd import halcmd
from chipwise.ini import Ini
from chipwise.panel import Json
from chipwise.settings import load_settings
from chipwise.tool_data.table import diameter_of

if TYPE_CHECKING:  # main() imports it when it is wanted
    from chipwise.entry import mdi
    from chipwise.program.records import Frame

GUARDS = ("rapid", "flute")  # chipwise-guard.0.guard-NAME
MONITOR = "chipwise-monitor."
PART_S = 3.0  # for the monitor
NICE = 10  # plans wait for whatever else this computer has to do


class Mdi(Protocol):
    """entry/mdi.py, or what a test has in its place."""

    State: "type[mdi.State]"

    def read(self) -> "mdi.State": ...

    def scene(self) -> Json: ...

    def tip(self, frame: "Frame | None") -> tuple: ...

    def check(self, state: "mdi.State", unit: str, cuts: bool = True) -> None: ...

    def same(self, before: "mdi.State", now: "mdi.State") -> None: ...

    def send(self, line: str) -> None: ...

    def open_program(self, path: str) -> None: ...


def refusal(machine: Mdi, state: "mdi.State", unit: str, code: str) -> str:
    """Why a line of a code may not be run now, "" if it may."""
    try:
        machine.check(state, unit, code.startswith("G"))
    except CycleError as error:
        return printable(unnamed(error))
    return ""


def plan(order: Json, machine: Mdi) -> Json:
    """The answer to "plan"; machine: entry/mdi.py, or what a test has in its place."""
    from chipwise.drawing.entered import figures, svg
    from chipwise.entry.planned import DRAWN, Scene
    from chipwise.entry.planned import plan as planned
    from chipwise.panel import colours

    settings, code = load_settings(order["ini"]), order["code"]
    table, translate = settings.path("ENTRY"), language.translator((order["language"],))
    line = entry.line(code, order["text"], table)
    state = machine.read()
    named = (("_chipwise_chop_size", float(order["chop"])),) if order["chop"] else ()
    found = planned(
        Scene(os.path.abspath(order["ini"]), state.unit, state.program, state.tool, state.position, named=named),
        line,
        table,
    )
    drawing = ""
    if code in DRAWN:
        words = entry.words(line, state.unit, translate, table)
        drawing = svg(
            found, entry.title(code, table), words, colours.load(settings.path("COLOURS")), order["mode"], translate
        )
    return {
        "line": line,
        "unit": state.unit,
        "svg": drawing,
        "figures": list(figures(found, translate)),
        "state": asdict(state),
        "messages": list(map(printable, found.messages)),
        "refused": refusal(machine, state, state.unit, code),
    }


def run(order: Json, machine: Mdi) -> Json:
    """The answer to "run": the machine has to be as it was when the line was planned."""
    now = machine.read()
    machine.check(now, order["unit"], order["code"].startswith("G"))
    machine.same(machine.State(**order["state"]), now)
    machine.send(order["line"])
    return {}


def guard(order: Json, machine: Mdi) -> Json:
    """The answer to "guard"; only at rest, because a stop or its end in a cut would come as a surprise."""
    state = machine.read()
    if not (state.idle and state.at_rest):
        raise CycleError(
            "the guard is not switched: a program or a command is under way, or the machine moves",
            "wait for its end, or press Stop",
        )
    halcmd("setp", f"chipwise-guard.0.guard-{order['name']}", "1" if order["on"] else "0")
    return {}


def part(_order: Json, machine: Mdi) -> Json:
    """The answer to "part"; only at rest, because the monitor does nothing else then."""
    state = machine.read()
    if not (state.idle and state.at_rest):
        raise CycleError(
            "no new part: a program or a command is under way, or the machine moves", "wait for its end, or press Stop"
        )
    count = halcmd("getp", MONITOR + "parts").strip()
    halcmd("setp", MONITOR + "new-part", "1")
    try:
        end = time.monotonic() + patience(PART_S)
        while halcmd("getp", MONITOR + "parts").strip() == count:
            if time.monotonic() > end:
                raise CycleError("chipwise-monitor has not begun a new part", "see the messages on LinuxCNC's screen")
            time.sleep(0.05)
    finally:
        halcmd("setp", MONITOR + "new-part", "0")
    return {}


def check_corner(ini: str, number: int, radius: object) -> None:
    """Raise CycleError if a corner radius (mm, None: none) is larger than the tool: the stock tracker would be in
    fault."""
    machine = Ini(ini)
    try:
        diameter = diameter_of(machine.tool_table(), number) / machine.units_per_mm()
    except CycleError:  # a tool that the table does not have yet
        return
    if isinstance(radius, (int, float)) and radius > diameter / 2:
        raise CycleError(
            "corner_radius {radius} is larger than half of the diameter of tool {number}, {diameter}",
            "give at most {half}",
            radius=float(radius),
            number=str(number),
            diameter=diameter,
            half=diameter / 2,
        )


def tool(order: Json, machine: Mdi) -> Json:
    """The answer to "tool"; only at rest, because the stock tracker has the new tool at once."""
    path = load_settings(order["ini"]).path("TOOL_GEOMETRY")
    found = editor.listed(path)["tools"].get(str(order["number"]), {})
    check_corner(order["ini"], order["number"], {**found, **order["values"]}.get("corner_radius"))
    state = machine.read()
    if not (state.idle and state.at_rest):
        raise CycleError(
            "the tool is not changed: a program or a command is under way, or the machine moves",
            "wait for its end, or press Stop",
        )
    editor.change(path, order["seen"], order["number"], order["values"])
    return editor.listed(path)


def clamps(order: Json, machine: Mdi) -> Json:
    """The answer to "clamps": M256 in MDI, where it is done when the monitor has answered; only at rest."""
    state = machine.read()
    machine.check(replace(state, incremental=False), state.unit, False)  # M256 means the same in G91
    machine.send(f"M256 P{int(order['number'])}")
    return {}


def _set_up(order: Json, machine: Mdi) -> Json:
    """The answers to "measure", "corner" and "confirm"."""
    from chipwise.panel import set_up  # takes time

    return {"measure": set_up.measure, "corner": set_up.corner, "confirm": set_up.confirm}[order["do"]](order, machine)


def _resume(order: Json, machine: Mdi) -> Json:
    """The answers to "resume" and "go-on"."""
    from chipwise.panel import resume  # takes time

    return (resume.plan if order["do"] == "resume" else resume.go_on)(order, machine)


_WORK: dict[str, Callable[[Json, Mdi], Json]] = {
    "resume": _resume,
    "go-on": _resume,
    "plan": plan,
    "run": run,
    "guard": guard,
    "part": part,
    "tool": tool,
    "clamps": clamps,
    "measure": _set_up,
    "corner": _set_up,
    "confirm": _set_up,
}


class Seen:
    """entry/mdi.py with one look at LinuxCNC, before the work begins.

    The status buffer of LinuxCNC has a lock: a process that lets others come first must not hold it, or the task waits
    for as long as a busy computer lets that process wait.
    """

    def __init__(self, machine: Mdi) -> None:
        self.machine, self.error = machine, None
        try:
            self.state, self.in_force = machine.read(), machine.scene()
        except CycleError as error:  # said where the work needs the machine: what is wrong with the order comes first
            self.error = error

    def read(self) -> "mdi.State":
        if self.error:
            raise self.error
        return self.state

    def scene(self) -> Json:
        self.read()
        return self.in_force

    def __getattr__(self, name: str) -> object:
        return getattr(self.machine, name)


def answer(order: Json, machine: Mdi, nice: int = 0) -> Json:
    """The answer to an order; with `nice` it is worked out while others come first."""
    try:
        if nice:
            machine = cast(Mdi, Seen(machine))  # which hands on what it does not have
            os.nice(nice)
        return _WORK[order["do"]](order, machine)
    except CycleError as error:
        return {"error": printable(unnamed(error)), "number": getattr(error, "number", 0)}


def main() -> None:
    from chipwise.entry import mdi

    order = json.load(sys.stdin)
    print(json.dumps(answer(order, mdi, NICE if order["do"] in ("plan", "measure", "resume") else 0)), flush=True)


if __name__ == "__main__":
    main()
