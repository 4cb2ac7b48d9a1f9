# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock in a file while the machine works (monitor/live_stock.py, stock/journal.py): killed, torn or full, it has
more material than is there, never less."""

import contextlib
import ctypes
import mmap
import os
import random
import signal
import time
import types

import numpy as np
import pytest

from chipwise.host.files import JOURNAL
from chipwise.monitor import live_stock
from chipwise.monitor.live_stock import LiveStock
from chipwise.clib import core, layout
from chipwise.stock import journal, store
from chipwise.clib.library import library
from chipwise.stock.shared import SharedStock, mean_heights

LOW, HIGH = (ctypes.c_double * 3)(0.0, 0.0, -10.0), (ctypes.c_double * 3)(20.0, 15.0, 0.0)
TOOL = core.Tool(4.0)
STEP = 10.0 / layout.DROP_FULL  # mm: a cell that is cut again is rounded to it, up or down (cell.c: set_plain)


class Machine:
    """A map in memory that another process may have too, cut by a tool."""

    def __init__(self, shape=0, cell=0.5):
        cells = library().chip_stock_cells(cell, 20.0, 15.0)
        self.block = mmap.mmap(-1, library().chip_stock_bytes(cells))
        self.address = ctypes.addressof(ctypes.c_char.from_buffer(self.block))
        self.shape, self.tip = shape, (-5.0, -5.0, 5.0)
        library().chip_stock_init(self.address, cell, cells)
        self.define()
        self.stock = SharedStock(memoryview(self.block))

    def define(self):
        assert library().chip_stock_define_shape(self.address, LOW, HIGH, self.shape) == 0
        library().chip_stock_fill(self.address, 1 << 30)

    def cut(self, *tips):
        for tip in tips:
            core.Cutter(types.SimpleNamespace(address=self.address), TOOL, self.tip).to(tip)
            self.tip = tip

    def random_cut(self, rng):
        self.cut(
            (rng.uniform(-2, 22), rng.uniform(-2, 17), 2.0),
            (rng.uniform(-2, 22), rng.uniform(-2, 17), rng.uniform(-9, 1)),
        )


def state(machine):
    head, cells = machine.stock.take()
    return head, cells.copy()


def missing(found, truth):
    """The most that a found stock lacks of the true one, mm."""
    head = types.SimpleNamespace(
        drop_unit=(truth[0].high[2] - truth[0].low[2]) / layout.DROP_FULL, z_min=truth[0].low[2], z_max=truth[0].high[2]
    )
    low = mean_heights(truth[1].reshape(-1), head) - mean_heights(found[1].reshape(-1), head)
    return float(np.max(np.maximum(low, (truth[1]["top"] - found[1]["top"]).reshape(-1))))


def saved(tmp_path, machine, say=None):
    live = LiveStock(str(tmp_path / JOURNAL), machine.stock, say or pytest.fail)
    assert live.look()
    return live


@pytest.mark.parametrize("shape", [0, 1])
def test_the_file_has_what_was_cut(tmp_path, shape):
    machine, rng = Machine(shape), random.Random(7)
    live = saved(tmp_path, machine)
    for step in range(40):
        before = machine.stock.removed
        machine.random_cut(rng)
        live.note(machine.tip, 2.0, step, "part.ngc")
        assert live.look()
        head, cells, note = journal.read(live.path)
        truth = state(machine)
        assert head == truth[0] and np.array_equal(cells, truth[1])
        if head.removed > before:  # else nothing was cut, and nothing is written
            assert (note.tip, note.line, note.program, note.removed) == (machine.tip, step, "part.ngc", head.removed)


def test_cuts_that_no_note_was_near_are_found_later(tmp_path, monkeypatch):
    monkeypatch.setattr(live_stock, "ROLLING_CELLS", 100)
    machine = Machine()
    live = saved(tmp_path, machine)
    machine.cut((10.0, 10.0, 2.0), (10.0, 10.0, -4.0))
    for _ in range(40):
        assert live.look()
    assert np.array_equal(journal.read(live.path)[1], state(machine)[1])


def test_cells_that_are_cut_while_they_are_read(tmp_path):
    """One record has them more than once, so more cells than a small map: the last counts."""
    machine, rng = Machine(), random.Random(12)
    live = saved(tmp_path, machine)
    head, cells = state(machine)
    places = np.arange(cells.size)
    where, what = [], []
    for _ in range(3):
        machine.random_cut(rng)
        where.append(places)
        what.append(state(machine)[1].view(np.uint64).reshape(-1))
    live._append(live._file, np.concatenate(where), np.concatenate(what), journal.Note(1.0, machine.stock.removed))
    assert np.array_equal(journal.read(live.path)[1], state(machine)[1])


def test_an_idle_machine_writes_nothing(tmp_path):
    machine = Machine()
    live = saved(tmp_path, machine)
    machine.cut((10.0, 10.0, -4.0))
    for _ in range(3):
        live.look()
    size = os.path.getsize(live.path)
    live.note((50.0, 1.0, 5.0), 2.0)
    live.look()
    assert os.path.getsize(live.path) == size


def small_file(tmp_path):
    """-> (bytes of a file, bytes up to which it is the whole stock without cuts, the states after each look)."""
    machine, rng = Machine(cell=2.0), random.Random(3)
    live = saved(tmp_path, machine)
    states, sizes = [state(machine)], [os.path.getsize(live.path)]
    for _ in range(4):
        machine.random_cut(rng)
        live.note(machine.tip, 2.0)
        live.look()
        states.append(state(machine))
        sizes.append(os.path.getsize(live.path))
    return (tmp_path / JOURNAL).read_bytes(), sizes, states


@pytest.mark.parametrize("rest", ["nothing", "zeros", "noise", "another file"])
def test_torn_at_each_byte(tmp_path, rest):
    """What is behind the tear is missing, zero (blocks that were never written), anything, or the blocks of an older
    file."""
    data, sizes, states = small_file(tmp_path)
    other, *_rest = small_file(tmp_path)
    fill = {
        "nothing": b"",
        "zeros": bytes(len(data)),
        "noise": random.Random(1).randbytes(len(data)),
        "another file": other,
    }[rest]
    path = tmp_path / "torn"
    begin = (
        next(place for place in range(len(data)) if data[place] != other[place]) + 1 if rest == "another file" else 0
    )
    for size in range(begin, len(data)):
        content = data[:size] + fill[size:]
        path.write_bytes(content)
        same = len(os.path.commonprefix([content, data]))  # bytes behind the tear may be right by chance
        whole = sum(1 for least in sizes if least <= same) - 1
        if whole < 0:
            with pytest.raises(store.StoreError):
                journal.read(str(path))
            continue
        head, cells, _note = journal.read(str(path))
        truth = states[whole]
        assert np.array_equal(cells, truth[1]) and head == truth[0], size


def test_a_bit_anywhere_is_no_material_too_little(tmp_path):
    data, sizes, states = small_file(tmp_path)
    path = tmp_path / "flipped"
    for place in range(len(data)):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1 << place % 8]) + data[place + 1 :])
        whole = sum(1 for least in sizes if least <= place) - 1
        if whole < 0:
            with pytest.raises(store.StoreError):
                journal.read(str(path))
        else:
            assert np.array_equal(journal.read(str(path))[1], states[whole][1])


class PowerCut(BaseException):
    pass


def cut_after(monkeypatch, count):
    """The next `count` calls that change the disk work; each later one raises PowerCut, a write after half of its
    bytes."""
    left, real_write = [count], os.write

    def counted(real):
        def call(*args, **more):
            left[0] -= 1
            if left[0] < 0:
                raise PowerCut
            return real(*args, **more)

        return call

    def write(handle, data):
        left[0] -= 1
        if left[0] < 0:
            real_write(handle, bytes(data)[: len(data) // 2])
            raise PowerCut
        return real_write(handle, data)

    for name in ("fsync", "fdatasync", "replace", "unlink", "ftruncate"):
        monkeypatch.setattr(os, name, counted(getattr(os, name)))
    monkeypatch.setattr(os, "write", write)


def test_power_cut_between_any_two_steps(tmp_path):
    """Two stocks one after the other, the second one whole: the file never has less than is there, and the first one
    never comes back after the second one was noticed."""
    for count in range(60):
        folder = tmp_path / str(count)
        folder.mkdir()
        machine, rng = Machine(cell=1.0), random.Random(5)
        live, finished, noticed = LiveStock(str(folder / JOURNAL), machine.stock, pytest.fail), False, False
        with pytest.MonkeyPatch.context() as patch, contextlib.suppress(PowerCut):
            cut_after(patch, count)
            for stock in range(2):
                if stock:
                    machine.define()
                    live.glance()
                    noticed = True
                for _ in range(3):
                    machine.random_cut(rng)
                    live.note(machine.tip, 2.0)
                    live.look()
            finished = True
        with contextlib.suppress(store.StoreError):
            found = journal.read(live.path)
            if noticed or stock == 0:
                assert missing(found, state(machine)) <= STEP, count
    assert finished, "more steps than were tried"


def test_a_full_disk_is_told_once_and_nothing_is_lost(tmp_path, monkeypatch):
    said, machine, rng = [], Machine(), random.Random(2)
    monkeypatch.setattr(live_stock, "RETRY_S", 0.0)
    live = saved(tmp_path, machine, said.append)
    machine.random_cut(rng)
    live.note(machine.tip, 2.0)
    live.look()
    before = journal.read(live.path)
    real = os.write

    def full(handle, data):
        real(handle, bytes(data)[:10])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        for _ in range(3):
            machine.random_cut(rng)
            assert not live.look()
        assert (
            len(said) == 1
            and "No space left on device; after a power loss it has more material than is there" in said[0]
        )
        after = journal.read(live.path)
        assert np.array_equal(before[1], after[1]) and os.listdir(tmp_path) == [JOURNAL]
    assert live.look() and np.array_equal(journal.read(live.path)[1], state(machine)[1])


def test_a_long_file_begins_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(journal, "MOST_GROWTH", 2000)
    machine, rng, sizes = Machine(cell=1.0), random.Random(4), []
    live = saved(tmp_path, machine)
    for _ in range(80):
        machine.random_cut(rng)
        live.note(machine.tip, 2.0)
        assert live.look()
        sizes.append(os.path.getsize(live.path))
        assert np.array_equal(journal.read(live.path)[1], state(machine)[1])
    assert any(later < earlier for earlier, later in zip(sizes, sizes[1:])) and max(sizes) < 30_000


def saver(path, machine, tips):
    """The monitor: a process that saves, and notes where the tool is."""
    live = LiveStock(path, SharedStock(memoryview(machine.block)), lambda _text: None)
    live.start()
    while True:
        live.note(tuple(tips[:3]), 2.0)
        time.sleep(0.002)


def test_killed_at_random_moments(tmp_path, monkeypatch):
    """The tool cuts on while the process that saves is killed (-9), with a new stock in between: what is kept is never
    less than what is there."""
    monkeypatch.setattr(live_stock, "LOOK_S", 0.01)
    monkeypatch.setattr(live_stock, "GLANCE_S", 0.002)
    path, rng, kept, cut = str(tmp_path / JOURNAL), random.Random(11), 0.0, 0.0
    for _ in range(40):
        machine, tips = Machine(), np.frombuffer(mmap.mmap(-1, 32), float)
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)
        child = os.fork()
        if not child:
            try:
                saver(path, machine, tips)
            finally:
                os._exit(1)
        try:
            for stock in range(rng.randint(1, 2)):
                if stock:
                    before = open(path, "rb").read(200)
                    machine.define()
                    wait_for(lambda: not os.path.exists(path) or open(path, "rb").read(200) != before)  # noqa: B023
                wait_for(lambda: os.path.exists(path))
                for _cut in range(rng.randint(3, 60)):
                    machine.random_cut(rng)
                    tips[:3] = machine.tip
                    time.sleep(rng.uniform(0, 0.002))
        finally:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        found, truth = journal.read(path), state(machine)
        assert missing(found, truth) <= STEP
        kept, cut = kept + found[0].removed, cut + truth[0].removed
    assert kept > 0.5 * cut, "little was saved at all"


def wait_for(what):
    end = time.monotonic() + 300.0
    while True:
        with contextlib.suppress(FileNotFoundError):
            if what():
                return
        assert time.monotonic() < end
        time.sleep(0.001)


def test_the_note_of_a_restored_stock_stays_until_something_is_cut(tmp_path):
    """`chipwise resume` finds where the tool stopped, also after LinuxCNC has been started again and the tool was
    moved."""
    machine, rng = Machine(), random.Random(3)
    machine.random_cut(rng)
    live, note = saved(tmp_path, machine), journal.Note(1234.5, machine.stock.removed, (1.0, 2.0, 3.0), 7, "part.ngc")
    live.close()
    again = LiveStock(live.path, machine.stock, pytest.fail)
    again.adopt(note)
    again.note((0.0, 0.0, 50.0), 2.0, 0, "")
    assert again.look() and journal.read(again.path)[2] == note
    while machine.stock.removed <= note.removed + 1.0:
        machine.random_cut(rng)
    again.note(machine.tip, 2.0, 9, "part.ngc")
    assert again.look()
    assert journal.read(again.path)[2].tip == machine.tip and journal.read(again.path)[2].line == 9
