# SPDX-License-Identifier: GPL-2.0-or-later
"""Makes the program that goes on with another one, from the file to the bytes, which are read back and compared first.

Called by cli/resume.py.
"""

import contextlib
import functools
import os
import re
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from chipwise.program import records
from chipwise.program.program_file import MAX_BYTES, opened_name
from chipwise.program.reader import Unreadable
from chipwise.errors import CycleError, unnamed
from chipwise.host.files import open_regular, read_bytes, remove_durable, write_durable
from chipwise.ini import section_of
from chipwise.resume import clamps, compare, descent, place as places, split, state, stocks, text, walk
from chipwise.rewrite.program import read
from chipwise.rewrite.read_back import Different
from chipwise.rewrite.source import Lines
from chipwise.rewrite.marked_reader import Followed
from chipwise.settings import load_settings
from chipwise.stock import store
from chipwise.stock.reasons import SLOTS
from chipwise.tool_data.geometry import load_tools

_FILE = re.compile(rb"(\([ \t]*SURFACE[ \t]*,[^()\n]*?FILE[ \t]*=)([^,()\n]+)", re.I)
_OURS = "(chipwise resume: goes on with "  # the first line of a program of ours, before the name
MARK_FILE = "resume.slot"  # in STOCK_DIR: the slot that is ours


@dataclass(frozen=True)
class Order:
    """line: of the program, None: where the kept stock says; seconds: of program time before that; broke: a new tool is
    put in there."""

    line: Optional[int] = None
    seconds: float = 0.0
    broke: bool = False


@dataclass
class Resumed:
    """data: bytes of the new program; said: sentences; stock, removed (mm3), slot: what M254 restores, in folder."""

    data: bytes
    said: list
    stock: object
    removed: float
    slot: int
    folder: str

    def save(self):
        """The stock to its slot, and then that the slot is ours; both or none.  Raises Unreadable."""
        path, mark = (os.path.join(self.folder, name) for name in (store.slot_name(self.slot), MARK_FILE))
        stocks.save(path, self.stock, self.removed)
        try:
            write_durable(mark, b"%d\n" % self.slot, store.UNFINISHED)
        except OSError as error:
            with contextlib.suppress(OSError):
                remove_durable(path)
            raise Unreadable(
                f"the number of the slot cannot be written: {mark}: {error.strerror}",
                "make room, or remove what has that name",
            ) from error


def resumed(path, order, machine, **limits):
    """The Resumed of a program.  Raises Unreadable, Different, FolderError."""
    try:
        settings = load_settings(machine.ini)
        geometry = load_tools(settings.path("TOOL_GEOMETRY"))
    except CycleError as error:
        raise Unreadable(unnamed(error.text()), "") from error
    if goes_on_with(path):
        raise Unreadable(f"this program goes on with {goes_on_with(path)}", "name that one")
    program = with_paths(read(path, machine, **limits))
    job = Job(path, program, machine, geometry, settings, limits)
    stopped = job.of_line(order) if order.line is not None else job.of_kept(order)
    return job.finish(stopped, order)


def plain_name(path):
    """The name of a file as a comment has it."""
    return re.sub("[()]", " ", os.path.basename(path))


def goes_on_with(path):
    """The name of the program that a program of ours goes on with, "" for another program."""
    try:
        with open_regular(path, MAX_BYTES) as file:
            first = os.fsdecode(file.readline(1000))
    except OSError:
        return ""
    return first[len(_OURS) :].rpartition(" in line ")[0] if first.startswith(_OURS) else ""


def with_paths(program):
    """A Program whose text has the whole paths of the models that SURFACE comments name beside the program: it is read
    from other folders."""
    folder = os.path.dirname(os.path.abspath(program.path))

    def whole(match):
        path = os.path.join(folder, os.fsdecode(match[2].strip()))
        return match[1] + os.fsencode(path) if os.path.exists(path) and not set("(),;") & set(path) else match[0]

    data = _FILE.sub(whole, program.source.data)
    return program if data == program.source.data else replace(program, source=Lines(data))


@dataclass
class Stopped:
    """stock: Stock at the stop; removed: mm3 cut of its blank; at: place.Place in path; said: sentences."""

    stock: object
    removed: float
    path: walk.Path
    at: places.Place
    said: list
    backs: tuple = descent.BACK_MM


class Job:
    """One program and its machine."""

    def __init__(self, path, program, machine, geometry, settings, limits):
        self.file, self.program, self.machine, self.geometry, self.settings, self.limits = (
            path,
            program,
            machine,
            geometry,
            settings,
            limits,
        )
        self.folder = settings.path("STOCK_DIR")

    @functools.cached_property
    def followed(self):
        """The Followed of the program."""
        found = Followed(self.program, self.machine, None, limits=self.limits)
        found.program = with_paths(found.program)
        return found

    # ---- where -------------------------------------------------------------------------------------------------

    def of_kept(self, order):
        """The Stopped of the kept stock."""
        found, program = stocks.kept(self.folder), self.program
        found.note = self._checked(found.note)
        path = walk.path_of(program, self.machine, self.geometry, stocks.first_move(program, found.head))
        wanted, undone = walk.evidence(path, program, found)
        at = places.locate(path, program, found, wanted, undone)
        if not order.seconds and not order.broke:
            places.check_left(path, program, wanted, undone, at)
        try:
            places.prove(path, program, found, at, wanted)
        except Unreadable:  # the note may be newer than the cells, and some cells than others
            at = places.before_older(path, wanted, undone, at)
            places.prove(path, program, found, at, wanted)
        said = [f"The stock is that of {os.path.basename(found.path)}, with {found.head.removed:.0f} mm3 cut."]
        if at.tip:
            said.append(
                "The machine stopped at X{:.3f} Y{:.3f} Z{:.3f} mm machine".format(*at.tip)
                + f", {at.off:.3f} mm off the path."
            )
        else:
            said.append("Where the tool stopped is not known; the place is that of the last cut.")
        if order.seconds or order.broke:
            return self._earlier(path, at, order, said, found.head)
        return Stopped(stocks.stock_of(found), found.head.removed, path, at, said)

    def _checked(self, note):
        """The Note.  Raises Unreadable where it names another program, or where this one was edited since.  A program
        of ours that goes on with this one counts as this one, but its line numbers do not."""
        if note is None or not note.program:
            return note
        if goes_on_with(note.program) == plain_name(self.file):
            note = replace(note, line=0)
        elif opened_name(note.program) != opened_name(self.file):
            raise Unreadable(
                f"the kept stock is of another program, {opened_name(note.program)}",
                "name that one, or say where to go on with --line N",
            )
        if note.time and os.path.getmtime(self.file) > note.time + 1.0:
            raise Unreadable(
                "the program was edited after the stock was kept",
                "take the program that ran, or say where to go on with --line N",
            )
        return note

    def _earlier(self, path, at, order, said, head):
        """The Stopped some seconds before a place, or where its tool was put in: the stock is the program's."""
        if order.seconds:
            at = places.back_by(path, at, order.seconds)
            said.append(
                f"{order.seconds:g} s of program time before that nothing was cut any more; the stock is the program's "
                f"up to there."
            )
        else:
            same = path.tool[: min(at.segment, len(path.tool) - 1) + 1]
            other = np.flatnonzero(same != same[-1])
            at = places.Place(int(other[-1]) + 1 if len(other) else 0, 0.0)
            said.append(
                "The tool is said to have broken at an unknown moment; the stock is the program's where it was put in."
            )
        stock = stocks.blank(head)
        removed = walk.cut_to(path, stock, self.program, at.segment, at.share)
        return Stopped(stock, removed, path, at, said)

    def of_line(self, order):
        """The Stopped before a line of the program."""
        program = self.program
        if not 1 <= order.line <= len(program.source):
            raise Unreadable(f"the program has no line {order.line}", f"name one from 1 to {len(program.source)}")
        behind = np.flatnonzero(self.followed.program.place >= order.line)
        if not len(behind):
            raise Unreadable(f"nothing moves from line {order.line} on", "name an earlier line")
        move = int(behind[0])
        own = [event for event in program.events if event.kind == records.STOCK and event.at <= move]
        if not own:
            raise Unreadable("no stock is defined before the line", "add M250", order.line)
        room = stocks.most_cells(self.settings)
        stock = stocks.of_record(own[-1], self.settings["CELL"], None)
        if stock.head.capacity > room:
            raise Unreadable(
                "the program's stock does not fit into the map", "use a larger [CHIPWISE]CELL", own[-1].line
            )
        path = walk.path_of(program, self.machine, self.geometry, own[-1].at)
        at = places.Place(int(np.searchsorted(path.move, move)), 0.0)
        said = [f"The stock is the program's before line {order.line}."]
        if order.seconds:
            at = places.back_by(path, at, order.seconds)
            said.append(f"It goes on {order.seconds:g} s of program time before that.")
        removed = walk.cut_to(path, stock, program, at.segment, at.share)
        return Stopped(stock, removed, path, at, said, (0.0, *descent.BACK_MM))

    # ---- how ---------------------------------------------------------------------------------------------------

    def finish(self, stopped, order):
        """The Resumed."""
        if stopped.at.segment >= len(stopped.path.move):
            raise Unreadable("everything that the program moves is done", "nothing is left to go on with")
        cut = split.Split(self, stopped)
        found = cut.found()
        new = found.followed.program
        line = found.line
        now = state.before(found.followed, line, int(new.first[found.step]), self.machine, self.limits)
        slot = self._slot()
        said = [*stopped.said, *self._plan(found, now, order)]
        notes = ["Read the plan before you start it: chipwise resume --plan"]
        frame = new.frames[new.frame[found.step]]
        own_clamps, left = clamps.kept(new, line, now, self.machine.ini)
        said += left
        lines = clamps.with_kept(
            text.head(now, frame, found.approach, slot, self._top(), notes), own_clamps, self._top()
        )
        if order.broke:
            lines.insert(
                lines.index(f"T{now.tool} M6") if f"T{now.tool} M6" in lines else 4,
                f"M0 (put a new tool {now.tool} in and measure its length)",
            )
        first = [f"{_OURS}{plain_name(self.file)} in line {cut.own_line})", *text.subs_before(new, line), *lines]
        try:
            data = self._written(found, now, first, stopped.stock, False)
        except Different:  # what a later cycle plans depends on lines that are done
            data = self._written(found, now, first, stopped.stock, True)
        return Resumed(data, said, stopped.stock, stopped.removed, slot, self.folder)

    def _written(self, found, now, first, stock, cycles):
        """Bytes of the new program, compared.  first: its lines before the rest; cycles: as in text.rest().  Raises
        Unreadable, Different."""
        try:
            rest = text.rest(found, now.motion, cycles)
        except Unreadable as error:
            error.args = (f"the rest of the line cannot be written: {error}",)
            raise
        data = ("\n".join(first) + "\n").encode("utf-8", "surrogateescape") + text.without_percent(rest)
        compare.compare(self, found, now, data, len(first), stock)
        return data

    def _top(self):
        """mm: Z of the retract, machine coordinates."""
        limit = section_of(self.machine.text.splitlines(), "AXIS_Z").get("MAX_LIMIT")
        try:
            value = float(limit)
        except (TypeError, ValueError):
            value = 1e99
        if not abs(value) < 1e5:
            raise Unreadable(
                "[AXIS_Z]MAX_LIMIT is not set, so the height of the retract is not known", "set it in the INI file"
            )
        return value * self.machine.unit_mm

    def _slot(self):
        """The slot of the resume before, unless M253 has saved another stock there since, else one without a file."""
        paths, mark = (
            [os.path.join(self.folder, store.slot_name(slot)) for slot in range(SLOTS)],
            os.path.join(self.folder, MARK_FILE),
        )
        with contextlib.suppress(OSError, ValueError):
            own = int(read_bytes(mark, 20))
            if own in range(SLOTS) and os.path.getmtime(paths[own]) <= os.path.getmtime(mark):
                return own
        for slot in reversed(range(SLOTS)):
            if not os.path.exists(paths[slot]):
                return slot
        raise Unreadable(f"all slots of M253 have a stock in {self.folder}", "delete the file of one, as slot9.stock")

    def _plan(self, found, now, order):
        """Sentences: what the new program does."""
        frame = found.followed.program.frames[found.followed.program.frame[found.step]]
        where = "X{:.3f} Y{:.3f} Z{:.3f} mm".format(*frame.to_work(found.approach.place))
        yield f"It goes on in line {found.own_line}, at {where} in the program's coordinates, tool {now.tool}."
        yield f"First the tool retracts to Z{self._top():g} mm machine, then M254 restores the stock."
        if now.clamps:
            yield f"M256 P{now.clamps} puts the clamps of that set-up in force again."
        if order.broke:
            yield f"It waits (M0) until a new tool {now.tool} is in."
        spindle = next((f"M{code} S{now.settings[1]:g}" for code in (3, 4) if code in now.m), "off")
        coolant = " ".join(f"M{code}" for code in (7, 8) if code in now.m) or "off"
        yield f"Then tool {now.tool}, {now.length}, spindle {spindle}, coolant {coolant}" + (
            ", M251 as it was." if now.volume else "."
        )
        feed = found.approach.feed or now.feed or text.SLOW
        yield (
            f"It traverses above everything, then comes down, the last "
            f"{found.approach.free - found.approach.place[2]:.1f} mm at F{feed:.0f} mm/min, and goes on along the "
            "path."
        )
        for line, what in now.skipped[:3]:
            yield f"{what} of line {line} is not run again."
