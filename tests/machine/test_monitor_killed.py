# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise-monitor killed (-9) at the worst moments, with a map of 64 MB: old files stay whole, no stock is said to be
known that is not, the machine goes at F, and a monitor started again takes over."""

import os
import re

import pytest

from support.operate import CELL_MM, OWN_PATIENCE, operate

pytestmark = pytest.mark.machine

# 3200 x 2500 cells of 8 bytes
LARGE = "s#^CELL = .*#CELL = 0.1#; s#^MAP_SIZE = .*#MAP_SIZE = 320 250#"
BOX = "M250 P0 Q0 R-10 I320 J250 K10"
CUT = [["mdi", "G0 X-5 Y20"], ["mdi", "G0 Z-2"], ["mdi", "G1 X30 F3000"], ["mdi", "G0 Z5"]]
MORE = [["mdi", "G0 X-5 Y30"], ["mdi", "G0 Z-4"], ["mdi", "G1 X30"], ["mdi", "G0 Z5"]]
STATE = [
    "pins",
    "stock-tracker.0.stock-defined",
    "stock-tracker.0.ready",
    "stock-tracker.0.held",
    "stock-tracker.0.fault-code",
]
FAULT = "stock-tracker.0.fault-code"
HEIR = "chipwise-monitor-2"
DEAD = "chipwise: chipwise-monitor does not answer"  # from the stock tracker, behind a step watch_monitor


def large_machine(tmp_path):
    """(sed command, folder of the stock files)."""
    folder = tmp_path / "stock"
    return f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#; {LARGE}", folder


def run(tmp_path, *parts, **options):
    """The steps of all parts in one LinuxCNC; -> the answers part by part."""
    answers = iter(operate(tmp_path, [step for part in parts for step in part], **options))
    return [[next(answers) for _step in part] for part in parts]


def test_killed_while_saving(tmp_path):
    """The old file stays as it was; a monitor started again does what is still asked for."""
    edit, folder = large_machine(tmp_path)
    _start, (saved, first), _more, (_killed, state), _heir, (waited, second), (back, third, tool) = run(
        tmp_path,
        [["mdi", "T1 M6"], ["mdi", BOX], *CUT],
        [["mdi", "M253 P1"], ["map_sum"]],
        MORE,
        [["kill_monitor_in", "M253 P1", str(folder), 0.2], STATE],
        [["start_monitor"]],
        [["mdi_end"], ["map_sum"]],
        [["mdi", "M254 P1"], ["map_sum"], ["mdi", "T2 M6"]],
        edit=edit,
    )
    assert saved == []
    assert (state[0], state[2], state[3]) == ("TRUE", "FALSE", "0"), "saving touches no stock"
    assert waited == [], "the request was still there for the new monitor"
    assert second[1] > first[1] and back == [] and third == second and tool == []
    names = sorted(os.listdir(folder))
    assert "slot1.stock" in names and len(names) <= 2, names


def _restoring():
    """Steps of run(): killed under hold, a feed move, M251, the next monitor, the slot again."""
    feed = ["over", 0.4, "motion.current-vel", "volumetric-feed.0.limited-by"]
    return (
        [["mdi", "T1 M6"], ["mdi", BOX], *CUT],
        [["mdi", "M253 P1"], ["map_sum"]],
        [["mdi", "F300"], ["mdi", "M251 Q6 P2 E3000"]],
        [
            ["hal", "unlinkp", "chipwise-monitor.held"],
            ["kill_monitor_in", "M254 P1", "hold", 0.02],
            ["until", "stock-tracker.0.held", "=", 1],  # a busy computer may not have run the servo thread yet
            STATE,
            ["watch_monitor"],
            ["until", FAULT, "=", 16],
            ["mdi_end"],
        ],
        [
            ["mdi", "F300"],
            ["start", "G90 G0 X-10 Y60 Z30\nG1 X30\nM2\n"],
            ["until", "motion.motion-type", ">", 1.5],
            ["until", "axis.x.pos-cmd", ">", 0],
            feed,
            ["finish"],
        ],
        [["mdi", "M251 Q6 P1"], ["mdi", "M250 P0 Q0 R-10 I30 J30 K10"]],
        [
            ["hal", "net", "chipwise-held", "chipwise-monitor.held"],
            ["start_monitor"],
            ["until", FAULT, "=", 4],
            STATE,
            ["errors", "no longer valid"],
        ],
        [["mdi", "M254 P1"], ["map_sum"], STATE, ["pins", HEIR + ".tool-number", HEIR + ".hold"]],
    )


def test_killed_while_restoring(tmp_path):
    """hold stays TRUE: no stock is known, M254 says so, F counts, M251 refuses; the next monitor lets go and M254
    works.

    The monitor does not hear the tracker's answer, so that it waits under hold and is surely killed there; the map half
    written is tests/core/test_hold.c's."""
    edit, _folder = large_machine(tmp_path)
    (
        _start,
        (_saved, first),
        _on,
        (_deaf, _killed, _held, state, _watch, _silent, said),
        fed,
        refused,
        (_net, _heir, _wait, after, message),
        (restored, second, last, cut),
    ) = run(tmp_path, *_restoring(), edit=edit, before=OWN_PATIENCE)
    assert state == ["FALSE", "FALSE", "TRUE", "0"]
    refusal, dead = sorted(said)
    assert dead.startswith(DEAD)
    assert refusal.startswith("chipwise: M254: slot 1 was not restored: chipwise-monitor gave no answer")
    velocity, limited_by = fed[4]
    assert velocity == pytest.approx([5.0, 5.0], rel=1e-3) and limited_by == [5, 5] and fed[5] == []
    assert refused[0] == [
        "chipwise: M251: the tool in the spindle is not known: chipwise-monitor does not answer; start `chipwise "
        "monitor` in a shell"
    ]
    assert len(refused[1]) == 1 and "start `chipwise monitor` again" in refused[1][0]
    assert after[2] == "FALSE" and (after[0], after[3]) == ("FALSE", "4")
    assert any("no longer valid" in text for text in message), message
    assert restored == [] and second == first and last == ["TRUE", "TRUE", "FALSE", "0"]
    assert cut == ["1", "FALSE"]


def test_killed_before_it_writes_and_the_machine_goes_on(tmp_path):
    """A cut under hold is in no map: no stock is known afterwards, although the map was never touched."""
    edit, _folder = large_machine(tmp_path)
    *_, held, _cut, _let_go, _heir, _wait, state, said, again = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"],
            ["kill_monitor"],
            ["hal", "unlinkp", "stock-tracker.0.hold"],
            ["hal", "setp", "stock-tracker.0.hold", "1"],
            ["mdi", "G0 X-5 Y20"],
            ["mdi", "G0 Z-2"],
            STATE,
            ["mdi", "G1 X30 F3000"],
            ["hal", "setp", "stock-tracker.0.hold", "0"],
            ["start_monitor"],
            ["until", FAULT, "=", 4],
            STATE,
            ["errors", "no longer valid"],
            ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"],
        ],
        edit=edit,
    )
    assert held[2] == "TRUE" and state == ["FALSE", "FALSE", "FALSE", "4"]
    assert said == [text for text in said if "no longer valid" in text] and again == []


def test_with_keep_stock_a_dead_monitor_keeps_nothing_old(tmp_path):
    """Session 1 keeps its stock; in session 2 the monitor dies, another takes over and does not bring the old stock
    back; in session 3 the monitor dies for good: session 4 has the stock as it was saved last, with more material than
    is there, and says so.  In session 4 a new stock is defined without a monitor: session 5 knows none rather than the
    old one."""
    folder = tmp_path / "stock"
    edit = f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#; s#^KEEP_STOCK = .*#KEEP_STOCK = yes#"
    operate(tmp_path, [["mdi", "T1 M6"], ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"], *CUT], edit=edit)
    first, *_, second, last = operate(
        tmp_path,
        [
            ["map_sum"],
            ["mdi", "T1 M6"],
            ["mdi", "F3000"],
            *MORE,
            ["kill_monitor"],
            ["start_monitor"],
            ["map_sum"],
            STATE,
        ],
        edit=edit,
    )
    assert last[0] == "TRUE" and second[1] > first[1]
    third, *_ = operate(tmp_path, [["map_sum"], ["mdi", "T1 M6"], ["kill_monitor"], *CUT], edit=edit)
    assert third == second
    fourth, state, said, *_ = operate(
        tmp_path, [["map_sum"], STATE, ["errors"], ["kill_monitor"], ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"]], edit=edit
    )
    assert fourth == third and state[0] == "TRUE" and len(said) == 1
    assert said[0].startswith(
        "chipwise: LinuxCNC did not end in order (power loss, crash): the stock is as saved "
    ) and said[0].endswith("or use M250"), said
    state, said = operate(tmp_path, [STATE, ["errors"]], edit=edit)
    assert state[0] == "FALSE" and len(said) == 1 and "the stock of the last run is not known" in said[0], said


def test_what_was_cut_is_saved_while_the_machine_works(tmp_path):
    """Killed some time after a cut: the next session has the cut; what is cut afterwards is missing in it."""
    folder = tmp_path / "stock"
    edit = f"s#^STOCK_DIR = .*#STOCK_DIR = {folder}#; s#^KEEP_STOCK = .*#KEEP_STOCK = yes#"
    *_, first, _killed, _f, _to, _down, _on, _up = operate(
        tmp_path,
        [
            ["mdi", "T1 M6"],
            ["mdi", "M250 P0 Q0 R-10 I60 J40 K10"],
            *CUT,
            ["kept", f"{folder}/kept.journal"],
            ["map_sum"],
            ["kill_monitor"],
            ["mdi", "F3000"],
            *MORE,
        ],
        edit=edit,
    )
    second, said, other = operate(tmp_path, [["map_sum"], ["errors"], ["mdi", "T1 M6"]], edit=edit)
    assert second == first and first[1] > 300 and len(said) == 1, said
    (tip,) = re.findall(r"tip X(\S+) Y20\.000 Z", said[0])
    assert 30 - 2 * CELL_MM < float(tip) <= 30, said  # where it was when the last cell was cut
    third, said = operate(tmp_path, [["map_sum"], ["errors"]], edit=edit)
    assert third == first and said == [] and other == []
