# SPDX-License-Identifier: GPL-2.0-or-later
"""A program of FreeCAD with the post of docs/user/cam.md, on the simulated mill: M250 has its stock, M251 is in
force."""

import numpy as np
import pytest

from chipwise.headless import runner
from support import cam_posts

pytestmark = pytest.mark.machine


def test_the_machine_understands_freecad(tmp_path):
    program, log = tmp_path / "posted.ngc", tmp_path / "posted.npz"
    cam_posts.freecad(program, cam_posts.PROFILE.read_text())
    summary = runner.run_headless(str(program), speed=6.0, log=str(log), timeout=900.0)
    assert summary["finished"] and summary["errors"] == [], summary
    assert summary["stock"] == "program" and summary["rate_target"] == 12000, summary
    with np.load(log) as stored:
        removed = float(stored["removed_volume"].max())
    assert removed == pytest.approx(cam_posts.CUT_MM3, rel=0.01)
