# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs of nc_files/ on the headless mill that several tests judge, each made once.  Their tests are marked
`together`."""

import functools
import os
import tempfile
from pathlib import Path

import numpy as np

from chipwise.headless import runner
from support.headless_rig import SLOW_MOTION, own_ini

DEMOS = ("contour", "pocket", "pocket_oneway", "relief")
GROUP = "demo runs"  # of the mark `together`
SPEED = 10
TIMEOUT_S = 3000  # of the machine's time; the longest takes 230 where the computer has time for it


@functools.lru_cache(maxsize=None)
def demo_run(name):
    """-> (summary, log) of nc_files/NAME.ngc on configs/mill_headless.ini."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "log.npz")
        summary = runner.run_headless(
            os.path.join(runner.ROOT, "nc_files", name + ".ngc"),
            runner.Machine(own_ini(Path(folder), EMCMOT=SLOW_MOTION)),
            speed=SPEED,
            timeout=TIMEOUT_S,
            log=path,
        )
        with np.load(path) as stored:
            return summary, {column: stored[column] for column in stored.files}
