# SPDX-License-Identifier: GPL-2.0-or-later
"""[CHIPWISE]KEEP_STOCK without a LinuxCNC: which stock comes back at the next start, and what becomes of its file
(monitor/stock_files.py)."""

import ctypes
import os
import threading

import numpy as np
import pytest

from chipwise.host.files import JOURNAL
from chipwise.monitor import open_mark, stock_files
from chipwise.monitor.live_stock import LiveStock
from chipwise.monitor.stock_files import StockFiles
from chipwise.resume import stocks
from chipwise.settings import parse_settings
from chipwise.clib import core
from chipwise.stock import journal, reasons, store, turn_over, turn_request
from chipwise.clib.layout import FileRequest
from chipwise.clib.library import library
from chipwise.stock.shared import SharedStock


class Pins(dict):
    """The tracker hands over its map at once."""

    def __getitem__(self, name):
        return super().__getitem__("hold" if name == "held" else name)


class Map(SharedStock):
    """The stock of one run of LinuxCNC."""

    def __init__(self, capacity):
        block = memoryview(bytearray(library().chip_stock_bytes(1_000_000)))
        library().chip_stock_init(ctypes.addressof(ctypes.c_char.from_buffer(block)), 0.5, 1_000_000)
        super().__init__(block)
        self.room = capacity

    @property
    def capacity(self):
        return self.room

    @property
    def taken(self):
        return self.take()


@pytest.fixture
def cut():
    """A stock with a slot."""
    stock = core.Stock((-5.0, 10.0, -12.0), (25.0, 30.0, -2.0), 0.5)
    core.Cutter(stock, core.Tool(4.0), (0.0, 15.0, -5.0)).to((20.0, 22.0, -6.5))
    return SharedStock(memoryview(stock._block)).take()


@pytest.fixture
def run(tmp_path, cut, monkeypatch):
    """A run of LinuxCNC with STOCK_DIR tmp_path -> (its StockFiles after the first look, messages); `end()` ends it."""
    store.write(str(tmp_path / store.KEPT), *cut)

    def begin(capacity=1_000_000):
        said = []
        pins = Pins(
            {"request": 0, "hold": False, "ready": False, "stock-defined": True, "certain": True, "job-stock": 0}
        )
        files = StockFiles(pins, parse_settings({"KEEP_STOCK": "yes", "STOCK_DIR": str(tmp_path)}), said.append)
        files.stock = Map(capacity)
        files.step(0.0)
        return files, said

    monkeypatch.setattr(LiveStock, "start", lambda live: None)  # a test looks by itself
    return begin


def test_the_stock_comes_back_once(run, tmp_path, cut):
    files, said = run()
    assert (
        np.array_equal(files.stock.taken[1], cut[1])
        and said == []
        and sorted(os.listdir(tmp_path)) == [JOURNAL, store.OPEN]
    )
    files.end()
    assert store.read(str(tmp_path / store.KEPT))[0] == cut[0] and sorted(os.listdir(tmp_path)) == KEPT


def test_a_slow_disk_holds_up_no_look(run, tmp_path, cut, monkeypatch):
    """The tool is followed while the disk takes its time with the note that there is a stock; the end waits for it."""
    os.unlink(tmp_path / store.KEPT)
    files, said = run()
    sent, done, write = threading.Event(), threading.Event(), open_mark.write_durable

    def slow(*given):
        sent.set()
        assert done.wait(300.0)
        write(*given)

    monkeypatch.setattr(open_mark, "write_durable", slow)
    files.stock.put(*cut)
    files.component.update({"ready": True})
    files.step(0.0)
    files.step(0.0)
    assert sent.wait(300.0) and not os.path.exists(tmp_path / store.OPEN)
    threading.Timer(0.1, done.set).start()
    files.end()
    assert sorted(os.listdir(tmp_path)) == KEPT and said == []


def test_a_slow_disk_holds_up_no_look_of_the_next_monitor(tmp_path, monkeypatch):
    """One that begins in place of another deletes what that has saved, before it saves itself; the end waits for it."""
    (tmp_path / JOURNAL).write_bytes(b"of another stock")
    sent, done, remove, began = threading.Event(), threading.Event(), stock_files.remove_durable, []

    def slow(path):
        sent.set()
        assert done.wait(300.0)
        remove(path)

    monkeypatch.setattr(stock_files, "remove_durable", slow)
    monkeypatch.setattr(LiveStock, "start", lambda live: began.append(os.listdir(tmp_path)))
    files = StockFiles(
        Pins({"request": 0, "ready": False, "stock-defined": False, "certain": False, "job-stock": 0}),
        parse_settings({"KEEP_STOCK": "yes", "STOCK_DIR": str(tmp_path)}),
        print,
    )
    files.stock, files.kept_is_due = Map(1_000_000), False
    files.step(0.0)
    files.step(0.0)
    assert sent.wait(300.0) and os.listdir(tmp_path) == [JOURNAL] and began == []
    threading.Timer(0.1, done.set).start()
    files.end()
    assert began == [[]] and os.listdir(tmp_path) == []


def test_an_assumed_stock_is_not_kept(run, tmp_path, cut):
    """Nobody has confirmed it, so the next run must not find it certain; no note is made of it either."""
    os.unlink(tmp_path / store.KEPT)
    files, said = run()
    files.stock.put(*cut)
    files.component.update({"certain": False, "ready": True})
    files.step(0.0)
    files.end()
    assert os.listdir(tmp_path) == [] and said == []


KEPT = [store.KEPT, store.KEPT + journal.NOTE]

NOT_KNOWN = (
    "the stock of the last run is not known ([CHIPWISE]KEEP_STOCK): LinuxCNC or chipwise-monitor did not end in order "
    "(power loss, crash); "
    "define it with M250, or restore it with M254"
)


BACK = "LinuxCNC did not end in order (power loss, crash): the stock is as saved 0 s ago ("


def test_after_a_power_loss_the_operator_is_told(run, tmp_path, cut):
    """The stock comes back with its age and the place of the tool; a run after an orderly end knows nothing of it."""
    files, _said = run()
    files.live.note((1.0, 2.0, -3.5), 2.0, 57, "/home/me/part.ngc")
    files.stock._head.removed += 1.0
    files.stock._head.generation += 2
    np.frombuffer(files.stock._memory, np.uint8)[ctypes.sizeof(type(files.stock._head)) + 8 * 400] ^= 1  # a cell
    files.live.look()
    now = files.stock.take()
    store.write(str(tmp_path / store.KEPT), *cut)  # a deleted file that the power loss brings back
    files, said = run()
    assert len(said) == 1 and said[0].startswith(BACK) and len("chipwise: " + said[0]) <= 250, said
    assert "tip X1.000 Y2.000 Z-3.500 mm machine, line 57 of part.ngc); up to 1 s of cuts may be missing" in said[0]
    assert files.stock.taken[0] == now[0] and np.array_equal(files.stock.taken[1], now[1])
    assert sorted(os.listdir(tmp_path)) == [JOURNAL, store.OPEN]
    files.end()
    assert sorted(os.listdir(tmp_path)) == KEPT
    assert run()[1] == []


def test_where_the_tool_was_outlives_an_orderly_end(run, tmp_path, cut):
    """An abort in the evening, `chipwise resume` in the morning: the tool is at home then, and was there when LinuxCNC
    ended."""
    files, _said = run()
    files.stock._head.removed += 1.0
    files.stock._head.generation += 2
    np.frombuffer(files.stock._memory, np.uint8)[ctypes.sizeof(type(files.stock._head)) + 8 * 400] ^= 1  # a cell
    files.live.note((1.0, 2.0, -3.5), 2.0, 57, "/home/me/part.ngc")
    files.live.look()
    for _again in range(3):  # nothing is cut in between
        files.live.note((0.0, 0.0, 50.0), 2.0, 0, "")
        files.end()
        found = stocks.kept(str(tmp_path))
        assert found.path.endswith(store.KEPT) and (found.note.tip, found.note.line, found.note.program) == (
            (1.0, 2.0, -3.5),
            57,
            "/home/me/part.ngc",
        )
        files, said = run()
        found = stocks.kept(str(tmp_path))
        assert (
            said == [] and found.path.endswith(JOURNAL) and (found.note.tip, found.note.line) == ((1.0, 2.0, -3.5), 57)
        )
    files.end()
    store.write(str(tmp_path / store.KEPT), *cut)
    assert stocks.kept(str(tmp_path)).note is None, "the note of another file"
    run()
    assert stocks.kept(str(tmp_path)).note.tip == (), "where the tool is now says nothing of it"


def test_without_a_journal_the_stock_is_not_known(run, tmp_path, cut):
    """Nothing could be saved, or an older chipwise ran last: its kept.open does not name the journal, which is of an
    earlier stock."""
    run()
    (tmp_path / JOURNAL).unlink()
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None
    files.stock.put(*cut)
    files.live.look()
    (tmp_path / store.OPEN).write_bytes(
        b"A run of LinuxCNC with [CHIPWISE]KEEP_STOCK has a stock. If none runs, it did not end in order.\n"
    )
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None and not (tmp_path / JOURNAL).exists()


def test_another_stock_ends_the_file_of_the_one_before(run, tmp_path, cut):
    """It may have more material."""
    files, _said = run()
    files.stock._head.definitions += 1
    files.live.glance()
    assert not (tmp_path / JOURNAL).exists()


def test_a_journal_that_does_not_fit_waits_for_the_remedy(run, tmp_path, cut):
    run()
    files, said = run(capacity=100)
    assert len(said) == 1 and "has more cells than the map; enlarge [CHIPWISE]MAP_SIZE" in said[0]
    assert (tmp_path / JOURNAL).exists()
    files, said = run()
    assert said[0].startswith(BACK) and np.array_equal(files.stock.taken[1], cut[1])
    run()
    files, said = run(capacity=100)
    files.was_on = True
    files.step(0.0)
    files.removal.wait()
    assert not (tmp_path / JOURNAL).exists(), "it may have cut"


def test_a_refused_stock_does_not_come_back_after_cuts_and_a_power_loss(run, tmp_path):
    files, _said = run(capacity=100)
    files.was_on = True
    files.step(0.0)
    files.open_mark.wait()
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None


def test_a_stock_that_does_not_fit_waits_for_the_remedy(run, tmp_path, cut):
    """MAP_SIZE was made smaller: the message names it, and after it is set right the stock is there; it was deleted
    when LinuxCNC ended."""
    files, said = run(capacity=100)
    assert files.stock.taken is None
    assert said == [
        "the stock of the last run was not restored ([CHIPWISE]KEEP_STOCK): the stock in the file has more cells than "
        "the map; "
        "enlarge [CHIPWISE]MAP_SIZE, or use a smaller CELL, before you switch the machine on"
    ]
    files.end()
    files, said = run()
    assert np.array_equal(files.stock.taken[1], cut[1]) and said == []


def test_after_the_machine_was_on_no_old_stock_comes_back(run, tmp_path):
    """It may have cut."""
    files, _said = run(capacity=100)
    files.was_on = True
    files.end()
    assert os.listdir(tmp_path) == []


def test_a_damaged_file_is_replaced(run, tmp_path, cut):
    path = tmp_path / store.KEPT
    path.write_bytes(path.read_bytes()[:300])
    files, said = run()
    assert len(said) == 1 and "damaged or none of chipwise's; define it with M250" in said[0]
    files.was_on = True
    files.stock.put(*cut)
    files.end()
    assert store.read(str(path))[0] == cut[0]


def test_a_file_that_cannot_be_deleted_is_not_used(run, tmp_path, monkeypatch, capfd):
    """In a folder without write access it would come back at every start, after later cuts too."""
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write in every folder
    files, said = run()
    assert files.stock.taken is None and len(said) == 1 and "cannot be read or written" in said[0]
    assert "cannot be deleted" in capfd.readouterr().out

    def refuse(_path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "unlink", refuse)
    files.was_on = True
    files.end()
    assert "was not deleted: Permission denied" in capfd.readouterr().out


def test_a_stock_that_is_turned_over(run, tmp_path, cut):
    """M254 with R180: the map has it, the slot is not written; what cannot be turned leaves the map as it was."""
    files, _said = run()

    def asked(request, slot=reasons.TURNED):
        files.component.update({"slot": slot, "request": 0})
        files.step(0.0)
        files.component["request"] = request
        files.step(0.0)
        return files.component["reply"]

    store.write(str(tmp_path / "slot1.stock"), *cut)
    before = sorted(os.listdir(tmp_path))
    slot = (tmp_path / "slot1.stock").read_bytes()
    assert asked(FileRequest.RESTORE) == reasons.DISK and np.array_equal(
        files.stock.taken[1], cut[1]
    )  # nobody has said what
    turn_request.write(str(tmp_path), turn_request.TurnRequest(1, "Y", (40.0, -3.0, 7.0), 0.0))
    for wrong in (
        (FileRequest.SAVE, reasons.TURNED),
        (FileRequest.RESTORE, reasons.TURNED + 1),
        (FileRequest.RESTORE, -1),
    ):
        assert asked(*wrong) == reasons.BAD_SLOT and np.array_equal(files.stock.taken[1], cut[1])
    assert asked(FileRequest.RESTORE) == reasons.DONE
    head, cells = turn_over.turned_over(*cut, "Y", (40.0, -3.0, 7.0))
    assert (
        files.stock.taken[0] == head
        and np.array_equal(files.stock.taken[1], cells)
        and not np.array_equal(cells, cut[1])
    )
    assert (
        sorted(os.listdir(tmp_path)) == sorted([*before, turn_request.NAME])
        and (tmp_path / "slot1.stock").read_bytes() == slot
    )
    (tmp_path / "slot1.stock").write_bytes(slot[:-1])
    assert asked(FileRequest.RESTORE) == reasons.BROKEN and np.array_equal(files.stock.taken[1], cells)
