# SPDX-License-Identifier: GPL-2.0-or-later
"""Tools measured with lengths, changed in mid-program on a running LinuxCNC: by G43, G43.1, G43.2, G49 and M6, also
with X and Y.

Every slot goes through the whole block, so its volume is width x depth x 60 mm; the sums and the floors below are
arithmetic, nothing of the core's.  A stock that was lost, a false stop of a guard and a path swept by an offset each
show in one of them.
"""

import re

import numpy as np
import pytest

from support.operate import Shared, operate

pytestmark = pytest.mark.machine

BOX = "M250 P0 Q0 R-10 I60 J40 K10"
TABLE = """T1 P1 D6.0 Z10.0 ;6 mm end mill
T2 P2 D3.0 Z47.3 ;3 mm end mill
T3 P3 D10.0 Z150.0 X4.5 Y-2.25 ;10 mm end mill on an angle head
T8 P8 D6.0 Z95.125 ;another 6 mm end mill
"""
# (codes that put the tool and its length there, y, diameter, depth); the tip is at Z10 before and after
SLOTS = [
    ("T1 M6\nG43", 4.0, 6.0, 2.0),
    ("T2 M6\nG43", 9.0, 3.0, 3.0),
    ("T3 M6\nG43", 16.0, 10.0, 2.5),
    ("T1 M6\nG43 H1", 25.0, 6.0, 1.0),
    ("G43.1 Z60", 25.0, 6.0, 2.0),  # the same slot, deeper, by a length given in the program
    ("G43.2 H2", 25.0, 6.0, 3.0),  # and one more added to it
    ("G49", 32.0, 6.0, 1.5),
    ("T8 M6\nG43 H8", 32.0, 6.0, 4.0),
    ("G43.1 X3 Y2 Z-12", 38.0, 6.0, 1.0),
]
STATE = [
    "pins",
    "stock-tracker.0.removed-volume",
    "stock-tracker.0.fault-code",
    "stock-tracker.0.ready",
    "volumetric-feed.0.limited-by",
    "chipwise-guard.0.stop",
]


def program(unit=1.0, feed="M251 Q6 P2 E3000"):
    """The program in mm, or with unit 25.4 in inch."""

    def number(value):
        return f"{value / unit:.6f}"

    lines = [f"{'G21' if unit == 1.0 else 'G20'} G90 G17 G40 G64 P{number(0.01)}", "S10000 M3", feed, f"F{number(900)}"]
    for codes, y, _diameter, depth in SLOTS:
        codes = re.sub("([XYZ])(-?[0-9.]+)", lambda word: word[1] + number(float(word[2])), codes)
        lines += [
            codes,
            f"G0 Z{number(10)}",
            f"G0 X{number(-10)} Y{number(y)}",
            f"G0 Z{number(-depth)}",
            f"G1 X{number(70)}",
            f"G0 Z{number(10)}",
        ]
    return "\n".join([*lines, "M252", "M2", ""])


def machine(tmp_path):
    """A sed command for a machine that is tall enough, with tools from TABLE."""
    return (
        f"s#^TOOL_TABLE = .*#TOOL_TABLE = {tmp_path}/tools.tbl#; s#^MAX_LIMIT = 90#MAX_LIMIT = 290#; "
        "s#^MAX_LIMIT = 3.543307#MAX_LIMIT = 11.5#; s#^FINEST_CELL = .*#FINEST_CELL = 0.25#"
    )


CELL_MM = 0.25
ROWS = (np.arange(160) + 0.5) * CELL_MM


def floors():
    """Depth of the floor at the middle of each cell row (y), mm."""
    depth = np.zeros(len(ROWS))
    for _codes, middle, diameter, down in SLOTS:
        depth[np.abs(ROWS - middle) < 0.5 * diameter] = np.maximum(depth[np.abs(ROWS - middle) < 0.5 * diameter], down)
    return depth


def removed():
    """mm3 of all slots; the last one is open at the block's side."""
    return float(floors().sum() * CELL_MM * 60.0)


def check(answers, seen):
    end, state = answers[-3], answers[-2]
    assert end == [], end
    assert state[1:3] == ["0", "TRUE"] and state[4] == "FALSE", state
    assert float(state[0]) == pytest.approx(removed(), rel=2e-3)
    heights = np.load(seen)
    inside = heights[:, 20:-20]
    edge = np.array([np.abs(ROWS - s[1] + side * s[2] / 2) < CELL_MM + 0.01 for s in SLOTS for side in (-1, 1)]).any(
        axis=0
    )
    wrong = np.abs(inside + floors()[:, None]).max(axis=1)
    assert (wrong[~edge] < 1e-3).all(), np.flatnonzero(wrong[~edge] >= 1e-3)


def steps(tmp_path, text, box=BOX):
    (tmp_path / "tools.tbl").write_text(TABLE)
    seen = str(tmp_path / "map.npy")
    return [["mdi", "T1 M6"], ["mdi", box], ["start", text], ["finish"], STATE, ["map", seen]], seen


MILL = Shared(
    "tool lengths",
    before=f"printf '%s' '{TABLE}' >lengths.tbl",
    edit=machine(".").replace("./tools.tbl", "lengths.tbl"),
)


@pytest.mark.parametrize("feed", ["M251 Q6 P2 E3000", "M251 Q6 P1", "M252"])
@pytest.mark.scene(
    MILL, lambda feed: [["mdi", "T1 M6"], ["mdi", BOX], ["start", program(feed=feed)], ["finish"], STATE, ["map"]]
)
def test_lengths_change_in_mid_program(answers, feed):
    check(answers, answers[-1][1])


def test_lengths_on_an_inch_machine(tmp_path):
    do, seen = steps(tmp_path, program(25.4, "M251 Q0.4 P2 E120"), BOX)
    do.insert(1, ["mdi", "G21"])
    inch = "\n".join(
        " ".join(
            word if word[0] not in "DXYZ" else f"{word[0]}{float(word[1:]) / 25.4:.8f}"
            for word in line.split(" ;")[0].split()
        )
        for line in TABLE.splitlines()
    )
    (tmp_path / "tools.tbl").write_text(inch + "\n")
    check(operate(tmp_path, do, ini="mill_inch.ini", edit=machine(tmp_path)), seen)


def stopped_by_the_guard(tmp_path, text):
    """(mm3 removed, messages but for that of a traverse that waits) of a program that the guard stops."""
    do, _seen = steps(tmp_path, text)
    program_file = tmp_path / "stopped.ngc"
    program_file.write_text(text)
    answers = operate(
        tmp_path,
        [*do[:2], ["open", str(program_file)], ["run_until_stopped", 30], STATE, ["abort"], ["errors"]],
        edit=machine(tmp_path),
    )
    assert answers[3] is True, answers
    return float(answers[4][0]), [text for text in answers[6] if "a traverse waits because" not in text]


def test_the_guard_still_stops_a_long_tool(tmp_path):
    """A length that is really too long for the move: the traverse is stopped before the stock, nothing is cut.

    Also if a busy computer keeps the monitor from seeing T8: the first traverse behind it waits, and says so after half
    a second."""
    text = "G21 G90 G17\nT1 M6\nG43\nG0 Z160\nG0 X30 Y20\nT8 M6\nG43\nG0 Z5\nG49\nG0 Z120\nG43 H8\nG0 Z20\nG0 Z-5\nM2\n"
    removed, told = stopped_by_the_guard(tmp_path, text)
    assert removed == 0.0
    assert len(told) == 1 and "rapid stopped" in told[0], told


def test_a_length_that_cannot_be(tmp_path):
    """The length of T8 places its tip 25.10 mm under the top of the stock, whether the monitor has seen the
    tool before or after G43.  The operator reads it, and the model loses nothing by the tool at rest or going up;
    sideways the guard stops it within 1 mm."""
    text = "G21 G90 G17\nT1 M6\nG43\nG0 Z60.023\nG0 X30 Y20\nT8 M6\nG43\nG0 Z5\nG49\nG0 Z60.023\nG43 H8\nG0 X35\nM2\n"
    removed, told = stopped_by_the_guard(tmp_path, text)
    assert removed < 1.0 * 6.0 * 10.0
    assert len(told) == 3 and "the tip of tool 8 is 25.10 mm deep in the stock" in told[0], told
    assert "rapid stopped" in told[2], told
