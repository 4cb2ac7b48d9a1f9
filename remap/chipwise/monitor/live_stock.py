# SPDX-License-Identifier: GPL-2.0-or-later
"""Saves the stock while the machine works: [CHIPWISE]KEEP_STOCK after a power loss.

Called by stock_files.py, in the working process of chipwise-monitor.  look() is a thread's, so that a slow disk holds
up nothing else; note() is the monitor's.

 1. The file is stock/journal.py's: the whole stock once, then the cells that have changed.  `OpenFile.seen` has the
    cells as the file has them.
 2. The map's generation says whether anything was cut at all.  Where: around the tips that note() has seen since the
    look before the last.
 3. What was cut elsewhere, because a look came late, is found by a part of the map that each look compares in turn.
    Until then the file has more material than is there.
 4. A copy of cells is of one moment of one stock (SharedStock.part).
 5. Another stock (SharedStock.definitions) makes the file wrong, because it may have less material: it is removed
    before anything else, every GLANCE_S.
"""

import dataclasses
import os
import threading
import time
from collections import deque

import numpy as np

from chipwise.host.clock import patience
from chipwise.host.files import printable, remove_durable
from chipwise.stock import journal

LOOK_S = 0.7  # between two looks: with the time of a write a change is at most 1 s old
GLANCE_S = 0.03  # between two looks at whether there is another stock: M250 waits 0.05 s before the program goes on
RETRY_S = 10.0  # after a disk that was full
JOIN_S = 60.0  # for the last look at the end
PART_CELLS = 1 << 14  # copied at one moment
ROLLING_CELLS = 1 << 18  # compared in each look wherever the tool is
MERGED_CELLS = 1 << 16  # of the surroundings of tips that are compared together
MOST_TIPS = 1000  # remembered while the file cannot be written
SAME_MM3 = 1e-3  # cut since a stock was restored: nothing
MARGIN_MM = 2.0  # around a tip: an arc between two notes, a tool that is not round


def joined(one, other):
    """The rows and columns around two boxes of rows and columns."""
    return [pick(a, b) for pick, a, b in zip((min, max, min, max), one, other)]


@dataclasses.dataclass
class OpenFile:
    """The file that is written, with the whole stock in it."""

    writer: journal.Writer
    generation: int  # of the map, up to which the file is
    seen: np.ndarray  # (rows, columns) uint64, the cells as the file has them


class LiveStock:
    """The file of one map."""

    def __init__(self, path, stock, say, wanted=lambda: True):
        """stock: SharedStock.  say: function of a text for the operator.  wanted: function -> whether this stock is
        saved."""
        self.path, self.stock, self.say, self.wanted = path, stock, say, wanted
        self.saved = None  # time.monotonic() up to which the file has everything that was near a tip
        self._file = None  # OpenFile
        self._definitions = None  # of the stock in the file on the disk, which another run may have written
        self._tips: deque = deque(maxlen=MOST_TIPS)
        self._last_tips, self._next, self._unseen, self._retry = [], 0, 0, 0.0
        self._was_gone = False
        self._note, self._kept, self._told, self._stop = journal.Note(), None, False, False
        self.written = None  # journal.Note of the last cells in the file
        self._lock, self._thread = threading.RLock(), None

    # --- the monitor's ------------------------------------------------------------------------------------------

    def note(self, tip, radius, line=0, program=""):
        """Where the tool is: tip and radius, mm in machine coordinates."""
        moved = self._note.tip != tuple(tip)
        self._note = journal.Note(tip=tuple(tip), line=line, program=program)
        if moved:
            self._tips.append((tip[0], tip[1], radius + MARGIN_MM))

    def adopt(self, note):
        """The stock that the map has now was saved by another run.  note: of its last cells; it stays until something
        more is cut."""
        self._definitions, self._kept = self.stock.definitions, note

    def start(self):
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def end(self):
        """A last look; the file stays."""
        self._stop = True
        if self._thread:
            self._thread.join(patience(JOIN_S))
        if self._lock.acquire(timeout=patience(JOIN_S)):
            try:
                self.look()
            finally:
                self._lock.release()

    def close(self):
        """Nothing more is written; the file stays."""
        with self._lock:
            self._close()

    def _work(self):
        following = 0.0
        while not self._stop:
            try:
                if time.monotonic() >= following:
                    self.look()
                    following = time.monotonic() + LOOK_S
                else:
                    self.glance()
            except Exception as error:  # the thread goes on
                print(printable(f"chipwise: stock file: {type(error).__name__}: {error}"), flush=True)
            time.sleep(GLANCE_S)

    # --- the thread's -------------------------------------------------------------------------------------------

    def glance(self):
        """Remove the file of another stock."""
        if self._definitions not in (None, self.stock.definitions):
            with self._lock:
                self._give_up()

    def look(self):
        """Bring the file up to date; -> whether it is."""
        with self._lock:
            self.glance()
            if time.monotonic() < self._retry or not self.wanted():
                return False
            try:
                done = self._bring_up_to_date()
            except OSError as error:
                self._failed(error)
                return False
            return done

    def _failed(self, error):
        self._retry = time.monotonic() + RETRY_S
        if not self._told:
            self._told = True
            self.say(
                f"the stock is not saved while the machine works ([CHIPWISE]KEEP_STOCK): {self.path}: "
                f"{error.strerror}; after a power loss it has "
                "more material than is there; make room, or correct STOCK_DIR"
            )

    def _give_up(self):
        file, self._file = self._file, None
        self._close()
        self._kept = None
        try:
            remove_durable(self.path)
        except OSError as error:  # the folder is read-only; the file need not be
            try:
                journal.spoil(self.path)
            except OSError:
                self.say(
                    f"{self.path} is of another stock and was not deleted: {error.strerror}; delete it before you "
                    f"switch the computer off"
                )
        if file is not None:
            file.writer.close()

    def _close(self):
        if self._file is not None:
            self._file.writer.close()
        self._file = self._definitions = None

    def _bring_up_to_date(self):
        began = time.monotonic()
        now = self.stock.moment()
        if now is None:
            return False
        raw, head, cells = now
        gone, self._was_gone = (
            self._was_gone,
            not os.path.exists(self.path),
        )  # M250 removes it; if the stock is the same in the look after, it was refused
        file = self._file
        if file is None or self._definitions != raw.definitions or file.writer.is_long or gone and self._was_gone:
            return self._begin(raw, head, cells, began)
        tips = [self._tips.popleft() for _ in range(len(self._tips))]
        before, self._last_tips = self._last_tips, tips
        if raw.generation != file.generation:
            self._unseen = cells.size
        elif self._unseen <= 0:
            self.saved = began
            return True
        complete = self._save(file, head, cells, self._places(head, before + tips))
        if complete:
            file.generation, self.saved = raw.generation, began
            self._unseen -= ROLLING_CELLS // cells.shape[1] * cells.shape[1] or cells.shape[1]
        return complete

    def _begin(self, raw, head, cells, began):
        """A new file with the whole stock; the old one stays until it is there."""
        writer = journal.Writer(self.path, head)
        try:
            seen = self._whole(writer, raw, cells)
        finally:
            if not writer.is_complete:
                writer.close()
        if seen is None:
            return False
        self._close()
        self._file, self._definitions = OpenFile(writer, raw.generation, seen.reshape(cells.shape)), raw.definitions
        self._unseen, self.saved, self._told = cells.size, began, False
        return True

    def _whole(self, writer, raw, cells):
        """All cells to a new file, which takes the place of the old one; -> the cells, None where it is still the old
        one."""
        seen, flat = np.empty(cells.size, np.uint64), cells.reshape(-1)
        for first in range(0, flat.size, PART_CELLS):
            part = self.stock.part(flat[first : first + PART_CELLS], raw.definitions)
            if part is None:
                return None
            seen[first : first + part.size] = part
        note = self._noted(raw.removed)
        step = max(1, journal.BAND_CELLS // cells.shape[1]) * min(cells.shape[1], journal.BAND_CELLS)  # whole rows
        for first in range(0, flat.size, step):
            writer.band(first, seen[first : first + step], note)
        self.written = note
        if self.stock.definitions != raw.definitions:
            return None
        writer.publish()
        return seen

    def _noted(self, removed):
        note = self._note
        if self._kept:
            if removed <= self._kept.removed + SAME_MM3:
                return dataclasses.replace(self._kept, removed=max(removed, 0.0))
            self._kept = None
        return journal.Note(time.time(), max(removed, 0.0), note.tip, note.line, note.program)

    def _places(self, head, tips):
        """Slices (rows, columns) of the map around the tips, and the part of it whose turn it is."""
        boxes: list = []
        before = None
        for x, y, reach in tips:
            tip = [
                int((y - reach - head.low[1]) / head.cell),
                int((y + reach - head.low[1]) / head.cell) + 3,
                int((x - reach - head.low[0]) / head.cell),
                int((x + reach - head.low[0]) / head.cell) + 3,
            ]
            box = joined(before, tip) if before else tip  # with the path from the tip before
            before = tip
            merged = joined(boxes[-1], box) if boxes else box
            if boxes and (merged[1] - merged[0]) * (merged[3] - merged[2]) <= MERGED_CELLS:
                boxes[-1] = merged
            else:
                boxes.append(box)
        width = head.nx + 2
        rows = max(1, ROLLING_CELLS // width)
        first = self._next if self._next < head.ny + 2 else 0
        self._next = first + rows
        boxes.append([first, first + rows, 0, width])
        return [(slice(max(0, box[0]), max(0, box[1])), slice(max(0, box[2]), max(0, box[3]))) for box in boxes]

    def _save(self, file, head, cells, places):
        """The cells of these places that have changed to the file; -> whether all could be read."""
        where, what, complete = [], [], True
        width = head.nx + 2
        removed = self.stock.removed  # before the cells: they have at least this much cut
        for rows, columns in places:
            live, seen = cells[rows, columns], file.seen[rows, columns]
            if not live.size:
                continue
            step = max(1, PART_CELLS // live.shape[1])
            for first in range(0, live.shape[0], step):
                old = seen[first : first + step]
                if np.array_equal(live[first : first + step], old):
                    continue
                part = self.stock.part(live[first : first + step], self._definitions)
                if part is None:
                    complete = False
                    continue
                y, x = np.nonzero(part != old)
                where.append((y + rows.start + first) * width + x + columns.start)
                what.append(part[y, x])
                old[y, x] = part[y, x]  # `old` is a view of file.seen
        if where:
            self._append(file, np.concatenate(where), np.concatenate(what), self._noted(removed))
        return complete

    def _append(self, file, where, what, note):
        try:
            for first in range(0, where.size, journal.BAND_CELLS):
                file.writer.changes(
                    where[first : first + journal.BAND_CELLS], what[first : first + journal.BAND_CELLS], note
                )
            file.writer.sync()
            self.written = note
            self._told = False
        except OSError:
            file.writer.close()  # a file that begins anew has what this one lacks
            self._file = None
            raise
