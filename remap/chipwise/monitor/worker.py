# SPDX-License-Identifier: GPL-2.0-or-later
"""The work of chipwise-monitor: reports the tool to the realtime components, and to the operator what they found.

Called by cli/monitor.py in the child process of supervisor.py.  spindle_tool.py follows the tool.

A failure in one part of the work is reported, and the others continue.  `heartbeat` counts every look, and
`tool-followed` is the machine's own tool number as of the last look: with them the stock tracker notices that the
monitor is late, stopped or dead
(core/tool_watch.h).
"""

import os
import signal
import threading
import time
from contextlib import contextmanager

from chipwise.host.clock import patience
from chipwise.host.files import printable
from chipwise.program.loaded import MainProgram
from chipwise.monitor import known
from chipwise.monitor.carried_feed import CarriedFeed, mark_of
from chipwise.monitor.comment_clamps import CommentClamps
from chipwise.monitor.hints import Hints
from chipwise.monitor.limits import Limits
from chipwise.monitor.loaded_program import LoadedProgram
from chipwise.monitor.messages import FAULTS, Stop, clamp_text, guard_text, override_text
from chipwise.monitor.saying import Saying
from chipwise.monitor.set_up import SetUp
from chipwise.monitor.shadow import Shadow
from chipwise.monitor.spindle_load import SpindleLoad
from chipwise.monitor.spindle_tool import SpindleTool
from chipwise.monitor.start_line import Quiet, StartLine
from chipwise.monitor.stock_files import StockFiles
from chipwise.monitor.tool_place import ToolPlace
from chipwise.settings import feed_is_remapped
from chipwise.clib.layout import MOTION_ARC, MOTION_FEED, Fault, GuardReason, LimitedBy

POLL_S = 0.02
SETTLE_S = 0.1  # a fallback shorter than this is not worth a message
LOST_S, LOST_LOOKS = 0.5, 3  # a load that is lost for so long, and in so many looks, stays lost
REPEAT_S = 30.0  # least time between two messages about the same part
MAX_FILE_S = 300.0  # the heart beats on for this long while a file is worked on
MAX_BEATS = 1 << 30
TOOL_FAULTS = range(Fault.TOOL_DIAMETER, Fault.NO_MONITOR + 1)
FEED_MOTION = (MOTION_FEED, MOTION_ARC)

ANOTHER_PROGRAM = (
    "another program has begun while chipwise-monitor was late, so M251 has ended; start the program "
    "again if it needs M251"
)
RESUMED = "chipwise-monitor follows the tool again, so M251 goes on"
NOT_RESUMED = (
    "another tool or another stock since chipwise-monitor was lost, so M251 does not raise the feed; use M252, give "
    "M251 again, or "
    "press Stop"
)
NO_STOCK = "no stock is known, so the feed is F as programmed; define it with M250"
NO_LIMIT = (
    "no limit of tool {tool} is known, so the feed is F while M251 has no Q; give the tool flutes and "
    "chip_load, start the spindle, or add Q"
)


class Monitor(SpindleTool):
    """One LinuxCNC, watched."""

    def __init__(self, component, settings, died="", first=True):
        """died: how the child before has ended, '' for the first one.  first: whether no monitor was before it in this
        run of LinuxCNC."""
        import linuxcnc

        super().__init__(linuxcnc, component, settings)
        self.program = MainProgram()
        self.fallback_since = None
        self.said_fallback = self.said_ignored = False
        self.said_fault = self.said_guard = 0
        self.guard_depth = None  # of the last look, during a flute excess
        self.reported = {}  # part of the work: (text, time.monotonic()) of the last message
        self.died = died
        self.resumes = not first  # M251 may be in force already
        self.begins = self.resumes  # nobody has followed the tool yet
        self.said_lost = False
        self.lost_since, self.lost_looks = None, 0  # seen in all looks since then
        self.tool_place = ToolPlace()
        self.stock_files = StockFiles(component, settings, self.say, self.working, self.place)
        ini, is_remapped = os.environ.get("INI_FILE_NAME", ""), feed_is_remapped()
        self.shadow = Shadow(component, settings, self.stock_files, ini, self.inform, is_remapped)
        self.set_up = SetUp(component, settings, self.stock_files, ini, self.inform, is_remapped)
        self.comment_clamps = CommentClamps(component, self.stock_files, ini, self.inform, self.working)
        self.saying = Saying(self.inform)
        self.limits = Limits(component, settings, self.saying)
        self.spindle_load = SpindleLoad(component, settings, self.say, self.inform)
        self.loaded = LoadedProgram(self.inform, is_remapped, self.limits)
        self.carried_feed = CarriedFeed(component, self.inform, is_remapped)
        self.hints = Hints(component, self.say, self.inform, linuxcnc)
        self.start_line, self.quiet = StartLine(settings, self.inform, first), None

    def follow_run(self, _now):
        """Whether a program runs, also while it is paused; not MDI.

        A look that comes late, or after another monitor has died, may have missed the end of one program and the
        beginning of another: the pin is FALSE until the look after it, so M251 ends rather than stays on in a program
        that knows nothing of it.  The same program keeps it: a feed that rises to F in the middle of a cut is worse
        than a limit in a program's first lines."""
        status, pins = self.status, self.component
        running = status.task_mode == self.linuxcnc.MODE_AUTO and status.interp_state != self.linuxcnc.INTERP_IDLE
        self.stock_files.was_on |= status.task_state == self.linuxcnc.STATE_ON
        path = self.main_program()
        program = known.checksum(path)
        if running and pins["program-running"] and pins["program-loaded"] != program:
            running = False
            if pins["mode"]:
                self.inform(ANOTHER_PROGRAM)
        self.set_up.check(path)
        pins["program-loaded"] = program
        pins["program-mark"] = mark_of(path)  # before program-running, with which it counts
        pins["program-running"] = running
        self.stock_files.clamps.follow(running)
        self.carried_feed.follow(path, status.motion_line)

    def main_program(self):
        """Path of the program that is open."""
        return self.program.of(self.status, self.status.interp_state == self.linuxcnc.INTERP_IDLE)

    def place(self):
        """(tip, radius of the tool, line, program): mm, machine coordinates."""
        status = self.status
        tip, line = self.tool_place.look(status)
        return (
            [at / self.units for at in tip],
            status.tool_table[0].diameter / (2 * self.units),
            line,
            self.main_program(),
        )

    def as_set_up(self, number, shape):
        return self.shadow.tool(number, self.set_up.tool(number, shape, self.units), self.units)

    def default_chip(self, number, shape):
        return self.limits.default_chip(number, shape, self.units)

    def note_bending(self, number, shape):
        self.limits.note_bending(number, shape)

    def beat(self):
        """The first beat in place of another monitor sets the count back (core/tool_watch.h, 3), once the tool is
        described."""
        if self.begins and not self.task:
            return
        self.component["heartbeat"] = 0 if self.begins else (self.component["heartbeat"] + 1) % MAX_BEATS
        self.begins = False

    @contextmanager
    def working(self):
        """The heart beats on while a file is worked on, for MAX_FILE_S at most."""
        done = threading.Event()

        def keep_beating():
            end = time.monotonic() + MAX_FILE_S
            while not done.is_set() and time.monotonic() < end:
                self.beat()
                time.sleep(POLL_S)  # libfaketime does not know the clock of done.wait(POLL_S)

        thread = threading.Thread(target=keep_beating, daemon=True)
        thread.start()
        try:
            yield
        finally:
            done.set()
            thread.join()

    def falling_back(self, now):
        """Whether the feed has fallen back to F for SETTLE_S; a tool change ends a shorter fallback."""
        if self.component["limited-by"] != LimitedBy.FALLBACK:
            self.fallback_since = None
        elif self.fallback_since is None:
            self.fallback_since = now
        return self.fallback_since is not None and now - self.fallback_since > SETTLE_S

    def follow_faults(self, now):
        """Faults and fallbacks -> messages, each once.  A missing tool matters when it should cut."""
        code = self.component["fault-code"] if self.component["fault"] else 0
        falling_back = self.falling_back(now)
        if code in TOOL_FAULTS and not falling_back and code != self.said_fault:
            return
        if code and code != self.said_fault and self.said_tool is None:
            self.say(FAULTS.get(code, f"fault {code} of the stock tracker"))
        self.said_fault = code
        if falling_back and not code and not self.said_fallback:
            if not (self.component["ready"] and self.component["certain"]):
                self.say(NO_STOCK)
            elif self.component["mode"] and not self.component["mrr-target"] > 0:
                self.inform(NO_LIMIT.format(tool=self.component["tool-number"]))
        self.said_fallback = falling_back

    def adaptive_feed_is_off(self):
        """Whether the machine cuts with F replaced by the ceiling and no override: one snapshot of the status, so
        that the move, the ceiling and the override belong together."""
        status = self.status
        programmed = status.aout[self.settings["ANALOG_OUT"] + 2]  # above 0 while F is replaced
        return status.motion_type in FEED_MOTION and programmed > 0 and not status.adaptive_feed_enabled

    def follow_override(self, _now):
        """Adaptive feed disabled -> pin; an ignored override -> one message, and the program is aborted, because
        feed-inhibit has no effect while the spindle override is disabled (M49, M51 P0; LinuxCNC 2.9,
        motion/control.c)."""
        self.component["adaptive-off"] = self.adaptive_feed_is_off()
        self.component["feed-override"] = self.status.feedrate if self.status.feed_override_enabled else 1.0
        ignored = self.component["override-ignored"]
        if ignored and not self.said_ignored:
            self.command.abort()
            self.say(override_text())
        self.said_ignored = ignored

    def follow_guard(self, _now):
        """A stop by a guard -> one message with line and tool.  The depth of a flute excess grows while the tool stops;
        the message waits until it has been the same for two looks."""
        reason, depth, before = self.component["guard-reason"], self.component["guard-depth"], self.guard_depth
        self.guard_depth = depth if reason == GuardReason.FLUTE_EXCESS else None
        if reason == GuardReason.FLUTE_EXCESS and depth != before and reason != self.said_guard:
            return
        unit = "mm" if self.units > 0.5 else "in"
        of_program = (
            bool(reason) and self.status.task_mode == self.linuxcnc.MODE_AUTO
        )  # motion's line of a move of MDI is that of the program before
        if reason == GuardReason.CLAMP_CONTACT and reason != self.said_guard:
            pins = self.component
            self.say(
                clamp_text(
                    self.stock_files.clamps.name(pins["guard-clamp"]),
                    pins["guard-part"],
                    pins["guard-distance"],
                    pins["guard-line"] if of_program else 0,
                    pins["tool-number"],
                    unit,
                )
            )
        if (
            reason in (GuardReason.RAPID_CONTACT, GuardReason.FLUTE_EXCESS) and reason != self.said_guard
        ):  # the third: follow_override
            self.say(
                guard_text(
                    Stop(
                        reason,
                        self.component["guard-line"] if of_program else 0,
                        self.component["guard-distance"],
                        self.component["guard-depth"],
                        self.component["tool-number"],
                        self.component["tool-diameter"],
                        self.component["tool-flute-length"],
                    ),
                    unit,
                )
            )
        self.said_guard = reason

    def follow_spindle(self, _now):
        material = self.limits.material
        self.spindle_load.follow(
            material.name if material else "",
            lambda: self.status.motion_line if self.status.task_mode == self.linuxcnc.MODE_AUTO else 0,
        )
        self.spindle_load.saying.speak(self.linuxcnc)

    def report_restart(self, _now):
        """Report that the child before has died."""
        if self.died:
            died, self.died = self.died, ""
            self.say(f"chipwise-monitor {died} and was started again; messages of a guard, M253 or M254 may be missing")

    def follow_load(self, now):
        """A load that stays lost, and M251 taken up again in place of a monitor that died: one message each.

        The pins are read one after the other, and on a busy computer much may have happened between them, at a tool
        change again and again; and two looks may be half a second apart."""
        pins = self.component
        seen = bool(pins["ready"] and pins["load-lost"] and pins["ready"] and pins["mode"])
        self.lost_since = (now if self.lost_since is None else self.lost_since) if seen else None
        self.lost_looks = self.lost_looks + 1 if seen else 0
        lost = seen and self.lost_looks >= LOST_LOOKS and now - self.lost_since >= patience(LOST_S)
        if lost and not self.said_lost:
            self.say(NOT_RESUMED)
        elif self.resumes and not self.begins and not seen and pins["ready"] and pins["mode"]:
            self.inform(RESUMED)
            self.resumes = False
        self.said_lost = lost
        self.resumes = self.resumes and not lost and pins["mode"] != 0

    def trouble(self, part, error, now):
        """Report that one part of the work has failed, at most every REPEAT_S."""
        text = f"{type(error).__name__}: {error}"
        before, when = self.reported.get(part, ("", -REPEAT_S))
        if now - when < REPEAT_S:
            return
        self.reported[part] = text, now
        try:
            self.say(f"chipwise-monitor cannot {part} ({text}); it continues with the rest")
        except Exception as second:  # the screen is gone; the log remains
            print(printable(f"chipwise: {second}"), flush=True)

    def greet(self, now):
        if self.start_line.texts:
            self.quiet = self.quiet or Quiet(self.linuxcnc)
            self.start_line.follow(self.status.echo_serial_number, self.quiet(now), now)

    def follow_program(self, _now):
        self.saying.speak(self.linuxcnc)
        self.loaded.follow(self.main_program(), self.status.spindle[0]["speed"])
        if self.set_up.follow(self.linuxcnc, self.status, self.command):
            self.shadow.leave()
        else:
            self.shadow.follow(self.linuxcnc, self.status, self.main_program())
        self.limits.set_up(self.set_up.material(), self.set_up.has_read(self.main_program()))
        self.comment_clamps.follow(self.linuxcnc, self.status)
        known.show(self.component, self.main_program(), self.shadow, self.set_up, self.comment_clamps)

    def step(self):
        self.machine_tool = self.component["tool-in-spindle"]  # before the status, which follows it
        if self.connect():
            for part, work in (
                ("greet the operator", self.greet),
                ("report its restart", self.report_restart),
                ("follow the run", self.follow_run),
                ("watch the override", self.follow_override),
                ("follow the tool", self.follow_tool),
                ("report what a guard stopped", self.follow_guard),
                ("report faults", self.follow_faults),
                ("follow the spindle's load", self.follow_spindle),
                ("report what became of M251", self.follow_load),
                ("look at the program", self.follow_program),
                ("look at the realtime side", self.hints.follow),
                ("save and restore the stock", self.stock_files.step),
            ):
                now = time.monotonic()
                try:
                    work(now)
                except Exception as error:  # of one part: the others go on
                    self.trouble(part, error, now)
        self.beat()


def leave(_number, _frame):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a stock may have to be saved first
    raise SystemExit(0)


def watch(component, settings, inherited, died):
    """The work, in a process of its own.  inherited: pins taken over; died: how the child before has ended."""
    signal.signal(signal.SIGTERM, leave)
    monitor = Monitor(component, settings, died, not (inherited or died))
    if inherited or died:
        monitor.stock_files.kept_is_due = False  # the stock is that of this run
        component["reply"] = component["hold"] = component["assumed"] = component["job"] = component[
            "job-waits"
        ] = component["stock-doubt"] = 0  # the one before may have left them set
    try:
        while True:
            monitor.step()
            time.sleep(POLL_S)
    finally:
        monitor.set_up.end()
        monitor.comment_clamps.end()
        monitor.stock_files.end()
        monitor.spindle_load.end()
