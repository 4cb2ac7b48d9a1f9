# SPDX-License-Identifier: GPL-2.0-or-later
"""Saves and restores the stock: M253, M254, and from one run of LinuxCNC to the next.

Called by worker.py, in user space, while motion waits.  A restore has five steps:
    1. store.read(): the file is checked completely, nothing is changed yet
    2. hold: the tracker releases the map and answers with held
    3. shared.put(): cells and head, the generation odd meanwhile
    4. hold FALSE: the tracker checks the head and uses the stock
    5. the reply (stock/reasons.py), which stays until the interpreter has read it and withdraws the request.
If the monitor is killed in between, hold stays TRUE: no stock is known, the feed is F, M254 ends with a message.  The
next monitor (takeover.py) ends the hold; the tracker finds the map incomplete, and a request that still waits is served
from step 1.

While the machine may move, a thread deletes and writes files (aside.py, live_stock.py).  If the monitor is killed
before a saved stock that is not that of the machine any more is deleted, the next monitor deletes it; after a power
loss in that moment it may come back.
"""

from __future__ import annotations

import os
import time
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from chipwise.host.clock import patience
from chipwise.host.files import JOURNAL, printable, read_bytes, remove_durable
from chipwise.monitor.aside import Aside
from chipwise.monitor.clamps_in_force import ClampsInForce
from chipwise.monitor.known import LARGEST_S32
from chipwise.monitor.live_stock import LiveStock
from chipwise.monitor.open_mark import OpenMark
from chipwise.stock import journal, reasons
from chipwise.clib.layout import FileRequest
from chipwise.program.program_file import opened_name

if TYPE_CHECKING:
    from chipwise.stock.shared import SharedStock

HELD_TIMEOUT_S = (
    10.0  # for the tracker's answer, which comes in its next period: a busy computer may hold up either for seconds
)

NOT_ENDED = (
    "the stock of the last run is not known ([CHIPWISE]KEEP_STOCK): LinuxCNC or chipwise-monitor did not end in order "
    "(power loss, crash); "
    "define it with M250, or restore it with M254"
)
MOST_OPEN = 4096


def words_of(note, now):
    """When and where a stock was saved."""
    age = max(0.0, now - note.time)
    ago = f"{age:.0f} s" if age < 120 else f"{age / 60:.0f} min" if age < 7200 else f"{age / 3600:.0f} h"
    tip = ", tip X{:.3f} Y{:.3f} Z{:.3f} mm machine".format(*note.tip) if note.tip else ""
    line = f", line {note.line} of {opened_name(note.program)[:40]}" if note.line > 0 and note.program else ""
    return f"{ago} ago ({time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(note.time))}{tip}{line})"


class NoMap:
    """In place of the map until it is attached: no stock, and no room for one."""

    capacity = definitions = 0
    removed = 0.0

    def __bool__(self):
        return False

    def take(self):
        return None

    def clamp_table(self):
        return None

    def put(self, _found, _cells):
        raise RuntimeError("the stock map is not attached yet")

    def close(self):
        pass


class StockFiles:
    """The stock of one LinuxCNC and its files."""

    def __init__(self, component, settings, say, working=nullcontext, place=None):
        """component: the monitor's pins; say: function of a text for the operator; working: context of long work.
        place: function -> where the tool is (LiveStock.note)."""
        self.component, self.settings, self.say, self.working = component, settings, say, working
        self.stock: NoMap | SharedStock = NoMap()
        self.place = place
        self.served = 0
        self.doubted = 0  # count() of the stock whose doubt is known
        self.clamps = ClampsInForce(component, settings)
        self.kept_is_due = settings["KEEP_STOCK"]
        self.was_on = False  # the machine, in this run: it may have cut
        self.kept_refused = False  # the stock of the last run is still in its file
        self.refused_journal = False  # and that is JOURNAL
        self.open_mark = OpenMark(self.path)  # this run has a stock
        self.live = None  # LiveStock, with KEEP_STOCK
        self.removal = Aside()  # of a JOURNAL that is not of this stock

    def path(self, name):
        return os.path.join(self.settings.path("STOCK_DIR"), name)

    def step(self, _now):
        """A request of the interpreter, or the stock of the last run, once."""
        self.attach()
        self.follow_live()
        self.follow_doubt()
        if self.live and self.place:
            self.live.note(*self.place())
        request = self.component["request"]
        if request != self.served:
            self.served = request
            with self.working():
                self.component["reply"] = reasons.IDLE if not request else self.answer(request)
        elif self.clamps.waits:
            reply = self.clamps.look()
            if request == FileRequest.CLAMPS:
                self.component["reply"] = reply
        if self.live and self.kept_is_due:
            self.kept_is_due = False
            with self.working():
                self.restore_kept(self.live)
            self.live.start()
        if self.kept_refused and self.was_on and self.refused_journal:
            self.refused_journal = False
            self.removal.begin(lambda: self.remove(self.path(JOURNAL)))
        if self.settings["KEEP_STOCK"] and (
            self.component["ready"] and self.component["certain"] or self.kept_refused and self.was_on
        ):
            self.open_mark.write()

    def attach(self):
        """The map, attached from the first period on: it is still needed when everything else has ended."""
        if not self.stock:
            from chipwise.stock import shared

            self.stock = shared.attach(0, self.component)

    def answer(self, request):
        """-> the reply, also after an unexpected error, because the program waits for it."""
        try:
            return self.serve(request)
        except Exception as error:
            print(printable(f"chipwise: stock file: {type(error).__name__}: {error}"), flush=True)
            return reasons.DISK

    def serve(self, request):
        """-> the reply."""
        slot = self.component["slot"]
        if request == FileRequest.CLAMPS:
            return self.put_clamps(slot)
        if slot not in range(reasons.SLOTS) and (slot, request) != (reasons.TURNED, FileRequest.RESTORE):
            return reasons.BAD_SLOT
        self.component["reply"] = reasons.BUSY
        from chipwise.stock import store, turn_over, turn_request

        if slot == reasons.TURNED:
            return self.restore(self.path(turn_request.NAME), turn_over.asked)
        path = self.path(store.slot_name(slot))
        return self.save(path) if request == FileRequest.SAVE else self.restore(path)

    def put_clamps(self, number):
        """M256; -> the reply."""
        self.component["reply"] = reasons.BUSY
        return self.with_clamps(lambda table: self.clamps.put(table, number))

    def lay_clamps(self, source, clamps):
        """ClampsInForce.lay() with the table; -> the reply."""
        return self.with_clamps(lambda table: self.clamps.lay(table, source, clamps))

    def with_clamps(self, work):
        """What a function of the clamps' table gives."""
        table = self.stock.clamp_table()
        try:
            return work(table)
        finally:
            if table:
                table.close()

    def is_confirmed(self):
        """Whether the stock is more than an assumption."""
        return not self.component["stock-defined"] or bool(self.component["certain"])

    def count(self):
        """The number of the stock in the map: another one is another stock; 0 before there is a map."""
        return (int(self.stock.definitions) & LARGEST_S32 or 1) if self.stock else 0

    def is_kept(self):
        """Whether the stock is one that KEEP_STOCK saves: confirmed, and not that of one program's set-up
        (set_up.py)."""
        return self.is_confirmed() and self.component["job-stock"] != self.count()

    def save(self, path):
        """The map to a file; -> the reply."""
        from chipwise.stock import shared, store

        try:
            taken = self.stock.take()
            if taken is None or not self.is_confirmed():
                return reasons.NO_STOCK
            store.write(path, *taken)
        except store.StoreError as error:
            return self.failed(error)
        except shared.SharedStockError as error:
            print(error, flush=True)
            return reasons.NO_ANSWER
        return reasons.DONE

    def restore(self, path, read=None):
        """A file to the map; -> the reply.  Any error leaves the stock as it was.  read: instead of store.read()."""
        from chipwise.stock import store

        try:
            reply = self.give((read or store.read)(path, self.stock.capacity))
        except store.StoreError as error:
            return self.failed(error)
        if reply == reasons.DONE:
            self.say_doubt(path)
        return reply

    def say_doubt(self, path):
        """If a stock is that of a probed blank (`chipwise blank`), how sure it is."""
        from chipwise.blank import doubt

        found = doubt.figures_of(path)
        self.component["stock-doubt"] = found["most_doubt_mm"] if found else 0.0
        self.doubted = self.count() if found else 0
        if found:
            self.say(f"the stock is a probed blank: {doubt.sentence(found)}")

    def follow_doubt(self):
        """Another stock has no doubt."""
        if self.doubted and self.doubted != self.count():
            self.doubted, self.component["stock-doubt"] = 0, 0.0

    def give(self, found):
        """(head, cells) to the map; -> the reply."""
        return self.held(lambda: self.stock.put(*found))

    def empty(self):
        """The map has no stock; -> the reply."""
        return self.held(lambda: self.stock.put(None, None))

    def held(self, write, seconds=None):
        """Write while the tracker has released the map, which it does within so many seconds, else HELD_TIMEOUT_S; ->
        the reply."""
        seconds = patience(HELD_TIMEOUT_S) if seconds is None else seconds
        self.component["hold"] = True
        end = time.monotonic() + seconds
        try:
            while not self.component["held"]:
                if time.monotonic() > end:
                    return reasons.NO_ANSWER
                time.sleep(0.001)
            write()
        finally:
            self.component["hold"] = False
        while self.component["held"] and time.monotonic() < end:
            time.sleep(0.001)
        return reasons.DONE

    @staticmethod
    def failed(error):
        print(printable(f"chipwise: stock file: {error}"), flush=True)
        return error.reply

    # --- [CHIPWISE]KEEP_STOCK -----------------------------------------------------------------------------------

    def restore_kept(self, live):
        """The stock of the last run, at the start.  The file is deleted: if this run ends without a monitor, no stock
        is better than one from before its cuts.  So one that cannot be deleted is not used."""
        from chipwise.stock import store

        path = self.path(store.KEPT)
        if os.path.exists(self.path(store.OPEN)):
            self.restore_live(live)
            if os.path.exists(path):  # from before the last cuts
                self.remove_kept(path)
            return
        self.remove(self.path(JOURNAL))
        if os.path.exists(path) and not os.access(os.path.dirname(path), os.W_OK):
            reply = self.failed(
                store.StoreError(reasons.DISK, f"{path} cannot be deleted, so it would come back after later cuts")
            )
        else:
            reply = self.restore(path)
        if reply == reasons.DONE:
            live.adopt(replace(journal.read_note(path) or journal.Note(time.time()), removed=self.stock.removed))
            live.look()  # before the mark: at any moment one of the files has the stock
            self.open_mark.write()
            self.open_mark.wait()  # before: a power loss may bring the deleted file back
            self.remove_kept(path)
        self.kept_refused = reply not in (reasons.DONE, reasons.NO_FILE)
        if self.kept_refused:
            self.say_refused(reply)

    def say_refused(self, reply):
        problem, remedy = reasons.REASONS[reply][0], reasons.kept_remedy(reply)
        self.say(f"the stock of the last run was not restored ([CHIPWISE]KEEP_STOCK): {problem}; {remedy}")

    def restore_live(self, live):
        """The stock as it was saved last before a power loss."""
        from chipwise.stock import store

        path = self.path(JOURNAL)
        try:
            if JOURNAL.encode() not in read_bytes(
                self.path(store.OPEN), MOST_OPEN
            ):  # of an older chipwise, which knows no journal
                raise store.StoreError(reasons.NO_FILE, f"{path} is not named in {self.path(store.OPEN)}")
            head, cells, note = journal.read(path, self.stock.capacity)
            reply = self.give((head, cells))
        except OSError as error:
            reply = self.failed(store.StoreError(reasons.DISK, f"{self.path(store.OPEN)}: {error.strerror}"))
        except store.StoreError as error:
            reply = self.failed(error)
        if reply == reasons.DONE:
            live.adopt(note)
            live.look()
            self.say(
                f"LinuxCNC did not end in order (power loss, crash): the stock is as saved "
                f"{words_of(note, time.time())}; up to 1 s of cuts may be missing; "
                "compare it, or use M250"
            )
            return
        if reply in (reasons.NO_FILE, reasons.BROKEN):
            self.remove(path)
            self.say(NOT_ENDED)
            return
        self.kept_refused = self.refused_journal = True
        self.say_refused(reply)

    def follow_live(self):
        """Begin to save while the machine works."""
        if self.live is not None or not self.settings["KEEP_STOCK"]:
            return
        live = self.live = LiveStock(self.path(JOURNAL), self.stock, self.say, self.is_kept)
        if not self.kept_is_due:  # another monitor was before: its file may be of another stock
            self.removal.begin(lambda: self.begin_live(live))

    def begin_live(self, live):
        """Save without what another monitor has saved."""
        self.remove(self.path(JOURNAL))
        live.start()

    def end(self):
        """Save the stock for the next run and detach the map."""
        try:
            self.keep()
        finally:
            self.stock.close()

    def keep(self):
        """Save the stock for the next run; without a stock, delete the file of an earlier run, unless it was refused
        and nothing can have been cut since: the remedy may be a setting."""
        if not self.stock or not self.settings["KEEP_STOCK"] or self.kept_is_due:
            return
        from chipwise.stock import store

        path = self.path(store.KEPT)
        self.removal.wait()
        if self.live:
            self.live.end()
        reply = self.save(path)
        if reply == reasons.NO_STOCK and os.path.exists(path) and (self.was_on or not self.kept_refused):
            self.remove_kept(path)
        if reply == reasons.DONE:
            self.keep_note(path)
        self.open_mark.wait()
        if reply in (reasons.DONE, reasons.NO_STOCK):
            self.remove(self.path(store.OPEN))  # first: while it is there, JOURNAL counts
            if self.live and not self.refused_journal:
                self.live.close()
                self.remove(self.path(JOURNAL))
        else:
            print(f"chipwise: the stock was not saved for the next run: {reasons.REASONS[reply][0]}", flush=True)

    def keep_note(self, path):
        """Where the tool was when the stock in a file was cut last, for `chipwise resume`."""
        if self.live is None or self.live.written is None:
            return
        try:
            journal.write_note(path, self.live.written)
        except OSError as error:
            print(
                printable(
                    f"chipwise: {path}{journal.NOTE} was not written: {error.strerror}; chipwise resume does not know "
                    f"where the tool was"
                ),
                flush=True,
            )

    def remove_kept(self, path):
        """A stock file and its note."""
        self.remove(path)
        self.remove(path + journal.NOTE)

    @staticmethod
    def remove(path):
        try:
            remove_durable(path)
        except OSError as error:
            print(
                printable(
                    f"chipwise: {path} was not deleted: {error.strerror}; delete it, because it is from before the "
                    f"last cuts"
                ),
                flush=True,
            )
