# SPDX-License-Identifier: GPL-2.0-or-later
"""M256 in chipwise-monitor: the set-up goes into the table whole, or the reply says why not."""

import ctypes as C
import math
import types

import pytest

from chipwise.clamps.clamp import Clamp
from chipwise.clib import layout
from chipwise.clib.library import library
from chipwise.clib.layout import FileRequest
from chipwise.monitor import clamps_in_force
from chipwise.monitor.messages import clamp_text
from chipwise.monitor.stock_files import StockFiles
from chipwise.settings import parse_settings
from chipwise.stock import reasons
from chipwise.stock.clamp_table import SIZE, ClampTable

SET_UP = (
    "[set_up.2.clamp.jaw]\nbox = [40, -12, -20, 60, -2, 8]\n[set_up.2.clamp.stop]\n"
    "cylinder = [0, 60, -20, 30, 10]\n[set_up.3]\n"
)


class Pins(dict):
    """As the tracker shows them: it takes a table over when the pin is read."""

    def __init__(self, memory, takes=True):
        super().__init__()
        self.clamps, self.memory, self.takes = layout.Clamps(), memory, takes
        self.spoils = False

    def __getitem__(self, name):
        if name == "clamps-taken" and self.takes:
            if self.spoils:
                layout.ClampTable.from_buffer(self.memory).clearance = math.nan
            library().chip_clamps_take(self.clamps, C.byref(layout.ClampTable.from_buffer(self.memory)))
            return -1 if self.clamps.refused else self.clamps.seen // 2
        return super().get(name, 0)


@pytest.fixture
def machine(tmp_path):
    """(ClampsInForce, its pins, the table)."""
    path = tmp_path / "clamps.toml"
    path.write_text(SET_UP)
    memory = bytearray(SIZE)
    pins = Pins(memory)
    return (
        clamps_in_force.ClampsInForce(pins, parse_settings({"CLAMPS": str(path), "CLAMP_CLEARANCE": "1.5"})),
        pins,
        ClampTable(memory, 0),
        path,
    )


def test_a_set_up_and_none(machine):
    clamps, pins, table, _path = machine
    assert clamps.put(table, 2) == reasons.DONE
    found = pins.clamps.table
    assert (found.count, found.clearance) == (2, 1.5)
    jaw, stop = found.clamp[0], found.clamp[1]
    assert (jaw.x, jaw.y, jaw.half_x, jaw.half_y, jaw.top, jaw.cosine, jaw.sine, jaw.is_round) == (
        50,
        -7,
        10,
        5,
        8,
        1,
        0,
        0,
    )
    assert (stop.x, stop.y, stop.half_x, stop.half_y, stop.top, stop.is_round) == (0, 60, 5, 5, 30, 1)
    assert clamps.name(2) == "clamp stop of set-up 2" and clamps.name(3) == "clamp 3 of the set-up in force"
    for number in (3, 0):
        assert clamps.put(table, number) == reasons.DONE and found.count == 0


def test_what_is_refused_changes_nothing(machine, monkeypatch, capsys):
    clamps, pins, table, path = machine
    clamps.put(table, 2)
    path.write_text("[set_up.2.clamp.jaw]\nbox = [40]\n")
    assert clamps.put(table, 2) == reasons.NO_CLAMPS and "box is not 6 numbers" in capsys.readouterr().out
    path.write_text(SET_UP)
    monkeypatch.setattr(clamps_in_force, "TAKEN_S", 0.0)
    pins.takes = False
    assert clamps.put(table, 3) == reasons.NOT_TAKEN and not clamps.waits
    assert pins.clamps.table.count == 2 and clamps.name(1) == "clamp jaw of set-up 2"
    assert clamps.put(None, 2) == reasons.NOT_TAKEN
    assert reasons.NO_CLAMPS in reasons.REASONS and reasons.NOT_TAKEN in reasons.REASONS


def test_a_tracker_that_does_not_answer_holds_nobody_up(machine):
    """The monitor goes on with its work, its heartbeat above all, and has the answer when it comes."""
    clamps, pins, table, _path = machine
    pins.takes = False
    assert (
        clamps.put(table, 2) == reasons.BUSY and clamps.waits and clamps.look() == reasons.BUSY and clamps.names == ()
    )
    pins.takes = True
    assert clamps.look() == reasons.DONE and not clamps.waits and clamps.name(1) == "clamp jaw of set-up 2"


def test_a_refusal_is_said_at_once(machine):
    """One that was there before the table says nothing of it."""
    clamps, pins, table, path = machine
    assert clamps.put(table, 2) == reasons.DONE
    path.write_text("[set_up.2.clamp.jaw]\nbox = [0, 0, 0, 1, 1, 1]\n")
    pins.spoils = True
    assert clamps.put(table, 2) == reasons.NOT_TAKEN and not clamps.waits
    pins.spoils = pins.takes = False
    pins["clamps-taken"] = -1
    assert clamps.put(table, 2) == reasons.BUSY
    pins.takes = True
    assert clamps.look() == reasons.DONE


def test_a_request_that_is_answered_later(machine):
    """What the interpreter waits for comes when the tracker has answered, and not for another request."""
    clamps, pins, table, _path = machine
    pins.takes = False
    pins.update({"request": FileRequest.CLAMPS, "slot": 2, "stock-defined": False})
    files = StockFiles(pins, clamps.settings, print)
    files.stock, table.close = types.SimpleNamespace(clamp_table=lambda: table), lambda: None
    files.step(0.0)
    assert pins["reply"] == reasons.BUSY
    files.step(0.0)
    assert pins["reply"] == reasons.BUSY
    pins.takes = True
    files.step(0.0)
    assert pins["reply"] == reasons.DONE and files.clamps.name(1) == "clamp jaw of set-up 2"
    pins.takes = False
    pins["request"] = 0
    files.step(0.0)
    pins["request"] = FileRequest.CLAMPS
    files.step(0.0)
    pins["request"] = 0
    files.step(0.0)
    pins.takes = True
    files.step(0.0)
    assert pins["reply"] == reasons.IDLE


def test_a_writer_that_was_killed(machine):
    """It has left the generation odd: the next one is taken over all the same."""
    clamps, pins, table, _path = machine
    raw = layout.ClampTable.from_buffer(pins.memory)
    raw.generation, raw.count, raw.clearance = 7, 3, math.nan
    assert clamps.put(table, 2) == reasons.DONE and pins.clamps.table.count == 2


def clamp(x, name="the clamp of line 3"):
    return Clamp(0, 30.0, (x, 0.0, -20.0), (x + 10.0, 10.0, 8.0), name)


def names(clamps, pins, table):
    """Of those in force; their places in the table are theirs."""
    assert pins["clamps-taken"] == table._table.generation // 2 and pins.clamps.table.count == len(clamps.names)
    return clamps.names


def test_clamps_of_the_program_beside_those_of_m256(machine):
    """M256 of a run takes the place of what the program has named before it, in MDI only P0 does."""
    clamps, pins, table, _path = machine
    vice = "clamp jaw of set-up 2", "clamp stop of set-up 2"
    assert clamps.put(table, 2) == reasons.DONE
    assert clamps.lay(table, "comments", [(0, clamp(0.0, "a")), (1, clamp(30.0, "b"))]) == reasons.DONE
    assert clamps.lay(table, "job", [(0, clamp(60.0, "j"))]) == reasons.DONE
    assert names(clamps, pins, table) == (*vice, "a", "b", "j")
    assert clamps.put(table, 3) == reasons.DONE and names(clamps, pins, table) == ("a", "b", "j") and not clamps.dropped
    pins["program-running"] = True
    clamps.put(table, 2)
    assert (
        names(clamps, pins, table) == (*vice, "b")
        and clamps.dropped == {"comments", "job"}
        and clamps.has("comments")
        and not clamps.has("job")
    )
    clamps.put(table, 0)
    assert names(clamps, pins, table) == ()
    pins["program-running"] = False
    clamps.follow(False)
    clamps.lay(table, "comments", [(0, clamp(0.0, "a")), (1, clamp(30.0, "b"))])
    assert names(clamps, pins, table) == ("a", "b") and clamps.dropped == {"job"}
    pins["program-running"] = True
    clamps.put(table, 2)
    assert names(clamps, pins, table) == (*vice, "b")
    pins["program-running"] = False
    clamps.put(table, 0)
    assert names(clamps, pins, table) == () and not clamps.dropped


def test_clamps_that_the_tracker_refuses_are_not_kept(machine, monkeypatch):
    """What comes after them is that of before, and the new ones."""
    clamps, pins, table, _path = machine
    clamps.put(table, 2)
    pins.spoils = True
    assert clamps.lay(table, "job", [(0, clamp(60.0))]) == reasons.NOT_TAKEN and not clamps.has("job")
    pins.spoils = False
    pins.clamps.refused = 0
    assert clamps.lay(table, "comments", [(0, clamp(0.0, "a"))]) == reasons.DONE
    assert names(clamps, pins, table) == ("clamp jaw of set-up 2", "clamp stop of set-up 2", "a")
    assert (
        clamps.lay(table, "job", [(0, clamp(60.0))] * 98) == reasons.NO_CLAMPS and len(names(clamps, pins, table)) == 3
    )
    assert clamps.lay(None, "job", []) == reasons.NOT_TAKEN


def test_a_monitor_that_takes_over_keeps_what_is_in_the_table(machine):
    """The clamps of the program are in it once only, and go with the program."""
    clamps, pins, table, _path = machine
    clamps.put(table, 2)
    clamps.lay(table, "comments", [(0, clamp(0.0, "a"))])
    second = clamps_in_force.ClampsInForce(pins, clamps.settings)
    assert second.name(1) == "clamp 1 of the set-up in force"
    assert second.lay(table, "comments", [(0, clamp(0.0, "a"))]) == reasons.DONE
    assert names(second, pins, table) == ("clamp 1 of the set-up in force", "clamp 2 of the set-up in force", "a")
    found = pins.clamps.table
    assert (found.clamp[1].x, found.clamp[1].y, found.clamp[1].half_x, found.clamp[1].top, found.clamp[1].is_round) == (
        0,
        60,
        5,
        30,
        1,
    )
    second.lay(table, "comments", [])
    assert len(names(second, pins, table)) == 2


def test_the_message():
    said = clamp_text("clamp jaw of set-up 2", 1, 3.1, 57, 3, "mm")
    assert said.startswith(
        "move stopped 3.10 mm before the holder comes too near to clamp jaw of set-up 2 (line 57, tool 3); press Stop"
    )
    assert clamp_text("clamp 1", 0, 0.5, 0, 3, "in").startswith(
        "move stopped 0.5000 in before the tool or its shank comes too near to clamp 1 (MDI, tool 3);"
    )
