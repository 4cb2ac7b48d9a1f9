# SPDX-License-Identifier: GPL-2.0-or-later
"""A program of a machine without LinuxCNC that is stopped at a share of its path.  Used by tests/resume/ and
tests/panel/."""

import os
import time

from chipwise.program.reader import Machine
from chipwise.resume import run as resume
from chipwise.resume import stocks, walk
from chipwise.rewrite.program import read
from chipwise.tool_data.geometry import load_tools
from support import ROOT, forked
from support.resume_oracle import Run, make_machine, write_journal
from support.resume_programs import SUBS

CHIPWISE = str(ROOT / "bin" / "chipwise")
SHARE = 0.6  # of the program's path, at which it is stopped


def own_words(errors):
    """Without what LinuxCNC's library prints where a LinuxCNC of another container runs, as that of a test beside this
    one."""
    return "".join(
        line for line in errors.splitlines(True) if not line.startswith(("tool_mmap_user()", "poll(): continuing"))
    )


class Stop:
    """A program that is stopped."""

    def __init__(self, folder, text=SUBS, share=SHARE):
        self.ini, self.program = make_machine(folder / "mill"), folder / "part.ngc"
        self.program.write_text(text)
        os.utime(self.program, (1e9, 1e9))
        self.machine, self.geometry = Machine(str(self.ini)), load_tools(str(self.ini.parent / "tools.toml"))
        self.read = read(str(self.program), self.machine)
        self.run = Run(self.read, self.geometry)
        self.journal = self.ini.parent / "stock" / "kept.journal"
        self.cut_to(int(share * len(self.run.points)))
        self.keep()

    def cut_to(self, index):
        """The stock is cut up to a point of the path; keep() saves it."""
        self.index, self.stock = index, self.run.new_stock()
        self.removed = self.run.cut(self.stock, 0, index)

    def keep(self, tip=None, program=None):
        write_journal(
            self.journal,
            self.stock,
            self.removed,
            self.run.points[self.index] if tip is None else tip,
            int(self.read.line[self.run.move[self.index]]),
            program or self.program,
            time.time(),
        )

    def resume(self, *options, program=None):
        """(status, stdout, stderr)."""
        command = [CHIPWISE, "resume", str(program or self.program), "--ini", str(self.ini), *options]
        done = forked.run(command, timeout=300)
        assert "Traceback" not in done.stdout + done.stderr and "internal error" not in done.stderr
        return done.returncode, done.stdout, own_words(done.stderr)

    def made(self, **order):
        return resume.resumed(str(self.program), resume.Order(**order), self.machine)

    def final(self, data, stock):
        """The stock that a program leaves of another one."""
        path = self.ini.parent / "new.ngc"
        path.write_bytes(data)
        program = read(str(path), self.machine)
        cut = stocks.blank(stocks.head_of(stock, 0.0))
        cut.cells_and_ring[:] = stock.cells_and_ring
        walk.removed(walk.path_of(program, self.machine, self.geometry, 0), cut, program)
        return cut

    def whole(self, head):
        stock = stocks.blank(head)
        self.run.cut(stock, 0, len(self.run.points) - 1)
        return stock
