# SPDX-License-Identifier: GPL-2.0-or-later
"""remap/chipwise/stock/shared.py on a map in this process; tests/components/test_load_components.py has it in a HAL."""

import numpy as np
import pytest

from chipwise.clib import core, layout
from chipwise.stock.shared import SharedStock, SharedStockError

LOW, HIGH, CELL = (-5.0, 10.0, -12.0), (25.0, 30.0, -2.0), 0.5


@pytest.fixture
def stock():
    fresh = core.Stock(LOW, HIGH, CELL)
    cutter = core.Cutter(fresh, core.Tool(4.0), (0.0, 15.0, -5.0))
    cutter.to((20.0, 22.0, -6.5))
    return fresh


def test_heights_are_those_of_the_core(stock):
    seen = SharedStock(memoryview(stock._block)).snapshot()
    assert (seen.low, seen.high, seen.cell, seen.exact) == (LOW, HIGH, CELL, True)
    assert seen.heights.shape == (40, 60)
    left = (seen.heights - LOW[2]).sum() * CELL**2
    assert left == pytest.approx(stock.volume(), rel=1e-9)
    assert left == pytest.approx(30 * 20 * 10 - seen.removed, rel=1e-9)
    assert seen.heights.max() == pytest.approx(HIGH[2]) and seen.heights.min() < -6.4


def test_a_snapshot_does_not_change_with_the_stock(stock):
    shared = SharedStock(memoryview(stock._block))
    before = shared.snapshot()
    kept = before.heights.copy()
    core.Cutter(stock, core.Tool(4.0), (0.0, 25.0, -10.0)).to((1.0, 25.0, -10.0))
    assert np.array_equal(before.heights, kept)
    after = shared.snapshot()
    assert after.generation > before.generation and after.removed > before.removed


def test_no_stock_no_snapshot(stock):
    stock.head.nx = 0
    shared = SharedStock(memoryview(stock._block))
    assert not shared.defined and shared.snapshot() is None


def test_half_filled_is_no_stock(stock):
    stock.head.filled = 7
    assert SharedStock(memoryview(stock._block)).snapshot() is None


def test_a_writer_that_never_ends_is_an_error(stock):
    stock.head.generation += 1
    with pytest.raises(SharedStockError, match="0.05 s"):
        SharedStock(memoryview(stock._block)).snapshot(timeout_s=0.05)


@pytest.mark.parametrize("read", ("snapshot", "take"))
@pytest.mark.parametrize("speed, wanted_s", (("1", 2.0), ("5", 10.0)))
def test_with_a_fast_clock_it_waits_as_long_in_real_time(stock, monkeypatch, read, speed, wanted_s):
    """A simulation at five times the speed: a process that a busy computer holds up has its 2 s all the same."""
    now = iter(np.arange(0.0, 100.0, 0.25))
    monkeypatch.setattr("chipwise.stock.shared.time.monotonic", lambda: next(now))
    monkeypatch.setenv("CHIPWISE_SPEED", speed)
    stock.head.generation += 1
    with pytest.raises(SharedStockError, match="changed faster"):
        getattr(SharedStock(memoryview(stock._block)), read)()
    assert next(now) == pytest.approx(wanted_s, abs=0.5)


class Restless(SharedStock):
    """The tracker cuts between any two copies larger than `calm` rows."""

    calm = 0

    def _rows(self, head, first, count):
        cells = super()._rows(head, first, count)
        if count > self.calm:
            self._head.generation += 2
        return cells


def test_a_map_too_large_for_one_look_is_read_in_bands(stock, monkeypatch):
    from chipwise.stock import shared as module

    monkeypatch.setattr(module, "BAND_BYTES", 5 * 62 * 8)
    exact = SharedStock(memoryview(stock._block)).snapshot()
    restless = Restless(memoryview(stock._block))
    restless.calm = 5
    seen = restless.snapshot()
    assert not seen.exact
    assert np.array_equal(seen.heights, exact.heights)


def test_a_map_that_changes_in_every_look_is_an_error(stock):
    with pytest.raises(SharedStockError, match="stands"):
        Restless(memoryview(stock._block)).snapshot(timeout_s=0.05)


@pytest.mark.parametrize("field, value", [("magic", 1), ("version", 9)])
def test_another_layout_is_refused(stock, field, value):
    setattr(stock.head, field, value)
    with pytest.raises(SharedStockError, match="version"):
        SharedStock(memoryview(stock._block))


# --- a head that says what is not so ----------------------------------------------------------------------------


def test_a_head_larger_than_its_memory_is_refused(stock):
    stock.head.capacity = 1 << 31
    with pytest.raises(SharedStockError, match="do not fit"):
        SharedStock(memoryview(stock._block))


@pytest.mark.parametrize("cell", [0.0, -1.0, float("nan"), 1e-12, 1e300])
def test_a_cell_no_map_has_is_refused(stock, cell):
    stock.head.coarsest = cell
    with pytest.raises(SharedStockError, match="do not fit"):
        SharedStock(memoryview(stock._block))


def test_too_short_a_memory_is_refused():
    with pytest.raises(SharedStockError, match="is not a map"):
        SharedStock(memoryview(bytearray(50)))


@pytest.mark.parametrize(
    "field, value",
    [
        ("nx", 1 << 30),
        ("ny", 1 << 30),
        ("ny", -1),
        ("cell", 0.0),
        ("cell", float("nan")),
        ("coarsest", 9.0),
        ("finest", 0.01),
        ("nx", 2**31 - 1),
    ],
)
def test_what_was_believed_once_counts(stock, field, value):
    """Another program changes the head after it has been checked."""
    shared = SharedStock(memoryview(stock._block))
    setattr(stock.head, field, value)
    if field == "ny":
        stock.head.filled = 2**31 - 1
    for read in (shared.snapshot, shared.take):
        with pytest.raises(SharedStockError, match="another program has written"):
            read()
    stock.head.capacity = 7
    assert shared.capacity != 7


def test_random_heads_are_read_or_refused(stock):
    """Bytes of the head changed at random, before or after it is looked at: a map, none, or a SharedStockError."""
    import random

    from support.random_cases import random_count, random_seed

    chance, good = random.Random(random_seed()), bytes(stock._block)
    for case in range(random_count(1500)):
        block = bytearray(good)
        changes = [
            (
                chance.randrange(8, layout.Stock.removed.offset),
                chance.choice([0, 1, 127, 128, 255, chance.randrange(256)]),
            )
            for _ in range(chance.randrange(1, 5))
        ]
        late = chance.random() < 0.5
        try:
            shared = SharedStock(memoryview(block)) if late else None
            for place, value in changes:
                block[place] = value
            shared = shared or SharedStock(memoryview(block))
            seen, taken = shared.snapshot(timeout_s=0.01), shared.take(timeout_s=0.01)
        except SharedStockError:
            continue
        except Exception as error:
            raise AssertionError(
                f"CHIPWISE_SEED={random_seed()}, case {case}: {type(error).__name__}: {error}: {changes}"
            ) from error
        assert (seen is None) == (taken is None)
