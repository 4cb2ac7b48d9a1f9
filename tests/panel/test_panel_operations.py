# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of operations: where one ends and the next begins, its figures, and random programs against sums written
apart."""

import json
import random
from dataclasses import replace
from itertools import groupby

import pytest

from chipwise.panel import load_log, operations, server, tool_log
from support.panel_client import request
from support.panel_rig import Machine, serving
from support.random_cases import random_count, random_seed, write_replay

DT = 0.1
LIMITS = (
    "nothing",
    "stock",
    "ahead",
    "floor",
    "ceiling",
    "fallback",
    "chip",
    "power",
    "torque",
)  # by number, as chip_limited_by has them
MODES = ("off", "limit", "constant", "window")


# ---- the lines of cycles ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text, lines",
    [
        ("G21\nG13 X1 I5 Z-1\nM2\n", {2: "G13"}),
        (
            "N10 G90 g 79 q100\n/G012 I5\n(G13)\nG12.1\nG1 X13 (G77)\n; G78\nG778\nG7 9\n",
            {1: "G79", 2: "G12", 8: "G79"},
        ),
        ("O100 sub\nG1 X1\nO100 endsub\no 100 call\nG77 Q100\n", {5: "G77"}),
        ("o<My Part> sub\no<mypart> endsub\no<my part> call [1]\nG24 D1\n", {4: "G24"}),
        ("O0100 sub\nO100 endsub\nO100 call\nG26 Q1\n", {4: "G26"}),
        ("G13 I5\no200 call\n", {}),
        ("G13 I5\no<part> call\n", {}),
        ("G13 I5\nO100 sub\nO100 endsub\no[#1] call\n", {}),
        ("G13 I5\nM98 P1\n", {}),
        ("G13 I5\nM980\nO1 if [1]\nO1 endif\nO2 while [0]\nO2 endwhile\n", {1: "G13"}),
        ("#<g13> = 4\nG1 X#<_g79>\nG#<x>\nG[13]\n", {}),
        ("G13 I5\r\nG75 Q1\r\n", {1: "G13", 2: "G75"}),
        ("", {}),
        ("\xff\x00G13\n", {1: "G13"}),
    ],
)
def test_lines_of_cycles(tmp_path, text, lines):
    path = tmp_path / "part.ngc"
    path.write_bytes(text.encode("latin-1"))
    assert operations.cycle_lines(str(path)) == lines


def test_programs_that_are_not_read(tmp_path, monkeypatch):
    path = tmp_path / "part.ngc"
    path.write_text("G13 I5\n")
    assert operations.cycle_lines(str(path)) == {1: "G13"}
    monkeypatch.setattr(operations, "MOST_PROGRAM", 3)
    assert (
        operations.cycle_lines(str(path))
        == operations.cycle_lines(str(tmp_path))
        == operations.cycle_lines("/nowhere")
        == {}
    )
    assert operations.cycle_lines("/dev/zero") == operations.cycle_lines("") == {}


# ---- operations ------------------------------------------------------------------------------------------------------


class Cut:
    """A machine that a test moves; each look is DT after the one before."""

    def __init__(self, log):
        self.log, self.values, self.now = log, {**Machine().values, "motion_type": 2.0, "tool": 1.0}, 1000.0
        self.look()

    def look(self, cm3=0.0, **values):
        """A look after so much was cut."""
        self.values.update(values, removed=self.values["removed"] + 1000 * cm3, mrr=1000 * cm3 / DT * 60)
        self.now += DT
        self.log.look(DT, dict(self.values), self.now)


def log_of(tmp_path, text):
    path = tmp_path / "part.ngc"
    path.write_text(text)
    log = load_log.LoadLog()
    log.begin(str(path), 0.0)
    return log


def test_where_operations_end(tmp_path):
    """A slot, a hole, its neighbour on the next line, M251, another target, another tool."""
    log = log_of(tmp_path, "G1\nG1\nG13 I5\nG13 I6\nG1\n")
    cut = Cut(log)
    for line in (1, 1, 2):
        cut.look(0.01, line=line)
    for _ in range(4):
        cut.look(0.02, line=3)
    cut.look(0.0, line=3, motion_type=1.0)
    cut.look(0.03, line=4, motion_type=2.0)
    cut.look(0.0, line=5, motion_type=1.0)
    cut.look(0.01, line=5, motion_type=2.0, mode=1.0, target=6000.0, limited_by=1.0)
    cut.look(0.011, limited_by=2.0)
    cut.look(0.015, limited_by=1.0)
    cut.look(0.02, target=12000.0, limited_by=4.0)
    cut.look(0.0, tool=2.0, tool_diameter=3.0, motion_type=1.0)
    cut.look(0.02, motion_type=2.0)
    log.end()
    found = log.shown()
    names = (
        "operation",
        "code",
        "line",
        "last_line",
        "tool",
        "mode",
        "reference_cm3_min",
        "removed_cm3",
        "cutting_s",
        "seconds",
        "limited_by",
        "over_s",
    )
    assert [tuple(row[name] for name in names) for row in found["operations"]] == [
        (1, "", 1, 2, 1, "off", "", 0.03, 0.3, 0.3, "nothing", 0.0),
        (2, "G13", 3, 3, 1, "off", "", 0.08, 0.4, 0.5, "nothing", 0.0),
        (3, "G13", 4, 4, 1, "off", "", 0.03, 0.1, 0.1, "nothing", 0.0),
        (4, "", 5, 5, 1, "limit", 6.0, 0.036, 0.3, 0.3, "stock", 0.1),
        (5, "", 5, 5, 1, "limit", 12.0, 0.02, 0.1, 0.1, "ceiling", 0.0),
        (6, "", 5, 5, 2, "limit", 12.0, 0.02, 0.1, 0.1, "ceiling", 0.0),
    ]
    row = found["operations"][3]
    assert (row["stock_s"], row["ahead_s"], row["mean_cm3_min"], row["peak_cm3_min"]) == (0.2, 0.1, 7.2, 9.0) and found[
        "count"
    ] == 6
    assert set(row) | {"start", "program", "complete"} == set(operations.COLUMNS)


def test_what_was_cut_before_a_traverse_is_seen(tmp_path):
    """A look that comes late: the volume belongs to the operation that was cutting, though the motion is on another
    line already."""
    log = log_of(tmp_path, "G13\nG0\nG13\n")
    cut = Cut(log)
    cut.look(0.02, line=1)
    cut.look(0.02, line=2, motion_type=1.0)
    cut.look(0.0, line=2, tool=2.0)
    cut.look(0.03, line=3, motion_type=2.0)
    assert [(row["code"], row["removed_cm3"], row["cutting_s"]) for row in log.shown()["operations"]] == [
        ("G13", 0.04, 0.2),
        ("G13", 0.03, 0.1),
    ]
    assert [(row["tool"], row["removed_cm3"]) for row in log.shown()["tools"]] == [(1, 0.04), (2, 0.03)]


@pytest.mark.parametrize("late", (0.005, 0.02, 0.04))
def test_a_late_look_raises_no_mean_above_the_peak(tmp_path, late):
    """The time in which it was cut counts too, which is at most the time between the looks."""
    log = log_of(tmp_path, "G13\n")
    cut = Cut(log)
    cut.look(0.02, line=1)
    cut.look(late, line=2, motion_type=1.0)
    for row in (log.shown()["operations"][0], log.shown()["tools"][0]):
        mean = 12.0 if late <= 0.02 else 60 * (0.02 + late) / (2 * DT)
        assert row["mean_cm3_min"] == pytest.approx(mean) and row["removed_cm3"] == pytest.approx(0.02 + late)


def test_a_stop_by_a_guard_is_in_its_operation(tmp_path):
    log = log_of(tmp_path, "G0\n")
    cut = Cut(log)
    cut.look(line=1, motion_type=1.0)
    for _ in range(3):
        cut.look(guard_reason=1.0)
    cut.look(guard_reason=0.0)
    cut.look(guard_reason=2.0)
    (row,) = log.shown()["operations"]
    assert row["stops"] == 2 and row["removed_cm3"] == 0.0 and row["line"] == 1


def test_very_many_operations(tmp_path):
    """Only the last can be shown; all are in the file."""
    log = log_of(tmp_path, "")
    log.path = str(tmp_path / "load.csv")
    cut = Cut(log)
    for k in range(600):
        cut.look(0.001, tool=1.0 + k % 2)
        log.write()
    log.end()
    log.write()
    found = log.shown()
    assert (
        len(found["operations"]) == operations.SHOWN
        and found["count"] == 600
        and found["operations"][-1]["operation"] == 600
    )
    assert len((tmp_path / "load_operations.csv").read_text().splitlines()) == 601 and log.error == ""
    assert len(json.dumps(found)) < 200_000


# ---- random programs -------------------------------------------------------------------------------------------------


def random_looks(rng):
    """(cycle lines, looks) of a program: dicts of pins and "cm3"."""
    cycles = {line for line in range(1, 30) if rng.random() < 0.3}
    looks, state = (
        [],
        {
            "tool": 1.0,
            "mode": 0.0,
            "target": 0.0,
            "line": 1.0,
            "motion_type": 1.0,
            "guard_reason": 0.0,
            "limited_by": 0.0,
        },
    )
    for _ in range(rng.randint(1, 120)):
        if rng.random() < 0.1:
            state["tool"] = float(rng.randint(1, 3))
        if rng.random() < 0.1:
            state["mode"] = float(rng.randint(0, 3))
            state["target"] = 1000.0 * rng.randint(1, 3) if state["mode"] else 0.0
        if rng.random() < 0.4:
            state["line"] = float(rng.randint(1, 30))
        state["motion_type"] = float(rng.choice((1, 2, 2, 3)))
        state["guard_reason"] = float(rng.random() < 0.05)
        state["limited_by"] = float(rng.randint(0, 8))
        looks.append({**state, "cm3": rng.choice((0.0, rng.uniform(0.001, 0.01))) if state["motion_type"] > 1 else 0.0})
    return cycles, looks


def expected(cycles, looks):
    """[(tool, mode, target cm3/min, volume cm3, cutting s, stops, longest limits)] of the operations, from the looks at
    once."""
    rows, stopped = [], False
    for look in looks:
        look["stop"] = bool(look["guard_reason"]) and not stopped
        stopped = bool(look["guard_reason"])

    def key(look):
        return look["tool"], look["mode"], look["target"], look["line"] if look["line"] in cycles else 0

    for (tool, mode, target, _line), group in groupby(looks, key):
        group = list(group)
        cuts = [look for look in group if look["cm3"] > 0]
        if not cuts and not any(look["stop"] for look in group):
            continue
        times = [sum(DT for look in cuts if mode and look["limited_by"] == k) for k in range(1, len(LIMITS))]
        longest = {
            LIMITS[k + 1] for k, seconds in enumerate(times) if times and seconds > max(times) - 1e-9 and seconds > 0
        } or {"nothing"}
        rows.append(
            (
                tool,
                MODES[int(mode)],
                target / 1000 if cuts else 0.0,
                sum(look["cm3"] for look in cuts),
                DT * len(cuts),
                sum(look["stop"] for look in group),
                longest,
            )
        )
    return rows


def fault_of(cycles, looks):
    """What is wrong with the log of the looks, "" if nothing is."""
    log = load_log.LoadLog()
    log.begin("/nowhere", 0.0)
    log.operations.cycles = {line: "G13" for line in cycles}
    cut = Cut(log)
    for look in looks:
        cut.look(**{name: value for name, value in look.items() if name != "stop"})
    log.end()
    found, wanted = log.shown(), expected(cycles, looks)
    if len(found["operations"]) != len(wanted):
        return f"{len(found['operations'])} operations, expected {len(wanted)}"
    for row, (tool, mode, target, volume, seconds, stops, longest) in zip(found["operations"], wanted):
        if (
            (row["tool"], row["mode"], row["stops"]) != (tool, mode, stops)
            or abs((row["reference_cm3_min"] or 0.0) - target) > 1e-9
            or abs(row["removed_cm3"] - volume) > 1e-4
            or abs(row["cutting_s"] - seconds) > 0.051
            or row["limited_by"] not in longest
        ):
            return f"{row}, expected {(tool, mode, target, volume, seconds, stops, longest)}"
    for use in found["tools"]:
        own = [row for row in found["operations"] if row["tool"] == use["tool"]]
        for name, near in (("removed_cm3", 1e-4 * (1 + len(own))), ("cutting_s", 0.06 * (1 + len(own))), ("stops", 0)):
            if abs(sum(row[name] for row in own) - use[name]) > near:
                return f"tool {use['tool']}: {name} {use[name]}, its operations {[row[name] for row in own]}"
    return ""


def run(count, seed):
    rng = random.Random(seed)
    for number in range(count):
        cycles, looks = random_looks(rng)
        fault = fault_of(cycles, looks)
        if fault:
            path = write_replay(
                "panel_operations", {"seed": seed, "number": number, "cycles": sorted(cycles), "looks": looks}
            )
            return f"seed {seed}, program {number}, {path}: {fault}"
    return ""


def test_random_programs():
    fault = run(random_count(200), random_seed())
    assert not fault, fault


@pytest.mark.parametrize(
    "owner, name, other",
    [
        (operations.OperationLog, "end", lambda self: None),  # operations never end
        (tool_log.Use, "add", lambda self, moment: setattr(self, "volume", self.volume + moment.volume)),
        (
            tool_log.Moments,
            "look",
            lambda self, dt, pins, look=tool_log.Moments.look: replace(
                look(self, dt, pins), stop=bool(pins["guard_reason"])
            ),
        ),
        (tool_log.Use, "limited_by", "stock"),
    ],
)
def test_the_checker_sees_a_fault(monkeypatch, owner, name, other):
    monkeypatch.setattr(owner, name, other)
    assert run(50, 5)


# ---- the page --------------------------------------------------------------------------------------------------------


def test_the_page_asks_for_it():
    with serving() as rig:
        rig.machine.tasks["running"] = True
        rig.machine.values.update(motion_type=2.0, tool=7.0)
        rig.look()
        rig.machine.values["removed"] = 60.0
        rig.look()
        status, headers, content = request(rig.url, "/log.json")
        found = json.loads(content)
        assert (
            status == 200
            and headers["Content-Type"] == "application/json"
            and found["program"] == "part.ngc"
            and found["file"] == ""
        )
        assert [row["tool"] for row in found["tools"]] == [row["tool"] for row in found["operations"]] == [7]
        assert request(rig.url, "/log.json", Origin="http://evil.example")[0] == 403
    assert "/log.json" not in server.FILES
