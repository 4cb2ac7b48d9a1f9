# SPDX-License-Identifier: GPL-2.0-or-later
"""G79 on a running LinuxCNC: the demo programs to the end, the guards on, everything removed that the tool reaches."""

import json
import os

import pytest

from chipwise.geometry.base import polygons
from chipwise.geometry.base.contour import make_contour
from chipwise.geometry.base import chains
from chipwise.geometry.pocket import machinable
from chipwise.headless import runner
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import read_shape
from support.demo_runs import GROUP, demo_run
from support.operate import operate

pytestmark = pytest.mark.machine

RADIUS, SIDE, DEPTH = 5.0, 0.2, 7.9  # of the demo programs: tool, I, Z + K under the top of the stock


def reached_mm2(program):
    """Area that the tool reaches, by polygons."""
    loops = [make_contour(list(loop)) for loop in read_shape(Job(program, 179)).loops]
    areas = [
        polygons.area_region(chains.flat(f.boundary, 1e-3), [chains.flat(h, 1e-3) for h in f.holes])
        for f in machinable.split(loops[0], loops[1:], RADIUS + SIDE)
    ]
    return polygons.area_of(polygons.grown(polygons.joined(areas), RADIUS, 1e-3))


@pytest.mark.parametrize("name", os.environ.get("CHIPWISE_POCKETS", "pocket pocket_oneway").split())
@pytest.mark.together(GROUP)
def test_demo_program(name):
    """No message, no guard, the volume of the pocket.  CHIPWISE_POCKETS names more of them."""
    program = os.path.join(runner.ROOT, "nc_files", name + ".ngc")
    summary, _log = demo_run(name)
    assert summary["finished"] is True and summary["errors"] == []
    assert summary["volume_mm3"] == pytest.approx(reached_mm2(program) * DEPTH, rel=0.003)
    assert summary["over_target_share"] < 0.02


def test_mdi(tmp_path):
    """Refused lines move nothing; a region that stays uncut is said; the machine goes on."""
    folder = tmp_path / "subs"
    folder.mkdir()
    (folder / "100.ngc").write_text("o100 sub\nG0 X0 Y0\nG1 X20\nY9\nX32\nY12\nX20\nY15\nX0\nY0\no100 endsub\n")
    steps = [
        ["mdi", "T1 M6"],
        ["mdi", "G0 X5 Y5 Z5"],
        ["mdi", "F900"],
        ["mdi", "G79 Q100 Z-1 R0.5 D7.2"],
        ["mdi", "G79 Q101 Z-1 R0.5"],
        ["position"],
        ["mdi", "#<_chipwise_ramp_angle> = 20"],
        ["mdi", "G79 Q100 Z-1 R0.5 L30 P2"],
        ["position"],
        ["messages"],
        ["mdi", "G79 Q100 Z-1 R0.5 P4 D3.1"],
        ["mdi", "G79 Q100 Z-1 R0.5 P4"],
        ["position"],
        ["messages"],
        ["mdi", "M250 P-8 Q-8 R-10 I48 J30 K10"],
        ["mdi", "G79 Q100 Z-1 R0.5 P4"],
        ["messages"],
        ["mdi", "G79 Q100 Z-1 R0.5 P4"],
        ["messages"],
    ]
    answers = operate(tmp_path, steps, edit=f"s#^SUBROUTINE_PATH = .*#SUBROUTINE_PATH = {folder}#")
    assert answers[3] == ["chipwise: G79: step-over D7.2 mm is larger than the tool (6 mm); use D up to 6 mm"]
    assert len(answers[4]) == 1 and "there is no sub O101" in answers[4][0]
    assert answers[5] == pytest.approx([5, 5, 5], abs=1e-6)
    assert answers[7] == [] and answers[8][2] == pytest.approx(0.5, abs=1e-6)
    assert "G79: 1 region of the pocket cannot be entered by this tool" in json.dumps(answers[9])
    assert answers[10] == [
        "chipwise: G79: step-over D3.1 mm is above half the tool diameter (6 mm), which is the most of P4; use D up to "
        "3 mm, or P0"
    ]
    assert answers[11] == [] and answers[12][2] == pytest.approx(0.5, abs=1e-6)
    assert "G79: the engagement is above that of D in " in json.dumps(answers[13])
    assert answers[14:16] == [[], []] and "stock as it stands" not in json.dumps(answers[16])
    assert answers[17] == [] and "G79: P4 starts from the stock as it stands, 9" in json.dumps(answers[18])
