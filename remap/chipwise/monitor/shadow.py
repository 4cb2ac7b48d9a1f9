# SPDX-License-Identifier: GPL-2.0-or-later
"""Assumes a stock for a loaded program that defines none ([CHIPWISE]SHADOW).  Called by worker.py.

1. The program is read in a process of its own (monitor/shadow_process.py) when it is loaded, and again when the file or
   the work offset changes.
2. The stock is written while no program runs and nothing moves, and never over a certain one: the tracker refuses that
   (components/core/tracker.h, 2).  One that comes too late, because the program has begun, is not written for that run.
3. A program at the same work offset goes on in the stock of the one before: one file a tool is the habit.  If its own
   stock is larger, the one before grows
   (monitor/joined_stock.py).  The pin new-part, or the button of the page, begins with a whole stock.  A program
   without a stock at another offset ends it.
4. A tool that only comments describe counts in an assumed stock only.  Where neither they nor the tool table have it,
   the program is read again as soon as another tool is in the spindle or the tool table has changed.
5. The operator reads once what is assumed, or why nothing is, when no command is under way (start_line.py: Quiet).
6. The program that AXIS opens by itself at its start is nobody's part: it has no stock, and nothing is said of it.
"""

import contextlib
import math
import time

from chipwise.program import loaded
from chipwise.monitor.joined_stock import around, join
from chipwise.host.clock import patience
from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.monitor.answering import Answering
from chipwise.monitor.saying import Saying
from chipwise.monitor.set_up_time import SetUpTime
from chipwise.monitor.tool_shape import Tool
from chipwise.stock import reasons
from chipwise.clib.core import CellSides, CoreError, Stock
from chipwise.program.program_file import is_splash, opened_name
from chipwise.stock.store import head_of

HELD_S = 1.0  # for the tracker's answer
MOST_TRIES = 3  # to give it a stock: a busy computer lets it answer late
PERIODS_S = 0.05  # some servo periods
INSIDE_MM = 0.01
NO_STOCK = "define it with M250"
NEW_PART = "press New part for another one"


def is_idle(linuxcnc, status):
    """Whether neither a program nor a move is under way."""
    return status.interp_state == linuxcnc.INTERP_IDLE and not status.queue and bool(status.inpos)


def to_machine(answer):
    """(low, high, turn in rad) of the box that stock.h turns about its middle: mm, machine coordinates."""
    turn, offset, g92 = answer["to_machine"]
    middle = [(a + b) / 2 + c for a, b, c in zip(answer["low"], answer["high"], g92)]
    half = [(b - a) / 2 for a, b in zip(answer["low"], answer["high"])]
    c, s = math.cos(turn), math.sin(turn)
    centre = middle[0] * c - middle[1] * s + offset[0], middle[0] * s + middle[1] * c + offset[1], middle[2] + offset[2]
    return tuple(a - b for a, b in zip(centre, half)), tuple(a + b for a, b in zip(centre, half)), turn


class Shadow:
    """Of one LinuxCNC.  follow() at each look of the monitor."""

    def __init__(self, component, settings, stock_files, ini, inform, feed_is_remapped=False):
        """inform: function of a text for the operator; feed_is_remapped: whether the INI file has REMAP = F."""
        self.pins, self.settings, self.files, self.ini = component, settings, stock_files, ini
        self.saying, self.reading = Saying(inform), Answering("chipwise.monitor.shadow_process")
        self.is_on = settings["SHADOW"] and bool(ini)
        self.time = SetUpTime(component, self.is_on and feed_is_remapped)
        self.table = _tool_table(ini) if self.is_on else ""
        self.scene = None  # in which the loaded program was read
        self.loaded: tuple = ()  # (program, identity, work offset) that was asked for
        self.answer = None  # of the loaded program, if it has a stock
        self.wanted = None  # the same, until it is written
        self.written: tuple = ()  # (work offset, low, high) of the stock that is assumed
        self.owner: tuple = ()  # (program, identity) that it was assumed for last
        self.asks_tool = None  # (tool, identity of the tool table) for which a tool was unknown
        self.pressed = bool(component["new-part"])
        self.tools, self.spindle, self.tries = {}, None, 0

    def follow(self, linuxcnc, status, program):
        """At each look; nothing of it waits for the process.  program: the path of the one that is open."""
        if not self.is_on:
            return
        self.saying.speak(linuxcnc)
        self.time.look(program)
        pressed, self.pressed = self.pins["new-part"] and not self.pressed, bool(self.pins["new-part"])
        if not is_idle(linuxcnc, status):
            if self.reading.child is not None or self.wanted is not None:
                self.reading.end()  # too late for this run: it is read again behind it
                self.loaded, self.wanted = (), None
            return
        scene = loaded.scene(status)
        place = loaded.place(scene)
        is_loaded = status.file and not is_splash(status.file)
        found = (status.file, loaded.identity(status.file), place) if is_loaded else ()
        if pressed:
            self._begin_part()
        if found != self.loaded or self.asks_tool and self.asks_tool != self._tool_state(scene):
            self.reading.end()
            self.loaded, self.answer, self.wanted, self.asks_tool = found, None, None, None
            if found and found[1]:
                self.scene = scene
                self.reading.ask({"ini": self.ini, "program": status.file, "scene": scene})
        else:
            answer = self.reading.take()
            if answer:
                self._take(answer)
        if self.wanted is not None and not self._is_certain() and not self.pins["request"]:
            answer, self.wanted = self.wanted, None
            with self.files.working():
                self._write(answer, place, lambda: status.poll() or is_idle(linuxcnc, status))

    def leave(self):
        """The program has a set-up (set_up.py): nothing is assumed."""
        self.reading.end()
        self.time.forget()
        self.loaded = self.written = self.owner = ()
        self.answer = self.wanted = self.asks_tool = None
        self.tools = {}
        self.saying.forget()

    def has_read(self, program):
        """Whether nothing more is to come for the loaded program."""
        waits = self.reading.child is not None or self.wanted is not None and not self._is_certain()
        is_answered = self.loaded and self.loaded[0] == program and not waits
        return not self.is_on or is_splash(program) or bool(is_answered)

    def _is_certain(self):
        """Whether there is a stock that a program or a person has confirmed."""
        return bool(self.pins["stock-defined"] and self.pins["certain"])

    def _tool_state(self, scene):
        """What the answer for a program with an unknown tool depends on."""
        return scene["tool"], loaded.identity(self.table)

    def _begin_part(self):
        """A whole stock for the loaded program, in place of an assumed one that was cut."""
        if self.pins["certain"]:
            self.saying.tell("the stock is not an assumed one, and New part does not change it; use M250")
            return
        self.written, self.wanted = (), self.answer
        self.pins["parts"] += 1

    # ---- the process -----------------------------------------------------------------------------------------------

    def _take(self, answer):
        if answer.get("asks_tool"):
            self.asks_tool = self._tool_state(self.scene)
        if answer["why"] and not self._is_certain():
            self.saying.tell(
                f"{opened_name(self.loaded[0])}: no stock is assumed: {answer['why']}; "
                f"{answer.get('remedy') or NO_STOCK}"
            )
        if answer.get("low"):
            self.answer, self.wanted, self.tries = answer, answer, 0
            self.time.ask(self.loaded, {"ini": self.ini, "program": self.loaded[0], "scene": self.scene})
            return
        self.time.forget()
        if self.written and self.written[0] != self.loaded[2]:
            self._give_up()

    # ---- the stock -------------------------------------------------------------------------------------------------

    def _write(self, answer, place, is_still):
        """Put the assumed stock into the map, unless it lies inside the one before.  is_still: whether nothing has
        begun meanwhile."""
        name = opened_name(self.loaded[0])
        low, high, turn = to_machine(answer)
        self.tools, self.spindle = {int(number): tool for number, tool in answer["tools"].items()}, answer["spindle"]
        before = self.written if self.pins["stock-defined"] and self.written and self.written[0] == place else None
        try:
            stock, removed, box = self._stock((low, high), turn, before)
        except CoreError as error:
            self.saying.tell(f"{name}: no stock is assumed: {error}; {NO_STOCK}")
            return
        if stock is None:
            self._tell_on(name, "")
        elif not is_still():
            self.loaded = ()  # read again behind the run
        elif self._put(head_of(stock.head, removed), stock.cells_and_ring):
            self.written = place, *box
            if box == (low, high) or not before:
                self.saying.tell(
                    f"{name}: a stock is assumed from {answer['text']}, and nothing acts on it; define it with M250"
                )
                self.owner = self.loaded[:2]
            else:
                self._tell_on(name, ", which is larger now")
        else:
            self._try_again(name, answer)

    def _try_again(self, name, answer):
        """The tracker has not taken the stock: it belongs to another one by now, or this computer is busy."""
        self.tries += 1
        if self.tries < MOST_TRIES:
            self.wanted = answer
        elif not self._is_certain():
            what, remedy = reasons.REASONS[reasons.NO_ANSWER]
            self.saying.tell(f"{name}: no stock is assumed: {what}; {remedy}")

    def _stock(self, box, turn, before):
        """(core.Stock or None if it is in the map already, mm3 cut of it, (low, high))."""
        finest, coarsest = self.files.stock.bounds
        room = finest, coarsest, self.files.stock.capacity
        low, high = box
        if before and _inside(low, high, *before[1:]):
            return None, 0.0, box
        taken = self.files.stock.take() if before else None
        if taken:
            head, cells = taken
            larger = around(before[1:], box, turn)
            with contextlib.suppress(CoreError):  # too far apart: the new one alone
                return join(head, cells, larger, turn, room), head.removed, larger
        return Stock(low, high, CellSides(coarsest, finest), room[2], turn=turn), 0.0, box

    def _tell_on(self, name, how):
        """That the loaded program goes on in the stock of the one before."""
        owner, self.owner = self.owner, self.loaded[:2]
        if owner != self.owner:
            self.saying.tell(f"{name} goes on in the assumed stock of {opened_name(owner[0])}{how}; {NEW_PART}")

    def _give_up(self):
        """No stock in place of an assumed one of another work offset."""
        if (
            self.pins["stock-defined"]
            and not self.pins["certain"]
            and self._hold(lambda: self.files.stock.put(None, None))
        ):
            self.written = self.owner = ()

    def _put(self, found, cells):
        """-> whether the tracker has given the map away for it."""
        if not self._hold(lambda: self.files.stock.put(found, cells)):
            return False
        end = time.monotonic() + patience(HELD_S)
        while not self.pins["stock-defined"] and time.monotonic() < end:  # the tracker looks at it in its next period
            time.sleep(0.001)
        return bool(self.pins["stock-defined"])

    def _hold(self, work):
        """Do work on the map of an assumed stock; -> whether the tracker has given it away for that."""
        self.pins["assumed"] = True
        try:
            return self.files.held(work, patience(HELD_S)) == reasons.DONE
        finally:
            time.sleep(PERIODS_S)  # a hold that the tracker may still see is one with `assumed`
            self.pins["assumed"] = False

    def tool(self, number, shape, units):
        """Tool for the pins: a tool without a diameter as comments describe it, in an assumed stock."""
        found = self.tools.get(number if number > 0 or self.spindle is None else self.spindle)
        assumed = bool(
            self.is_on and found and shape.diameter <= 0 and self.pins["stock-defined"] and not self.pins["certain"]
        )
        self.pins["tool-assumed"] = assumed
        return Tool(found[0] * units, found[1] * units, found[2]) if found and assumed else shape


def _inside(low, high, low_before, high_before):
    return all(a >= b - INSIDE_MM for a, b in zip(low, low_before)) and all(
        a <= b + INSIDE_MM for a, b in zip(high, high_before)
    )


def _tool_table(ini):
    """Its path, "" without one."""
    try:
        return Ini(ini).tool_table()
    except (CycleError, OSError):
        return ""
