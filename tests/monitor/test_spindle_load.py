# SPDX-License-Identifier: GPL-2.0-or-later
"""What chipwise-monitor makes of the load of the spindle: factors that are kept, wear, words."""

import errno
import os
import threading

import pytest

from chipwise.clib.layout import LoadAlarm
from chipwise.cli.load import feed_parameters
from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.monitor.spindle_load import LOAD_ALARMS, SpindleLoad
from chipwise.settings import LOAD_ACTIONS, parse_settings
from chipwise.tool_data import load_factors


class Watched:
    """SpindleLoad with a tool 3 and a file in `folder`; what was said."""

    def __init__(self, folder):
        self.pins = {
            "tool-number": 3,
            "load-cuts": 0,
            "load-cut-factor": 0.0,
            "load-alarm": 0,
            "load-ratio": 0.0,
            "load-factor": 0.0,
        }
        self.errors, self.shown = [], []
        self.load = SpindleLoad(self.pins, parse_settings({}, str(folder)), self.errors.append, self.shown.append)
        self.told = self.load.saying.texts
        self()

    def __call__(self, material="6061", **pins):
        self.pins.update({name.replace("_", "-"): value for name, value in pins.items()})
        self.load.follow(material, lambda: 57)
        self.load.aside.wait()  # for the thread that writes
        self.load.look()
        self.load.aside.wait()

    def cut(self, factor, material="6061"):
        self(material, load_cut_factor=factor, load_cuts=self.pins["load-cuts"] + 1)


def test_the_first_cut_teaches_and_is_kept(tmp_path):
    watched = Watched(tmp_path)
    watched.cut(1.312)
    assert watched.pins["load-factor"] == 1.312 and len(watched.told) == 1 and "1.31 times" in watched.told[0]
    watched.cut(1.5)
    assert watched.pins["load-factor"] == 1.312
    watched("C45")
    assert watched.pins["load-factor"] == 0.0
    watched.cut(0.9, "C45")
    again = Watched(tmp_path)
    assert again.pins["load-factor"] == 1.312 and not again.told
    again("C45")
    assert again.pins["load-factor"] == 0.9
    again(tool_number=4)
    assert again.pins["load-factor"] == 0.0


def test_what_a_person_deletes_is_taught_again(tmp_path):
    watched = Watched(tmp_path)
    watched.cut(1.3)
    (tmp_path / "spindle_loads.toml").unlink()
    watched()
    assert watched.pins["load-factor"] == 0.0
    watched.cut(1.7)
    assert watched.pins["load-factor"] == 1.7


def test_cuts_before_the_monitor_began_and_of_no_tool_teach_nothing(tmp_path):
    watched = Watched(tmp_path)
    watched.cut(1.3, "")
    watched(tool_number=0)
    watched.cut(1.3)
    assert not watched.told and not (tmp_path / "spindle_loads.toml").exists()
    late = SpindleLoad(
        {**watched.pins, "tool-number": 3, "load-cuts": 9},
        parse_settings({}, str(tmp_path)),
        watched.errors.append,
        watched.shown.append,
    )
    late.follow("6061", lambda: 1)
    assert not late.saying.texts


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_a_factor_that_cannot_be_written_counts_all_the_same(tmp_path, monkeypatch, number):
    """One sentence; the next one that can be written brings the first one along."""
    watched = Watched(tmp_path)

    def full(*_arguments):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patched:
        patched.setattr(load_factors, "write_durable", full)
        watched.cut(1.3)
        for _ in range(3):
            watched()
        watched.cut(1.31)
    assert (
        watched.pins["load-factor"] == 1.3
        and len(watched.told) == 1
        and f"is not kept in spindle_loads.toml: {os.strerror(number)}; make room" in watched.told[0]
    )
    assert not watched.errors and not (tmp_path / "spindle_loads.toml").exists()
    watched.cut(0.9, "C45")
    assert load_factors.read(str(tmp_path / "spindle_loads.toml")) == {(3, "6061"): 1.3, (3, "C45"): 0.9}


def test_a_file_that_is_being_changed_is_written_at_the_next_look(tmp_path):
    """Whoever has the lock, and what it writes, comes first; the monitor does not wait for it."""
    watched, path = Watched(tmp_path), str(tmp_path / "spindle_loads.toml")
    with load_factors.changing(path) as other:
        watched.cut(1.3)
        watched()
        assert not watched.told and watched.pins["load-factor"] == 1.3 and not os.path.exists(path)
        other[5, "C45"] = 2.0
    watched()
    assert (
        load_factors.read(path) == {(3, "6061"): 1.3, (5, "C45"): 2.0}
        and len(watched.told) == 1
        and "it is kept in" in watched.told[0]
    )


def test_a_slow_disk_holds_up_no_look(tmp_path, monkeypatch):
    """The tool is followed while the disk takes its time with a factor; one that is taught meanwhile comes next, and
    the end waits for both."""
    watched, path = Watched(tmp_path), str(tmp_path / "spindle_loads.toml")
    sent, done, write = threading.Event(), threading.Event(), load_factors.write_durable

    def slow(*given):
        sent.set()
        assert done.wait(300.0)
        write(*given)

    monkeypatch.setattr(load_factors, "write_durable", slow)
    monkeypatch.setattr(watched.load.aside, "wait", lambda: None)
    watched.cut(1.3)
    assert sent.wait(300.0)
    watched.cut(0.9, "C45")
    assert watched.pins["load-factor"] == 0.9 and not os.path.exists(path) and not watched.told
    watched()
    assert watched.pins["load-factor"] == 1.3
    monkeypatch.undo()
    threading.Timer(0.1, done.set).start()
    watched.load.end()
    assert (
        load_factors.read(path) == {(3, "6061"): 1.3, (3, "C45"): 0.9} and len(watched.told) == 2 and not watched.errors
    )


def test_a_broken_file_is_not_replaced(tmp_path):
    watched, path = Watched(tmp_path), tmp_path / "spindle_loads.toml"
    path.write_text("[3")
    watched.cut(1.3)
    assert (
        path.read_text() == "[3"
        and watched.pins["load-factor"] == 1.3
        and "is not kept in spindle_loads.toml: spindle_loads.toml: is not TOML" in watched.told[0]
    )


def test_wear_is_said_after_two_cuts_once(tmp_path, capsys):
    watched = Watched(tmp_path)
    for factor in (1.0, 1.35, 1.2, 1.36):
        watched.cut(factor)
    assert len(watched.told) == 1
    for _ in range(3):
        watched.cut(1.4)
    assert len(watched.told) == 2 and "tool 3 takes 1.40 times" in watched.told[1]
    assert capsys.readouterr().out.count("taught 1.000") == 6


def test_a_note_waits_until_no_command_is_executed(tmp_path):
    watched, quiet = Watched(tmp_path), []
    watched.load.saying.quiet = lambda: bool(quiet)
    watched.cut(1.0)
    watched.load.saying.speak(None)
    assert not watched.shown
    quiet.append(True)
    watched.load.saying.speak(None)
    assert len(watched.shown) == 1 and "1.00 times" in watched.shown[0]


@pytest.mark.parametrize("alarm", list(LOAD_ALARMS))
def test_an_alarm_in_words_once(tmp_path, alarm):
    watched = Watched(tmp_path)
    watched.cut(1.0)
    for _ in range(3):
        watched(load_alarm=alarm, load_ratio=2.0)
    assert len(watched.errors) == 1 and ("line 57, tool 3" in watched.errors[0]) == (alarm != LoadAlarm.UNUSABLE)
    watched(load_alarm=0)
    watched(load_alarm=alarm)
    assert len(watched.errors) == 2
    assert len(watched.errors[0]) < 200


@pytest.mark.parametrize("ratio", [0.0006, 50.0])
def test_a_unit_that_is_wrong_is_said_once(tmp_path, ratio):
    watched = Watched(tmp_path)
    for now in (ratio, 1.0, ratio, 0.0, ratio):
        for _ in range(49):
            watched(load_ratio=now)
    assert not watched.told
    for _ in range(200):
        watched(load_ratio=ratio)
    assert len(watched.told) == 1 and "SPINDLE_LOAD_SCALE" in watched.told[0]
    known = Watched(tmp_path)
    known.cut(1.3)
    for _ in range(200):
        known(load_ratio=ratio)
    assert len(known.told) == 1  # that of the factor: an alarm speaks for it


def test_every_alarm_has_words():
    assert set(LOAD_ALARMS) == set(LoadAlarm) - {LoadAlarm.SOUND}


@pytest.mark.parametrize(
    "text", ["[3", "[x]\n", "3 = 1", '[3]\n"6061" = true', '[3]\n"6061" = nan', '[3]\n"6061" = -1', '[3]\n"6061" = "1"']
)
def test_a_broken_file_is_said_and_changes_nothing(tmp_path, text):
    watched = Watched(tmp_path)
    watched.cut(1.3)
    (tmp_path / "spindle_loads.toml").write_text(text)
    for _ in range(3):
        watched()
    assert len(watched.errors) == 1 and watched.pins["load-factor"] == 1.3
    with pytest.raises(CycleError):
        load_factors.read(str(tmp_path / "spindle_loads.toml"))


def test_names_of_any_kind(tmp_path):
    kept = {(3, 'a "b" \\ c'): 1.5, (3, "é"): 0.5, (12, "6061"): 2.25}
    load_factors.write(str(tmp_path / "loads.toml"), kept)
    assert load_factors.read(str(tmp_path / "loads.toml")) == kept


def test_the_settings(tmp_path, monkeypatch):
    (tmp_path / "mill.ini").write_text("[TRAJ]\nLINEAR_UNITS = mm\n")
    monkeypatch.setenv("INI_FILE_NAME", str(tmp_path / "mill.ini"))
    settings = parse_settings({"SPINDLE_LOAD_SCALE": "2200", "SPINDLE_LOAD_ACTION": "Hold"})
    assert feed_parameters(Ini(), settings, 1.0, 500.0)["spindle-load-scale"] == 2200.0
    assert LOAD_ACTIONS.index(settings["SPINDLE_LOAD_ACTION"]) == 1
    with pytest.raises(CycleError):
        parse_settings({"SPINDLE_LOAD_ACTION": "jump"})
