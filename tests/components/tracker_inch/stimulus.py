# SPDX-License-Identifier: GPL-2.0-or-later
"""The slot of tracker_slot, in inch."""

from support.halrig import SCENES, load_module


def stimulus():
    return load_module(SCENES / "tracker_slot/stimulus.py").stimulus(scale=1 / 25.4)
