# SPDX-License-Identifier: GPL-2.0-or-later
"""[CHIPWISE]KEEP_STOCK without a LinuxCNC: which stock comes back at the next start, and what becomes of its file (monitor/stock_files.py)."""
import os

import numpy as np
import pytest

from chipwise.monitor.stock_files import StockFiles
from chipwise.settings import parse_settings
from chipwise.stock import core, store
from chipwise.stock.shared import SharedStock


class Pins(dict):
    """The tracker hands over its map at once."""

    def __getitem__(self, name):
        return super().__getitem__('hold' if name == 'held' else name)


class Map:
    """The stock of one run of LinuxCNC."""

    def __init__(self, capacity):
        self.capacity, self.taken = capacity, None

    def take(self):
        return self.taken

    def put(self, head, cells):
        self.taken = head, cells

    def close(self):
        pass


@pytest.fixture
def cut():
    """A stock with a slot."""
    stock = core.Stock((-5.0, 10.0, -12.0), (25.0, 30.0, -2.0), 0.5)
    core.Cutter(stock, core.Tool(4.0), (0.0, 15.0, -5.0)).to((20.0, 22.0, -6.5))
    return SharedStock(memoryview(stock._block)).take()


@pytest.fixture
def run(tmp_path, cut):
    """A run of LinuxCNC with STOCK_DIR tmp_path -> (its StockFiles after the first look, messages); `end()` ends it."""
    store.write(str(tmp_path / store.KEPT), *cut)

    def begin(capacity=1_000_000):
        said = []
        pins = Pins({'request': 0, 'hold': False, 'ready': False, 'stock-defined': True, 'certain': True})
        files = StockFiles(pins, parse_settings({'KEEP_STOCK': 'yes', 'STOCK_DIR': str(tmp_path)}), said.append)
        files.stock = Map(capacity)
        files.step(0.0)
        return files, said
    return begin


def test_the_stock_comes_back_once(run, tmp_path, cut):
    files, said = run()
    assert np.array_equal(files.stock.taken[1], cut[1]) and said == [] and os.listdir(tmp_path) == [store.OPEN]
    files.end()
    assert store.read(str(tmp_path / store.KEPT))[0] == cut[0] and os.listdir(tmp_path) == [store.KEPT]


def test_an_assumed_stock_is_not_kept(run, tmp_path, cut):
    """Nobody has confirmed it, so the next run must not find it certain; no note is made of it either."""
    os.unlink(tmp_path / store.KEPT)
    files, said = run()
    files.stock.taken = cut
    files.component.update({'certain': False, 'ready': True})
    files.step(0.0)
    files.end()
    assert os.listdir(tmp_path) == [] and said == []


NOT_KNOWN = ('the stock of the last run is not known ([CHIPWISE]KEEP_STOCK): LinuxCNC or chipwise-monitor did not end in order (power loss, crash); '
             'define it with M250, or restore it with M254')


def test_after_a_power_loss_the_operator_is_told(run, tmp_path, cut):
    """A run with a restored stock, and one with a new stock, that never ended; said once: the run after an orderly end knows nothing of it."""
    run()
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None
    files.component['ready'] = True
    files.step(0.0)
    files, said = run()
    assert said == [NOT_KNOWN]
    files.end()
    assert run()[1] == []


def test_a_deleted_file_that_a_power_loss_brings_back_is_not_used(run, tmp_path, cut):
    """The folder's entry need not have reached the disk."""
    run()
    store.write(str(tmp_path / store.KEPT), *cut)
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None and os.listdir(tmp_path) == [store.OPEN]


def test_a_refused_stock_does_not_come_back_after_cuts_and_a_power_loss(run, tmp_path):
    files, _said = run(capacity=100)
    files.was_on = True
    files.step(0.0)
    files, said = run()
    assert said == [NOT_KNOWN] and files.stock.taken is None


def test_a_stock_that_does_not_fit_waits_for_the_remedy(run, tmp_path, cut):
    """MAP_SIZE was made smaller: the message names it, and after it is set right the stock is there; it was deleted when LinuxCNC ended."""
    files, said = run(capacity=100)
    assert files.stock.taken is None
    assert said == ['the stock of the last run was not restored ([CHIPWISE]KEEP_STOCK): the stock in the file has more cells than the map; '
                    'enlarge [CHIPWISE]MAP_SIZE, or use a smaller CELL, before you switch the machine on']
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
    files.was_on, files.stock.taken = True, cut
    files.end()
    assert store.read(str(path))[0] == cut[0]


def test_a_file_that_cannot_be_deleted_is_not_used(run, tmp_path, monkeypatch, capfd):
    """In a folder without write access it would come back at every start, after later cuts too."""
    monkeypatch.setattr(os, 'access', lambda path, mode: False)         # root may write in every folder
    files, said = run()
    assert files.stock.taken is None and len(said) == 1 and 'cannot be read or written' in said[0]
    assert 'cannot be deleted' in capfd.readouterr().out

    def refuse(_path):
        raise PermissionError(13, 'Permission denied')
    monkeypatch.setattr(os, 'unlink', refuse)
    files.was_on = True
    files.end()
    assert 'was not deleted: Permission denied' in capfd.readouterr().out
