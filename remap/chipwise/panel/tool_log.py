# SPDX-License-Identifier: GPL-2.0-or-later
"""What each tool did in a program: reference, mean and peak of the removal rate, time, how often and how it was held
back.

Called by load_log.py for the running program; operations.py has the same for each operation.  The columns are those of
load logs of machine tools: reference, mean, peak, time, overload reaction.

 1. Moments makes one Moment of two looks at the machine: time, volume, whether it cuts, whether a guard has just
    stopped it.
 2. A Use adds up the moments of one tool, or of one operation.
"""

from collections.abc import Collection
from dataclasses import dataclass

from chipwise.panel.display import FEED_MOTION, LIMITS
from chipwise.panel.limits import TOOTH, loads, power
from chipwise.panel.log_file import Row
from chipwise.panel.machine import Pins
from chipwise.rates import MM3_PER_CM3
from chipwise.clib.layout import LimitedBy

SHARES = tuple(f"{name}_percent" for name in TOOTH)  # largest share of each bound; empty: no bound
WATTS = ("predicted_w", "measured_w")  # means while it cuts; empty: not known
COLUMNS = (
    "start",
    "program",
    "tool",
    "diameter_mm",
    "reference_cm3_min",
    "mean_cm3_min",
    "peak_cm3_min",
    "cutting_s",
    "removed_cm3",
    "slowed_s",
    "over_s",
    "limited_by",
    "stops",
    *SHARES,
    *WATTS,
    "complete",
)
SLOWED = (LimitedBy.STOCK_HERE, LimitedBy.STOCK_AHEAD)
OVER = 1.1  # of the target: an overload
MOST_TOOLS = 1000


def watts_of(pins: Pins) -> tuple[float | None, float | None]:
    """Predicted and measured power, W; None: not known."""
    found = power(pins)
    return (found["predicted"] or None, found["measured"]) if found else (None, None)


def mean(uses: "Collection[Use]") -> float:
    """Removal rate of uses while they cut, mm3/min."""
    seconds = sum(use.cut_s for use in uses)
    return sum(use.volume for use in uses) / seconds * 60 if seconds > 0 else 0.0


@dataclass(frozen=True)
class Moment:
    """The time between two looks: dt s, volume mm3, whether it cuts, whether a guard has stopped the machine in it;
    pins: Machine.pins() at its end."""

    dt: float
    volume: float
    cutting: bool
    stop: bool
    pins: Pins

    @property
    def counts(self) -> bool:
        """Whether a tool or an operation of which nothing is known yet gets a row for it."""
        return self.cutting or self.stop

    @property
    def late(self) -> float:
        """Volume that was cut before the motion which this look has found: it belongs to whoever has cut last."""
        return 0.0 if self.cutting else self.volume

    @property
    def tool(self) -> int:
        return int(self.pins["tool"])


class Moments:
    """Looks one after the other."""

    def __init__(self) -> None:
        self._removed: float | None = None
        self._stopped = False

    def look(self, dt: float, pins: Pins) -> Moment:
        """-> the Moment that ends with this look, dt s after the one before."""
        before, self._removed = self._removed, pins["removed"]
        volume = pins["removed"] - before if before is not None else 0.0  # below 0: another stock
        stopped, was_stopped = bool(pins["guard_reason"]), self._stopped
        self._stopped = stopped
        # a rate without volume: the servo thread has not run since the look before (a busy simulation), and makes up
        # for it later
        cutting = before is not None and pins["motion_type"] in FEED_MOTION and (volume > 0 or pins["mrr"] > 0)
        return Moment(dt, max(0.0, volume), cutting, stopped and not was_stopped, pins)


class Use:
    """What one tool did, or one operation; s, mm3, mm3/min."""

    def __init__(self, tool: int, diameter: float) -> None:
        self.tool, self.diameter = tool, diameter
        self.cut_s = self.over_s = self.volume = self.peak = self.reference = 0.0
        self.rate = 0.0  # that it was last seen to cut with
        self.limited_s = [0.0] * len(LIMITS)  # by LimitedBy
        self.stops = 0
        self.shares: dict[str, float] = {}  # the largest of limits.loads()
        self.watts = {name: (0.0, 0.0) for name in WATTS}  # Ws, and the s for which it was known

    def add(self, moment: Moment) -> None:
        pins = moment.pins
        self.stops += moment.stop
        if not moment.cutting:
            return
        self.cut_s += moment.dt
        self.volume += moment.volume
        self.peak, self.rate = max(self.peak, pins["mrr"]), pins["mrr"] or self.rate
        self.reference = max(self.reference, pins["target"])
        limit = int(pins["limited_by"])
        if pins["mode"] and 0 < limit < len(LIMITS):
            self.limited_s[limit] += moment.dt
        if pins["mode"] and 0 < OVER * pins["target"] < pins["mrr"]:
            self.over_s += moment.dt
        self.add_limits(moment)

    def add_limits(self, moment: Moment) -> None:
        """The largest share of each bound, and the powers."""
        for name, share in loads(moment.pins).items():
            self.shares[name] = max(share, self.shares.get(name, 0.0))
        for name, value in zip(WATTS, watts_of(moment.pins)):
            if value is not None:
                joules, seconds = self.watts[name]
                self.watts[name] = joules + value * moment.dt, seconds + moment.dt

    def add_late(self, moment: Moment) -> None:
        """What it had cut before the motion which this look has found, and the time for that: a mean above the peak
        cannot be."""
        self.volume += moment.late
        if self.rate > 0:
            self.cut_s += min(moment.dt, 60 * moment.late / self.rate)

    @property
    def slowed_s(self) -> float:
        """Time for which the stock held the feed back."""
        return sum(self.limited_s[limit] for limit in SLOWED)

    @property
    def limited_by(self) -> str:
        """What held the feed back longest: a name of display.LIMITS."""
        longest = max(self.limited_s)
        return LIMITS[self.limited_s.index(longest)] if longest > 0 else LIMITS[LimitedBy.NONE]

    def figures(self) -> Row:
        """The figures that tools and operations have in common."""
        return {
            "tool": self.tool,
            "diameter_mm": round(self.diameter, 4),
            "reference_cm3_min": round(self.reference / MM3_PER_CM3, 4) or "",
            "mean_cm3_min": round(mean([self]) / MM3_PER_CM3, 4),
            "peak_cm3_min": round(self.peak / MM3_PER_CM3, 4),
            "cutting_s": round(self.cut_s, 1),
            "removed_cm3": round(self.volume / MM3_PER_CM3, 4),
            "over_s": round(self.over_s, 1),
            "limited_by": self.limited_by,
            "stops": self.stops,
            **{
                column: round(100 * self.shares[name], 1) if name in self.shares else ""
                for column, name in zip(SHARES, TOOTH)
            },
            **{
                name: round(joules / seconds, 1) if seconds > 0 else ""
                for name, (joules, seconds) in self.watts.items()
            },
        }

    def row(self) -> Row:
        """The figures of a tool, as a page and the file show them."""
        return {**self.figures(), "slowed_s": round(self.slowed_s, 1)}


class ToolLog:
    """The tools of one run of a program, in the order of their first cut."""

    def __init__(self) -> None:
        self.uses: dict[int, Use] = {}
        self._last: Use | None = None  # the Use that has cut last

    def add(self, moment: Moment) -> None:
        if self._last is not None:
            self._last.add_late(moment)
        number = moment.tool
        if number not in self.uses:
            if not moment.counts or len(self.uses) >= MOST_TOOLS:
                return
            self.uses[number] = Use(number, moment.pins["tool_diameter"])
        self.uses[number].add(moment)
        self._last = self.uses[number] if moment.cutting else self._last

    @property
    def mean(self) -> float:
        """Of all tools, mm3/min."""
        return mean(self.uses.values())

    def rows(self) -> list[Row]:
        return [use.row() for use in self.uses.values()]
