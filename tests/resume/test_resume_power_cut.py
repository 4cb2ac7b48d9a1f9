# SPDX-License-Identifier: GPL-2.0-or-later
"""A power cut while the stock is saved (monitor/live_stock.py): what the disk has then is enough for `chipwise resume`,
and no cut is left out.

The program cuts the map that LiveStock saves, as on the machine: a place of the tool every 20 ms, a look every 0.7 s.
A disk image has the file up to a random byte of a write that was under way, and behind it nothing, zeros, noise or the
blocks of an older file.
"""

import bisect
import ctypes
import random

import pytest

from chipwise.clib.library import library
from chipwise.clib.core import Cutter
from chipwise.monitor import live_stock
from chipwise.resume import run as resume
from chipwise.stock.shared import SharedStock
from support.random_cases import random_count, random_seed
from support.resume_case import SAME_MM, SAME_MM3, SAME_SHARE, Case, feed_left
from support.resume_oracle import PERIOD_S, apart
from support.resume_programs import DRILL, FINISH, NESTED, SUBS

NOTE_POINTS, LOOK_POINTS = round(0.02 / PERIOD_S), round(live_stock.LOOK_S / PERIOD_S)
ADDED_S = 20.0  # of feed in air, the most
LEFT_OUT_S = 0.5  # as in bench_resume.py: rounding of the periods
NOTHING_MM3 = 0.1  # cut in the whole part of the file: the program has to begin anew
RADIUS = 3.0  # mm, of the largest tool here


class Saved:
    """A Case that was run to its end and saved meanwhile.  index, size, removed: point of the path, bytes of the file
    and mm3 that were cut, after each look."""

    def __init__(self, folder, text):
        (folder / "part.ngc").write_text(text)
        self.case = case = Case(folder, folder / "part.ngc")
        stock, run, self.index, self.size, self.removed = case.run.new_stock(), case.run, [], [], []
        block = (ctypes.c_char * library().chip_stock_bytes(stock.head.capacity)).from_address(stock.address)
        live = live_stock.LiveStock(str(case.journal), SharedStock(memoryview(block).cast("B")), pytest.fail)
        cutter, had = None, None
        for k in range(1, len(run.points)):
            if run.tool[k] != had:
                had = run.tool[k]
                cutter = Cutter(stock, run.tools[had], run.points[k - 1]) if run.tools[had] else None
            if cutter:
                cutter.to(run.points[k])
            if k % NOTE_POINTS == 0:
                live.note(run.points[k], RADIUS, int(case.program.line[run.move[k]]), str(case.path))
            if k % LOOK_POINTS == 0:
                assert live.look()
                self.index.append(k)
                self.size.append(case.journal.stat().st_size)
                self.removed.append(stock.head.removed)
        live.close()
        self.data = case.journal.read_bytes()
        assert len(self.data) == self.size[-1] and self.size == sorted(self.size)  # it only grows

    def cut_off(self, rng):
        """Put a disk image in the place of the file; -> (number of the last look that is whole in it, bytes that are
        left)."""
        changed = [look for look in range(1, len(self.size)) if self.size[look] > self.size[look - 1]]
        look = rng.choice(changed)  # under way
        left = rng.randrange(self.size[look - 1], self.size[look])
        rest = self.size[look] - left
        behind = rng.choice([b"", bytes(rest), rng.randbytes(rest), (self.data[:left])[:rest]])
        self.case.journal.write_bytes(self.data[:left] + behind)
        return bisect.bisect_right(self.size, left) - 1, left


@pytest.mark.parametrize("text", [SUBS, NESTED, FINISH, DRILL], ids=["subs", "nested", "finish", "drilling"])
def test_power_cut_while_the_stock_is_saved(tmp_path, text):
    saved, seed = Saved(tmp_path, text), random_seed()
    case, rng = saved.case, random.Random(seed)
    for number in range(random_count(12)):
        look, left = saved.cut_off(rng)
        which = f"seed {seed} number {number}: look {look}, {left} bytes of {len(saved.data)}"
        try:
            made = case.job.finish(case.job.of_kept(resume.Order()), resume.Order())
        except resume.Unreadable as error:
            assert saved.removed[look] < NOTHING_MM3 and "nothing of it is cut" in str(error), (which, str(error))
            continue
        cut, met, fed = case.resumed(made.data, made.stock)
        higher, lower = apart(case.whole, cut)
        assert (
            max(higher, lower) < SAME_MM
            and abs(cut.volume() - case.whole.volume()) < SAME_MM3 + SAME_SHARE * case.volume
        ), (which, higher, lower)
        assert met < 1e-3, (which, met)
        assert -LEFT_OUT_S < fed - feed_left(case, saved.index[look]) < ADDED_S, (which, fed)
