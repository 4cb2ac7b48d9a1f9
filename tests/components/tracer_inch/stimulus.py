# SPDX-License-Identifier: GPL-2.0-or-later
"""tracer_slope with its feed in inch."""

from support.halrig import SCENES, load_module


def stimulus():
    s = load_module(SCENES / "tracer_slope/stimulus.py").stimulus()
    s.columns["feed"] = [feed / 25.4 for feed in s.columns["feed"]]
    return s
