# SPDX-License-Identifier: GPL-2.0-or-later
"""A program, the machine it runs on, and the stock that is kept of it at a stop.  Used by tests/resume/ and
bench/bench_resume.py."""

import time

from chipwise.program.reader import Machine
from chipwise.program.records import RAPID
from chipwise.resume import run as resume
from chipwise.resume import stocks, walk
from chipwise.rewrite.program import read
from chipwise.settings import load_settings
from chipwise.tool_data.geometry import load_tools
from support.resume_oracle import Run, make_machine, moments, write_journal

SAME_MM = 0.06  # of heights outside of a cell and its neighbours
SAME_MM3 = 1.0  # of what is left, and SAME_SHARE of what is cut: chords of arcs
SAME_SHARE = 2e-4


class Case:
    """A program, how the machine runs it, and where its stock is kept."""

    def __init__(self, folder, path):
        self.ini, self.path = make_machine(folder / "mill"), path
        self.machine = Machine(str(self.ini))
        self.geometry = load_tools(str(self.ini.parent / "tools.toml"))
        self.program = resume.with_paths(read(str(path), self.machine))
        self.run = Run(self.program, self.geometry)
        self.journal = self.ini.parent / "stock" / "kept.journal"
        self.job = resume.Job(str(path), self.program, self.machine, self.geometry, load_settings(str(self.ini)), {})
        self.whole = self.run.new_stock()
        self.volume = self.run.cut(self.whole, 0, len(self.run.points) - 1)

    def keep(self, stock, removed, tip, program=None, when=None):
        """Save as the machine does; tip: index of a point."""
        write_journal(
            self.journal,
            stock,
            removed,
            self.run.points[tip],
            int(self.program.line[self.run.move[tip]]),
            program or self.path,
            when or time.time(),
        )

    def resumed(self, data, stock):
        """(stock that the new program leaves, mm3 that its traverses meet, s of its feeds)."""
        new = self.ini.parent / "resumed.ngc"
        new.write_bytes(data)
        program = read(str(new), self.machine)
        path = walk.path_of(program, self.machine, self.geometry, 0)
        cut = stocks.blank(stocks.head_of(stock, 0.0))
        cut.cells_and_ring[:] = stock.cells_and_ring
        traverse = program.kind[path.move] == RAPID
        return cut, float(walk.removed(path, cut, program)[traverse].sum()), float(path.seconds[~traverse].sum())


def stations(case, count, seed):
    """Yield (index, stock up to there, mm3) of random moments at which something is cut."""
    stock, removed, at = case.run.new_stock(), 0.0, 0
    for index in moments(case.run, count, seed):
        removed += case.run.cut(stock, at, index)
        at = index
        if 1.0 < removed < case.volume - 1.0:
            yield index, stock, removed


def feed_left(case, index):
    """s of feed behind a point."""
    kinds = case.program.kind[case.run.move[index:]]
    return float(case.run.seconds[index:][kinds != RAPID].sum())
