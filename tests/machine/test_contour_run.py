# SPDX-License-Identifier: GPL-2.0-or-later
"""G77 and G78 on a running LinuxCNC: what the machine really moves, the messages, and that bad subs hurt nothing."""

import json
import math
import os

import numpy as np
import pytest

from support.contour_oracle import from_elements, nearest
from support.demo_runs import GROUP, demo_run
from support.operate import operate

from chipwise.geometry.base.contour import make_contour
from chipwise.headless import runner
from chipwise.contour_sub.job import Job
from chipwise.contour_sub.read import read_shape

pytestmark = pytest.mark.machine

PROGRAM = os.path.join(runner.ROOT, "nc_files", "contour.ngc")
G64_MM = 0.01  # the program's path tolerance


@pytest.mark.together(GROUP)
def test_sample_program():
    """Rough with 12 mm, finish with 6 mm: every servo period of both keeps off the two shapes, and both get there."""
    summary, data = demo_run("contour")
    assert summary["finished"] is True and summary["errors"] == []
    assert 10 < summary["largest_piece_mm"] < 25
    with open(PROGRAM) as handle:
        lines = handle.read().splitlines()
    codes = {code: [n for n, text in enumerate(lines, 1) if text.startswith(code)] for code in ("G77", "G78")}
    for diameter, code, clear in ((12.0, "G77", 0.3), (6.0, "G78", 0.0)):
        cut = np.isin(data["line"], codes[code]) & (data["z"] < -0.5)
        place = np.unique(np.round(np.stack((data["x"][cut], data["y"][cut]), axis=1), 4), axis=0)
        for sub in (100, 200):
            (loop,) = read_shape(Job(PROGRAM, sub)).loops
            finish = from_elements(make_contour(list(loop)).elements)
            gap = nearest(finish, place)
            assert gap.min() >= diameter / 2 + clear - G64_MM - 1e-3
            assert gap.min() <= diameter / 2 + clear + G64_MM
    # G78 touches all of the outline: no point of it is further from the path than the tool reaches
    outline = from_elements(make_contour(list(read_shape(Job(PROGRAM, 100)).loops[0])).elements)
    points = np.array(
        [
            [el[1] + t * (el[3] - el[1]), el[2] + t * (el[4] - el[2])]
            for el in outline
            if el[0] == "L"
            for t in (0.1, 0.5, 0.9)
        ]
    )
    far = max(float(np.hypot(*(place - p).T).min()) for p in points)
    assert far <= 3.0 + G64_MM + 0.02


SUB = "o100 sub\nG0 X0 Y0\nG1 X30\nG1 Y20\nG1 X0\nG1 Y0\no100 endsub\n"


def test_mdi(tmp_path):
    """Subs on the SUBROUTINE_PATH, in MDI: refused ones move nothing and leave the machine usable, a good one is
    cut."""
    folder = tmp_path / "subs"
    folder.mkdir()
    for number, body in ((100, None), (101, "o1 while [1]\no1 endwhile\n"), (102, "G0 X0 Y0\nG1 X5 Z-1\n"), (103, "")):
        text = SUB if body is None else f"o{number} sub\n{body}o{number} endsub\n"
        (folder / f"{number}.ngc").write_text(text)
    steps = [
        ["mdi", "T1 M6"],
        ["mdi", "G0 X5 Y5 Z20"],
        ["mdi", "F600"],
        ["mdi", "G77 Q101 P41 Z-2 R2"],
        ["mdi", "G77 Q102 P41 Z-2 R2"],
        ["mdi", "G77 Q103 P41 Z-2 R2"],
        ["mdi", "G78 Q99 P41 Z-2 R2"],
        ["position"],
        ["mdi", "G78 Q100 P41 Z-2 R2 F3000"],
        ["position"],
        ["messages"],
    ]
    answers = operate(tmp_path, steps, edit=f"s#^SUBROUTINE_PATH = .*#SUBROUTINE_PATH = {folder}#")
    for answer, words in zip(
        answers[3:7],
        (
            "101, line 1 of 101.ngc: the sub does not end within 1 s",
            "102, line 3 of 102.ngc: a move in Z",
            "103, line 1 of 103.ngc: the sub holds no",
            "there is no sub O99",
        ),
    ):
        assert len(answer) == 1 and words in answer[0], answer
    assert answers[7] == pytest.approx([5, 5, 20], abs=1e-6)
    assert answers[8] == []
    assert answers[9][2] == pytest.approx(2.0, abs=1e-6)
    assert "4 inside corners keep" in json.dumps(answers[10])
    assert math.dist(answers[9][:2], (5, 5)) > 1
