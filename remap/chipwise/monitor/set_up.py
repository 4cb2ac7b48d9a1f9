# SPDX-License-Identifier: GPL-2.0-or-later
"""Applies the set-up of the loaded program, which a person has confirmed (setup/job.py).  Called by worker.py.

1. The job file is read in a process of its own (setup/job_process.py) when its program is loaded, and again when one of
   the files or the work offset changes.  Without a job file nothing is done.
2. Its stock is written while no program runs and nothing moves, as a certain one, and again when a run has ended by
   itself: the next part.  After a stop it stays as it was cut.  A stock of M250 or M254 that has come since stays.
3. Adaptive feed is switched on in manual mode or MDI; LinuxCNC refuses that in AUTO.  It outlives programs, aborts and
   E-stops.  In AUTO the program's first F does it, where F is remapped (glue/volumetric.py).
4. Then the pin `job` is TRUE, and chipwise_command switches the feed on when the program starts.  The target is that of
   the tool in the spindle; 0, F stays: for a tool that only goes down, one that the set-up does not know, or one with
   another diameter than was confirmed.  The feed is at most F until the program's first F has put the ceiling in the
   place of F (glue/volumetric.py).
5. Its clamps are in front of the guard (clamps_in_force.py) as soon as it has been read, and end with it.  Without them
   it is not in force.
6. check() ends it at once where another program, or the same file with another content, is there: the monitor looks
   before it says that a program runs.  Its stock goes, too.
"""

import contextlib
import time

from chipwise.program import loaded
from chipwise.host.clock import patience
from chipwise.clamps.clamp import Clamp
from chipwise.monitor.clamp_request import ClampRequest
from chipwise.monitor.clamps_in_force import JOB
from chipwise.monitor.answering import Answering
from chipwise.monitor.saying import Saying
from chipwise.monitor.shadow import is_idle, to_machine
from chipwise.monitor.start_line import Quiet
from chipwise.monitor.tool_shape import tool_shape
from chipwise.rates import MAX_RATE
from chipwise.setup.job import path_of
from chipwise.stock import reasons
from chipwise.clib.core import CellSides, CoreError, Stock
from chipwise.clib.layout import RunEnd
from chipwise.program.program_file import opened_name
from chipwise.stock.store import head_of

CALM_S = 0.3  # without a command: a screen that opens a program and runs it sends several
AGAIN_S, TRIES = 1.0, 3  # to switch adaptive feed on
SAME_DIAMETER = 0.01  # share


class SetUp:
    """Of one LinuxCNC.  check() and follow() at each look of the monitor."""

    def __init__(self, component, settings, stock_files, ini, inform, feed_is_remapped=False):
        """inform: function of a text for the operator; feed_is_remapped: whether the INI file has REMAP = F."""
        self.pins, self.settings, self.files, self.ini = component, settings, stock_files, ini
        self.saying = Saying(inform)
        self.feed_is_remapped = feed_is_remapped
        self.reading = Answering("chipwise.setup.job_process")
        self.loaded: tuple = ()  # (program, identity, identity of the job file, work offset) that was asked for
        self.claims = False  # there is a set-up, or it is being read
        self.answer: dict = {}  # of the process; empty without a set-up
        self.tools: dict = {}
        self.stock_is_due = False
        self.clamps = ClampRequest(component, stock_files, JOB)
        self.in_force = None  # (program, identity) that `job` is TRUE for
        self.ran = self.said_late = self.said_mode = False
        self.asked = 0, 0.0  # how often, and when, adaptive feed was switched on
        self.calm, self.said_tools = None, set()

    # ---- at each look ----------------------------------------------------------------------------------------------

    def check(self, program):
        """Before the monitor says whether a program runs: the set-up is that of this file, the main program's, with
        this content."""
        if self.in_force and self.in_force != (program, loaded.identity(program)):
            changed = program == self.in_force[0]
            self._withdraw()
            if changed and self.pins["program-running"]:
                self.saying.tell(
                    f"{opened_name(program)} was changed while it ran, so its set-up has ended; set it up again"
                )

    def follow(self, linuxcnc, status, command):
        """-> whether the program has a set-up; nothing of it waits for the process."""
        if not self.ini:
            return False
        self.saying.speak(linuxcnc)
        if not is_idle(linuxcnc, status):
            if self.pins["program-running"]:
                self._runs()
            return self.claims
        self._has_ended()
        found = self._found(status)
        if found != self.loaded:
            self._load(status, found)
        answer = self.reading.take()
        if answer:
            self._take(answer)
        if self.answer and not self._has_clamps():
            return self.claims
        if self.stock_is_due and self.files.stock and not self.files.kept_is_due and not self.pins["request"]:
            self.stock_is_due = False
            with self.files.working():
                self._write(lambda: status.poll() or is_idle(linuxcnc, status))
        elif self.answer:
            self._switch_on(linuxcnc, status, command)
        return self.claims

    def tool(self, number, shape, units):
        """Tool for the pins: one without a diameter in the tool table as it was confirmed.  Sets the target, which
        belongs to it."""
        target, ceiling, key = (
            0.0,
            self.ceiling(),
            number if number > 0 or len(self.tools) != 1 else next(iter(self.tools)),
        )
        if key in self.tools:
            diameter, confirmed, own = self.tools[key]
            if shape.diameter <= 0:
                shape = tool_shape(key, diameter * units, self.settings.path("TOOL_GEOMETRY"), units)
            if abs(shape.diameter / units - diameter) <= SAME_DIAMETER * diameter:
                target, ceiling = (confirmed or MAX_RATE, own) if self.air() else (confirmed or 0.0, ceiling)
            else:
                self._tell_of_tool(
                    key,
                    f"has {shape.diameter / units:.4g} mm in the tool table and {diameter:.4g} mm in its set-up, so it "
                    f"keeps F",
                )
        elif self.tools and number > 0 and self.pins["job-active"]:
            self._tell_of_tool(number, "is not in its set-up, so it keeps F")
        self.pins["job-target"], self.pins["job-ceiling"] = target, ceiling
        return shape

    def material(self):
        """The name of what the stock is made of, while the set-up is in force; "": none."""
        return self.answer["material"] if self.in_force and self.answer else ""

    def ceiling(self):
        """Times F, of any tool with a target; 1: the feed never rises."""
        found = [ceiling for _diameter, target, ceiling in self.tools.values() if target]
        return min(found) if found and self._may_raise() else 1.0

    def air(self):
        """Whether feeds above the stock are as fast as the axes.  Elsewhere a tool without a target is at most at F,
        which is its ceiling."""
        return self._may_raise() and bool(self.answer["air"])

    def _may_raise(self):
        """Whether a feed may be above F: every F is seen, and no code of the program keeps it."""
        return bool(self.answer and self.feed_is_remapped and not self.answer["keeps_f"])

    def end(self):
        """The monitor ends: the stock of a set-up is not kept for another run of LinuxCNC."""
        self.reading.end()
        self._withdraw()
        with contextlib.suppress(Exception):
            self._give_up_stock()

    def has_read(self, program):
        """Whether nothing more is to come for the loaded program: it has no set-up, or its set-up is in force, or waits
        for another mode."""
        return not self.ini or bool(
            self.loaded and self.loaded[0] == program and (not self.claims or self.in_force or self.said_mode)
        )

    # ---- what is said ----------------------------------------------------------------------------------------------

    def _name(self):
        return opened_name(self.loaded[0])

    def _tell_of_tool(self, number, text):
        if number not in self.said_tools:
            self.said_tools.add(number)
            self.saying.tell(f"{self._name()}: tool {number} {text}; set it up again")

    # ---- the job file ----------------------------------------------------------------------------------------------

    def _found(self, status):
        if not status.file:
            return ()
        scene = loaded.scene(status)
        job = path_of(status.file, self.settings.path("JOBS"))
        return (
            status.file,
            loaded.identity(status.file),
            loaded.identity(job, follow_links=False),
            loaded.place(scene),
        )  # why a link is not used is said

    def _load(self, status, found):
        """Another program, content, job file or work offset: what was before ends."""
        self.reading.end()
        self._withdraw()
        with self.files.working():
            self._give_up_stock()
            self._give_up_clamps()
        self.loaded, self.answer, self.tools, self.stock_is_due = found, {}, {}, False
        self.claims = bool(found and found[1] and found[2])
        self.asked, self.said_mode, self.said_tools = (0, 0.0), False, set()
        if self.claims:
            self.reading.ask(
                {
                    "ini": self.ini,
                    "program": status.file,
                    "job": path_of(status.file, self.settings.path("JOBS")),
                    "scene": loaded.scene(status),
                }
            )

    def _take(self, answer):
        if answer["why"]:
            self.claims = False
            remedy = "" if ";" in answer["why"] else "; set it up again"
            self.saying.tell(f"{self._name()}: its set-up is not used: {answer['why']}{remedy}")
            return
        self.answer, self.tools = answer, {int(number): tool for number, tool in answer["tools"].items()}
        self.stock_is_due = answer["to_machine"] is not None
        self.clamps.begin(bool(answer["clamps"]))

    def _runs(self):
        """A program is under way."""
        if self.claims and not self.in_force and not self.said_late:
            self.said_late = True
            self.saying.tell(
                f"{self._name()}: its set-up is not in force in this run, which has begun before; the feed is F"
            )
        if self.reading.child is not None:  # too late for this run: it is read again behind it
            self.reading.end()
            self.loaded = ()
        self.ran = True

    def _has_ended(self):
        """At rest: what a run leaves to do, once the realtime side says how it has ended."""
        if not self.ran or not self.pins["run-end"]:
            return
        self.ran = self.said_late = self.said_mode = False
        self.asked = 0, 0.0
        if self.pins["run-end"] == RunEnd.WHOLE and self.has_stock() and self.answer:
            self.stock_is_due = True
        if self.answer and JOB in self.files.clamps.dropped:
            self.clamps.begin(True)  # M256 of the program has taken their place

    # ---- the clamps ------------------------------------------------------------------------------------------------

    def _has_clamps(self):
        """Whether its clamps are in force, or it has none."""
        if not self.clamps.is_open:
            return True
        reply = (
            self.clamps.step([(0, Clamp.of_row(row)) for row in self.answer["clamps"]]) if self.files.stock else None
        )
        if reply is None:
            return False
        if reply != reasons.DONE:
            self.answer, self.claims = {}, False
            self._withdraw()
            problem, remedy = reasons.REASONS[reply]
            self.saying.tell(
                f"{self._name()}: its set-up is not used: its clamps are not in force: {problem}; {remedy}"
            )
            return False
        return True

    def _give_up_clamps(self):
        """Of a set-up that has ended."""
        if self.files.stock and self.files.clamps.has(JOB):
            self.files.lay_clamps(JOB, [])

    # ---- the stock -------------------------------------------------------------------------------------------------

    def has_stock(self):
        """Whether the stock in the map is that of the set-up."""
        return 0 != self.pins["job-stock"] == self.files.count()

    def _give_up_stock(self):
        """Of a set-up that has ended: no other program has it."""
        if self.has_stock():
            self.files.empty()
        self.pins["job-stock"] = 0

    def _write(self, is_still):
        """The stock into the map.  is_still: whether nothing has begun meanwhile."""
        low, high, turn = to_machine(self.answer)
        finest, coarsest = self.files.stock.bounds
        try:
            stock = Stock(low, high, CellSides(coarsest, finest), self.files.stock.capacity, turn=turn)
        except CoreError as error:
            self.answer, self.claims = {}, False
            self._withdraw()
            self.saying.tell(f"{self._name()}: its set-up is not used: {error}; set it up again")
            return
        self.pins["job-stock"] = 0
        if not is_still() or self.files.give((head_of(stock.head, 0.0), stock.cells_and_ring)) != reasons.DONE:
            self._withdraw()
            self.stock_is_due = True
        else:
            self.pins["job-stock"] = self.files.count()

    # ---- in force --------------------------------------------------------------------------------------------------

    def _withdraw(self):
        self.pins["job"] = self.pins["job-waits"] = self.pins["job-air"] = False
        self.in_force = None

    def _switch_on(self, linuxcnc, status, command):
        """Adaptive feed, and then the set-up; with a stock of its own, or the program's to come."""
        waits = not status.adaptive_feed_enabled
        if waits and not (self.feed_is_remapped and status.task_mode == linuxcnc.MODE_AUTO):
            self._withdraw()
            self._enable(linuxcnc, status, command)
        elif self.answer["to_machine"] is None or self.pins["certain"]:
            self.pins["job-waits"] = waits
            self._is_set_up()

    def _is_set_up(self):
        if not self.in_force:
            self.in_force = self.loaded[:2]
            self.pins["job"], self.pins["job-air"] = True, self.air()
            stock = "the stock of its M250" if self.answer["to_machine"] is None else f"the stock {self.answer['text']}"
            code = self.answer["keeps_f"]
            feed = (
                f"up to {self.ceiling():g} times F"
                if self.ceiling() > 1
                else f"at most F, because of its {code}"
                if code
                else "at most F"
            )
            stock += (
                f" and its {len(self.answer['clamps'])} clamps"
                if len(self.answer["clamps"]) > 1
                else " and its clamp"
                if self.answer["clamps"]
                else ""
            )
            feed += ", and above the stock that of the axes" if self.air() else ""
            self.saying.tell(f"{self._name()}: set up as confirmed, with {stock}; the feed is {feed}")

    def _enable(self, linuxcnc, status, command):
        self.calm = self.calm or Quiet(linuxcnc, CALM_S)
        is_calm = self.calm()
        tries, when = self.asked
        if status.task_mode not in (linuxcnc.MODE_MANUAL, linuxcnc.MODE_MDI):
            if is_calm and not self.said_mode:
                self.said_mode = True
                self.saying.tell(
                    f"{self._name()}: its set-up waits for manual mode or MDI, where adaptive feed can be switched on; "
                    f"choose one of them before Run"
                )
        elif (
            is_calm
            and status.task_state == linuxcnc.STATE_ON
            and tries < TRIES
            and time.monotonic() - when > patience(AGAIN_S)
        ):
            self.asked = tries + 1, time.monotonic()
            command.set_adaptive_feed(1)
