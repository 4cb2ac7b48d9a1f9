# SPDX-License-Identifier: GPL-2.0-or-later
"""The cases of feed_law, in inch."""

from support.halrig import SCENES, load_module

LENGTHS = ("programmed-vel", "requested-vel", "acceleration", "distance-first", "distance-last")


def stimulus():
    rows = load_module(SCENES / "feed_law/stimulus.py").stimulus()
    for name in LENGTHS:
        rows.columns[name] = [value / 25.4 for value in rows.columns[name]]
    return rows
