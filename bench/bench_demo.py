# SPDX-License-Identifier: GPL-2.0-or-later
"""The time that the samples save, without a limit of the chip and with that of a material beside it.

Called by bench/run.py (prints JSON rows); by hand with --table: `/usr/bin/python3 bench/bench_demo.py --table --only
slots`.

 1. nc_files/slots.ngc and panel.ngc run on the real LinuxCNC at F as programmed (M252), and under M251 at the rate of
    the program.
 2. They run again with a material, whose default chip then limits each edge (docs/user/materials.md).
 3. Beside each of the two is the constant feed that loads the tool no more: that has the same peak rate at the largest
    section, as in `chipwise demo`, and, with a material, at most that chip in a full slot.
 4. Compared is the time in which the axes move: a busy computer adds to the rest.
"""

import argparse
import json
import re
import tempfile
from pathlib import Path

import numpy as np

from roots import ROOT
from rows import row
from chipwise.cli import demo
from chipwise.headless import log as runlog
from chipwise.headless import runner
from chipwise.tool_data.chip_loads import default_chip
from chipwise.tool_data.geometry import tool_geometry
from chipwise.tool_data.materials import find_material

PROGRAMS = ("slots", "panel")
MATERIALS = ("6061", "C45")
SPEED = 5.0
HEAD = f"{'program':8s} {'material':9s} {'F s':>7s} {'M251 s':>7s} {'of F %':>7s} {'constant s':>10s} {'of it %':>8s}"


def tool_of(text):
    """(number, diameter mm, S 1/min) of a sample, which has one tool."""
    number = int(re.search(r"^T(\d+)\s*M6", text, re.M).group(1))
    table = (ROOT / "configs" / "mill.tbl").read_text()
    return (
        number,
        float(re.search(rf"^T{number}\s.*?D([\d.]+)", table, re.M).group(1)),
        float(re.search(r"^S(\d+)", text, re.M).group(1)),
    )


def chip_feed(text, material):
    """mm/min at which a full slot has the default chip of the material."""
    number, diameter, speed = tool_of(text)
    geometry = tool_geometry(str(ROOT / "configs" / "tools.toml"), number)
    return default_chip(diameter, geometry.flutes, find_material(material)) * geometry.flutes * speed


class Sample:
    def __init__(self, name, folder, speed):
        self.name, self.folder, self.speed = name, folder, speed
        self.text = (ROOT / "nc_files" / f"{name}.ngc").read_text()

    def ran(self, text, settings=None):
        """(s in which the axes move, mm2 of the largest section, largest rate mm3/min) of a run."""
        path, log = self.folder / f"{self.name}.ngc", self.folder / "run.npz"
        path.write_text(text)
        summary = runner.run_headless(str(path), runner.Machine(settings=settings), self.speed, log=str(log))
        if summary["exit_status"] or summary["errors"]:
            raise RuntimeError(f"bench: {self.name}: {summary['errors']}")
        with np.load(log) as stored:
            columns = {name: stored[name] for name in stored.files}
        ticks, period = np.diff(columns["sample"]), float(columns["period"])
        moves = np.any([np.diff(columns[axis]) != 0.0 for axis in "xyz"], axis=0)
        section = runlog.largest_section(columns, period, float(columns["units_per_mm"]))
        return float(ticks[moves].sum()) * period, section, summary["rate_peak"]

    def measured(self, material):
        """(s under M251, s at the constant feed beside it); material: a name, None: none."""
        took, section, rate = self.ran(self.text, {"MATERIAL": material} if material else None)
        feed = rate / section
        if material:
            feed = min(feed, chip_feed(self.text, material))
        return took, self.ran(demo.constant_feed(self.text, feed))[0]

    def at_f(self):
        return self.ran(demo.FEED_ON.sub("M252 ", self.text))[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=PROGRAMS, help="programs")
    parser.add_argument("--material", nargs="*", default=MATERIALS)
    parser.add_argument("--speed", type=float, default=SPEED)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    if options.table:
        print(HEAD, flush=True)
    for name in options.only:
        with tempfile.TemporaryDirectory() as scratch:
            sample = Sample(name, Path(scratch), options.speed)
            plain = sample.at_f()
            for material in (None, *options.material):
                took, constant = sample.measured(material)
                saved = 100.0 * (1.0 - took / plain), 100.0 * (1.0 - took / constant)
                if options.table:
                    print(
                        f"{name:8s} {material or 'none':9s} {plain:7.1f} {took:7.1f} {saved[0]:7.1f} {constant:10.1f} "
                        f"{saved[1]:8.1f}",
                        flush=True,
                    )
                    continue
                what = f"{name}, {f'chip of {material}' if material else 'no limit of the chip'}: time saved"
                print(json.dumps(row(f"{what} of F", round(saved[0], 1), "%", f"{took:.1f} of {plain:.1f} s")))
                print(
                    json.dumps(
                        row(f"{what} of a constant feed", round(saved[1], 1), "%", f"{took:.1f} of {constant:.1f} s")
                    )
                )


if __name__ == "__main__":
    main()
