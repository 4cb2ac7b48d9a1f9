# SPDX-License-Identifier: GPL-2.0-or-later
"""Bands of a new stock that are equal are compressed once (stock/journal.py: Writer.band); the file has all of them in
their places."""

import numpy as np

from chipwise.resume import stocks
from chipwise.clib import core
from chipwise.stock import journal


def test_equal_bands(tmp_path):
    stock = core.Stock((0, 0, -10), (60, 40, 0), 0.25)
    cutter = core.Cutter(stock, core.Tool(6.0), (30.0, -5.0, -2.0))
    cutter.to((30.0, 21.0, -2.0))
    cutter.run()
    rows = np.ascontiguousarray(stock.cells_and_ring).view(np.uint64).reshape(stock.cells_and_ring.shape[0], -1)
    path, packed = str(tmp_path / "kept.journal"), []
    writer = journal.Writer(path, stocks.head_of(stock, 0.0))
    for number, row in enumerate(rows):
        writer.band(number * row.size, row, journal.Note(1.0, 2.0, (0.0, 0.0, 0.0), 3, "part.ngc"))
        packed.append(writer._band[1])
    writer.publish()
    writer.close()
    _head, cells, note = journal.read(path)
    assert np.array_equal(cells.view(np.uint64).reshape(rows.shape), rows) and note.line == 3
    assert len({id(one) for one in packed}) == 1 + int((rows[1:] != rows[:-1]).any(axis=1).sum()) < len(rows) / 2
