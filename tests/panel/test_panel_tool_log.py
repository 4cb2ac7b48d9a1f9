# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of each tool: figures of a run, and the file that is appended to at its end."""

import csv
import json
import os

import pytest

from chipwise.panel import tool_log, watch
from support.panel_rig import Machine


def pins(**values):
    return {**Machine().values, "motion_type": 2.0, "mode": 1.0, "target": 6000.0, "limited_by": 1.0, **values}


def run_of(*looks):
    """A log of (dt, values) looks; the first one is the beginning."""
    log = tool_log.ToolLog("part.ngc", 0.0)
    for dt, values in looks:
        log.look(dt, pins(**values))
    return log


def test_two_tools():
    """Tool 3: 1000 mm3 in 10 s, 4 of them slowed; tool 5: 30 mm3 in 1 s, and a stop by a guard."""
    removed, looks = 0.0, [(0.1, {"tool": 3.0})]
    for k in range(100):
        removed += 10.0
        looks.append((0.1, {"tool": 3.0, "removed": removed, "mrr": 6000.0 + k, "limited_by": 1.0 if k < 40 else 4.0}))
    looks += [(5.0, {"tool": 5.0, "removed": removed, "motion_type": 1.0})]
    for k in range(10):
        removed += 3.0
        looks.append((0.1, {"tool": 5.0, "removed": removed, "mrr": 1800.0, "target": 2000.0, "tool_diameter": 2.0, "limited_by": 0.0}))
    looks += [(0.1, {"tool": 5.0, "removed": removed, "guard_reason": 1.0})] * 5
    first, second = run_of(*looks).rows()
    assert first == {"tool": 3, "diameter_mm": 6.0, "reference_cm3_min": 6.0, "mean_cm3_min": 6.0, "peak_cm3_min": 6.099,
                     "cutting_s": 10.0, "removed_cm3": 1.0, "slowed_s": 4.0, "stops": 0}
    assert second == {"tool": 5, "diameter_mm": 2.0, "reference_cm3_min": 2.0, "mean_cm3_min": 1.8, "peak_cm3_min": 1.8,
                      "cutting_s": 1.0, "removed_cm3": 0.03, "slowed_s": 0.0, "stops": 1}


def test_another_stock_in_the_run_removes_nothing():
    log = run_of((0.1, {"removed": 50.0}), (0.1, {"removed": 60.0}), (0.1, {"removed": 0.0}), (0.1, {"removed": 5.0}))
    assert log.rows()[0]["removed_cm3"] == 0.015


def test_a_tool_that_cuts_nothing_has_no_row():
    assert run_of((0.1, {}), (0.1, {}), (0.1, {"tool": 9.0})).rows() == []


def table(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_file(tmp_path):
    path = tmp_path / "load.csv"
    log = run_of((0.1, {}), (0.1, {"removed": 60.0}))
    log.program = '=HYPERLINK("x"),\n"a"'
    tool_log.append(str(path), log)
    tool_log.append(str(path), run_of((0.1, {}), (0.1, {"removed": 6.0})))
    first, second = table(path)
    assert tuple(first) == tool_log.COLUMNS and first["program"] == "'" + log.program and second["program"] == "part.ngc"
    assert (first["removed_cm3"], second["removed_cm3"]) == ("0.06", "0.006")
    tool_log.append(str(tmp_path / "none.csv"), run_of((0.1, {})))
    assert not (tmp_path / "none.csv").exists()


def test_a_long_file_is_kept_and_a_new_one_begins(tmp_path, monkeypatch):
    monkeypatch.setattr(tool_log, "MOST_BYTES", 300)
    path = tmp_path / "load.csv"
    for _ in range(20):
        tool_log.append(str(path), run_of((0.1, {}), (0.1, {"removed": 6.0})))
    assert len(table(path)) < 20 and len(table(str(path) + ".old")) > 1


@pytest.mark.parametrize("make", [lambda path: path.mkdir(), lambda path: os.mkfifo(path), lambda path: path.symlink_to("/nowhere/x")])
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
    assert json.loads(watching.text)["log_error"] == ""


def test_linuxcnc_that_ends_in_a_program(tmp_path):
    machine = Machine()
    watching = watch.Watch(machine, str(tmp_path / "load.csv"))
    machine.tasks["running"] = True
    machine.values.update(motion_type=2.0)
    watching.look()
    machine.values["removed"] += 60.0
    watching.look()
    watching.close()
    assert len(table(tmp_path / "load.csv")) == 1
