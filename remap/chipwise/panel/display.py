# SPDX-License-Identifier: GPL-2.0-or-later
"""What a screen shows of chipwise: pins for a small panel, and one line at the end of each program.

Called by cli/display.py.  configs/panel.xml (PyVCP) shows the pins.

Times, mean and peak are sums of the servo thread (components/core/run_sums.h), so they are those of the panel page and
of the summary.
"""

import os
import time
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

from chipwise import report
from chipwise.errors import MM_PER_INCH, format_minutes
from chipwise.program.loaded import MainProgram
from chipwise.rates import MM3_PER_CM3, MM3_PER_IN3
from chipwise.clib.layout import MOTION_ARC, MOTION_FEED, FeedMode, LimitedBy

COMPONENT = "chipwise-display"
POLL_S = 0.02  # of the pins
STATUS_S = 0.1  # of LinuxCNC's status
FEED_MOTION = (MOTION_FEED, MOTION_ARC)
MODES = tuple(mode.name.lower() for mode in FeedMode)
_LIMIT_WORDS = {
    LimitedBy.NONE: "nothing",
    LimitedBy.STOCK_HERE: "stock",
    LimitedBy.STOCK_AHEAD: "ahead",
    LimitedBy.FLOOR: "floor",
    LimitedBy.CEILING: "ceiling",
    LimitedBy.FALLBACK: "fallback",
    LimitedBy.CHIP: "chip",
    LimitedBy.POWER: "power",
    LimitedBy.TORQUE: "torque",
    LimitedBy.FORCE: "force",
}
LIMITS = tuple(_LIMIT_WORDS[limit] for limit in LimitedBy)
SHOWN = LIMITS[: LimitedBy.CHIP]  # on the tab, which has room for six; a limit of the tooth is a ceiling there
SUMS = (
    "run-time",
    "fed-time",
    "saved-time",
    "mean-rate",
    "peak-rate",
    "cut-time",
    "air-time",
    "rub-time",
)  # of volumetric-feed.0
TIMES = ("at-f-time", "set-up-time")  # of chipwise-monitor (monitor/set_up_time.py)
LEAST_RUB_S = 0.5  # below chip_least: what a tool rubs as it enters and leaves is not spoken of
WORTH = 0.99  # of the time at F: a set-up that takes more is not spoken of
STOCK = ("stock-defined", "certain")
STOCK_WORDS = ("none", "defined", "assumed")
LARGEST = 1e9  # a pin may hold any number; larger ones are not shown


class Component(Protocol):
    """A hal.component: its pins by their names."""

    def __getitem__(self, name: str, /) -> float: ...

    def __setitem__(self, name: str, value: float, /) -> None: ...


class Numbers(Protocol):
    """Pins by their names: a Component, or what somebody has read of it."""

    def __getitem__(self, name: str, /) -> float: ...


class Run:
    """One run of a program, from its start to its end."""

    def __init__(self) -> None:
        self.seconds = self.fed_s = self.saved_s = 0.0  # all of it; with the volumetric feed on; saved against F
        self.peak = self.mean = self.target = 0.0  # mm3/min
        self.cut_s = self.air_s = self.rub_s = 0.0  # of feed moves, in the stock and outside
        self.at_f_s = self.set_up_s = 0.0  # of the whole program by simulation; 0: not known
        self.assumed = False  # nobody has confirmed the stock

    def look(self, pins: Numbers) -> None:
        """The sums so far (components/core/run_sums.h), by the names of SUMS; the target; by the names of STOCK whether
        the stock is assumed."""
        self.seconds, self.fed_s, self.saved_s, self.mean, self.peak, self.cut_s, self.air_s, self.rub_s = (
            shown(pins[name]) for name in SUMS
        )
        self.assumed = is_assumed(*(pins[name] for name in STOCK))
        if pins["motion-type"] in FEED_MOTION and pins["mode"] and 0 < pins["target"] < LARGEST:
            self.target = pins["target"]

    def look_at_set_up(self, pins: Numbers) -> None:
        """The whole program's times, by the names of TIMES."""
        self.at_f_s, self.set_up_s = (shown(pins[name]) for name in TIMES)

    @property
    def worth_a_line(self) -> bool:
        return self.fed_s > 0 or self.peak > 0 or self.assumed and self.air_share is not None

    @property
    def air_share(self) -> float | None:
        """Share of the feed time that is in air; None without feed moves."""
        return self.air_s / (self.cut_s + self.air_s) if self.cut_s + self.air_s > 0 else None

    def line(self, program: str, done: Sequence[dict[str, Any]], inch: bool) -> str:
        """The line for the operator.  done: what the cycles reported (chipwise.report)."""
        unit, per = ("in3/min", MM3_PER_IN3) if inch else ("cm3/min", MM3_PER_CM3)
        parts = [f"{os.path.basename(program) or 'program'}: {duration(self.seconds)}"]
        if self.fed_s > 0:
            parts[0] += f", {duration(abs(self.saved_s))} {'less' if self.saved_s >= 0 else 'more'} than at F"
        if self.assumed:
            parts[0] += " on an assumed stock"
        if self.fed_s > 0:
            if self.peak > 0:
                parts.append(
                    f"peak {self.peak / per:.3g}"
                    + (f", target {self.target / per:.3g} {unit}" if self.target else f" {unit}")
                )
        else:
            parts += self._at_f(per, unit)
        if self.rub_s >= LEAST_RUB_S:
            parts.append(f"rubs for {duration(self.rub_s)}: take wider cuts")
        pieces = [entry for entry in done if entry.get("chopped")]
        largest = max((entry.get("largest_piece_mm") or 0.0 for entry in done), default=0.0)
        if pieces:
            parts.append(f"{sum(entry.get('pieces') or 1 for entry in pieces)} pieces")
        if largest:
            parts.append("largest piece " + (f"{largest / MM_PER_INCH:.3g} in" if inch else f"{largest:.3g} mm"))
        return "; ".join(parts)

    def _at_f(self, per: float, unit: str) -> Iterator[str]:
        """What a run at F has cut.  per: mm3/min in a unit."""
        if self.air_share is not None:
            yield f"in air {100 * self.air_share:.0f} % of the feed time"
        if self.peak > 0:
            yield f"largest {self.peak / per:.3g}, mean {self.mean / per:.3g} {unit}"
        if self.assumed and 0 < self.set_up_s < WORTH * self.at_f_s:
            yield f"set up it would take {format_minutes(self.set_up_s)}, not {format_minutes(self.at_f_s)}"


def is_assumed(defined: float, certain: float) -> bool:
    """Whether there is a stock that neither a program nor a person has confirmed (stock-tracker.N.certain)."""
    return bool(defined and not certain)


def shown(value: float) -> float:
    """A sum that can be shown: 0 for one that is not finite or larger than LARGEST."""
    return value if -LARGEST < value < LARGEST else 0.0


def duration(seconds: float) -> str:
    """12.34 -> "12.3 s", 754 -> "12 min 34 s"."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {rest} s"


class Display:
    """The panel of one LinuxCNC."""

    def __init__(self, component: Component) -> None:
        import linuxcnc

        self.linuxcnc = linuxcnc
        self.component = component
        self.status: Any = None  # a linuxcnc.stat, which has no types
        self.command: Any = None  # a linuxcnc.command
        self.inch = False
        self.run: Run | None = None
        self.program, self.main = "", MainProgram()
        self.looked = 0.0

    def look(self) -> bool | None:
        """LinuxCNC's status; -> whether a program runs, None without an answer."""
        try:
            if self.status is None:
                self.status, self.command = self.linuxcnc.stat(), self.linuxcnc.command()
            self.status.poll()
        except (self.linuxcnc.error, SystemError):  # not started yet, or already ended
            self.status = None
            return None
        self.inch = 0 < (self.status.linear_units or 1.0) < 0.5
        if self.status.file:
            self.program = self.main.of(self.status, self.status.interp_state == self.linuxcnc.INTERP_IDLE)
        return (
            self.status.task_mode == self.linuxcnc.MODE_AUTO and self.status.interp_state != self.linuxcnc.INTERP_IDLE
        )

    def step(self) -> None:
        now = time.monotonic()
        if self.run:
            self.run.look(self.component)
            self.run.look_at_set_up(self.component)
        if now - self.looked < STATUS_S:
            return
        self.looked = now
        running = self.look()
        self.show()
        if running and not self.run:
            self.run = Run()
        elif not running and self.run:
            ended, self.run = self.run, None
            if running is not None:
                self.report(ended)

    def report(self, ended: Run) -> None:
        """The line at the end of a run, if there is anything to report; the cycles' report file is emptied."""
        done = report.read(report.path())
        report.begin()
        if ended.worth_a_line or done:
            text = "chipwise: " + ended.line(self.program, done, self.inch)
            print(text, flush=True)
            self.command.text_msg(text[:250])

    def show(self) -> None:
        """The panel's pins."""
        pins = self.component
        per = MM3_PER_IN3 if self.inch else MM3_PER_CM3
        rate, target = (value if 0 <= value < LARGEST else 0.0 for value in (pins["mrr"], pins["target"]))
        pins["rate"], pins["rate-target"] = rate / per, target / per
        pins["share"] = min(100.0 * rate / target, 999.0) if target > 0 else 0.0
        choose(pins, "mode-", MODES, pins["mode"])
        choose(pins, "by-", SHOWN, pins["limited-by"] if pins["limited-by"] < len(SHOWN) else LimitedBy.CEILING)
        choose(
            pins,
            "stock-is-",
            STOCK_WORDS,
            2 if is_assumed(*(pins[name] for name in STOCK)) else int(pins["stock-defined"]),
        )
        choose(pins, "unit-", ("cm3", "in3"), int(self.inch))


def choose(pins: Component, prefix: str, names: Sequence[str], number: float) -> None:
    """Exactly one of the bits is TRUE; a number out of range counts as 0."""
    for at, name in enumerate(names):
        pins[prefix + name] = at == (number if 0 <= number < len(names) else 0)


def make_component() -> Component:
    import hal

    component = hal.component(COMPONENT)
    for name in ("mrr", "target", *SUMS, *TIMES):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_IN)
    for name in ("mode", "limited-by", "motion-type"):
        component.newpin(name, hal.HAL_S32, hal.HAL_IN)
    for name in STOCK:
        component.newpin(name, hal.HAL_BIT, hal.HAL_IN)
    for name in ("rate", "rate-target", "share"):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    for prefix, names in (("mode-", MODES), ("by-", SHOWN), ("stock-is-", STOCK_WORDS), ("unit-", ("cm3", "in3"))):
        for name in names:
            component.newpin(prefix + name, hal.HAL_BIT, hal.HAL_OUT)
    return component
