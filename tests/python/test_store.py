"""remap/chipwise/stock/store.py: what is saved comes back, what is hostile does not; a write cut off leaves the old file."""

import hashlib
import json
import os
import struct
import zlib

import numpy as np
import pytest

from chipwise.stock import core, reasons, store
from chipwise.stock.shared import SharedStock

LOW, HIGH, CELL = (-5.0, 10.0, -12.0), (25.0, 30.0, -2.0), 0.5


@pytest.fixture
def stock():
    fresh = core.Stock(LOW, HIGH, CELL)
    core.Cutter(fresh, core.Tool(4.0, 2.0), (0.0, 15.0, -5.0)).to((20.0, 22.0, -6.5))
    return fresh


@pytest.fixture
def taken(stock):
    return SharedStock(memoryview(stock._block)).take()


def test_there_and_back(stock, taken, tmp_path):
    path = str(tmp_path / "new" / "slot1.stock")
    store.write(path, *taken)
    head, cells = store.read(path, CELL)
    assert head == taken[0] and np.array_equal(cells, taken[1])
    other = core.Stock((0, 0, 0), (1, 1, 1), CELL, capacity=stock.head.capacity)
    SharedStock(memoryview(other._block)).put(head, cells)
    assert other.volume() == stock.volume() and other.head.removed == stock.head.removed
    sound = core.library().cw_stock_sound
    assert sound(other.address, CELL, other.head.capacity) and not sound(other.address, 2 * CELL, other.head.capacity)
    other.head.ny += 1
    assert not sound(other.address, CELL, other.head.capacity)
    other.head.ny -= 1
    tool, twin = core.Tool(6.0), core.Tool(6.0)         # and it is cut on as the first
    assert core.Cutter(other, tool, (10.0, 20.0, -4.0)).to((24.0, 12.0, -9.0)) \
        == core.Cutter(stock, twin, (10.0, 20.0, -4.0)).to((24.0, 12.0, -9.0))


def sealed(body):
    return body + hashlib.sha256(body).digest()


def forged(taken, cells=None, raw=None, **fields):
    """A file with a right checksum and what we like in it."""
    head = dict(version=2, cell=CELL, low=LOW, high=HIGH, shape=0, nx=60, ny=40, removed=taken[0].removed,
                half=(15.0, 10.0), turn=0.0)
    head.update(fields)
    text = json.dumps({k: v for k, v in head.items() if v is not ...}).encode()
    raw = (taken[1] if cells is None else cells).tobytes() if raw is None else raw
    return sealed(store.MARK + struct.pack("<I", len(text)) + text + zlib.compress(raw))


def with_cell(taken, **values):
    cells = taken[1].copy()
    for name, value in values.items():
        cells[7, 9][name] = value
    return cells


def test_the_forger_can_make_a_good_one(taken):
    head, cells = store.unpack(forged(taken))
    assert head == taken[0] and np.array_equal(cells, taken[1])


@pytest.mark.parametrize("what", [
    dict(version=1), dict(version="1; rm"), dict(version=None)])
def test_another_version(taken, what):
    with pytest.raises(store.StoreError) as caught:
        store.unpack(forged(taken, **what))
    assert caught.value.reply == reasons.OTHER_VERSION


@pytest.mark.parametrize("what", [
    dict(nx=61), dict(nx=-60), dict(nx=60.0), dict(nx=1 << 40, ny=1 << 40), dict(cell=0), dict(cell=-0.5), dict(cell=float("nan")),
    dict(cell="0.5"[:0]), dict(high=LOW), dict(high=[1e308] * 3), dict(low=[0, 0]), dict(low=5), dict(removed=-1),
    dict(removed=float("inf")), dict(shape=7), dict(shape=[]), dict(extra=1), dict(low=...), dict(version=...),
    dict(raw=b""), dict(raw=b"\0" * (1 << 24))])
def test_a_hostile_head(taken, what):
    with pytest.raises(store.StoreError) as caught:
        store.unpack(forged(taken, **what))
    assert caught.value.reply in (reasons.BROKEN, reasons.TOO_LARGE)


@pytest.mark.parametrize("values", [
    dict(top=np.nan), dict(top=np.inf), dict(top=5.0), dict(top=-99.0), dict(cut=0, drop=7), dict(cut=65535, drop=7)])
def test_a_hostile_cell(taken, values):
    with pytest.raises(store.StoreError, match="cells that cannot be"):
        store.unpack(forged(taken, cells=with_cell(taken, **values)))


def test_a_ring_with_stock_in_it(taken):
    cells = taken[1].copy()
    cells[0, 5]["top"] = HIGH[2]
    with pytest.raises(store.StoreError, match="cells that cannot be"):
        store.unpack(forged(taken, cells=cells))


def test_every_length_and_every_bit(taken):
    """Cut off anywhere, a bit turned anywhere: refused."""
    data = store.pack(*taken)
    for length in [*range(0, len(data), max(1, len(data) // 200)), len(data) - 1]:
        with pytest.raises(store.StoreError):
            store.unpack(data[:length])
    for place in range(0, len(data), max(1, len(data) // 200)):
        with pytest.raises(store.StoreError):
            store.unpack(data[:place] + bytes([data[place] ^ 4]) + data[place + 1:])
    with pytest.raises(store.StoreError):
        store.unpack(data + b"\0")


def test_a_map_too_small_or_of_other_cells(taken, tmp_path):
    path = str(tmp_path / "a.stock")
    store.write(path, *taken)
    for arguments, reply in (((0.25,), reasons.OTHER_CELL), ((CELL, 62 * 42 - 1), reasons.TOO_LARGE)):
        with pytest.raises(store.StoreError) as caught:
            store.read(path, *arguments)
        assert caught.value.reply == reply
    store.read(path, CELL, 62 * 42)
    with pytest.raises(store.StoreError) as caught:
        store.read(str(tmp_path / "none.stock"))
    assert caught.value.reply == reasons.NO_FILE


@pytest.mark.parametrize("step", ["fsync", "replace", "write"])
def test_a_write_cut_off_leaves_the_old_file(taken, tmp_path, monkeypatch, step):
    path = tmp_path / "slot0.stock"
    store.write(str(path), *taken)
    before = path.read_bytes()

    def full(*_arguments, **_names):
        raise OSError(28, "No space left on device")
    if step == "write":
        monkeypatch.setattr(store, "pack", full)
    else:
        monkeypatch.setattr(os, step, full)
    with pytest.raises(store.StoreError, match="No space left") as caught:
        store.write(str(path), *taken)
    assert caught.value.reply == reasons.DISK
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["slot0.stock"]


def test_a_killed_writer_leaves_the_old_file(taken, tmp_path):
    """SIGKILL at a random moment of many writes: the file is one of the two, always whole."""
    path = str(tmp_path / "slot0.stock")
    store.write(path, *taken)
    for delay in np.linspace(0.0, 0.02, 8):
        child = os.fork()
        if child == 0:
            while True:
                store.write(path, *taken)
        import time
        time.sleep(delay)
        os.kill(child, 9)
        os.waitpid(child, 0)
        head, _cells = store.read(path, CELL)
        assert head == taken[0]


def test_every_reply_has_its_text():
    for number in range(reasons.NO_STOCK, reasons.BAD_SLOT + 1):
        problem, remedy = reasons.REASONS[number]
        assert problem and remedy and "{" not in problem + remedy
