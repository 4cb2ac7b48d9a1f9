# SPDX-License-Identifier: GPL-2.0-or-later
"""How long a program would take set up: what the monitor has on its pins (monitor/set_up_time.py), and what the process
says (setup/time_process.py)."""

import json

import pytest

from chipwise.monitor.set_up_time import PINS, SetUpTime
from chipwise.host.temp_folder import OwnFolder
from chipwise.setup import time_process
from support.check_runs import mill_with_tools
from support.setup_runs import chipwise_setup
from support.scenes import SCENE

SLOT = """(T1 D=10. CR=0. - ZMIN=-2. - flat end mill)
G21 G90 G64 P0.01
T1 M6
G0 X0 Y0 Z5
G1 Z-2 F300
G1 X60 F400
Y3
X0
G0 Z5
M2
"""
EMPTY = {**SCENE, "tool": 0, "codes": "G17 G54 G90"}


class Reading:
    """In place of Answering."""

    def __init__(self):
        self.orders, self.answer, self.ends = [], None, 0

    def ask(self, order):
        self.orders.append(order)

    def take(self):
        found, self.answer = self.answer, None
        return found

    def end(self):
        self.ends += 1


def watched(is_wanted=True):
    pins = {}
    time = SetUpTime(pins, is_wanted)
    time.reading = Reading()
    return time, pins


def test_each_program_once():
    """The figures stay while the program is loaded, and go with it; the same one again, as behind a run, is not read
    again."""
    time, pins = watched()
    key, order = ("/a/part.ngc", (1, 2, 3), [1]), {"program": "/a/part.ngc"}
    time.ask(key, order)
    time.ask(key, order)
    assert time.reading.orders == [order] and [pins[name] for name in PINS] == [0, 0]
    time.reading.answer = {"time": 455.0, "time_with": 325.0}
    time.look("/a/part.ngc")
    time.ask(key, order)
    time.look("/a/part.ngc")
    time.look(None)  # in a sub
    assert time.reading.orders == [order] and [pins[name] for name in PINS] == [455.0, 325.0]
    time.look("/a/other.ngc")
    assert [pins[name] for name in PINS] == [0, 0]
    time.ask((*key[:1], (1, 2, 4), key[2]), order)  # another content
    assert len(time.reading.orders) == 2


@pytest.mark.parametrize("answer", [{}, {"why": "it could not be read"}])
def test_what_is_not_known(answer):
    time, pins = watched()
    time.ask(("a", 1, 2), {})
    time.reading.answer = answer
    time.look("a")
    assert [pins[name] for name in PINS] == [0, 0]


def test_where_no_set_up_raises_the_feed_nothing_is_read():
    time, _pins = watched(is_wanted=False)
    time.ask(("a", 1, 2), {})
    assert time.reading.orders == []


def said(folder, text, machine):
    (folder / "part.ngc").write_text(text)
    with OwnFolder("test") as own:
        return time_process.answer({"ini": str(machine), "program": str(folder / "part.ngc"), "scene": EMPTY}, own)


def test_it_is_what_set_up_proposes(tmp_path):
    """The sums of chipwise setup, which writes no job file here; nothing for a program whose feed a set-up does not
    raise."""
    machine = mill_with_tools(tmp_path)
    found = said(tmp_path, SLOT, machine)
    _status, _out, _err, report = chipwise_setup(tmp_path, SLOT, machine=machine)
    for name, key in (("time", "time_s"), ("time_with", "time_with_s")):
        assert found[name] == pytest.approx(sum(tool[key] for tool in report["tools"]), abs=0.01)
    assert 10 < found["time_with"] < 0.95 * found["time"] and json.dumps(found)
    for text in (
        SLOT.replace("G1 X60", "M251 Q6\nG1 X60"),
        SLOT.replace("M2\n", "G84 X0 Y0 Z-1 R2\nM2\n"),
        SLOT.replace("X60", "X[1/0]"),
    ):
        assert said(tmp_path, text, machine) == {}


def test_with_feeds_above_the_stock_as_fast_as_the_axes(tmp_path):
    """SETUP_AIR is what `chipwise setup` would confirm on this machine, so its time is the one that is shown."""
    machine = mill_with_tools(tmp_path)
    machine.write_text(machine.read_text().replace("[CHIPWISE]\n", "[CHIPWISE]\nSETUP_AIR = yes\n"))
    text = SLOT.replace("G0 X0 Y0 Z5", "G0 X0 Y0 Z5\nG1 X60 F400\nX0")
    found = said(tmp_path, text, machine)
    _status, out, _err, report = chipwise_setup(tmp_path, text, machine=machine)
    (tool,) = report["tools"]
    assert (
        found["time_with"] == pytest.approx(tool["time_air_s"], abs=0.01)
        and tool["time_air_s"] < 0.8 * tool["time_with_s"]
    )
    assert f"{tool['time_air_s']:.1f} s set up" in out
