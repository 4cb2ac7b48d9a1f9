# SPDX-License-Identifier: GPL-2.0-or-later
"""remap/chipwise/stock/store.py: what is saved comes back, what is hostile does not; a write cut off leaves the old
file."""

import hashlib
import json
import os
import random
import struct
import zlib

import numpy as np
import pytest

import chipwise
from support.random_cases import random_count, random_seed

from chipwise.clib import core
from chipwise.stock import reasons, store
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
    head, cells = store.read(path)
    assert head == taken[0] and np.array_equal(cells, taken[1])
    other = core.Stock((0, 0, 0), (1, 1, 1), CELL, capacity=stock.head.capacity)
    SharedStock(memoryview(other._block)).put(head, cells)
    assert other.volume() == stock.volume() and other.head.removed == stock.head.removed
    sound = core.library().chip_stock_sound
    assert sound(other.address, CELL, CELL, other.head.capacity) and not sound(
        other.address, 2 * CELL, CELL, other.head.capacity
    )
    other.head.ny += 1
    assert not sound(other.address, CELL, CELL, other.head.capacity)
    other.head.ny -= 1
    tool, twin = core.Tool(6.0), core.Tool(6.0)  # and it is cut on as the first
    assert core.Cutter(other, tool, (10.0, 20.0, -4.0)).to((24.0, 12.0, -9.0)) == core.Cutter(
        stock, twin, (10.0, 20.0, -4.0)
    ).to((24.0, 12.0, -9.0))


def sealed(body):
    return body + hashlib.sha256(body).digest()


def head_of(taken):
    """The head of the stock as a file has it."""
    return dict(
        version=2,
        cell=CELL,
        low=LOW,
        high=HIGH,
        shape=0,
        nx=60,
        ny=40,
        removed=taken[0].removed,
        half=(15.0, 10.0),
        turn=0.0,
    )


def forged(taken, cells=None, raw=None, **fields):
    """A file with a right checksum and what we like in it."""
    head = {**head_of(taken), **fields}
    text = json.dumps({k: v for k, v in head.items() if v is not ...}).encode()
    raw = (taken[1] if cells is None else cells).tobytes() if raw is None else raw
    return sealed(store.MARK + struct.pack("<I", len(text)) + text + zlib.compress(raw))


def headed(taken, text):
    """A file with a right checksum and any head."""
    return sealed(store.MARK + struct.pack("<I", len(text)) + text + zlib.compress(taken[1].tobytes()))


@pytest.mark.parametrize(
    "text",
    [
        b"[1]",
        b"1",
        b"null",
        b'"version"',
        b"",
        b"{}",
        b"[" * 4000,
        b'{"version": 1}',
        b'{"version": true}',
        b'{"version": 1.0}',
        b'{"version": 2}',
        b'{"version": 2, "cell": NaN}',
        b"\xff\xfe",
        b'{"version": ' + b"1" * 4000 + b"}",
        b'{"cell": 1' + b"0" * 3900 + b', "version": 2}',
    ],
    ids=lambda text: repr(text[:20]),
)
def test_a_head_that_is_none(taken, text):
    with pytest.raises(store.StoreError) as caught:
        store.unpack(headed(taken, text))
    assert caught.value.reply in (reasons.BROKEN, reasons.OTHER_VERSION)


VALUES = [
    0,
    1,
    -1,
    1.0,
    0.5,
    1e-12,
    1e308,
    -0.0,
    10**400,
    2**63,
    True,
    None,
    "",
    "1",
    [],
    [1],
    {},
    [0, 0, 0],
    [0, 0],
    [1e9] * 3,
    [None] * 3,
    [[]] * 3,
    60,
    40,
    62,
    25.0,
]


def test_random_heads(taken):
    """Every head with a right checksum is the one that was saved or is refused by name: no other exception."""
    chance, seed = random.Random(random_seed()), random_seed()
    good = head_of(taken)
    kept = 0
    for case in range(random_count(3000)):
        head = dict(good)
        for _ in range(chance.randrange(0, 4)):
            name = chance.choice([*good, "extra"])
            if chance.random() < 0.15:
                head.pop(name, None)
            elif name in ("low", "high", "half") and chance.random() < 0.5:
                head[name] = (
                    [chance.choice([*head.get(name, LOW), *VALUES]) for _ in range(chance.choice((2, 3, 3, 3, 4)))]
                    if isinstance(head.get(name, LOW), (list, tuple))
                    else chance.choice(VALUES)
                )
            else:
                head[name] = chance.choice(VALUES)
        text = bytearray(json.dumps(head).encode())
        if chance.random() < 0.3:
            text[chance.randrange(len(text))] = chance.randrange(256)
        try:
            found, cells = store.unpack(headed(taken, bytes(text)), 100_000)
        except store.StoreError as error:
            assert error.reply in reasons.REASONS, error
            continue
        except Exception as error:
            raise AssertionError(
                f"CHIPWISE_SEED={seed}, case {case}: {type(error).__name__}: {error}: {bytes(text)!r}"
            ) from error
        kept += 1
        assert (found.nx, found.ny) == (60, 40) and np.array_equal(cells, taken[1])
        other = core.Stock((0, 0, 0), (1, 1, 1), CELL, capacity=62 * 42)
        SharedStock(memoryview(other._block)).put(found, cells)
        assert core.library().chip_stock_sound(other.address, CELL, CELL, other.head.capacity), bytes(text)
    assert kept


def test_what_stands_where_remains_would_be(taken, tmp_path):
    """A folder, a link or a FIFO called like an unfinished file hinders no save; old remains of ours go."""
    path = tmp_path / "slot1.stock"
    (tmp_path / "slot1.stock.x.new").mkdir()
    (tmp_path / "slot1.stock.y.new").symlink_to(tmp_path)
    os.mkfifo(tmp_path / "slot1.stock.z.new")
    (tmp_path / "slot1.stock.old.new").write_text("")
    for name in os.listdir(tmp_path):
        os.utime(tmp_path / name, (1, 1), follow_symlinks=False)
    store.write(str(path), *taken)
    assert store.read(str(path))[0] == taken[0]
    assert sorted(os.listdir(tmp_path)) == [
        "slot1.stock",
        "slot1.stock.x.new",
        "slot1.stock.y.new",
        "slot1.stock.z.new",
    ]


def test_a_folder_where_the_file_should_be(taken, tmp_path):
    (tmp_path / "slot1.stock").mkdir()
    with pytest.raises(store.StoreError) as caught:
        store.write(str(tmp_path / "slot1.stock"), *taken)
    assert caught.value.reply == reasons.DISK and os.listdir(tmp_path) == ["slot1.stock"]


def with_cell(taken, **values):
    cells = taken[1].copy()
    for name, value in values.items():
        cells[7, 9][name] = value
    return cells


@pytest.mark.parametrize("what", [{}, dict(chipwise="0.4.0"), dict(chipwise="12.10.3~rc1+dirty")])
def test_the_forger_can_make_a_good_one(taken, what):
    """Also one of a chipwise that did not name itself yet."""
    head, cells = store.unpack(forged(taken, **what))
    assert head == taken[0] and np.array_equal(cells, taken[1])


def test_a_file_says_which_chipwise_wrote_it(taken):
    text = store.pack(*taken)
    assert b'"chipwise": "%s"' % chipwise.version().encode() in text
    with pytest.raises(store.StoreError, match=r"version 9 \(chipwise 7.1\), this chipwise reads 2"):
        store.unpack(forged(taken, version=9, chipwise="7.1"))


@pytest.mark.parametrize("what", [dict(version=1), dict(version="1; rm"), dict(version=None)])
def test_another_version(taken, what):
    with pytest.raises(store.StoreError) as caught:
        store.unpack(forged(taken, **what))
    assert caught.value.reply == reasons.OTHER_VERSION


@pytest.mark.parametrize(
    "what",
    [
        dict(nx=61),
        dict(nx=-60),
        dict(nx=60.0),
        dict(nx=1 << 40, ny=1 << 40),
        dict(cell=0),
        dict(cell=-0.5),
        dict(cell=float("nan")),
        dict(cell="0.5"[:0]),
        dict(high=LOW),
        dict(high=[1e308] * 3),
        dict(low=[0, 0]),
        dict(low=5),
        dict(removed=-1),
        dict(removed=float("inf")),
        dict(shape=7),
        dict(shape=[]),
        dict(extra=1),
        dict(chipwise=4),
        dict(chipwise=None),
        dict(chipwise="4; rm -rf"),
        dict(chipwise="4" * 33),
        dict(low=...),
        dict(version=...),
        dict(raw=b""),
        dict(raw=b"\0" * (1 << 24)),
        dict(cell=10**400),
        dict(cell=True),
        dict(cell=1e-12),
        dict(cell=1e9),
        dict(shape=1.0),
        dict(shape=True),
        dict(shape=10**30),
        dict(nx=True),
        dict(nx=10**300),
        dict(removed=10**400),
        dict(removed=None),
        dict(removed="0"),
        dict(low=[10**400, 0, 0]),
        dict(low="abc"),
        dict(low=[[0], 0, 0]),
        dict(low={"0": 1}),
        dict(low=[True, 10.0, -12.0]),
        dict(high=[25.0, 30.0, -12.0 + 1e-9]),
        dict(low=[-1e300, 10.0, -12.0]),
        dict(half=15.0),
        dict(half=[15.0, 10.0, 1.0]),
        dict(half=[15.0, True]),
        dict(half=[10**400, 1]),
        dict(turn=None),
        dict(turn=10**400),
        dict(turn=1e300),
        dict(turn=0.3),
    ],
)
def test_a_hostile_head(taken, what):
    with pytest.raises(store.StoreError) as caught:
        store.unpack(forged(taken, **what))
    assert caught.value.reply in (reasons.BROKEN, reasons.TOO_LARGE)


@pytest.mark.parametrize(
    "values",
    [dict(top=np.nan), dict(top=np.inf), dict(top=5.0), dict(top=-99.0), dict(cut=0, drop=7), dict(cut=65535, drop=7)],
)
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
            store.unpack(data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :])
    with pytest.raises(store.StoreError):
        store.unpack(data + b"\0")


def test_a_map_too_small(taken, tmp_path):
    path = str(tmp_path / "a.stock")
    store.write(path, *taken)
    with pytest.raises(store.StoreError) as caught:
        store.read(path, 62 * 42 - 1)
    assert caught.value.reply == reasons.TOO_LARGE
    assert store.read(path, 62 * 42)[0].cell == CELL
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
        head, _cells = store.read(path)
        assert head == taken[0]


def test_every_reply_has_its_text():
    for number in range(reasons.NO_STOCK, reasons.BAD_SLOT + 1):
        problem, remedy = reasons.REASONS[number]
        assert problem and remedy and "{" not in problem + remedy
