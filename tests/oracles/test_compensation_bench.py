# SPDX-License-Identifier: GPL-2.0-or-later
"""The bench of LinuxCNC's own cutter compensation: that it gives a fair chance, and sees alarms and gouges.

bench/bench_compensation.py compares G41.1/G42.1 with the geometry kernel; were its programs wrong, every figure of it
would be.  So: what LinuxCNC can do it does exactly as the kernel, and one alarm and one gouge are known.
"""

import pytest

from support import compensation as bench
from support import contour_oracle as oracle
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.offset.kernel import LEFT, RIGHT, offset_contour
from support.contour_shapes import rounded_square


def through_linuxcnc(contour, side, radius, folder):
    (folder / "case.var").write_text("5161 0\n")
    place = bench.seam(contour, offset_contour(contour, side, radius))
    return bench.interpret(bench.program(contour, side, radius, *place), str(folder))


@pytest.mark.parametrize("side", [LEFT, RIGHT])
def test_what_linuxcnc_can_do(side, tmp_path):
    contour = rounded_square(60, 10)
    path, alarm = through_linuxcnc(contour, side, 4.0, tmp_path)
    assert alarm is None
    ours = [el for p in offset_contour(contour, side, 4.0).paths for el in oracle.from_elements(p.elements)]
    assert sum(map(oracle.length, path)) == pytest.approx(sum(map(oracle.length, ours)), abs=1e-3)
    assert oracle.gouge(oracle.from_elements(contour.elements), 4.0, path, 0.1) < 1e-4


def test_a_tool_larger_than_the_fillet_is_an_alarm(tmp_path):
    path, alarm = through_linuxcnc(rounded_square(60, 3), LEFT, 4.0, tmp_path)
    assert path == [] and alarm == "Tool radius not less than arc radius with comp"


def test_a_known_gouge_is_seen(tmp_path):
    """Contour 77: an arc runs through a wall that is not its neighbour."""
    parts, radius = bench.contour_case(77, "bulged")
    contour = make_contour(parts)
    path, alarm = through_linuxcnc(contour, LEFT, radius, tmp_path)
    assert alarm is None
    assert oracle.gouge(oracle.from_elements(contour.elements), radius, path, 0.1) > 1.0


def test_cases_are_counted_once(tmp_path):
    (tmp_path / "case.var").write_text("5161 0\n")
    counts, worst, alarms = bench.judge_case(77, "bulged", LEFT, str(tmp_path))
    assert counts == {"cases": 1, "possible": 1, "one path": 1, "gouges": 1, "gouges, one path": 1}
    assert worst["theirs"] > 1.0 > 1e-6 > worst["ours"] and not alarms
