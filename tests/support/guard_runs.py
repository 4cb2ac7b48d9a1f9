# SPDX-License-Identifier: GPL-2.0-or-later
"""The block of the tests of the guards and the logs of runs on it.  Called by tests/machine/test_guards*.py."""

import numpy as np

SPEED = 10
HEAD = "G21 G90 G17 G40 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nM3 S10000\nF1200\n"


def log_of(path):
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}
