# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock as tiles: a page that joins them has the map, whenever it has looked, and gets what has changed only."""

import os
import random

import numpy as np
import pytest

from chipwise.panel.tiles import MOST_CELLS, MOST_SIDE, TILE, Tiles, step_of
from chipwise.stock.shared import SharedStock
from support.panel_client import Page
from support.panel_rig import Machine

ROUNDS = int(os.environ.get("CHIPWISE_PANEL_ROUNDS", 30))


class Reader:
    """A page by hand."""

    def __init__(self, tiles):
        self.tiles, self.since, self.page = tiles, (0, 0), Page()

    def read(self):
        found, self.since = self.tiles.messages(self.since)
        for kind, content in found:
            self.page.take(kind.decode(), content)
        return found

    def heights(self):
        found = self.page.map
        return found["bottom"] + np.array(self.page.rows, float) / 65535 * (found["top"] - found["bottom"])


def truth(machine):
    return SharedStock(memoryview(machine.core._block)).snapshot().heights


@pytest.mark.parametrize("seed", range(ROUNDS))
def test_pages_have_the_map(seed):
    """Random boxes and cuts; pages that look at random times; what they have is within half a step of 16 bits of the
    map."""
    chance = random.Random(seed)
    size = [chance.uniform(5, 60), chance.uniform(5, 60), chance.uniform(1, 30)]
    low = tuple(chance.uniform(-100, 100) for _ in size)
    machine = Machine(low, tuple(a + b for a, b in zip(low, size)), chance.choice([0.25, 0.3, 0.5]))
    tiles, stock = Tiles(), machine.stock()
    readers = [Reader(tiles) for _ in range(3)]
    point = [low[0] - 5, low[1] + size[1] / 2, low[2] + size[2] / 2]
    for _ in range(12):
        there = [
            low[0] + chance.uniform(-5, size[0] + 5),
            low[1] + chance.uniform(-5, size[1] + 5),
            low[2] + chance.uniform(0.1, 1) * size[2],
        ]
        machine.cut(tuple(point), tuple(there), chance.uniform(0.5, 20))
        point = there
        tiles.look(stock.live())
        reader = chance.choice(readers)
        reader.read()
        assert np.abs(reader.heights() - truth(machine)).max() <= size[2] / 65535 * 0.501, f"seed {seed}"


def test_only_what_has_changed_is_sent():
    machine = Machine((0, 0, -10), (100, 80, 0))
    tiles, reader = Tiles(), None
    assert tiles.look(machine.stock().live())
    reader = Reader(tiles)
    assert [kind for kind, _ in reader.read()] == [b"M", b"T"]
    assert reader.page.tiles == -(-400 // TILE) * -(-320 // TILE)
    assert not tiles.look(machine.stock().live()) and reader.read() == []
    machine.cut((8.0, 8.0, -1.0), (8.0, 8.0, -2.0), 4.0)  # within the first tile, 16 mm wide
    assert tiles.look(machine.stock().live())
    before = reader.page.tiles
    assert [kind for kind, _ in reader.read()] == [b"T"] and reader.page.tiles == before + 1


def test_another_box_is_another_map():
    machine, tiles = Machine(), Tiles()
    tiles.look(machine.stock().live())
    reader = Reader(tiles)
    reader.read()
    machine.cut((10.0, 10.0, -3.0), (30.0, 10.0, -3.0))
    machine.core.define((0, 0, -10), (30, 20, 0))
    tiles.look(machine.stock().live())
    assert [kind for kind, _ in reader.read()] == [b"M", b"T"]
    assert reader.heights().shape == (80, 120) and (reader.heights() == 0).all()
    machine.cut((10.0, 10.0, -3.0), (20.0, 10.0, -3.0))
    tiles.look(machine.stock().live())
    machine.core.define((0, 0, -10), (30, 20, 0))  # the same box, filled again
    tiles.look(machine.stock().live())
    reader.read()
    assert (reader.heights() == 0).all()


def test_no_stock_keeps_the_last_picture():
    tiles = Tiles()
    assert not tiles.look(None) and Reader(tiles).read() == []


@pytest.mark.parametrize(
    "rows, columns", [(1, 1), (600, 1000), (1024, 1024), (1025, 1024), (1, 1_000_000), (16384, 16384), (4097, 2)]
)
def test_a_large_map_is_shown_in_steps(rows, columns):
    step = step_of(rows, columns)
    shown = -(-rows // step), -(-columns // step)
    assert shown[0] * shown[1] <= MOST_CELLS and max(shown) <= MOST_SIDE
    if step > 1:
        finer = -(-rows // (step - 1)), -(-columns // (step - 1))
        assert finer[0] * finer[1] > MOST_CELLS or max(finer) > MOST_SIDE


def test_steps_show_cells_of_the_map(monkeypatch):
    monkeypatch.setattr("chipwise.panel.tiles.MOST_CELLS", 5000)
    machine, tiles = Machine(), Tiles()
    machine.cut((-10.0, 20.0, -4.0), (40.0, 20.0, -4.0))
    tiles.look(machine.stock().live())
    reader = Reader(tiles)
    reader.read()
    machine.cut((40.0, 20.0, -4.0), (40.0, 35.0, -6.0))
    tiles.look(machine.stock().live())
    reader.read()
    step = step_of(160, 240)
    assert step == 3 and reader.page.map["cell"] == pytest.approx(0.75)
    assert np.abs(reader.heights() - truth(machine)[::3, ::3]).max() < 2e-4


# ---- the stock before a program ------------------------------------------------------------------------------------


def heights_of(message):
    """(epoch, (n,) heights) of a message B, read by itself."""
    kind, content = message
    assert kind == b"B"
    return int.from_bytes(content[:4], "little"), np.frombuffer(content[4:], "<u2")


def test_the_stock_before_a_program():
    machine, tiles = Machine(), Tiles()
    tiles.mark()  # nothing was seen yet
    assert tiles.before(0)[0] == []
    machine.cut((-10.0, 20.0, -4.0), (70.0, 20.0, -4.0))
    tiles.look(machine.stock().live())
    assert tiles.before(0)[0] == []  # no program has begun
    tiles.mark()
    reader = Reader(tiles)
    reader.read()
    then = reader.heights().copy()
    machine.cut((70.0, 20.0, -4.0), (70.0, 33.0, -8.0))
    machine.cut((70.0, 33.0, -8.0), (-10.0, 33.0, -8.0))
    tiles.look(machine.stock().live())
    (message,), mark = tiles.before(0)
    epoch, heights = heights_of(message)
    assert epoch == reader.page.map["epoch"] and tiles.before(mark) == ([], mark)
    assert np.abs(heights / 65535 * 10 - 10 - then.ravel()).max() < 2e-4
    reader.read()
    assert reader.heights().min() == pytest.approx(-8, abs=2e-4) and then.min() == pytest.approx(-4, abs=2e-4)
    tiles.mark()  # the next program
    (message,), mark = tiles.before(mark)
    assert heights_of(message)[1].min() == round(65535 * 0.2)
    machine.core.define((0, 0, -10), (30, 20, 0))  # another box
    tiles.look(machine.stock().live())
    assert tiles.before(mark)[0] == [] and tiles.before(0)[0] == []


def test_another_stock_of_the_same_box_ends_that():
    machine, tiles = Machine(), Tiles()
    machine.cut((-10.0, 20.0, -4.0), (70.0, 20.0, -4.0))
    tiles.look(machine.stock().live())
    tiles.mark()
    mark = tiles.before(0)[1]
    tiles.unmark()
    (message,), now = tiles.before(mark)
    assert len(message[1]) == 4 and tiles.before(now) == ([], now)
    tiles.unmark()
    assert tiles.before(now) == ([], now)
    tiles.mark()
    assert len(tiles.before(now)[0][0][1]) > 4
