# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock that is turned over: what is left of random two-sided parts, against the exact shapes, which share nothing
with the product."""

import errno
import os

import numpy as np
import pytest

from chipwise.clib import core
from chipwise.cli import main
from chipwise.errors import CycleError
from chipwise.host import files
from chipwise.stock import reasons, store, turn_over, turn_request
from chipwise.stock.shared import SharedStock, mean_heights
from support.random_cases import random_count, random_seed

CASES = 50
FINE = 5  # samples along a cell's side
SAME_MM = 2e-3  # of a height: drop has steps of 1/32767 of the thickness, rim cells of 1/1023


class Part:
    """A blank of any size, cut by random slots of flat tools, some through it, on both sides; exact: as sampled
    columns."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.cell = float(rng.choice([0.25, 0.4, 0.5]))
        self.low = rng.uniform(-300.0, 300.0, 3)
        self.high = self.low + [*rng.uniform(18.0, 40.0, 2), rng.uniform(4.0, 15.0)]
        self.about = str(rng.choice(["X", "Y"]))
        self.corner = rng.uniform(-300.0, 300.0, 3)
        self.round = rng.random() < 0.25
        thick = self.high[2] - self.low[2]
        self.first = [
            self.slot(rng, self.low, thick * (rng.choice([1.02, rng.uniform(0.1, 0.95)])))
            for _ in range(rng.integers(3, 8))
        ]
        # the whole top is faced in part of the cases: the new bottom is higher then
        self.second = [
            self.slot(rng, (*self.corner[:2], self.corner[2] - thick), thick * rng.uniform(0.05, 1.0))
            for _ in range(rng.integers(2, 6))
        ]

    def slot(self, rng, low, deep):
        """(start, end, radius): a level cut, its Z `deep` below the top."""
        size = self.high - self.low
        ends = [
            [*(np.asarray(low[:2]) + rng.uniform(-0.1, 1.1, 2) * size[:2]), low[2] + size[2] - deep] for _ in range(2)
        ]
        return np.array(ends[0]), np.array(ends[1]), float(rng.uniform(1.0, 4.0))

    def cut(self, stock, slots):
        for start, end, radius in slots:
            core.Cutter(stock, core.Tool(2.0 * radius), start).to(end)

    def left(self, slots, x, y, top):
        """Heights after cuts: the lowest slot that reaches a place."""
        height = np.full(np.shape(x), top)
        for start, end, radius in slots:
            along = end[:2] - start[:2]
            t = np.clip(((x - start[0]) * along[0] + (y - start[1]) * along[1]) / max(along @ along, 1e-12), 0.0, 1.0)
            height = np.where(
                np.hypot(x - start[0] - t * along[0], y - start[1] - t * along[1]) <= radius,
                np.minimum(height, start[2]),
                height,
            )
        return height

    def first_side(self, x, y):
        """Heights of side one above its bottom; 0 outside of the blank and where it is cut through."""
        return np.where(
            self.in_blank(x, y), np.maximum(self.left(self.first, x, y, self.high[2]) - self.low[2], 0.0), 0.0
        )

    def in_blank(self, x, y):
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        u, v = (x - middle[0]) / half[0], (y - middle[1]) / half[1]
        return u * u + v * v <= 1.0 if self.round else (np.abs(u) <= 1.0) & (np.abs(v) <= 1.0)

    def before(self, x, y):
        """Where places were on side one."""
        if self.about == "X":
            return self.low[0] + x - self.corner[0], self.high[1] - (y - self.corner[1])
        return self.high[0] - (x - self.corner[0]), self.low[1] + y - self.corner[1]

    def exact(self, x, y):
        """(thickness of side one there, height after side two, bottom of the material there) at places as the part lies
        now."""
        thick = self.first_side(*self.before(x, y))
        return thick, self.left(self.second, x, y, self.corner[2]), self.corner[2] - thick

    def walls(self, x, y):
        """Whether places as the part lies now are within each slot of both sides, and within the blank."""
        was = self.before(x, y)
        for place, slots in ((was, self.first), ((x, y), self.second)):
            for slot in slots:
                yield self.left([slot], *place, np.inf) < np.inf
        yield self.in_blank(*was)

    def made(self):
        """(head, cells) of side one as the machine saves it, and turned over."""
        stock = core.Stock(self.low, self.high, self.cell, shape=int(self.round))
        self.cut(stock, self.first)
        taken = SharedStock(memoryview(stock._block)).take()
        return taken, turn_over.turned_over(*taken, self.about, tuple(self.corner))


def on_a_map(head, cells):
    """A core.Stock with this content."""
    stock = core.Stock((0, 0, 0), (1, 1, 1), head.cell, capacity=head.count)
    SharedStock(memoryview(stock._block)).put(head, cells)
    assert core.library().chip_stock_sound(stock.address, head.cell, head.cell, head.count)
    return stock


def windows(value, head):
    """Samples of a cell and of those around it, for each cell: (ny, nx, 3 FINE, 3 FINE)."""
    return np.lib.stride_tricks.sliding_window_view(value, (3 * FINE, 3 * FINE))[::FINE, ::FINE][: head.ny, : head.nx]


def judged(part, turned):
    """Cut side two on the turned stock -> (mm below the truth anywhere, mm off it where a map can hold it, share of
    such cells, exact volume, found volume)."""
    head, cells = turned
    stock = on_a_map(head, cells)
    part.cut(stock, part.second)
    found = mean_heights(stock.cells, stock.head)
    # the exact columns of the map and a ring of cells round it: "within a cell" is between the least and the most of a
    # cell and its neighbours
    steps = (np.arange(-FINE, (max(head.nx, head.ny) + 1) * FINE) + 0.5) * head.cell / FINE
    x, y = np.meshgrid(head.low[0] + steps[: (head.nx + 2) * FINE], head.low[1] + steps[: (head.ny + 2) * FINE])
    thick, top, bottom = part.exact(x, y)
    floor = head.low[2]
    rest = np.where(thick > 0, np.maximum(top, floor), floor)  # as high as a height map has it: undercuts count
    # it cannot hold a place that is cut from both sides, nor a cell with the walls of two cuts: a cell has one wall
    walls = sum(np.ptp(windows(inside.astype(np.int8), head), axis=(2, 3)) for inside in part.walls(x, y))
    can = (walls < 2) & windows((thick == 0) | (top > bottom), head).all(axis=(2, 3))
    least, most = windows(rest, head).min(axis=(2, 3)), windows(rest, head).max(axis=(2, 3))
    below, above = np.maximum(least - found, 0.0), np.maximum(found - most, 0.0)
    volume = float((rest - floor)[FINE:-FINE, FINE:-FINE].sum() * (head.cell / FINE) ** 2)
    return (
        float(below.max()),
        float(np.maximum(below, above)[can].max(initial=0.0)),
        float(can.mean()),
        volume,
        stock.volume(),
    )


@pytest.mark.parametrize("k", range(random_count(CASES)))
def test_random_two_sided_parts(k):
    part = Part(random_seed() * 100_019 + k)
    taken, turned = part.made()
    below, off, share, volume, have = judged(part, turned)
    thickness = part.high[2] - part.low[2]
    step = thickness / 1023 if part.round else 0.0
    assert below <= SAME_MM + step and off <= SAME_MM + step and share > 0.3, (below, off, share)
    assert have == pytest.approx(volume, rel=0.02)
    assert turned[0].high[2] == part.corner[2] and turned[0].removed == taken[0].removed


@pytest.mark.parametrize("wrong", ["axis", "corner"])
def test_the_judge_sees_a_stock_that_is_turned_wrongly(wrong):
    """About the other axis, and two cells beside."""
    part = Part(4)
    taken, _turned = part.made()
    about = "Y" if (part.about == "X") == (wrong == "axis") else "X"
    corner = part.corner + ([2 * part.cell, 0, 0] if wrong == "corner" else [0, 0, 0])
    below, off, *_ = judged(part, turn_over.turned_over(*taken, about, tuple(corner)))
    assert off > 1.0 and below > 1.0


def test_a_turned_box_and_an_allowance():
    """The box of a rotated work offset becomes empty cells; the allowance lies outside of the touched corner, at the
    sides and below."""
    stock = core.Stock((0.0, 0.0, 0.0), (20.0, 10.0, 5.0), 0.5, turn=0.4)
    taken = SharedStock(memoryview(stock._block)).take()
    head, cells = turn_over.turned_over(*taken, "X", (100.0, 50.0, 7.0), 0.5)
    assert on_a_map(head, cells).volume() == pytest.approx(20 * 10 * 5, rel=2e-3) and head.turn == 0.0
    assert head.high[2] == 7.0 and head.low[2] == pytest.approx(2.0) and head.low[0] == pytest.approx(99.5)
    # its long side rises along X; turned about X it falls
    filled = mean_heights(on_a_map(head, cells).cells, on_a_map(head, cells).head) > 4.0
    row, column = np.nonzero(filled)
    assert np.corrcoef(row, column)[0, 1] < -0.3


def test_the_new_bottom_is_the_highest_place_that_is_left():
    stock = core.Stock((0.0, 0.0, 0.0), (20.0, 10.0, 5.0), 0.5)
    core.Cutter(stock, core.Tool(60.0), (-5.0, 5.0, 3.0)).to((25.0, 5.0, 3.0))
    taken = SharedStock(memoryview(stock._block)).take()
    assert turn_over.turned_over(*taken, "Y", (0.0, 0.0, 0.0))[0].low[2] == pytest.approx(-3.0)
    core.Cutter(stock, core.Tool(60.0), (-5.0, 5.0, -1.0)).to((25.0, 5.0, -1.0))
    with pytest.raises(CycleError, match="nothing is left of the stock"):
        turn_over.turned_over(*SharedStock(memoryview(stock._block)).take(), "Y", (0.0, 0.0, 0.0))


@pytest.fixture
def machine(tmp_path):
    """An INI file with a stock in slot 1."""
    (tmp_path / "m.ini").write_text("[CHIPWISE]\nALLOWANCE = 0.5\n[TRAJ]\nLINEAR_UNITS = mm\n")
    stock = core.Stock((0.0, 0.0, 0.0), (20.0, 10.0, 5.0), 0.5)
    core.Cutter(stock, core.Tool(4.0), (5.0, 3.0, -1.0)).to((8.0, 3.0, -1.0))
    store.write(str(tmp_path / "stock" / "slot1.stock"), *SharedStock(memoryview(stock._block)).take())
    return tmp_path


def turn(machine, *arguments, ini=True):
    """-> (exit status, what is in the folder of stocks)."""
    status = main(["turn-over", *map(str, arguments), *(["--ini", str(machine / "m.ini")] if ini else [])])
    return status, {name: (machine / "stock" / name).read_bytes() for name in sorted(os.listdir(machine / "stock"))}


def test_the_command(machine, capsys):
    before = turn(machine, "9", "-o", "2", "--about", "x", "--corner", 0, 0, 0)[1]
    assert "slot9.stock does not exist; save a stock with M253" in capsys.readouterr().err and list(before) == [
        "slot1.stock"
    ]
    status, after = turn(machine, "1", "-o", "2", "--about", "x", "--corner", 100, 50, 30, "--json", machine / "f.json")
    said = capsys.readouterr()
    assert (
        status == 0
        and after["slot1.stock"] == before["slot1.stock"]
        and "pockets of side one count as stock" in said.out
    ), said
    head, cells = store.read(str(machine / "stock" / "slot2.stock"))
    assert head.low == (99.5, 49.5, 25.0) and head.high == (119.5, 59.5, 30.0)
    found = mean_heights(cells[1:-1, 1:-1], on_a_map(head, cells).head)
    assert found[int((10 - 3) / 0.5), int(6 / 0.5)] == 25.0 and found[int(3 / 0.5), int(6 / 0.5)] == 30.0


@pytest.mark.parametrize(
    "arguments, words",
    [
        (
            ("1", "-o", "2", "--about", "X"),
            "where the part lies now is not known; touch a corner and give --corner X Y Z",
        ),
        (("1", "-o", "2", "--about", "Z", "--corner", 0, 0, 0), "invalid choice: 'Z'"),
        (("1", "-o", "1", "--about", "X", "--corner", 0, 0, 0), "is the stock of side one itself; name another file"),
        (("1", "-o", "12", "--about", "X", "--corner", 0, 0, 0), "12 is neither FILE.stock nor a slot from 0 to 9"),
        (("1", "-o", "2", "--about", "X", "--corner", 0, 0, "nan"), "--corner 0 0 nan is not from -100000 to 100000"),
        (
            ("1", "-o", "2", "--about", "X", "--corner", 0, 0, 0, "--allowance", -1),
            "--allowance -1 is not from 0 to 100",
        ),
        (("m.ini", "-o", "2", "--about", "X", "--corner", 0, 0, 0), "does not begin as a stock file"),
        (
            ("1", "-o", "no/such/a.stock", "--about", "X", "--corner", 0, 0, 0),
            "there is no folder no/such; make it, or use another one",
        ),
    ],
)
def test_what_is_refused(machine, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(machine)
    status, after = turn(machine, *arguments)
    assert status == 2 and words in capsys.readouterr().err and list(after) == ["slot1.stock"]


def test_damaged_files(machine, capsys):
    path = machine / "stock" / "slot1.stock"
    good = path.read_bytes()
    for bad in (good[:-1], good[:100], b"", good[:300] + bytes([good[300] ^ 1]) + good[301:]):
        path.write_bytes(bad)
        status, after = turn(machine, "1", "-o", "2", "--about", "X", "--corner", 0, 0, 0)
        assert status == 2 and "delete it and save again" in capsys.readouterr().err and after == {"slot1.stock": bad}


def test_a_folder_in_place_of_a_file(machine, capsys):
    turn(machine, machine, "-o", "2", "--about", "x", "--corner", 0, 0, 0)
    said = "it is not a regular file; name a stock file that can be read; see chipwise turn-over --help\n"
    assert capsys.readouterr().err.endswith(said)


def test_a_slot_without_a_machine(machine, monkeypatch, capsys):
    monkeypatch.delenv("INI_FILE_NAME", raising=False)
    assert turn(machine, "1", "-o", machine / "a.stock", "--about", "X", "--corner", 0, 0, 0, ini=False)[0] == 2
    assert "slot 1 is that of a machine; use --ini INI" in capsys.readouterr().err
    assert (
        turn(
            machine,
            machine / "stock" / "slot1.stock",
            "-o",
            machine / "a.stock",
            "--about",
            "X",
            "--corner",
            0,
            0,
            0,
            ini=False,
        )[0]
        == 0
    )


def test_a_full_disk_leaves_the_old_files(machine, monkeypatch, capsys):
    (machine / "stock" / "slot2.stock").write_bytes(b"old")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", full)
    before = {name: (machine / "stock" / name).read_bytes() for name in ("slot1.stock", "slot2.stock")}
    status, after = turn(machine, "1", "-o", "2", "--about", "X", "--corner", 0, 0, 0)
    assert status == 2 and "No space left on device" in capsys.readouterr().err and after == before


def asked(machine, **words):
    """What M254 P1 R180 H1 I100 J50 K30 gives, or so many words changed."""
    turn_request.write(
        str(machine / "stock"),
        turn_request.TurnRequest(**{"slot": 1, "about": "X", "corner": (100.0, 50.0, 30.0), "allowance": 0.5, **words}),
    )
    return turn_over.asked(str(machine / "stock" / turn_request.NAME), 1_000_000)


def test_a_request_of_m254(machine):
    """The same as the command; no slot is written."""
    before = (machine / "stock" / "slot1.stock").read_bytes()
    head, cells = asked(machine)
    assert (
        sorted(os.listdir(machine / "stock")) == ["slot1.stock", turn_request.NAME]
        and (machine / "stock" / "slot1.stock").read_bytes() == before
    )
    assert turn(machine, "1", "-o", "2", "--about", "x", "--corner", 100, 50, 30)[0] == 0
    of_command = store.read(str(machine / "stock" / "slot2.stock"))
    assert head == of_command[0] and np.array_equal(cells, of_command[1])
    assert not np.array_equal(cells, asked(machine, about="Y")[1])


@pytest.mark.parametrize(
    "words, reply", [({"slot": 2}, reasons.NO_FILE), ({"corner": (1e6, 0.0, 0.0)}, reasons.TOO_FAR)]
)
def test_a_request_that_cannot_be_served(machine, words, reply):
    with pytest.raises(store.StoreError) as caught:
        asked(machine, **words)
    assert caught.value.reply == reply and reply in reasons.REASONS


def test_a_request_for_a_stock_that_is_cut_away(machine):
    stock = core.Stock((0.0, 0.0, 0.0), (20.0, 10.0, 5.0), 0.5)
    core.Cutter(stock, core.Tool(60.0), (-5.0, 5.0, -1.0)).to((25.0, 5.0, -1.0))
    store.write(str(machine / "stock" / "slot1.stock"), *SharedStock(memoryview(stock._block)).take())
    with pytest.raises(store.StoreError, match="slot 1: .*nothing is left of the stock") as caught:
        asked(machine)
    assert caught.value.reply == reasons.NOTHING_LEFT


GOOD = '{"slot": 1, "about": "X", "corner": [0, 0, 0], "allowance": 0}'


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        "[" * 4000,
        GOOD.replace("1", "10"),
        GOOD.replace("1", "true"),
        GOOD.replace("X", "Z"),
        GOOD[:-1],
        GOOD.replace('"X"', "[]"),
        GOOD.replace("[0,", "[NaN,"),
        GOOD.replace("[0,", "[1e9,"),
        GOOD.replace("[0,", "["),
        GOOD.replace("[0,", '["0x",'),
        GOOD.replace("slot", "slots"),
        GOOD.replace('ce": 0', 'ce": -1'),
        GOOD.replace('ce": 0', 'ce": 1e3'),
    ],
)
def test_a_damaged_request(machine, text):
    path = machine / "stock" / turn_request.NAME
    path.write_text(GOOD)
    turn_over.asked(str(path), 1_000_000)
    path.write_text(text)
    with pytest.raises(store.StoreError) as caught:
        turn_over.asked(str(path), 1_000_000)
    assert caught.value.reply == reasons.DISK and str(path) in str(caught.value)
