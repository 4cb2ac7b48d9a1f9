"""remap/chipwise/stock/shared.py on a map in this process; tests/hal/test_load.py has it in a HAL."""
import numpy as np
import pytest

from chipwise.stock import core
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
    left = (seen.heights - LOW[2]).sum() * CELL ** 2
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
