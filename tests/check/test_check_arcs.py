# SPDX-License-Identifier: GPL-2.0-or-later
"""Almost straight arcs, as FreeCAD writes them for lines: check, rewrite and filter read them as LinuxCNC's motion runs
them."""

import math

import pytest

from chipwise.program.reader import Machine, Reader
from chipwise.program.records import ARC
from support import ROOT, forked
from support.check_runs import CHIPWISE, HEAD, STOCK, chipwise_check, mill_with_tools
from support.filter_runs import mill_ini, run as run_filter

LINE = HEAD + STOCK + "T1 M6\nS8000 M3\nF600\nG0 X60 Y50 Z5\nG1 Z-4\n{}\nG0 Z5\nM2\n"
STRAIGHT = "G1 X60 Y46.587"
ARCS = {
    "XY": "G2 X60 Y46.587 I-7278224.337 J0",
    "the other way": "G3 X60 Y46.587 I7278224.337 J0",
    "larger": "G2 X60 Y46.587 I-8123456789.5 J0",
}


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


@pytest.mark.parametrize("name", ARCS)
def test_check(tmp_path, machine, name):
    status, out, _err, report = chipwise_check(
        tmp_path, {"arc.ngc": LINE.format(ARCS[name]), "line.ngc": LINE.format(STRAIGHT)}, machine=machine
    )
    arc, line = (program["tools"][0] for program in report["programs"])
    assert status == 0 and arc["volume_mm3"] == pytest.approx(line["volume_mm3"], rel=1e-3), out
    assert arc["planned_s"] == pytest.approx(line["planned_s"], rel=0.1)


def test_a_full_circle_stays_one(tmp_path, machine):
    """Also one whose end is not written, and one with a turn more."""
    lengths = []
    for text in ("G2 X60 Y50 I-10 J0", "G3 I-10", "G2 I-10 P2"):
        path = tmp_path / "circle.ngc"
        path.write_text(LINE.format(text))
        with Reader(str(path), Machine(str(machine))) as reader:
            rows = [row for block in reader for row in block.tolist() if row[0] == ARC]
        points = [(60.0, 50.0), *(tuple(row[2:4]) for row in rows)]
        lengths.append(sum(math.dist(a, b) for a, b in zip(points, points[1:])))
    assert lengths == pytest.approx([20 * math.pi, 20 * math.pi, 40 * math.pi], rel=1e-3)


def test_rewrite(tmp_path, machine):
    """The moves are the line's, to 1e-6 mm in what LinuxCNC reads back."""
    before, after = tmp_path / "arc.ngc", tmp_path / "out.ngc"
    before.write_text(LINE.format(ARCS["XY"]))
    done = forked.run(
        [CHIPWISE, "rewrite", before, "-o", after, "--feed", "2", "--ini", machine], cwd=ROOT, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    with Reader(str(after), Machine(str(machine))) as reader:
        rows = [row for block in reader for row in block.tolist() if row[0] == ARC]
    assert (
        rows
        and all(abs(row[2] - 60.0) < 1e-6 and 46.587 - 1e-6 < row[3] < 50 for row in rows)
        and rows[-1][3] == pytest.approx(46.587, abs=1e-6)
    )


def test_filter(tmp_path):
    ini = mill_ini(tmp_path)
    (tmp_path / "arc.nc").write_text(LINE.format(ARCS["XY"]))
    done = run_filter(ini.path, tmp_path / "arc.nc", tmp_path)
    assert done.status == 0 and "100 m" not in done.said and done.data == (tmp_path / "arc.nc").read_bytes(), done
