# SPDX-License-Identifier: GPL-2.0-or-later
"""M250 under a rotated work coordinate system (G10 L2 R) on a running LinuxCNC: the stock is the rotated box, not its
upright hull."""

import math

import numpy as np
import pytest

from support.operate import CELL_MM, Shared, operate

pytestmark = pytest.mark.machine

BOX = "M250 P0 Q0 R-10 I60 J40 K10"
STATE = [
    "pins",
    "stock-tracker.0.removed-volume",
    "stock-tracker.0.fault-code",
    "stock-tracker.0.ready",
    "chipwise-guard.0.stop",
    "chipwise-guard.0.reason",
]
TURN = ["pins", "stock-tracker.0.turn", *(f"stock-tracker.0.{end}-{axis}" for end in ("min", "max") for axis in "xyz")]
# Traverses down beside the four sides of the block, all within its hull; then slots through it, first to third depth.
BESIDE = "".join(f"G0 Z10\nG0 X{x} Y{y}\nG0 Z-9\n" for x, y in ((30, -4), (64, 20), (30, 44), (-4, 20)))
SLOTS = "".join(f"G0 Z5\nG0 X-6 Y{y}\nG0 Z{-z}\nG1 X66\n" for z in (2, 4, 6) for y in (12, 30))
VOLUME = 2 * 60 * 6 * 6.0
MILL = Shared("turned stock")


def program(turn):
    return (
        f"G21 G90 G17 G64 P0.01\nT1 M6\nG10 L2 P1 X80 Y60 Z0 R{turn}\nG92 X0 Y0\nG0 Z20\nG92.1\nS10000 M3\nF1200\n"
        f"{BOX}\n"
        f"M251 Q12 P2 E4000\n{BESIDE}{SLOTS}G0 Z5\nM252\nM2\n"
    )


@pytest.mark.parametrize("turn", [30, -77.7, 135])
@pytest.mark.scene(MILL, lambda turn: [["start", program(turn)], ["finish"], STATE, TURN, ["map"]])
def test_the_rotated_box(answers, turn):
    """No false stop beside it, the slots' volume, the map's sides where the block's are."""
    _start, end, state, pins, (_removed, seen) = answers
    assert end == []
    assert state[1:] == ["0", "TRUE", "FALSE", "0"]
    assert float(state[0]) == pytest.approx(VOLUME, rel=2e-3)
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    middle = 80 + 30 * c - 20 * s, 60 + 30 * s + 20 * c
    found = [float(v) for v in pins]
    assert found[0] == pytest.approx((turn + 180) % 360 - 180)
    assert found[1:] == pytest.approx(
        [middle[0] - 30, middle[1] - 20, -10, middle[0] + 30, middle[1] + 20, 0], abs=1e-4
    )
    left = (np.load(seen) + 10).sum() * CELL_MM**2
    assert left + float(state[0]) == pytest.approx(60 * 40 * 10, rel=1e-4)


UPRIGHT = (0, [80, 60, -10, 140, 100, 0]), (90, [40, 60, -10, 80, 120, 0]), (180, [20, 20, -10, 80, 60, 0])


@pytest.mark.scene(
    MILL, [step for turn, _box in UPRIGHT for step in (["mdi", f"G10 L2 P1 X80 Y60 Z0 R{turn}"], ["mdi", BOX], TURN)]
)
def test_an_upright_box_is_as_before(answers):
    """R0 and quarter turns: no turn, the box's own corners."""
    for number, (_turn, box) in enumerate(UPRIGHT):
        *said, pins = answers[3 * number : 3 * number + 3]
        assert said == [[], []]
        assert [float(v) for v in pins] == pytest.approx([0, *box], abs=1e-5)


# Side one: a slot through the block, 6 mm wide, at Y7 to Y13 up to X33. Turned about X with the touched corner at X45.4
# Y42.7 Z-4.54 of the machine (mm and inch), it lies at Y27 to Y33 from there: the same slot meets nothing, and 10 mm
# more of it 600 mm3.
CORNER = 20 + 25.4, 30 + 12.7, -2 - 2.54
OVER = [
    ["mdi", line]
    for line in (
        "G21",
        "G10 L2 P1 X80 Y60 Z0 R0",
        "T1 M6",
        BOX,
        "G0 Z5",
        "G0 X-6 Y10",
        "G0 Z-11",
        "G1 X30 F2000",
        "G0 Z5",
        "M253 P5",
    )
]
SIDE_TWO = [["mdi", line] for line in ("G10 L2 P1 X20 Y30 Z-2", "G0 Z5", "G20", "M254 P5 R180 H1 I1 J0.5 K-0.1", "G21")]
AGAIN = [["mdi", line] for line in ("G0 X19.4 Y42.7", "G0 Z-13.5", "G1 X55.4 F2000")]


@pytest.mark.scene(
    MILL,
    [
        *OVER,
        ["map"],
        *SIDE_TWO,
        ["map"],
        *AGAIN,
        STATE,
        ["mdi", "G1 X65.4"],
        STATE,
        ["mdi", "G0 Z5"],
        ["mdi", "M254 P5"],
        ["map"],
        ["mdi", "M254 P8 R180 H2"],
    ],
)
def test_the_second_side(answers):
    """M254 with R180: at the touched corner, in any unit; the slot keeps the stock of side one."""
    answers = iter(answers)

    def said(count):
        return [text for _ in range(count) for text in next(answers)]

    assert said(len(OVER)) == []
    before, first = next(answers)
    assert said(len(SIDE_TWO)) == []
    after, second = next(answers)
    first, second = np.load(first), np.load(second)
    hollow = first < -9.99
    assert hollow.any() and first.shape == second.shape and after == before
    assert np.array_equal(second[::-1] < CORNER[2] - 9.99, hollow) and second.max() == pytest.approx(
        CORNER[2], abs=1e-4
    )
    assert said(len(AGAIN)) == []
    state = next(answers)
    assert state[1:] == ["0", "TRUE", "FALSE", "0"] and float(state[0]) == pytest.approx(before, abs=2)
    assert said(1) == []
    assert float(next(answers)[0]) == pytest.approx(before + 10 * 6 * 10, abs=4)
    assert said(2) == [] and np.array_equal(np.load(next(answers)[1]), first)
    assert said(1) == [
        "chipwise: M254: slot 8 was not restored: nothing has been saved there; save a stock with M253 before, or see "
        "[CHIPWISE]STOCK_DIR"
    ]


def test_saved_restored_and_kept(tmp_path):
    """M253, M254 and KEEP_STOCK bring the rotated box back cell by cell, and it is cut on as before."""
    folder = tmp_path / "stock"
    edit = f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#; s#^KEEP_STOCK = .*#KEEP_STOCK = yes#"
    first, back, kept = (str(tmp_path / f"{name}.npy") for name in ("first", "back", "kept"))

    def slot(z):
        return [["mdi", line] for line in ("G0 Z5", "G0 X-6 Y20", f"G0 Z{-z}", "G1 X66 F2000", "G0 Z5")]

    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "G10 L2 P1 X80 Y60 Z0 R33"],
            ["mdi", BOX],
            *slot(2),
            ["map", first],
            ["mdi", "M253 P3"],
            ["mdi", "G10 L2 P1 R0"],
            ["mdi", BOX],
            ["mdi", "M254 P3"],
            ["mdi", "G10 L2 P1 R33"],
            ["map", back],
            *slot(4),
            STATE,
            ["map", kept],
            ["errors"],
        ],
        edit=edit,
    )
    assert np.array_equal(np.load(first), np.load(back)) and answers[-1] == []
    assert float(answers[-3][0]) == pytest.approx(2 * 720, rel=2e-3) and answers[-3][1:] == ["0", "TRUE", "FALSE", "0"]
    again = str(tmp_path / "again.npy")
    answers = operate(
        tmp_path, [["mdi", "T1 M6"], ["map", again], ["mdi", "G10 L2 P1 X80 Y60 Z0 R33"], *slot(6), STATE], edit=edit
    )
    assert np.array_equal(np.load(kept), np.load(again))
    assert float(answers[-1][0]) == pytest.approx(3 * 720, rel=2e-3)
