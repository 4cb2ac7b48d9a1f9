# SPDX-License-Identifier: GPL-2.0-or-later
"""M253, M254, KEEP_STOCK, run from line and abort on a running LinuxCNC: the stock is what the machine made of it."""

import hashlib
import os
import shutil
import struct
import zlib

import numpy as np
import pytest

from chipwise.stock import store
from support.operate import CELL_MM, operate

pytestmark = pytest.mark.machine

KEPT = ["kept.stock", "kept.stock.note"]
BOX = "M250 P0 Q0 R-10 I60 J40 K10"
CUT = [["mdi", "G0 X-5 Y20"], ["mdi", "G0 Z-2"], ["mdi", "G1 X30 F2000"], ["mdi", "G0 Z5"]]
STATE = ["pins", "stock-tracker.0.stock-defined", "stock-tracker.0.removed-volume", "stock-tracker.0.fault-code"]
VOLUME = 30 * 6 * 2 + 0.5 * np.pi * 9 * 2


def files(tmp_path):
    """(sed command, folder) for a STOCK_DIR of the test's own."""
    folder = tmp_path / "stock"
    return f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#", folder


def test_save_and_restore(tmp_path):
    """Cut, save, cut on, restore: the map is cell by cell what was saved; a cut goes on from there."""
    edit, folder = files(tmp_path)
    first, back = str(tmp_path / "first.npy"), str(tmp_path / "back.npy")
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            *CUT,
            ["map", first],
            ["mdi", "M253 P3"],
            ["mdi", "G0 X-5 Y5"],
            ["mdi", "G0 Z-8"],
            ["mdi", "G1 X70 F4000"],
            ["mdi", "G0 Z5"],
            STATE,
            ["mdi", "M254 P3"],
            ["map", back],
            STATE,
            ["mdi", "G0 X30 Y20"],
            ["mdi", "G0 Z-2"],
            ["mdi", "G1 X40"],
            STATE,
        ],
        edit=edit,
    )
    assert [a for a in answers[:8] if a and a is not answers[6]] == [] and answers[13] == []
    more, _restore, removed, restored, *_moves, last = answers[12:]
    assert float(more[1]) > VOLUME + 1000
    assert removed[0] == pytest.approx(VOLUME, rel=0.003)
    assert restored[0] == "TRUE" and restored[2] == "0"
    assert float(restored[1]) == pytest.approx(removed[0], rel=1e-6)
    assert np.array_equal(np.load(first), np.load(back))
    assert float(last[1]) == pytest.approx(VOLUME + 10 * 6 * 2, rel=0.003)
    assert sorted(os.listdir(folder)) == ["slot3.stock"]


def damaged(tmp_path, change):
    """A slot saved by LinuxCNC, changed; -> what M254 says of it and the state before and after."""
    edit, folder = files(tmp_path)
    operate(tmp_path, [["mdi", "T1 M6"], ["mdi", BOX], *CUT, ["mdi", "M253 P0"]], edit=edit)
    path = folder / "slot0.stock"
    path.write_bytes(change(path.read_bytes()))
    answers = operate(tmp_path, [["mdi", "M250 P5 Q5 R-4 I20 J20 K4"], STATE, ["mdi", "M254 P0"], STATE], edit=edit)
    return answers[2], answers[1], answers[3]


@pytest.mark.parametrize(
    "what, change",
    [
        ("cut off", lambda data: data[: len(data) // 2]),
        ("a bit", lambda data: data[:900] + bytes([data[900] ^ 1]) + data[901:]),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, what, change):
    said, before, after = damaged(tmp_path, change)
    assert said == [
        "chipwise: M254: slot 0 was not restored: the file is damaged or none of chipwise's; delete it and save again"
    ]
    assert before == after and after[0] == "TRUE"


def test_refusals(tmp_path):
    edit, folder = files(tmp_path)
    folder.write_text("no folder")
    answers = operate(
        tmp_path,
        [
            ["mdi", line]
            for line in ("M253", "M254 P10", "M253 P1.5", "M253 P1 Q2", "M253 P1", "M254 P1", BOX, "M253 P1")
        ],
        edit=edit,
    )
    assert answers == [
        [text] if text else []
        for text in (
            "chipwise: M253: word P (slot) is missing; add P0 to P9",
            "chipwise: M254: slot P10 is not from 0 to 9; use P0 to P9",
            "chipwise: M253: slot P1.5 is not from 0 to 9; use P0 to P9",
            "chipwise: M253: word Q is not used here; words are P F",
            "chipwise: M253: slot 1 was not saved: no stock is defined; define it with M250 before",
            "chipwise: M254: slot 1 was not restored: the file cannot be read or written; see the message in the log, "
            "[CHIPWISE]STOCK_DIR, and room on the disk",
            "",
            "chipwise: M253: slot 1 was not saved: the file cannot be read or written; see the message in the log, "
            "[CHIPWISE]STOCK_DIR, and room on the disk",
        )
    ]


MORE_CELLS = "the stock in the file has more cells than the map; enlarge [CHIPWISE]MAP_SIZE, or use a smaller CELL"
COARSE = "s#^CELL = .*#CELL = 4#; s#^FINEST_CELL = .*#FINEST_CELL = 4#"


def test_a_file_of_another_map(tmp_path):
    """It keeps its own cells where there is room for them, and is refused otherwise."""
    edit, _folder = files(tmp_path)
    first, back = str(tmp_path / "first.npy"), str(tmp_path / "back.npy")
    operate(tmp_path, [["mdi", "T1 M6"], ["mdi", BOX], *CUT, ["map", first], ["mdi", "M253 P0"]], edit=edit)
    answers = operate(
        tmp_path,
        [["mdi", "M254 P0"], STATE, ["map", back]],
        edit=edit + "; s#^CELL = .*#CELL = 0.2#; s#^FINEST_CELL = .*#FINEST_CELL = 0.2#",
    )
    assert answers[0] == [] and answers[1][0] == "TRUE" and np.array_equal(np.load(first), np.load(back))
    for change in (COARSE, "s#^MAP_SIZE = .*#MAP_SIZE = 50 40#"):
        answers = operate(tmp_path, [["mdi", "M254 P0"], STATE], edit=edit + "; " + change)
        assert answers[0] == ["chipwise: M254: slot 0 was not restored: " + MORE_CELLS]
        assert answers[1][0] == "FALSE"


def test_the_monitor_gone_is_said(tmp_path):
    """M253 without a monitor: a message within its time, the machine usable."""
    edit, _folder = files(tmp_path)
    answers = operate(
        tmp_path, [["mdi", BOX], ["kill_monitor"], ["mdi", "M253 P0"], ["mdi", "G0 X5"], ["position"]], edit=edit
    )
    (said,) = answers[2]
    assert said.startswith("chipwise: M253: slot 0 was not saved: chipwise-monitor gave no answer within 30 s; load")
    assert answers[3] == [] and answers[4][0] == pytest.approx(5)


def test_the_stock_outlives_linuxcnc(tmp_path):
    edit, folder = files(tmp_path)
    edit += "; s#^KEEP_STOCK = .*#KEEP_STOCK = yes#"
    first, back = str(tmp_path / "first.npy"), str(tmp_path / "back.npy")
    operate(tmp_path, [["mdi", "T1 M6"], ["mdi", BOX], *CUT, ["map", first]], edit=edit)
    assert sorted(os.listdir(folder)) == KEPT, (tmp_path / "linuxcnc.txt").read_text()[-1500:]
    answers = operate(tmp_path, [["map", back], STATE, ["errors"]], edit=edit)
    assert np.array_equal(np.load(first), np.load(back)) and answers[1][0] == "TRUE" and answers[2] == []
    for home, left in ((False, KEPT), (True, [])):  # the file stays until the machine has been switched on
        answers = operate(tmp_path, [["errors", "KEEP_STOCK"], STATE], edit=edit + "; " + COARSE, home=home)
        assert answers[0] == [
            "chipwise: the stock of the last run was not restored ([CHIPWISE]KEEP_STOCK): "
            + MORE_CELLS
            + ", before you switch the machine on"
        ]
        assert answers[1][0] == "FALSE" and sorted(os.listdir(folder)) == left
    shutil.rmtree(folder)
    answers = operate(tmp_path, [["errors"], STATE], edit=edit)
    assert answers == [[], ["FALSE", "0", "0"]]


def test_without_keep_stock_nothing_is_kept(tmp_path):
    edit, folder = files(tmp_path)
    operate(tmp_path, [["mdi", BOX]], edit=edit)
    assert not folder.exists()


# --- run from line, abort -----------------------------------------------------------------------------------------

PROGRAM = """G21 G90 G17 G40 G64 P0.01
T1 M6
G0 Z5
F1500
M251 Q30 P2 E3000
G0 X-10 Y10
G0 Z-2
G1 X70
G0 Z5
G0 X-10 Y30
G0 Z-2
G1 X70
G0 Z5
M252
M2
"""
FEED = ["pins", "volumetric-feed.0.mode", "motion.requested-vel", "motion.analog-out-02"]


def slot_heights(path, y):
    """Heights along the middle of a slot at y (mm), whole cells of the box of BOX."""
    return np.load(path)[int(y / CELL_MM), : int(60 / CELL_MM)]


def check_cut_up_to(path, y, x, depth):
    """The slot at y ends at the tool's edge, x + 3 mm: cut before it, untouched behind."""
    row = slot_heights(path, y)
    centres = (np.arange(len(row)) + 0.5) * CELL_MM
    wrong = (np.abs(row + depth) > 1e-3) & (centres < x + 2.5) | (np.abs(row) > 1e-3) & (centres > x + 3.5)
    assert not wrong.any(), f"slot at y {y:g}: {wrong.sum()} cells are not as the machine left them, allowed: 0"


def test_run_from_line(tmp_path):
    """From the second slot on: the first is not cut, mode and F are as before (the skipped M251 did nothing)."""
    program, seen = tmp_path / "two.ngc", str(tmp_path / "map.npy")
    program.write_text(PROGRAM)
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            ["mdi", "F1500"],
            ["open", str(program)],
            ["run_until_stopped", 60, 10],
            FEED,
            ["map", seen],
            ["errors"],
            ["mdi", "G1 X60 F600"],
            ["pins", "motion.analog-out-02"],
        ],
    )
    print(answers)
    assert answers[4] is False and answers[7] == []
    assert answers[5][0] == "0" and float(answers[5][2]) == 0
    assert np.abs(slot_heights(seen, 10)).max() < 1e-3
    check_cut_up_to(seen, 30, 70, 2.0)
    assert float(answers[9][0]) == 0


def test_abort_in_the_middle(tmp_path):
    """Abort in a cut under M251 P2: the stock ends where the tool stood; the program runs again and to its end."""
    program, seen, end = tmp_path / "two.ngc", str(tmp_path / "map.npy"), str(tmp_path / "end.npy")
    program.write_text(PROGRAM)
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            ["open", str(program)],
            ["run_until", 0, 25],
            ["abort"],
            ["position"],
            ["map", seen],
            FEED,
            ["mdi", "G0 Z5"],
            ["open", str(program)],
            ["run_until_stopped", 60],
            ["map", end],
            ["errors"],
            FEED,
        ],
    )
    position = answers[5]
    check_cut_up_to(seen, 10, position[0], 2.0)
    assert np.abs(slot_heights(seen, 30)).max() < 1e-3
    assert answers[10] is False and answers[12] == []
    check_cut_up_to(end, 10, 70, 2.0)
    check_cut_up_to(end, 30, 70, 2.0)
    assert answers[13][0] == "0" and float(answers[13][2]) == 0
    with pytest.raises(AssertionError, match="allowed: 0"):  # the checker can fail
        check_cut_up_to(seen, 10, position[0] + 5, 2.0)


# --- cylinder and allowance ----------------------------------------------------------------------------------------


def test_cylinder_and_allowance(tmp_path):
    """The comment's cylinder, its volume exact; the allowance makes sides and top larger, not the bottom."""
    program = tmp_path / "cylinder.ngc"
    text = "(WORKPIECE,CYLINDER,AXIS=Z,X=60,Y=40,ZMIN=-20,ZMAX=0,DIAMETER=50)\nG21 G90\nM250\nM2\n"
    program.write_text(text)
    larger = tmp_path / "larger.ngc"
    larger.write_text(text.replace("M250", "#<_chipwise_allowance> = 2\nM250"))
    seen, grown = str(tmp_path / "map.npy"), str(tmp_path / "grown.npy")
    box = [
        "pins",
        *(f"stock-tracker.0.{end}-{axis}" for end in ("min", "max") for axis in "xyz"),
        "stock-tracker.0.shape",
    ]
    answers = operate(
        tmp_path,
        [
            ["mdi", "G10 L2 P1 X0 Y0 Z0 R30"],
            ["open", str(program)],
            ["run_until_stopped", 20],
            box,
            ["map", seen],
            ["mdi", "G0 Z5"],
            ["open", str(larger)],
            ["run_until_stopped", 20],
            box,
            ["map", grown],
            ["mdi", BOX],
            box,
        ],
    )
    for path, radius, top in ((seen, 25, 0.0), (grown, 27, 2.0)):
        assert (np.load(path) + 20).sum() * CELL_MM**2 == pytest.approx(np.pi * radius**2 * (20 + top), rel=1e-5)
    low = np.array([float(v) for v in answers[3][:3]])
    assert [float(v) for v in answers[8][:3]] == pytest.approx(list(low - [2, 2, 0]), abs=1e-5)
    assert answers[3][6] == answers[8][6] == "1" and answers[11][6] == "0"


def with_head(text):
    """A stock file with a right checksum and this head."""
    body = store.MARK + struct.pack("<I", len(text)) + text + zlib.compress(b"\0" * 80)
    return body + hashlib.sha256(body).digest()


def test_hostile_files_on_the_machine(tmp_path):
    """A head that is a list, a number no float holds, 1.0 for a whole number, a FIFO, a device, a folder; a FIFO for
    the tools: each refused at once, the monitor lives on, the stock is what it was, and saving goes on beside a folder
    that looks like remains."""
    edit, folder = files(tmp_path)
    folder.mkdir()
    good = (b'{"version": %d, ' % store.VERSION) + (
        b'"cell": %s, "low": [0, 0, -10], "high": [1, 1, 0], "shape": %s, "nx": 4, "ny": 4, '
        b'"removed": 0, "half": [0.5, 0.5], "turn": 0}'
    )
    (folder / "slot0.stock").write_bytes(with_head(b"[1]"))
    (folder / "slot1.stock").write_bytes(with_head(good % (b"1" + b"0" * 400, b"0")))
    (folder / "slot2.stock").write_bytes(with_head(good % (b"0.25", b"1.0")))
    os.mkfifo(folder / "slot3.stock")
    (folder / "slot4.stock").symlink_to("/dev/zero")
    (folder / "slot5.stock").mkdir()
    (folder / "slot6.stock.x.new").mkdir()
    os.mkfifo(tmp_path / "tools.toml")
    restores = [["mdi", f"M254 P{slot}"] for slot in range(6)]
    answers = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", BOX],
            *CUT,
            STATE,
            *restores,
            STATE,
            ["mdi", "M253 P6"],
            ["mdi", "M254 P6"],
            ["pins", "chipwise-monitor.reply", "chipwise-monitor.hold", "chipwise-monitor.heartbeat"],
            ["messages"],
            ["pins", "chipwise-monitor.heartbeat"],
        ],
        edit=f"{edit}; s#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {tmp_path}/tools.toml#",
    )
    told, before, refused, after = answers[0], answers[6], answers[7:13], answers[13]
    assert len(told) == 1 and "tools.toml: cannot be read: it is not a regular file" in told[0], told
    for slot, said in enumerate(refused):
        assert len(said) == 1 and said[0].startswith(f"chipwise: M254: slot {slot} was not restored: the file "), said
    assert before == after and before[0] == "TRUE", "the stock is what it was"
    assert answers[14] == [] and answers[15] == []
    assert answers[16][:2] == ["0", "FALSE"] and int(answers[18][0]) > int(answers[16][2])
