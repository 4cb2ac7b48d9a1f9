# SPDX-License-Identifier: GPL-2.0-or-later
"""A tip that a length places in the stock: what the operator does then, and what is said.

Called by tests/machine/test_buried_tip.py and by a scene of tests/support/shipped_machines.py.  The tool stands at X30
Y20, the end of the spindle 20 mm above the top of a block, so the depths are arithmetic.
"""

from support.operate import BOX

LOOK = ["pins", "stock-tracker.0.buried-depth", "stock-tracker.0.removed-volume"]
PROGRAM = "G21 G90\nG43.1 Z26\nG4 P0.2\nG49\nM2\n"


def steps(mm=1.0):
    """Of scripted_display.py; mm: how many are a machine unit."""
    return [
        *([["mdi", line] for line in ("T1 M6", "G21 G90 G17 G49", "G0 Z20", "G0 X30 Y20", BOX)]),
        ["mdi", "G43.1 Z15"],  # above the stock,
        ["mdi", "G43.1 Z20"],  # on it,
        ["mdi", "G43.1 Z25"],  # 5 mm in it
        ["mdi", "G4 P0.5"],
        LOOK,
        ["estop"],
        ["on"],
        ["errors"],
        ["jog", 2, 1 / mm, 10 / mm],
        ["mdi", "G4 P0.1"],
        LOOK,
        ["mdi", BOX],
        LOOK,
        ["mdi", "M253 P7"],
        ["mdi", "M254 P7"],
        LOOK,
        ["mdi", "G49"],
        LOOK,
        ["mdi", "G0 Z20"],
        *([["start", PROGRAM], ["finish"]] * 2),
        LOOK,
    ]


def verdict(answers, units_per_mm, texts):
    """'' or what is wrong with the answers; texts: the depths of 5, 4 and 6 mm as the operator reads them."""
    five, four, six = (
        f"chipwise: by its length or shape the tip of tool 1 is {text} deep in the stock; press Stop, then check the "
        "tool table, H of G43 and the stock (M250)"
        for text in texts
    )
    found = answers[5:]
    said = [[text for text in found[k] if not text.startswith("Note:")] for k in (0, 1, 2, 3, 7, 9, 11, 14, 16, 20, 22)]
    wanted = [[], [], [five], [], [], [four], [four], [four], [], [six], [six]]
    looks = [[float(text) for text in found[k]] for k in (4, 10, 12, 15, 17, 23)]
    depths = [depth * units_per_mm for depth in (5.0, 4.0, 4.0, 4.0, 0.0, 0.0)]
    right = all(
        abs(depth - one) < 1e-4 * units_per_mm and cut == 0.0 for (depth, cut), one in zip(looks, depths, strict=True)
    )
    return "" if said == wanted and right else f"said {said}, depths and mm3 {looks}"
