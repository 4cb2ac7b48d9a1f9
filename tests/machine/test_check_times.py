# SPDX-License-Identifier: GPL-2.0-or-later
"""The time that `chipwise check` plans, against the real machine's: traverses, drilling, holes and arcs of
nc_files/panel.ngc, and CAM styles as foreign_styles.py writes them, at F and under M251."""

import re
from dataclasses import replace

import numpy as np
import pytest

from support import ROOT, claims, foreign_styles
from chipwise.check import answer
from chipwise.program.reader import Machine
from chipwise.headless import runner

pytestmark = pytest.mark.machine

ALLOWED = 0.05  # measured: panel -0.01, terraces -0.02, ramp_contour -0.04
FEED_CODES = re.compile(r"^(N\d+ ?)?M25[12].*$", re.M)


def moved(log):
    """s in which the axes move, from the first place on that is not the beginning across Z."""
    with np.load(log) as stored:
        kind, line, period = stored["motion_type"], stored["line"], float(stored["period"])
        across = np.column_stack([stored["x"], stored["y"]])
    first = np.flatnonzero(kind > 0)[0]
    begins = np.flatnonzero(np.abs(across - across[first]).max(axis=1) > 0.1 * float(np.ptp(across)))[0]
    behind = begins + np.flatnonzero(line[begins:] != line[begins])[0]
    return float((kind[behind:] > 0).sum()) * period


def test_the_planned_time_is_that_of_the_machine(tmp_path):
    """Without M251, and without what the check cannot know: the move to the first place, waits for tools and plans."""
    program, log = tmp_path / "panel.ngc", tmp_path / "panel.npz"
    program.write_text(FEED_CODES.sub("", (ROOT / "nc_files" / "panel.ngc").read_text()))
    result = answer.check(str(program), Machine(runner.HEADLESS))
    summary = runner.run_headless(str(program), speed=6.0, log=str(log), timeout=900.0)
    assert summary["finished"] and summary["errors"] == [], summary
    planned, real = sum(tool.planned_s for tool in result.tools.values()), moved(log)
    print(f"panel: planned {planned:.2f} s, moved {real:.2f} s")
    assert planned == pytest.approx(real, rel=ALLOWED)


@pytest.mark.parametrize("name, volumetric", [("terraces", False), ("ramp_contour", True)])
def test_the_planned_time_of_cam_styles(tmp_path, name, volumetric):
    """Exact path at F; blends of arcs and lines, and braking before stock, under M251."""
    program = foreign_styles.programs("40")[name]
    if not volumetric:
        program = replace(program, text=FEED_CODES.sub("", program.text))
    summary, log = claims.run(program, claims.Condition(), tmp_path)
    assert summary["finished"] and summary["errors"] == [], summary
    result = answer.check(str(tmp_path / f"{name}-held.ngc"), Machine(str(tmp_path / f"{name}-held.ini")))
    planned = sum(tool.volumetric_planned_s if volumetric else tool.planned_s for tool in result.tools.values())
    print(f"{name}: planned {planned:.2f} s, moved {moved(log):.2f} s")
    assert planned == pytest.approx(moved(log), rel=ALLOWED)
