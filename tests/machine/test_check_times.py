# SPDX-License-Identifier: GPL-2.0-or-later
"""The time that `chipwise check` plans, against the real machine's: traverses, drilling, holes and arcs of nc_files/panel.ngc."""
import re

import numpy as np
import pytest

from support import ROOT
from chipwise.check import simulate
from chipwise.check.reader import Machine
from chipwise.headless import runner

pytestmark = pytest.mark.machine

ALLOWED = 0.04      # measured: -0.02


def test_the_planned_time_is_that_of_the_machine(tmp_path):
    """Without M251, and without what the check cannot know: the move to the first place, waits for tools and plans."""
    program, log = tmp_path / "panel.ngc", tmp_path / "panel.npz"
    program.write_text(re.sub(r"^M25[12].*$", "", (ROOT / "nc_files" / "panel.ngc").read_text(), flags=re.M))
    result = simulate.check(str(program), Machine(runner.HEADLESS))
    summary = runner.run_headless(str(program), speed=6.0, log=str(log), timeout=600.0)
    assert summary["finished"] and summary["errors"] == [], summary
    with np.load(log) as stored:
        kind, line, period = stored["motion_type"], stored["line"], float(stored["period"])
    real = float(((kind > 0) & (line > line[kind > 0].min())).sum()) * period
    planned = sum(tool.planned_s for tool in result.tools.values())
    assert planned == pytest.approx(real, rel=ALLOWED), (planned, real)
