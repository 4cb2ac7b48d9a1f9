# SPDX-License-Identifier: GPL-2.0-or-later
"""Engraving and relief strokes that cross each other: the section area read before the tool is there, against the
judge."""

import pytest

from support import stock_strokes as strokes

# tool: (diameter, corner, tip angle), (mean error, deviation of windows of 0.3 mm) allowed at cells of 0.25 mm
TOOLS = {
    "vee 60 D12.7": ((12.7, 0.0, 60.0), 0.02, 0.085),
    "vee 90 D8": ((8.0, 0.0, 90.0), 0.02, 0.06),
    "taper D6": ((6.0, 0.5, 20.0), 0.02, 0.07),
    "ball D3.175": ((3.175, 1.5875, 0.0), 0.02, 0.03),
    "ball D6": ((6.0, 3.0, 0.0), 0.02, 0.03),
}


@pytest.mark.parametrize("sloped", [False, True], ids=["level", "sloped"])
@pytest.mark.parametrize("name", TOOLS)
def test_strokes(name, sloped):
    tool, mean_allowed, spread_allowed = TOOLS[name]
    found = [strokes.measured(tool, seed, sloped=sloped) for seed in (1, 2, 3)]
    mean, spread = (sum(one[n] for one in found) / len(found) for n in (0, 1))
    assert abs(mean) <= mean_allowed and spread <= spread_allowed, (
        f"mean error {100 * mean:.2f} %, deviation {100 * spread:.2f} %"
    )
