# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of each tool: figures of a run, and the files that are appended to."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from chipwise.panel import load_log, log_file, operations, tool_log, watch
from support import ROOT
from support.panel_rig import Machine


def pins(**values):
    return {**Machine().values, "motion_type": 2.0, "mode": 1.0, "target": 6000.0, "limited_by": 1.0, **values}


def run_of(*looks, path=""):
    """A log of (dt, values) looks; the first one is the beginning."""
    log = load_log.LoadLog(str(path))
    log.begin("/nowhere/part.ngc", 0.0)
    for dt, values in looks:
        log.look(dt, pins(**values), 0.0)
    return log


def ended(path, *looks, program="part.ngc"):
    """A log that has been written."""
    log = run_of(*looks, path=path)
    log.program = program
    log.end()
    log.write()
    return log


NO_LIMITS = {name: "" for name in (*tool_log.SHARES, *tool_log.WATTS)}
ONE = ((0.1, {}), (0.1, {"removed": 6.0}))  # 6 mm3 in 0.1 s


FIRST = {
    "tool": 3,
    "diameter_mm": 6.0,
    "reference_cm3_min": 6.0,
    "mean_cm3_min": 6.0,
    "peak_cm3_min": 6.099,
    "cutting_s": 10.0,
    "removed_cm3": 1.0,
    "slowed_s": 4.0,
    "over_s": 0.0,
    "limited_by": "ceiling",
    "stops": 0,
    **NO_LIMITS,
}
SECOND = {
    "tool": 5,
    "diameter_mm": 2.0,
    "reference_cm3_min": 2.0,
    "mean_cm3_min": 1.8,
    "peak_cm3_min": 2.3,
    "cutting_s": 1.0,
    "removed_cm3": 0.03,
    "slowed_s": 0.0,
    "over_s": 0.5,
    "limited_by": "nothing",
    "stops": 1,
    **NO_LIMITS,
}


def test_two_tools():
    """Tool 3: 1000 mm3 in 10 s, 4 of them slowed; tool 5: 30 mm3 in 1 s, 0.5 of them above the target, and a stop by a
    guard."""
    removed, looks = 0.0, [(0.1, {"tool": 3.0})]
    for k in range(100):
        removed += 10.0
        looks.append((0.1, {"tool": 3.0, "removed": removed, "mrr": 6000.0 + k, "limited_by": 1.0 if k < 40 else 4.0}))
    looks += [(5.0, {"tool": 5.0, "removed": removed, "motion_type": 1.0})]
    for k in range(10):
        removed += 3.0
        looks.append(
            (
                0.1,
                {
                    "tool": 5.0,
                    "removed": removed,
                    "mrr": 1800.0 if k < 5 else 2300.0,
                    "target": 2000.0,
                    "tool_diameter": 2.0,
                    "limited_by": 0.0,
                },
            )
        )
    looks += [(0.1, {"tool": 5.0, "removed": removed, "guard_reason": 1.0})] * 5
    assert run_of(*looks).tools.rows() == [FIRST, SECOND]


def test_limits_and_power():
    """The largest share of each bound and the mean powers, while it cuts; the sensor's idle power is known from the
    third look on."""
    cut = {
        "power": 200.0,
        "max_power": 500.0,
        "max_chip": 0.05,
        "max_force": 100.0,
        "spindle_load": 0.3,
        "spindle_load_scale": 2000.0,
    }
    looks = [(0.1, {})]
    for k, (chip, force) in enumerate([(0.02, 10.0), (0.049, 20.0), (0.03, 30.0), (0.03, 5.0)]):
        looks.append(
            (
                0.1,
                {
                    **cut,
                    "removed": 6.0 * (k + 1),
                    "mrr": 3600.0,
                    "chip": chip,
                    "force": force,
                    "load_idle": 400.0 if k > 1 else 0.0,
                },
            )
        )
    looks.append((0.1, {**cut, "removed": 24.0, "motion_type": 1.0, "chip": 9.0, "load_idle": 10.0}))  # a traverse
    log = run_of(*looks)
    for row in (log.tools.rows()[0], log.shown()["operations"][0]):
        assert [row[name] for name in (*tool_log.SHARES, *tool_log.WATTS)] == [98.0, 40.0, "", 30.0, 200.0, 200.0]


def test_another_stock_in_the_run_removes_nothing():
    log = run_of((0.1, {"removed": 50.0}), (0.1, {"removed": 60.0}), (0.1, {"removed": 0.0}), (0.1, {"removed": 5.0}))
    assert log.tools.rows()[0]["removed_cm3"] == 0.015


def test_a_tool_that_cuts_nothing_has_no_row():
    assert run_of((0.1, {}), (0.1, {}), (0.1, {"tool": 9.0})).tools.rows() == []


# ---- the files ---------------------------------------------------------------------------------------------------


def table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_files(tmp_path):
    path, strange = tmp_path / "load.csv", '=HYPERLINK("x"),\n"a"'
    ended(path, *ONE, program=strange)
    ended(path, *ONE, (0.1, {"removed": 66.0}))
    first, second = table(path)
    assert tuple(first) == tool_log.COLUMNS and first["program"] == "'" + strange and second["program"] == "part.ngc"
    assert (first["removed_cm3"], second["removed_cm3"], second["complete"]) == ("0.006", "0.066", "yes")
    first, second = table(tmp_path / "load_operations.csv")
    assert tuple(first) == operations.COLUMNS and (first["operation"], first["removed_cm3"], second["removed_cm3"]) == (
        "1",
        "0.006",
        "0.066",
    )
    ended(tmp_path / "none.csv", (0.1, {}))
    assert sorted(os.listdir(tmp_path)) == ["load.csv", "load_operations.csv"]


def test_a_long_file_is_kept_and_a_new_one_begins(tmp_path, monkeypatch):
    monkeypatch.setattr(log_file, "MOST_BYTES", 700)
    path = tmp_path / "load.csv"
    for _ in range(20):
        ended(path, *ONE)
    for name in ("load.csv", "load_operations.csv"):
        assert 0 < len(table(tmp_path / name)) < 20 and len(table(tmp_path / (name + ".old"))) > 1


def test_a_file_of_an_older_chipwise_is_kept_under_another_name(tmp_path):
    path, older = (
        tmp_path / "load.csv",
        ",".join(name for name in tool_log.COLUMNS if name not in (*tool_log.SHARES, *tool_log.WATTS)) + "\r\n1\r\n",
    )
    path.write_text(older, newline="")
    log = ended(path, *ONE)
    assert log.error == "" and (tmp_path / "load.csv.before").read_bytes() == older.encode() and len(table(path)) == 1


@pytest.mark.parametrize(
    "content", [b"a,b\r\n1,2\r\n", b"start,program\r\n", b"\x00" * 9000, b"x", "Größe;1\n".encode("latin-1")]
)
def test_a_file_of_somebody_else_stays_as_it_is(tmp_path, content, monkeypatch):
    monkeypatch.setattr(log_file, "MOST_BYTES", 5000)
    path = tmp_path / "load.csv"
    path.write_bytes(content)
    log = ended(path, *ONE)
    assert (
        path.read_bytes() == content
        and log.error == f"{path}: its first line is not that of this log; correct [CHIPWISE]PANEL_LOG"
    )
    assert len(table(tmp_path / "load_operations.csv")) == 1


def test_a_line_without_its_end(tmp_path):
    """A power cut leaves half a row: the next one is whole."""
    path = tmp_path / "load.csv"
    ended(path, *ONE)
    path.write_bytes(path.read_bytes()[:-9])
    ended(path, *ONE)
    assert [row["removed_cm3"] for row in table(path)] == ["0.006", "0.006"] and table(path)[1]["complete"] == "yes"


def test_a_file_with_other_line_ends(tmp_path):
    """As an editor may leave them."""
    path = tmp_path / "load.csv"
    ended(path, *ONE)
    path.write_bytes(path.read_bytes().replace(b"\r\n", b"\n"))
    assert ended(path, *ONE).error == "" and len(table(path)) == 2


def test_a_row_that_does_not_fit_is_taken_back(tmp_path, monkeypatch):
    path, write = tmp_path / "load.csv", os.write
    ended(path, *ONE)
    before = path.read_bytes()
    monkeypatch.setattr(os, "write", lambda handle, data: write(handle, data[:7]))
    log = run_of(*ONE, path=path)
    log.end()
    log.write()
    assert path.read_bytes() == before and "No space left on device; correct" in log.error


@pytest.mark.parametrize(
    "make", [lambda path: path.mkdir(), lambda path: os.mkfifo(path), lambda path: path.symlink_to("/nowhere/x")]
)
def test_a_file_that_cannot_be_written(tmp_path, make):
    """The page says so, and the looks go on; a pipe without a reader holds nothing up."""
    path = tmp_path / "load.csv"
    make(path)
    machine = Machine()
    watching = watch.Watch(machine, str(path))
    machine.values.update(motion_type=2.0, removed=0.0)
    machine.tasks["running"] = True
    watching.look()
    machine.values["removed"] = 60.0
    watching.look()
    assert json.loads(watching.text)["tools"][0]["removed_cm3"] == 0.06
    machine.tasks["running"] = False
    watching.look()
    state = json.loads(watching.text)
    assert state["log_error"].startswith(f"{path}: ") and state["tools"][0]["removed_cm3"] == 0.06


def test_the_end_of_a_program_writes_it(tmp_path):
    machine = Machine()
    watching = watch.Watch(machine, str(tmp_path / "load.csv"))
    for running in (True, False, True, False):
        machine.tasks["running"] = running
        machine.values.update(motion_type=2.0)
        watching.look()
        machine.values["removed"] += 60.0
        watching.look()
    assert [row["program"] for row in table(tmp_path / "load.csv")] == ["part.ngc"] * 2
    assert json.loads(watching.text)["log_error"] == "" and not (tmp_path / "load.csv.running").exists()


def test_the_time_is_that_of_the_servo_thread(tmp_path):
    """A simulation that was late makes up for it: 2 s of cutting between two looks a moment apart, then another run."""
    machine = Machine()
    watching = watch.Watch(machine, str(tmp_path / "load.csv"))
    machine.tasks["running"] = True
    machine.values.update(motion_type=2.0, mrr=6000.0, run_time=1.0)
    watching.look()
    machine.values.update(removed=200.0, run_time=3.0)
    watching.look()
    (use,) = json.loads(watching.text)["tools"]
    assert use["mean_cm3_min"] == pytest.approx(6, rel=0.01) and use["cutting_s"] == 2
    assert watching.passed(9.0, {"run_time": 0.5}) == 0.5 and watching.passed(9.0, {"run_time": 0.25}) == 0.25
    assert watching.passed(9.0, {"run_time": 0.0}) == 0 and watching.passed(9.0, {"run_time": float("nan")}) == 9


def test_linuxcnc_that_ends_in_a_program(tmp_path):
    machine = Machine()
    watching = watch.Watch(machine, str(tmp_path / "load.csv"))
    machine.tasks["running"] = True
    machine.values.update(motion_type=2.0)
    watching.look()
    machine.values["removed"] += 60.0
    watching.look()
    watching.close()
    for name in ("load.csv", "load_operations.csv"):
        (row,) = table(tmp_path / name)
        assert row["complete"] == "no"


# ---- a server that is killed -----------------------------------------------------------------------------------


def test_what_was_running_is_added_by_the_next_server(tmp_path, monkeypatch):
    monkeypatch.setattr(load_log, "RUNNING_S", 0.0)
    path = tmp_path / "load.csv"
    log = run_of(*ONE, path=path)
    log.write()
    log.look(0.1, pins(removed=12.0, mode=2.0), 0.0)  # another operation; the first one is in the file from now on
    log.write()
    del log  # killed
    load_log.LoadLog(str(path))
    (tool,) = table(path)
    assert (tool["removed_cm3"], tool["complete"]) == ("0.012", "no")
    assert [
        (row["operation"], row["removed_cm3"], row["complete"]) for row in table(tmp_path / "load_operations.csv")
    ] == [("1", "0.006", "yes"), ("2", "0.006", "no")]
    load_log.LoadLog(str(path))
    assert len(table(path)) == 1


def test_the_running_file_is_written_seldom(tmp_path, monkeypatch):
    """300 operations in 30 s: every 10 s, and once more when the operation that it has has ended, so that it is nowhere
    twice."""
    path, clock, writes = tmp_path / "load.csv", [1000.0], []
    monkeypatch.setattr(load_log.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(log_file, "keep_running", lambda _path, parts: writes.append(parts[1]))
    log = load_log.LoadLog(str(path))
    log.begin("part.ngc", 0.0)
    for k in range(300):
        clock[0] += 0.1
        log.look(0.1, pins(removed=10.0 * k, tool=float(1 + k % 2)), 0.0)
        log.write()
    assert 4 <= len(writes) <= 8 and [] in writes
    assert len(table(tmp_path / "load_operations.csv")) == 298


@pytest.mark.parametrize(
    "content", [b"", b"{", b"\xff", b"[]", b"[[], [], []]", b'[[{"x": 1}], []]', b"[1, 2]", b"[" * 100000], ids=range(8)
)
def test_a_running_file_that_is_damaged(tmp_path, content):
    path = tmp_path / "load.csv"
    (tmp_path / "load.csv.running").write_bytes(content)
    assert load_log.LoadLog(str(path)).error.startswith(f"{path}.running: it is not what the panel has kept")
    assert ended(path, *ONE).tools.rows() and len(table(path)) == 1


WRITER = """
import sys, time
from chipwise.panel import load_log
from support.panel_rig import Machine
load_log.RUNNING_S, path, removed = 0.0, sys.argv[1], 0.0
values = {**Machine().values, "motion_type": 2.0, "mode": 1.0, "target": 6000.0, "mrr": 6000.0}
log = load_log.LoadLog(path)
for number in range(10 ** 9):
    log.begin("part.ngc", float(number))
    for k in range(7):
        removed += 10.0
        log.look(0.1, {**values, "removed": removed, "tool": 1.0 + k // 4, "line": float(k)}, float(number))
        log.write()
    log.end()
    log.write()
    print(number, flush=True)
"""


def test_killed_at_any_moment(tmp_path):
    """Each line of the files is whole, and no program that has ended is lost; twice there at most the one that was
    being written."""
    path, env = tmp_path / "load.csv", {**os.environ, "PYTHONPATH": f"{ROOT / 'remap'}:{ROOT / 'tests'}"}
    for _ in range(4):
        writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], env=env, stdout=subprocess.PIPE)
        said = [writer.stdout.readline() for _ in range(5)]
        time.sleep(0.0317)
        writer.send_signal(signal.SIGKILL)
        rest = writer.communicate()[0].split(b"\n")[:-1]
        last = int((rest or said)[-1])
        load_log.LoadLog(str(path))
        starts = [(row["start"], row["tool"]) for row in table(path) if row["complete"] == "yes"]
        for number in range(last + 1):
            assert (load_log.moment_text(number), "1") in starts and (load_log.moment_text(number), "2") in starts
        assert len(starts) - len(set(starts)) <= 2
        for name, columns in (("load.csv", tool_log.COLUMNS), ("load_operations.csv", operations.COLUMNS)):
            for row in table(tmp_path / name):
                assert tuple(row) == columns and None not in row.values() and row["complete"] in ("yes", "no")
        for name in ("load.csv", "load_operations.csv"):
            (tmp_path / name).unlink()
