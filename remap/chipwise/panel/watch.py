# SPDX-License-Identifier: GPL-2.0-or-later
"""One look at the machine after the other, for all pages of `chipwise panel` together.

Called by cli/panel.py, in the main thread; server.py reads from other threads what it publishes.

 1. LOOK_S between two looks at the pins, whether a page is open or not: the last HISTORY_S, peak and mean of a program
    are known to a page that is opened later.
 2. The map is looked at when a program begins and while a page is open, and never for more than MAP_SHARE of the time.
 3. If a program runs and another one ran at the look before, the look counts as one between the two: the other one
    begins with the next look.
 4. The path done comes from the servo thread (stock/path_done.py), so a look that is late loses none of it.
 5. A look is published as one JSON text with a number; who waits for it is woken.
"""

import json
import os
import threading
import time
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from chipwise.host.clock import patience
from chipwise.errors import unnamed
from chipwise.panel.look_ahead import Ahead
from chipwise.panel.alarms import Alarms
from chipwise.panel.display import LIMITS, MODES, STOCK, SUMS, Run, is_assumed, shown
from chipwise.panel.limits import loads, power
from chipwise.panel import Json
from chipwise.panel.load_log import LoadLog
from chipwise.panel.machine import Machine, Pins, Task, Tip
from chipwise.panel.tiles import Tiles
from chipwise.panel.tool_log import OVER
from chipwise.stock.shared import SharedStock, SharedStockError

Points = npt.NDArray[np.float64]  # (n, 3) mm, machine coordinates
LOOK_S = 0.1
HISTORY_S = 60.0
ALIVE_S = 1.0  # between two looks whether LinuxCNC still runs
MAP_SHARE = 0.05  # of the time, for looks at the map
RETRY_S = 2.0  # until a map that could not be read is looked for again
RUN_SUMS = tuple(name.replace("-", "_") for name in SUMS)
OF_RUN = ("mode", "target", "motion_type", *(name.replace("-", "_") for name in STOCK), *RUN_SUMS)
SHOWN_AS_READ = (
    "mrr",
    "target",
    "lower",
    "override",
    "area",
    "area_ahead",
    "depth",
    "tip",
    "tool",
    "tool_diameter",
    "tool_corner_radius",
    "tool_flute_length",
    "removed",
    "line",
    "current_vel",
    "feed_per_tooth",
    "programmed_vel",
    "requested_vel",
    "work",
    "doubt",
)
SLOWER = 0.98  # of F: the background shows it
PATH_POINTS = 10000  # of the path done
PATH_STEP_MM = 0.2  # between two of them that were seen at looks


def figures(run: Run | None) -> Json | None:
    """Peak, mean, time and time saved of a run of a program (panel/display.py: Run); mm3/min and s, None: not known."""
    if run is None:
        return None
    return {
        "seconds": round(run.seconds, 1),
        "peak": run.peak,
        "mean": run.mean,
        "air_share": run.air_share,
        "saved": round(run.saved_s, 1) if run.fed_s > 0 else None,
    }


def background(pins: Pins, task: Task | None, alarms: Alarms) -> str:
    """The state at a glance: off, alarm, over (the target), limited (slower than F), cutting or calm."""
    if any(entry["active"] for entry in alarms.entries):
        return "alarm"
    if task is None or task["state"] != "on":
        return "off"
    if 0 < OVER * pins["target"] < pins["mrr"]:
        return "over"
    if pins["mrr"] <= 0:
        return "calm"
    programmed = pins["programmed_vel"] if pins["programmed_vel"] > 0 else pins["requested_vel"]
    return "limited" if pins["override"] * pins["requested_vel"] < SLOWER * programmed else "cutting"


class PathDone:
    """Where the tip was; the path of the running program, or of the last one."""

    def __init__(self) -> None:
        self.points: deque[tuple[float, ...]] = deque(maxlen=PATH_POINTS)
        self.count = 0  # points that were ever added
        self.epoch = 0  # counts programs

    def begin(self) -> None:
        self.points.clear()
        self.epoch += 1

    def add(self, points: Iterable[Sequence[float]], step: float = 0.0) -> None:
        """Points of the path, as far as each is `step` mm from the one before."""
        for point in points:
            if not self.points or max(abs(a - b) for a, b in zip(point, self.points[-1])) >= step:
                self.points.append(tuple(round(float(a), 3) for a in point))
                self.count += 1


class Watch:
    """The machine as the pages see it."""

    def __init__(self, machine: Machine, log_path: str = "", ahead: Ahead | None = None) -> None:
        """log_path: file of the load log, "" for none; ahead: Ahead, None: no program is read."""
        self.machine, self.log = machine, LoadLog(log_path)
        self.tiles, self.alarms, self.path, self.ahead = Tiles(), Alarms(), PathDone(), ahead or Ahead("")
        self.history: deque[tuple[object, ...]] = deque(maxlen=round(HISTORY_S / LOOK_S))
        self.published = threading.Condition()
        self.number = 0  # of the last look
        self.text = b"{}"
        self.pages = 0  # open ones (server.py)
        self.ended = False
        self.stock: SharedStock | None = None
        self.stock_error = ""
        self.clamps: list[list[float]] = []  # in force: rows of stock/clamp_table.py
        self.run: Run | None = None
        self.was_running, self.program = False, ""  # at the look before
        self._is_fresh = False  # the stock was defined in the run under way
        self.last = time.monotonic()
        self._generation: int | None = None  # of the map, at the last look
        self._shown: int | None = None  # of what tiles have
        self._tip: Tip | None = None  # at the look before
        self._points_read: int | None = None  # how many points stock_tracker had kept then
        self._map_due = self._alive_due = self._removed = self._run_time = 0.0

    def look(self) -> bool:
        """One look; -> whether LinuxCNC still runs."""
        if time.monotonic() >= self._alive_due:
            self._alive_due = time.monotonic() + patience(ALIVE_S)
            if not self.machine.runs():
                self.end()
                return False
        kept = self.kept_points()  # before the pins: the tip is at the end of them
        pins = self.machine.pins()
        now = time.monotonic()  # of the pins: what was removed since the look before belongs to this time
        dt, self.last = now - self.last, now
        task = self.machine.task()
        running = self.runs_on(task)
        busy = bool(task and task["running"])
        self.mark_stock(running, busy)
        if self.was_running and not running:
            self._map_due = now  # the next program may begin soon
        self.look_at_map(now, self.pages or not running)
        if pins["removed"] < self._removed:  # another stock, perhaps of the same box
            self.tiles.unmark()
            self._is_fresh = busy
        self._removed = pins["removed"]
        self.ahead.look(dt, self.machine.scene() if task else None, running, pins, self.pages > 0)
        with self.published:
            self.follow_path(pins["tip"], kept, running)
            self.follow_run(dt, pins, task, running)
        self.log.write()
        with self.published:
            self.alarms.step(pins, bool(task and task["inch"]), time.time(), not task or task["auto"])
            watts = power(pins) or {"predicted": 0.0, "measured": None}
            self.history.append(
                (
                    round(now, 2),
                    round(pins["mrr"], 1),
                    round(pins["target"], 1),
                    round(pins["override"], 3),
                    loads(pins),
                    watts["predicted"],
                    watts["measured"],
                )
            )
            self.text = json.dumps(self.state(pins, task), allow_nan=False).encode()
            self.number += 1
            self.published.notify_all()
        return True

    def mark_stock(self, running: bool, busy: bool) -> None:
        """At the beginning of a run: its stock is what the page compares with.  LinuxCNC 2.10 names a program only when
        its first move begins; by then the run has begun, and M250 may be behind it."""
        self._is_fresh &= busy
        if running and not self.was_running and not self._is_fresh:
            if self._shown == self._generation:
                self.tiles.mark()
            else:  # nobody has seen the stock before the program
                self.tiles.unmark()

    def runs_on(self, task: Task | None) -> bool:
        """Whether a program runs, and none that has begun since the look before while another one ran."""
        running, before = bool(task and task["running"]), self.program
        self.program = task["program"] if task else ""
        return running and not (self.was_running and self.program != before)

    def follow_run(self, dt: float, pins: Pins, task: Task | None, running: bool) -> None:
        if task and running and not self.was_running:
            self.run = Run()
            self.log.begin(task["program"], time.time())
        elif self.was_running and not running:
            self.log.end()
        self.was_running = running
        passed = self.passed(dt, pins)
        if running and self.run:
            self.run.look({name.replace("_", "-"): pins[name] for name in OF_RUN})
            self.log.look(passed, pins, time.time())

    def kept_points(self) -> Points | None:
        """Where the tip has been since the look before, (n, 3) mm, as stock_tracker has kept it; None where it keeps
        nothing that can be read."""
        done = self.stock.path_done() if self.stock else None
        if done is None:
            return None
        points, self._points_read = done.since(done.count if self._points_read is None else self._points_read)
        return points

    def follow_path(self, tip: Tip, kept: Points | None, running: bool) -> None:
        """The path done from what stock_tracker has kept; where it keeps nothing, from the tips of the looks."""
        if running and not self.was_running:
            self.path.begin()
            self.path.add([self._tip] if kept is not None and self._tip else [])
        if running or self.was_running:
            if kept is None:
                self.path.add([tip], PATH_STEP_MM)
            else:
                self.path.add(kept)
        if self.was_running and not running and kept is not None:
            self.path.add([tip])
        self._tip = tip

    def passed(self, dt: float, pins: Pins) -> float:
        """s of the servo thread since the look before: a simulation that was late makes up for it, so what it has cut
        does not belong to dt, the time by the clock.  A machine whose thread counts none has dt."""
        before, self._run_time = self._run_time, shown(pins[RUN_SUMS[0]])
        if before == self._run_time == 0:
            return dt
        return (
            self._run_time - before if self._run_time >= before else max(0.0, self._run_time)
        )  # another run has begun

    def look_at_map(self, now: float, wanted: object) -> None:
        """Its generation, and if wanted and due, what has changed; a map that cannot be read is tried again.  Between
        programs it is wanted without pages too: it is what was before the next program."""
        if now < self._map_due and self.stock is None:
            return
        began = time.process_time()
        try:
            if self.stock is None:
                self.stock = self.machine.stock()
            self._generation = self.stock.generation
            self.clamps = self.stock.clamps_in_force(self.clamps)
            if wanted and now >= self._map_due and self._shown != self._generation:
                live = self.stock.live()
                self.tiles.look(live)
                self._shown = live and live[0].generation
                self._map_due = now + (time.process_time() - began) / MAP_SHARE
            self.stock_error = ""
        except SharedStockError as error:
            self.stock_error = unnamed(error)
            self._map_due = now + patience(RETRY_S)
            if self.stock is not None:
                self.stock.close()
                self.stock = None

    def state(self, pins: Pins, task: Task | None) -> Json:
        """What a page shows beside the stock; mm, mm/s, mm2, mm3/min."""
        mode, limit = int(pins["mode"]), int(pins["limited_by"])
        run = self.run
        return {
            **{name: pins[name] for name in SHOWN_AS_READ},
            "time": self.history[-1][0],
            "clock": round(time.time(), 3),
            "look": self.number + 1,
            "stock": bool(pins["stock_defined"]),
            "assumed": is_assumed(pins["stock_defined"], pins["certain"]),
            "tool_assumed": bool(pins["tool_assumed"]),
            "ready": bool(pins["ready"]),
            "fault": bool(pins["fault"]),
            "mode": MODES[mode] if 0 <= mode < len(MODES) else MODES[0],
            "limited_by": LIMITS[limit] if 0 <= limit < len(LIMITS) else LIMITS[0],
            "task": {**task, "program": os.path.basename(task["program"])} if task else None,
            "loads": loads(pins),
            "power": power(pins),
            "run": figures(run),
            "background": background(pins, task, self.alarms),
            "guards": {"rapid": bool(pins["guard_rapid"]), "flute": bool(pins["guard_flute"])},
            "alarms": self.alarms.entries,
            "stock_error": self.stock_error,
            "clamps": self.clamps,
            "tools": self.log.tools.rows(),
            "log_error": self.log.error,
            "pages": self.pages,
            "path": [self.path.epoch, self.path.count],
            "ahead": self.ahead.state(),
        }

    def wait(self, number: int, seconds: float) -> tuple[int, bytes]:
        """Wait for a look after `number`.  -> (its number, its text), the same number after so many seconds or at the
        end."""
        with self.published:
            self.published.wait_for(lambda: self.number != number or self.ended, seconds)
            return self.number, self.text

    def path_since(self, epoch: int, count: int) -> Json:
        """Points of the path done that a page lacks which has `count` of them."""
        with self.published:
            points = list(self.path.points)
            missing = self.path.count - count if epoch == self.path.epoch else len(points)
            return {
                "epoch": self.path.epoch,
                "count": self.path.count,
                "points": points[len(points) - min(missing, len(points)) :],
            }

    def recent(self) -> list[tuple[object, ...]]:
        """The last HISTORY_S: rows of time (s), rate, target (mm3/min), override, loads(), predicted and measured power
        (W; None: not measured)."""
        with self.published:
            return list(self.history)

    def end(self) -> None:
        """LinuxCNC has ended: so do the streams of the pages."""
        with self.published:
            self.ended = True
            self.published.notify_all()

    def close(self) -> None:
        self.end()
        if self.was_running:
            self.was_running = False
            self.log.end(complete=False)
            self.log.write()
        if self.stock is not None:
            self.stock.close()
        self.ahead.close()
        self.machine.close()
