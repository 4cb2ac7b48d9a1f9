# SPDX-License-Identifier: GPL-2.0-or-later
"""What LinuxCNC and chipwise's components show, read for the page of `chipwise panel`.  Reads pins, commands nothing.

Called by cli/panel.py; watch.py asks it.  A pin that a machine lacks, or that holds no finite number, counts as 0.
Lengths come out in mm, velocities in mm/s, whatever the machine's unit.
"""

import math
import os
import time
from collections.abc import Mapping
from typing import Any, Literal, Protocol, TypedDict, cast, overload

from chipwise.host import processes
from chipwise.program import loaded
from chipwise.host.clock import patience
from chipwise.stock.shared import SharedStock, attach

START_S = 0.2  # between two looks whether LinuxCNC has started
SETTLED_S = 10.0  # after its first answer: whatever starts with it has started
G20 = 200  # of stat.gcodes: ten times the code
LARGEST = 1e12  # larger numbers are not shown
LOAD_STEPS = 8  # stock-tracker.0.load-step-area-N
TRACKER, FEED, GUARD, INPUTS, MONITOR = (
    "stock-tracker.0.",
    "volumetric-feed.0.",
    "chipwise-guard.0.",
    "chipwise-inputs.0.",
    "chipwise-monitor.",
)
NUMBERS = {  # name here: pin
    "mrr": TRACKER + "mrr",
    "removed": TRACKER + "removed-volume",
    "area": TRACKER + "section-area",
    "fault_code": TRACKER + "fault-code",
    "fault": TRACKER + "fault",
    "ready": TRACKER + "ready",
    "stock_defined": TRACKER + "stock-defined",
    "certain": TRACKER + "certain",
    "motion_type": TRACKER + "motion-type",
    "target": FEED + "mrr-effective",
    "lower": FEED + "mrr-lower",
    "mode": FEED + "mode",
    "limited_by": FEED + "limited-by",
    "run_time": FEED + "run-time",
    "fed_time": FEED + "fed-time",
    "saved_time": FEED + "saved-time",
    "mean_rate": FEED + "mean-rate",
    "peak_rate": FEED + "peak-rate",
    "cut_time": FEED + "cut-time",
    "air_time": FEED + "air-time",
    "rub_time": FEED + "rub-time",
    "override": FEED + "override",
    "override_ignored": FEED + "override-ignored",
    "chip": FEED + "chip",
    "power": FEED + "power",
    "torque": FEED + "torque",
    "force": FEED + "side-force",
    "max_chip": FEED + "max-chip",
    "max_power": FEED + "max-power",
    "max_torque": FEED + "max-torque",
    "max_force": FEED + "max-force",
    "spindle_load": FEED + "spindle-load",
    "spindle_load_scale": FEED + "spindle-load-scale",
    "load_idle": FEED + "load-idle",
    "load_ratio": FEED + "load-ratio",
    "load_factor": FEED + "load-factor",
    "load_alarm": FEED + "load-alarm",
    "work": TRACKER + "work-percent",
    "guard_reason": GUARD + "reason",
    "guard_clamp": GUARD + "clamp",
    "guard_part": GUARD + "part",
    "guard_line": GUARD + "line",
    "guard_rapid": GUARD + "guard-rapid",
    "guard_flute": GUARD + "guard-flute",
    "line": INPUTS + "program-line",
    "tool": MONITOR + "tool-number",
    "tool_assumed": MONITOR + "tool-assumed",
    "doubt": MONITOR + "stock-doubt",
    "flutes": MONITOR + "tool-flutes",
    "revolutions": INPUTS + "spindle-speed",
}
LENGTHS = {
    "depth": TRACKER + "depth",
    "pos_x": TRACKER + "pos-x",
    "pos_y": TRACKER + "pos-y",
    "pos_z": TRACKER + "pos-z",
    "offset_x": TRACKER + "tool-offset-x",
    "offset_y": TRACKER + "tool-offset-y",
    "offset_z": TRACKER + "tool-offset-z",
    "tool_diameter": TRACKER + "tool-diameter",
    "tool_corner_radius": TRACKER + "tool-corner-radius",
    "tool_flute_length": TRACKER + "tool-flute-length",
    "programmed_vel": FEED + "programmed-vel",
    "requested_vel": FEED + "requested-vel",
    "current_vel": INPUTS + "current-vel",
    "guard_distance": GUARD + "distance",
    "guard_depth": GUARD + "deepest",
}
AREAS = tuple(f"{TRACKER}load-step-area-{n}" for n in range(LOAD_STEPS))


Tip = tuple[float, float, float]  # mm, machine coordinates


class Pins(Protocol):
    """{name: float} of NUMBERS and LENGTHS, area_ahead (mm2), feed_per_tooth (mm), and tip."""

    @overload
    def __getitem__(self, name: Literal["tip"], /) -> Tip:  # type: ignore[misc]  # the one name that is not a number
        ...

    @overload
    def __getitem__(self, name: str, /) -> float: ...


class Task(TypedDict):
    """What LinuxCNC's status says, as Machine.task() has it."""

    state: str
    program: str
    auto: bool
    idle: bool
    failed: bool
    running: bool
    paused: bool
    inch: bool
    mdi_unit: str
    feed_override: float


class Scene(TypedDict):
    """Path of the loaded program, and what its path depends on: program.loaded.scene()."""

    program: str
    index: int
    offset: list[float]
    g92: list[float]
    turn: float
    tool: int
    block_delete: bool
    codes: str


def finite(value: float) -> float:
    """A number that can be shown: 0 in place of one that is not finite or larger than LARGEST."""
    value = float(value)
    return value if math.isfinite(value) and abs(value) < LARGEST else 0.0


def feed_per_tooth(pins: Mapping[str, float]) -> float:
    """What each edge advances at the feed of now, mm: velocity / (revolutions x edges); 0 if edges or spindle are
    unknown or at rest."""
    edges_s = pins["flutes"] * abs(pins["revolutions"])
    return finite(pins["current_vel"] / edges_s) if edges_s > 1e-9 else 0.0


def wait_for_task() -> bool:
    """Wait until LinuxCNC's task has got its first command, or has answered for SETTLED_S; -> False if the realtime
    ends before.  halcmd complains of a component that appears while it loads others, so ours comes after them."""
    import linuxcnc

    realtime, answered = processes.named("rtapi_app"), None
    while not realtime or any(map(processes.lives, realtime)):
        try:
            status = linuxcnc.stat()
            status.poll()
            answered = answered or time.monotonic()
            if status.echo_serial_number > 0 or time.monotonic() - answered > patience(SETTLED_S):
                return True
        except (linuxcnc.error, SystemError):
            pass
        time.sleep(patience(START_S))
    return False


class Machine:
    """The LinuxCNC that runs here."""

    def __init__(self) -> None:
        import hal
        import linuxcnc

        self.hal, self.linuxcnc = hal, linuxcnc
        self.component = hal.component(f"chipwise-page-{os.getpid()}")
        self.component.ready()
        self.status: Any = None  # a linuxcnc.stat, which has no types
        self.main = loaded.MainProgram()
        self.missing: set[str] = set()
        self.realtime = processes.named("rtapi_app")

    def runs(self) -> bool:
        """Whether the LinuxCNC that was there at the start still is."""
        return not self.realtime or any(map(processes.lives, self.realtime))

    def pin(self, name: str) -> float:
        """Its value as a finite float."""
        if name in self.missing:
            return 0.0
        try:
            return finite(self.hal.get_value(name))
        except RuntimeError:
            self.missing.add(name)
            return 0.0

    def pins(self) -> Pins:
        """{name: float} of NUMBERS and LENGTHS, area_ahead (mm2), feed_per_tooth (mm) and tip (x, y, z), machine
        coordinates."""
        units = self.pin(TRACKER + "units-per-mm") or 1.0
        found = {name: self.pin(pin) for name, pin in NUMBERS.items()}
        found.update((name, self.pin(pin) / units) for name, pin in LENGTHS.items())
        found["area_ahead"] = max(map(self.pin, AREAS))
        found["feed_per_tooth"] = feed_per_tooth(found)
        tip = tuple(found["pos_" + axis] - found["offset_" + axis] for axis in "xyz")
        return cast(Pins, {**found, "tip": tip})

    def task(self) -> Task | None:
        """What LinuxCNC's status says: {"state", "program", "auto" (the mode of programs), "idle" (nothing is
        under way, at rest), "failed" (the last command ended with an error), "running", "paused", "inch", "mdi_unit"
        ("mm" or "in"), "feed_override"}; None if nothing answers."""
        try:
            if self.status is None:
                self.status = self.linuxcnc.stat()
            self.status.poll()
        except (self.linuxcnc.error, SystemError):  # not started yet, or already ended
            self.status = None
            return None
        status, names = self.status, self.linuxcnc
        states = {
            names.STATE_ESTOP: "estop",
            names.STATE_ESTOP_RESET: "off",
            names.STATE_OFF: "off",
            names.STATE_ON: "on",
        }
        return {
            "state": states.get(status.task_state, "off"),
            "program": self.main.of(status, status.interp_state == names.INTERP_IDLE) or "",
            "auto": status.task_mode == names.MODE_AUTO,
            "idle": status.interp_state == names.INTERP_IDLE
            and not status.queue
            and status.exec_state == names.EXEC_DONE
            and bool(status.inpos),
            "failed": status.state == names.RCS_ERROR,
            "running": status.task_mode == names.MODE_AUTO and status.interp_state != names.INTERP_IDLE,
            "paused": bool(status.paused),
            "inch": 0 < (status.linear_units or 1.0) < 0.5,
            "mdi_unit": "in" if G20 in status.gcodes else "mm",
            "feed_override": status.feedrate if status.feed_override_enabled else 1.0,
        }

    def scene(self) -> Scene | None:
        """What the path of the loaded program depends on, as task() has found it: {"program", and loaded.scene()}; None
        without a program."""
        status = self.status
        if status is None or not self.main.path:
            return None
        return cast(Scene, {"program": self.main.path, **loaded.scene(status)})

    def stock(self) -> SharedStock:
        """The map of the tracker.  Raises SharedStockError."""
        return attach(component=self.component, read_only=True)

    def close(self) -> None:
        self.component.exit()
