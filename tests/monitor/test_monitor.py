# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise-monitor without a LinuxCNC: trouble in one part leaves the others going (monitor/worker.py), and a process
that dies is replaced
(monitor/supervisor.py)."""

import itertools
import os
import signal
import subprocess
import sys
import time
import types

import pytest

from chipwise.host import processes
from chipwise.monitor import saying, spindle_tool
from chipwise.monitor import worker as module
from chipwise.settings import parse_settings


class Refusing(Exception):
    pass


class Status:
    """A LinuxCNC as linuxcnc.stat() shows it."""

    linear_units, motion_type, adaptive_feed_enabled, feedrate, feed_override_enabled = 1.0, 0, True, 1.2, True
    file, echo_serial_number, interp_state = "", 0, 1
    spindle = ({"speed": 0.0},)
    aout = [0.0] * 64

    def __init__(self):
        self.tool_in_spindle = 1
        self.tool_table = [types.SimpleNamespace(diameter=6.0)]

    def poll(self):
        pass


class Command:
    def __init__(self):
        self.said = []

    def error_msg(self, text):
        self.said.append(text)

    def text_msg(self, text):
        pass

    def abort(self):
        pass


@pytest.fixture
def watched(monkeypatch):
    """A Monitor on pins that are a dict, with a LinuxCNC that has tool 1, 6 mm."""
    fake = types.SimpleNamespace(error=Refusing, stat=Status, command=Command, INTERP_IDLE=1)
    monkeypatch.setitem(sys.modules, "linuxcnc", fake)
    pins = dict.fromkeys(
        (
            "tool-number",
            "tool-followed",
            "tool-in-spindle",
            "heartbeat",
            "fault",
            "fault-code",
            "limited-by",
            "ready",
            "certain",
            "stock-defined",
            "tool-assumed",
            "job-stock",
            "job-target",
            "job-active",
            "override-ignored",
            "guard-reason",
            "guard-depth",
            "request",
            "adaptive-off",
            "feed-override",
            "load-lost",
            "mode",
            "new-part",
            "parts",
            "path-refused",
            "load-alarm",
            "load-cuts",
            "load-ratio",
            "load-cut-factor",
        ),
        0,
    )
    pins["tool-in-spindle"] = 1
    watcher = module.Monitor(pins, parse_settings({}))
    monkeypatch.setattr(watcher.stock_files, "attach", lambda: None)
    monkeypatch.setattr(watcher, "follow_run", lambda _now: None)
    return watcher


PARTS = (
    "report_restart",
    "follow_run",
    "follow_override",
    "follow_tool",
    "follow_guard",
    "follow_faults",
    "follow_program",
)


def test_a_look(watched):
    watched.step()
    pins = watched.component
    assert (pins["tool-number"], pins["tool-followed"], pins["tool-diameter"], pins["heartbeat"]) == (1, 1, 6.0, 1)
    assert watched.command.said == []


@pytest.mark.parametrize("part", [*PARTS, "stock_files"])
@pytest.mark.parametrize(
    "error",
    [RuntimeError("boom {x} %s"), KeyError("k"), RecursionError(), MemoryError(), OSError(5, "Input/output error")],
)
def test_trouble_in_one_part(watched, monkeypatch, part, error):
    """Said once, not at every look; every other part has its turn, the heart beats."""
    had = []

    def fail(_now):
        raise error

    for name in PARTS:
        monkeypatch.setattr(watched, name, lambda _now, name=name: had.append(name))
    monkeypatch.setattr(watched.stock_files, "step", lambda _now: had.append("stock_files"))
    monkeypatch.setattr(*((watched.stock_files, "step") if part == "stock_files" else (watched, part)), fail)
    for _ in range(5):
        watched.step()
    assert had == [name for name in (*PARTS, "stock_files") if name != part] * 5
    assert watched.component["heartbeat"] == 5
    assert len(watched.command.said) == 1 and type(error).__name__ in watched.command.said[0]


def test_a_screen_that_fails_too(watched, monkeypatch):
    def fail(*_):
        raise RuntimeError("gone")

    watched.step()
    monkeypatch.setattr(watched.command, "error_msg", fail)
    monkeypatch.setattr(watched, "follow_guard", fail)
    watched.step()
    assert watched.component["heartbeat"] == 2


def test_what_lacks_for_the_limits_waits(watched, monkeypatch, tmp_path):
    """A message is a command: it may take the place of the one that runs the program that has just been opened."""
    shown, rests = [], []
    monkeypatch.setattr(Command, "text_msg", lambda _command, text: shown.append(text))
    monkeypatch.setattr(saying, "Quiet", lambda *_: lambda: bool(rests))
    watcher = module.Monitor(watched.component, parse_settings({"SPINDLE_POWER": "800"}))
    watcher.connect()
    watcher.status.file = str(tmp_path / "a.ngc")
    (tmp_path / "a.ngc").write_text("G0 X0\n")
    for _ in range(3):
        watcher.follow_program(0.0)
    assert shown == []
    rests.append(True)
    for _ in range(3):
        watcher.follow_program(0.0)
    assert len(shown) == 1 and "no material is known" in shown[0]


def test_another_tool_since_it_was_lost(watched):
    """Said once, and not for a few looks: the two pins are not read at one moment."""
    watched.step()
    watched.component.update({"load-lost": 1, "ready": 1, "mode": 2})
    for now in (10.0, 10.4):
        watched.follow_load(now)
    watched.component["load-lost"] = 0
    watched.follow_load(10.6)
    watched.component["load-lost"] = 1
    watched.follow_load(10.7)
    assert watched.command.said == []
    for now in (11.3, 11.4, 15.0):
        watched.follow_load(now)
    assert len(watched.command.said) == 1 and "another tool or another stock" in watched.command.said[0]


@pytest.mark.parametrize("ready", [(0, 1), (1, 0)])
def test_a_load_that_is_found_or_lost_between_two_looks_at_the_pins(watched, monkeypatch, ready):
    """Which is at a tool change, and on a busy computer at each look; nor are two looks enough that are far apart."""
    watched.step()
    watched.component.update({"load-lost": 1, "ready": 1, "mode": 2})
    for now in (10.0, 11.0):
        watched.follow_load(now)
    looks = itertools.cycle(ready)

    class Between(dict):
        def __getitem__(self, name):
            return next(looks) if name == "ready" else super().__getitem__(name)

    monkeypatch.setattr(watched, "component", Between(watched.component))
    for now in (12.0, 13.0, 14.0, 15.0):
        looks = itertools.cycle(ready)
        watched.follow_load(now)
    assert watched.command.said == []


def test_a_monitor_in_place_of_another_sets_the_count_back(watched):
    """The first beat, once the tool is described: not while LinuxCNC does not answer."""
    watched.component["heartbeat"], watched.begins, watched.task = 700, True, []
    watched.beat()
    assert watched.component["heartbeat"] == 700
    watched.step()
    assert watched.component["heartbeat"] == 0
    watched.step()
    assert watched.component["heartbeat"] == 1


def test_a_late_look_ends_m251_for_another_program_only(watched, monkeypatch):
    monkeypatch.undo()
    fake = types.SimpleNamespace(MODE_AUTO=2, INTERP_IDLE=1, STATE_ON=4)
    watched.linuxcnc, pins, said = fake, watched.component, []
    watched.inform = said.append
    status = types.SimpleNamespace(
        task_mode=2, interp_state=3, task_state=4, file="one.ngc", echo_serial_number=1, motion_line=0
    )
    watched.task = [status, None]
    pins.update({"mode": 2, "program-running": False, "program-loaded": 0, "feed-carried": False})
    watched.follow_run(0.0)
    watched.status.echo_serial_number = 9  # commands of the operator, seen seconds later
    watched.follow_run(60.0)
    assert pins["program-running"] and said == []
    watched.status.file, watched.status.call_level = "sub.ngc", 1  # a sub in a file of its own
    watched.follow_run(60.01)
    assert pins["program-running"] and said == []
    watched.status.file, watched.status.call_level = "two.ngc", 0
    watched.follow_run(60.02)
    assert not pins["program-running"] and len(said) == 1 and "another program" in said[0]
    watched.follow_run(60.04)
    assert pins["program-running"] and len(said) == 1


def test_a_tool_that_cannot_be_described_is_unknown(watched, monkeypatch):
    watched.step()

    def fail(*_):
        raise RuntimeError("boom")

    monkeypatch.setattr(spindle_tool, "tool_shape", fail)
    watched.status.tool_in_spindle = watched.component["tool-in-spindle"] = 8
    watched.step()
    pins = watched.component
    assert (pins["tool-number"], pins["tool-diameter"], pins["tool-followed"]) == (8, 0.0, 8)


def test_a_rate_in_the_old_unit_is_named_once(watched, tmp_path):
    said, path = [], tmp_path / "tools.toml"
    path.write_text("[tool.1]\nmax_removal_rate = 30000\n[tool.2]\nmax_rate = 20\n")
    watched.step()
    watched.inform, watched.settings = said.append, parse_settings({"TOOL_GEOMETRY": str(path)})
    for number, rate in ((1, 30000), (2, 20000), (1, 30000)):
        watched.status.tool_in_spindle = watched.component["tool-in-spindle"] = number
        watched.step()
        watched.step()
        assert watched.component["tool-max-rate"] == rate
    assert said == ["tools.toml: tool 1: max_removal_rate is in mm3/min; write max_rate = 30 (cm3/min)"]


def test_the_status_comes_after_the_pin(watched, monkeypatch):
    """The machine's number is passed on once the status names the same; a lasting difference is the machine's way."""
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    watched.step()
    watched.component["tool-in-spindle"] = 8
    for _ in range(40):
        now[0] += 0.02
        watched.step()
        assert watched.component["tool-followed"] == 1
    watched.status.tool_in_spindle = 8
    watched.step()
    assert watched.component["tool-followed"] == 8
    watched.component["tool-in-spindle"] = 9
    watched.step()
    assert watched.component["tool-followed"] == 8
    now[0] += 1.1
    watched.step()
    assert watched.component["tool-followed"] == 9


def test_the_heart_beats_on_while_a_file_is_worked_on(watched):
    before = watched.component["heartbeat"]
    with watched.working():
        end = time.monotonic() + 300
        while watched.component["heartbeat"] - before < 3 and time.monotonic() < end:
            time.sleep(0.01)
    after = watched.component["heartbeat"]
    assert after - before >= 3
    time.sleep(0.1)
    assert watched.component["heartbeat"] == after


def test_a_request_that_fails_is_answered(watched, monkeypatch):
    from chipwise.stock import reasons

    def fail(_request):
        raise ZeroDivisionError

    monkeypatch.setattr(watched.stock_files, "serve", fail)
    watched.component["request"] = 1
    watched.step()
    assert watched.component["reply"] == reasons.DISK and watched.command.said == []


SCENE = """
import ctypes, mmap, os, signal, sys, time
sys.path.insert(0, {remap!r})
from chipwise.monitor import supervisor
supervisor.PAUSE_S, supervisor.LOOK_S, supervisor.HUNG_S = 0.05, 0.05, {hung_s}
beats = mmap.mmap(-1, 8)
def work(reason):
    print('work', os.getpid(), reason or 'first', flush=True)
    {work}
    for _ in range(30000):
        beats[0] = (beats[0] + 1) % 256
        time.sleep(0.02)
supervisor.Supervisor(work, lambda: beats[0]).run()
print('over', flush=True)
"""


HUNG_S = 2.0  # where a test is about that; otherwise a busy computer is waited for


class Scene:
    """A supervisor in a process of its own; `work`: a line its child does first; hung_s: s without a heartbeat that the
    child is given."""

    def __init__(self, root, work="pass", hung_s=300.0):
        text = SCENE.format(remap=str(root / "remap"), work=work, hung_s=hung_s)
        self.process = subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True)

    def line(self):
        return self.process.stdout.readline().split(maxsplit=2)

    def child(self):
        return int(self.line()[1])


@pytest.fixture
def scene(root):
    scenes = []

    def begin(*arguments, **options):
        scenes.append(Scene(root, *arguments, **options))
        return scenes[-1]

    yield begin
    for one in scenes:
        one.process.kill()
        one.process.communicate()


def gone(pid):
    end = time.monotonic() + 300
    while time.monotonic() < end:
        if not processes.lives(pid):
            return True
        time.sleep(0.01)
    return False


def test_a_child_that_is_killed_is_replaced(scene):
    one = scene()
    first = one.child()
    os.kill(first, signal.SIGKILL)
    word, second, reason = one.line()
    assert word == "work" and int(second) != first and reason.strip() == "was ended by signal 9"
    one.process.terminate()
    assert one.line() == ["over"] and one.process.wait(300) == 0 and gone(int(second))


def test_a_child_that_stops_is_replaced(scene):
    one = scene(hung_s=HUNG_S)
    os.kill(one.child(), signal.SIGSTOP)
    assert one.line()[2].startswith("hung for")


@pytest.mark.parametrize("who", ["parent", "both"])
def test_stopped_and_going_on_is_no_end(scene, who):
    """SIGSTOP for longer than the parent waits for a signal and for a heartbeat, SIGCONT: the same child works on."""
    one = scene(hung_s=HUNG_S)
    stopped = [one.process.pid] + ([one.child()] if who == "both" else [])
    for name in (signal.SIGSTOP, signal.SIGCONT):
        for number in stopped:
            os.kill(number, name)
        stopped.reverse()  # the child goes on first: the parent counts from its own first look
        time.sleep(1.5 * HUNG_S)
    assert one.process.poll() is None
    one.process.terminate()
    rest = one.process.communicate(timeout=300)[0].split()
    assert rest[-1] == "over" and rest.count("work") == (
        who == "parent"
    )  # of which the first line has been read for both


def test_a_child_that_fails_is_replaced(scene):
    one = scene('assert reason, "as it began"')
    one.line()
    assert one.line()[:2] == ["chipwise-monitor:", "AssertionError:"]
    assert one.line()[2].strip() == "ended with status 1"


def test_a_child_goes_with_its_parent(scene):
    one = scene()
    child = one.child()
    one.process.kill()
    assert gone(child)


def test_a_child_that_ends_well_is_the_end(scene):
    one = scene("return")
    one.line()
    assert one.line() == ["over"] and one.process.wait(300) == 0


def test_a_child_that_saves_is_waited_for(scene):
    one = scene(
        "signal.signal(signal.SIGTERM, lambda *_: (time.sleep(0.5), os.write(1, b'saved\\n'), sys.exit(0))); "
        "print('armed', flush=True)"
    )
    one.line()
    assert one.line() == ["armed"]
    one.process.terminate()
    assert one.line() == ["saved"] and one.line() == ["over"]
