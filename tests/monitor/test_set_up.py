# SPDX-License-Identifier: GPL-2.0-or-later
"""The set-up of the loaded program (monitor/set_up.py) without a LinuxCNC, and its process (setup/job_process.py):
whatever is there, a sentence and nothing applied."""

import contextlib
import hashlib
import types

import pytest

from chipwise.monitor import saying
from chipwise.monitor import set_up as module
from chipwise.monitor.tool_shape import Tool
from chipwise.rates import MAX_RATE
from chipwise.settings import parse_settings
from chipwise.stock import reasons
from chipwise.setup import job_process
from chipwise.setup.job import Job, JobTool, text_of
from support.check_runs import mill_with_tools
from support.scenes import SCENE

SLOT = "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG55 G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"
LINUXCNC = types.SimpleNamespace(
    INTERP_IDLE=1, MODE_MANUAL=1, MODE_AUTO=2, MODE_MDI=3, STATE_ON=4, stat=None, error=OSError
)
TOOLS = {"1": [6.0, 3000.0, 2.0], "2": [3.0, None, 1.0]}
ANSWER = {
    "why": "",
    "material": "",
    "low": [0, 0, -9],
    "high": [9, 9, 0],
    "to_machine": None,
    "text": "from a to b",
    "tools": TOOLS,
    "air": False,
    "keeps_f": "",
    "clamps": [],
}
JAW = [0, 90.0, [0.0, 0.0, -9.0], [5.0, 5.0, 9.0], "clamp jaw of the set-up of part.ngc"]


def job_of(path, **changes):
    """A program's job file beside it; changes: of its Job."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    fields = {
        "program": path.name,
        "digest": digest,
        "low": (0.0, 0.0, -20.0),
        "high": (100.0, 60.0, 0.0),
        "source": "option",
        "material": "",
        "tools": {1: JobTool(6.0, 3000.0, 2.0)},
    }
    path.with_name(path.stem + ".job.toml").write_text(text_of(Job(**(fields | changes))))


def answered(tmp_path, program, ini=None):
    """What the process answers."""
    order = {
        "ini": str(ini or mill_with_tools(tmp_path)),
        "program": str(program),
        "job": str(program.with_name(program.stem + ".job.toml")),
        "scene": SCENE,
    }
    return job_process.answer(order, str(tmp_path))


@pytest.fixture(name="part")
def make_part(tmp_path):
    path = tmp_path / "part.ngc"
    path.write_text(SLOT)
    job_of(path)
    return path


def test_the_stock_lies_where_the_first_move_is(tmp_path, part):
    """In G55, which the program chooses, not in G54."""
    machine = mill_with_tools(tmp_path)
    found = answered(tmp_path, part, machine)
    assert (
        found["why"] == ""
        and found["tools"] == {1: [6.0, 3000.0, 2.0]}
        and found["text"] == "from 0 0 -20 to 100 60 0 mm"
    )
    turn, offset, g92 = found["to_machine"]
    assert turn == 0 and list(g92)[:3] == [0, 0, 0] and len(offset) == 3
    job_of(part, source="program")
    assert answered(tmp_path, part, machine)["to_machine"] is None


@pytest.mark.parametrize(
    "spoil, said",
    [
        (lambda p: p.write_text(SLOT + "\n"), "was changed since it was set up"),
        (lambda p: job_of(p, program="other.ngc"), "is the set-up of other.ngc"),
        (lambda p: p.with_name("part.job.toml").write_text("]["), "it is not TOML"),
        (lambda p: p.with_name("part.job.toml").write_bytes(b"\0\xff" * 99), "it is not UTF-8"),
        (
            lambda p: (
                p.with_name("part.job.toml").rename(p.with_name("x")),
                p.with_name("part.job.toml").symlink_to(p.with_name("x")),
            ),
            "is a link",
        ),
        (lambda p: (p.with_name("part.job.toml").unlink(), p.with_name("part.job.toml").mkdir()), "cannot be read"),
        (lambda p: p.with_name("part.job.toml").unlink(), "it is not there any more"),
        (lambda p: p.unlink(), "the program cannot be read"),
    ],
)
def test_a_sentence_and_no_set_up(tmp_path, part, spoil, said):
    spoil(part)
    found = answered(tmp_path, part)
    assert said in found["why"] and not found["why"].startswith("chipwise:") and set(found) == {"why"}


# ---- in the monitor --------------------------------------------------------------------------------------------------


class Command:
    def __init__(self, status):
        self.status, self.sent = status, []

    def set_adaptive_feed(self, value):
        self.sent.append(value)
        self.status.adaptive_feed_enabled = bool(value)


class Reading:
    """In place of the process."""

    child, answer = None, None

    def ask(self, order):
        self.order = order

    def take(self):
        found, self.answer = self.answer, None
        return found

    def end(self):
        pass


@pytest.fixture(name="scene")
def make_scene(tmp_path, part, monkeypatch):
    """(SetUp, its pins, the status, the command, what was said)."""
    status = types.SimpleNamespace(
        file=str(part),
        interp_state=1,
        queue=0,
        inpos=True,
        adaptive_feed_enabled=False,
        task_mode=1,
        task_state=4,
        poll=lambda: None,
    )
    pins = dict.fromkeys(
        (
            "program-running",
            "job",
            "job-stock",
            "job-target",
            "job-active",
            "job-waits",
            "run-end",
            "certain",
            "stock-defined",
            "request",
        ),
        0,
    )
    files = types.SimpleNamespace(stock=None, kept_is_due=False, count=lambda: 0, emptied=0, laid=[])
    files.working = contextlib.nullcontext
    files.clamps = types.SimpleNamespace(
        dropped=set(), reply=reasons.DONE, has=lambda source: bool(files.laid and files.laid[-1][1])
    )
    files.lay_clamps = lambda source, clamps: files.laid.append((source, clamps)) or files.clamps.reply
    said = []
    for one in (module, saying):
        monkeypatch.setattr(one, "Quiet", lambda *_: lambda: True)
    monkeypatch.setattr(module.loaded, "scene", lambda _status: SCENE)
    set_up = module.SetUp(pins, parse_settings({}), files, "mill.ini", said.append)
    set_up.reading = Reading()
    return set_up, pins, status, Command(status), said


def look(scene, times=1):
    set_up, _pins, status, command, _said = scene
    for _ in range(times):
        set_up.check(status.file)
        claims = set_up.follow(LINUXCNC, status, command)
    return claims


def in_force(scene, **changes):
    set_up, pins, *_ = scene
    look(scene)
    set_up.reading.answer = ANSWER | changes
    look(scene, 4)
    assert pins["job"] is True


def test_its_material_counts_while_it_is_in_force(scene, part):
    """From the job file; not before, and not behind a change of the program."""
    job_of(part, material="C45")
    assert answered(part.parent, part)["material"] == "C45"
    set_up, _pins, _status, *_ = scene
    look(scene)
    assert set_up.material() == ""
    in_force(scene, material="C45")
    assert set_up.material() == "C45"
    part.write_text(SLOT + "\n")
    set_up.check(str(part))
    assert set_up.material() == ""


def test_its_clamps_are_in_force_before_it_is(scene, part):
    """On the machine, turned with the work coordinates; M256 of a run takes them away until its end, another program
    for good."""
    set_up, pins, status, _command, said = scene
    look(scene)
    set_up.reading.answer = ANSWER | {"clamps": [JAW]}
    look(scene, 3)
    assert not set_up.files.laid and not pins["job"]
    set_up.files.stock, set_up.files.clamps.reply = object(), reasons.BUSY
    look(scene, 3)
    ((source, ((after, clamp),)),) = set_up.files.laid
    assert (source, after, clamp.turn, clamp.high, clamp.name) == (
        "job",
        0,
        90.0,
        (5.0, 5.0, 9.0),
        JAW[4],
    ) and not pins["job"]
    set_up.files.clamps.reply = reasons.DONE
    look(scene, 3)
    assert pins["job"] is True and "and its clamp; the feed is" in said[-1] and len(set_up.files.laid) == 1
    status.interp_state, pins["program-running"] = 2, True
    look(scene)
    status.interp_state, pins["program-running"], pins["run-end"] = 1, False, 1
    look(scene, 2)
    assert len(set_up.files.laid) == 1
    status.interp_state, pins["program-running"] = 2, True
    look(scene)
    set_up.files.clamps.dropped = {"job"}
    status.interp_state, pins["program-running"] = 1, False
    look(scene, 2)
    set_up.files.clamps.dropped = set()
    assert len(set_up.files.laid) == 2
    part.write_text(SLOT + "\n")
    look(scene)
    assert set_up.files.laid[-1] == ("job", []) and not pins["job"]


def test_a_tracker_that_refuses_its_clamps(scene):
    set_up, pins, _status, _command, said = scene
    look(scene)
    set_up.files.stock, set_up.files.clamps.reply = object(), reasons.NOT_TAKEN
    set_up.reading.answer = ANSWER | {"clamps": [JAW]}
    look(scene, 4)
    assert (
        not pins["job"]
        and "its set-up is not used: its clamps are not in force: the stock tracker does not take" in said[0]
    )


def test_without_a_job_file_nothing_is_done(scene, part):
    set_up, pins, _status, command, said = scene
    part.with_name("part.job.toml").unlink()
    assert (
        look(scene, 5) is False
        and command.sent == []
        and said == []
        and not pins["job"]
        and not hasattr(set_up.reading, "order")
    )


def test_it_is_in_force_once_adaptive_feed_is_on(scene):
    set_up, pins, status, command, said = scene
    assert look(scene) is True and not pins["job"]
    status.task_mode = LINUXCNC.MODE_AUTO
    set_up.reading.answer = dict(ANSWER)
    look(scene, 4)
    assert command.sent == [] and not pins["job"] and len(said) == 1 and "waits for manual mode or MDI" in said[0]
    status.task_mode, status.task_state = LINUXCNC.MODE_MDI, 1
    look(scene, 3)
    assert command.sent == [] and not pins["job"]
    status.task_state = 4
    look(scene, 4)
    assert command.sent == [1] and pins["job"] is True and "set up as confirmed" in said[1]
    status.adaptive_feed_enabled = False  # M52 P0 of the operator stays
    look(scene, 4)
    assert not pins["job"] and command.sent == [1]


def test_in_auto_the_first_f_switches_adaptive_feed_on(scene):
    """Where F is remapped; in manual mode the monitor does it itself."""
    set_up, pins, status, command, said = scene
    set_up.feed_is_remapped, status.task_mode = True, LINUXCNC.MODE_AUTO
    look(scene)
    set_up.reading.answer = dict(ANSWER)
    look(scene, 3)
    assert pins["job"] is True and pins["job-waits"] is True and command.sent == [] and "set up as confirmed" in said[0]
    status.adaptive_feed_enabled = True
    look(scene, 2)
    assert pins["job"] is True and pins["job-waits"] is False and len(said) == 1
    status.adaptive_feed_enabled, status.task_mode = False, LINUXCNC.MODE_MANUAL
    look(scene)
    assert pins["job"] is False and command.sent == [1]


@pytest.mark.parametrize("change", ["program", "content"])
def test_another_program_in_the_look_in_which_it_runs(scene, tmp_path, part, change):
    """A late monitor sees the end of one and the start of another at once: check() comes before program-running."""
    set_up, pins, status, *_ = scene
    in_force(scene)
    if change == "program":
        status.file = str(tmp_path / "other.ngc")
        (tmp_path / "other.ngc").write_text(SLOT)
    else:
        part.write_text(SLOT + "G4 P1\n")
    status.interp_state = 2
    set_up.check(status.file)
    assert pins["job"] is False
    pins["program-running"] = True
    look(scene, 3)
    assert pins["job"] is False


def test_a_run_that_came_too_early_has_none_of_it(scene):
    set_up, pins, status, command, said = scene
    look(scene)
    status.interp_state, pins["program-running"] = 2, True
    set_up.reading.answer = dict(ANSWER)
    look(scene, 3)
    assert not pins["job"] and command.sent == []
    status.interp_state, pins["program-running"], pins["run-end"] = 1, 0, 1
    look(scene, 4)
    assert "not in force in this run" in said[0] and pins["job"] is True


@pytest.mark.parametrize(
    "number, diameter, target, wanted",
    [
        (1, 6.0, 3000.0, 6.0),
        (1, 6.05, 3000.0, 6.05),
        (1, 8.0, 0.0, 8.0),
        (1, 0.0, 3000.0, 6.0),
        (2, 3.0, 0.0, 3.0),
        (7, 6.0, 0.0, 6.0),
        (0, 0.0, 0.0, 0.0),
    ],
)
def test_the_target_is_that_of_the_tool(scene, number, diameter, target, wanted):
    """Another diameter than the confirmed one, another tool, a drill: F."""
    set_up, pins, *_ = scene
    in_force(scene)
    assert set_up.tool(number, Tool(diameter), 1.0).diameter == wanted and pins["job-target"] == target


@pytest.mark.parametrize("number, target, ceiling", [(1, 3000.0, 2.0), (2, MAX_RATE, 1.0), (7, 0.0, 2.0)])
def test_feeds_above_the_stock_are_free(scene, number, target, ceiling):
    """A drill goes at F in the stock, and with the others as fast as the axes above it; an unknown tool keeps F. Not
    without REMAP = F, nor with a code that keeps F."""
    set_up, pins, _status, _command, said = scene
    set_up.feed_is_remapped = True
    in_force(scene, air=True)
    assert pins["job-air"] and "and above the stock that of the axes" in said[-1]
    set_up.tool(number, Tool(TOOLS[str(number)][0] if number < 7 else 6.0), 1.0)
    assert (pins["job-target"], pins["job-ceiling"]) == (target, ceiling)
    set_up.answer["keeps_f"] = "M52"
    set_up.tool(2, Tool(3.0), 1.0)
    assert not set_up.air() and pins["job-target"] == 0.0
    set_up.end()
    assert not pins["job-air"]


def test_air_needs_an_f_that_is_seen(scene):
    in_force(scene, air=True)
    assert not scene[1]["job-air"] and "axes" not in scene[-1][-1]


def test_the_only_tool_of_a_program_that_calls_none(scene):
    set_up, pins, *_ = scene
    in_force(scene)
    set_up.tools = {1: TOOLS["1"]}
    assert set_up.tool(0, Tool(), 1 / 25.4).diameter == pytest.approx(6 / 25.4) and pins["job-target"] == 3000.0
    assert set_up.tool(5, Tool(), 1.0).diameter == 0 and pins["job-target"] == 0.0


def test_the_only_tool_of_another_set_up(scene, tmp_path):
    """No tool and no target are left of a set-up when another program is there."""
    set_up, pins, status, *_ = scene
    in_force(scene)
    set_up.tools = {1: TOOLS["1"]}
    status.file = ""
    look(scene)
    assert set_up.tool(0, Tool(), 1.0).diameter == 0 and pins["job-target"] == 0.0 and not pins["job"]


def test_the_program_is_read_when_nothing_more_is_to_come(scene, part, tmp_path):
    """For a display that waits before it starts the program: not before the job file has been read and its set-up is in
    force, nor for another program."""
    set_up, _pins, status, *_ = scene
    path = str(part)
    assert not set_up.has_read(path)
    look(scene)
    assert not set_up.has_read(path)
    set_up.reading.answer = dict(ANSWER)
    look(scene, 4)
    assert set_up.has_read(path) and not set_up.has_read(str(tmp_path / "other.ngc"))
    status.file = str(tmp_path / "other.ngc")
    (tmp_path / "other.ngc").write_text(SLOT)
    assert not look(scene) and set_up.has_read(status.file) and not set_up.has_read(path)


def test_a_set_up_that_is_refused_or_waits_for_another_mode_has_been_read(scene, part):
    set_up, _pins, status, *_ = scene
    look(scene)
    set_up.reading.answer = {"why": "it is not TOML"}
    look(scene)
    assert set_up.has_read(str(part))
    part.write_text(SLOT + "G4 P1\n")
    look(scene)
    status.task_mode, set_up.reading.answer = LINUXCNC.MODE_AUTO, dict(ANSWER)
    look(scene, 4)
    assert set_up.has_read(str(part)) and set_up.said_mode
