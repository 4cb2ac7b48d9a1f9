# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise load: what it says of an INI file and of a HAL, here written down as text."""

import os
from types import SimpleNamespace

import pytest

from chipwise import cli
from chipwise.cli import load, python_section, start_window
from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.settings import parse_settings
from chipwise.tool_data.geometry import ToolGeometry
from support import ROOT


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """(the INI file, HAL as {pin: (arrow, signal)}) of a machine on which all is well."""
    hal = {f"motion.analog-{direction}-{n:02d}": ("", "") for direction in ("out", "in") for n in range(4)}
    hal.update({"motion.adaptive-feed": ("", ""), "motion.feed-hold": ("", "")})
    monkeypatch.setattr(
        load, "pins", lambda start="": {pin: link for pin, link in hal.items() if pin.startswith(start)}
    )
    monkeypatch.setattr(load, "signal_of", lambda pin: hal.get(pin, ("", ""))[1])
    monkeypatch.setattr(load, "thread_functions", lambda: ["motion-controller"])
    monkeypatch.setattr(load, "halcmd", lambda *words: pytest.fail(f"halcmd {words}"))
    monkeypatch.setattr(load, "halcmds", lambda *commands: pytest.fail(f"halcmds {commands}"))
    ini = tmp_path / "machine.ini"
    monkeypatch.setenv("INI_FILE_NAME", str(ini))
    ini.write_text(
        "[TRAJ]\nCOORDINATES = XYZ\nLINEAR_UNITS = mm\nMAX_LINEAR_ACCELERATION = 500\n"
        + "".join(f"[AXIS_{axis}]\nMAX_ACCELERATION = 600\n" for axis in "XYZ")
    )
    return ini, hal


def said(function, *arguments):
    with pytest.raises(CycleError) as failure:
        function(*arguments)
    return str(failure.value)


def test_a_usual_machine(machine):
    load.check_machine(Ini())
    load.check_free(parse_settings({}))
    assert load.planner_acceleration(Ini()) == 500 and Ini().units_per_mm() == 1
    assert load.axis_accelerations(Ini()) == {"x": 600, "y": 600, "z": 600}


@pytest.mark.parametrize(
    "text, words",
    [
        ("[TRAJ]\nCOORDINATES = X Z\n", "this machine has no Y axis ([TRAJ]COORDINATES = X Z)"),
        ("[TRAJ]\nCOORDINATES = xy\n", "this machine has no Z axis"),
        ("[DISPLAY]\nDISPLAY = qtvcp qtplasmac\n[TRAJ]\nCOORDINATES = XYZ\n", "plasma machine"),
    ],
)
def test_a_machine_it_cannot_work_on(machine, text, words):
    machine[0].write_text(text)
    assert words in said(load.check_machine, Ini())


@pytest.mark.parametrize("text", ["[TRAJ]\nCOORDINATES = XYYZ\n", "[TRAJ]\nCOORDINATES = X Y Z A C\n", ""])
def test_a_machine_it_can_work_on(machine, text):
    machine[0].write_text(text)
    load.check_machine(Ini())


@pytest.mark.parametrize(
    "settings, taken, words",
    [
        ({}, "motion.analog-out-00", "motion.analog-out-00 is in use (signal theirs); set [CHIPWISE]ANALOG_OUT = 1"),
        ({}, "motion.analog-out-01", "load motmod with num_aio=7 and set [CHIPWISE]ANALOG_OUT = 4"),
        ({}, "motion.analog-in-00", "motion.analog-in-00 is in use (signal theirs); set [CHIPWISE]ANALOG_IN = 1"),
        ({"ANALOG_IN": "1"}, "motion.analog-in-01", "set [CHIPWISE]ANALOG_IN = 0"),
        (
            {"ANALOG_OUT": "2"},
            "",
            "[CHIPWISE]ANALOG_OUT = 2: there is no motion.analog-out-04, motion has 4 of them; set "
            "[CHIPWISE]ANALOG_OUT = 0",
        ),
        ({}, "motion.adaptive-feed", "motion.adaptive-feed is in use (signal theirs)"),
    ],
)
def test_a_pin_that_is_taken(machine, settings, taken, words):
    if taken:
        machine[1][taken] = ("<==", "theirs")
    assert words in said(load.check_free, parse_settings(settings))


def test_the_user_of_a_signal_is_named(machine):
    machine[1].update(
        {"motion.adaptive-feed": ("<==", "theirs"), "thc.0.feed": ("==>", "theirs"), "a.reader": ("<==", "theirs")}
    )
    assert "(signal theirs of thc.0.feed)" in said(load.check_free, parse_settings({}))


@pytest.mark.parametrize(
    "text, words",
    [
        ("[AXIS_X]\nMAX_ACCELERATION = fast\n", "[AXIS_X]MAX_ACCELERATION = fast is not a number above 0"),
        ("[TRAJ]\nMAX_LINEAR_ACCELERATION = -5\n", "[TRAJ]MAX_LINEAR_ACCELERATION = -5 is not a number above 0"),
        ("[TRAJ]\nMAX_LINEAR_ACCELERATION = {nan}\n", "[TRAJ]MAX_LINEAR_ACCELERATION = {nan} is not"),
    ],
)
def test_an_acceleration_that_is_none(machine, text, words):
    machine[0].write_text(text)
    assert words in said(load.planner_acceleration, Ini())


@pytest.mark.parametrize(
    "text, planner, axes",
    [
        ("", 1, {"x": 1, "y": 1, "z": 1}),
        ("[TRAJ]\nMAX_LINEAR_ACCELERATION = 500\n", 1, {"x": 1, "y": 1, "z": 1}),
        ("[AXIS_X]\nMAX_ACCELERATION = 500\n[AXIS_Y]\nMAX_ACCELERATION = 400\n", 1, {"x": 500, "y": 400, "z": 1}),
        ("[AXIS_X]\nMAX_ACCELERATION = 0.5\n", 0.5, {"x": 0.5, "y": 1, "z": 1}),
    ],
)
def test_an_axis_without_an_acceleration_has_linuxcncs(machine, text, planner, axes):
    machine[0].write_text(text)
    assert load.planner_acceleration(Ini()) == planner and load.axis_accelerations(Ini()) == axes


# --- what LinuxCNC has expanded ------------------------------------------------


@pytest.mark.parametrize(
    "line, words",
    [
        ("#INCLUDE /no/such/chipwise_codes.inc", 'LinuxCNC has not expanded "#INCLUDE /no/such/chipwise_codes.inc"'),
        ("  #include chipwise.inc", 'has not expanded "#include chipwise.inc"'),
        (
            "# handle_includes(): <37> CANNOT READ /opt/chipwise.inc",
            "LinuxCNC cannot read /opt/chipwise.inc; correct the #INCLUDE line",
        ),
    ],
)
def test_an_include_that_linuxcnc_has_left(machine, line, words):
    with machine[0].open("a") as file:
        file.write(line + "\n")
    assert words in said(python_section.check_includes, Ini())


@pytest.mark.parametrize(
    "line",
    [
        "#*** Begin #INCLUDE file: /usr/local/share/chipwise/configs/chipwise.inc",
        "#INCLUDE spindle.inc",
        "# handle_includes(): <37> CANNOT READ spindle.inc",
        "##INCLUDE chipwise.inc",
    ],
)
def test_other_includes_are_not_ours(machine, line):
    with machine[0].open("a") as file:
        file.write(line + "\n")
    python_section.check_includes(Ini())


def test_what_linuxcnc_2_10_includes_itself(machine):
    """2.10 has no INI.expanded: a file that is included counts, and those that it includes, beside it."""
    folder = machine[0].parent
    (folder / "below").mkdir()
    (folder / "below/chipwise.inc").write_text("[CHIPWISE]\nCELL = 0.125\n#INCLUDE spindle.inc\r\n")
    (folder / "below/spindle.inc").write_text(
        "[SPINDLE_0]\nMAX_FORWARD_VELOCITY = 7000\n#INCLUDE spindle.inc\n"
    )  # LinuxCNC refuses that
    text = machine[0].read_text() + "#INCLUDE  below/chipwise.inc\n"
    machine[0].write_text(text + "[TRAILER]\nHERE = 1\n")
    ini = Ini()
    python_section.check_includes(ini)
    assert (
        ini.text("CHIPWISE", "CELL"),
        ini.text("SPINDLE_0", "MAX_FORWARD_VELOCITY"),
        ini.text("TRAILER", "HERE"),
    ) == ("0.125", "7000", "1")
    before = machine[0].with_suffix(".ini.expanded")
    before.write_text(text)
    assert 'has not expanded "#INCLUDE  below/chipwise.inc"' in said(python_section.check_includes, Ini(str(before)))


# --- the [PYTHON] section ---------------------------------------------------

REMAPS = "[RS274NGC]\nREMAP = M250 modalgroup=10 argspec=pqrijkN python=m250\n"


def own(tmp_path, section, remap="def m600(self): pass\n"):
    (tmp_path / "python").mkdir()
    (tmp_path / "python" / "remap.py").write_text(remap)
    ini = tmp_path / "own.ini"
    ini.write_text(REMAPS + section + "[PYTHON]\nTOPLEVEL = nowhere/toplevel.py\n")  # a second section does not count
    return str(ini)


GOOD = f"[PYTHON]\nTOPLEVEL = python/toplevel.py\nPATH_PREPEND = python\nPATH_APPEND = {python_section.CODES}\n"


@pytest.mark.parametrize(
    "section, remap",
    [
        (GOOD, "from chipwise.codes import *\n"),
        (f"[PYTHON]\nPATH_PREPEND = {python_section.CODES}\nTOPLEVEL = {python_section.CODES}/toplevel.py\n", ""),
    ],
)
def test_a_python_section_that_knows_the_codes(tmp_path, section, remap):
    python_section.check_codes(Ini(own(tmp_path, section, remap)))


@pytest.mark.parametrize(
    "section, remap",
    [
        (GOOD, ""),
        (GOOD, "# from chipwise.codes import *\n"),
        (GOOD.replace("PATH_APPEND", "#PATH_APPEND"), "from chipwise.codes import *\n"),
        ("[PYTHON]\nTOPLEVEL = python/toplevel.py\n", ""),
    ],
)
def test_a_python_section_that_does_not(tmp_path, section, remap):
    text = said(python_section.check_codes, Ini(own(tmp_path, section, remap)))
    assert f"PATH_APPEND = {python_section.CODES}" in text and "from chipwise.codes import *" in text


@pytest.mark.parametrize(
    "section",
    (
        "[PYTHON]\nTOPLEVEL = {other}/toplevel.py\nPATH_PREPEND = {other}\n",
        "[PYTHON]\nTOPLEVEL = python/toplevel.py\nPATH_PREPEND = python\nPATH_APPEND = {other}\n",
    ),
)
def test_codes_of_another_copy(tmp_path, section):
    """As with `make install` of a copy beside the packages: LinuxCNC starts the components of one, and the INI file
    names the other."""
    other = tmp_path / "share/chipwise/remap"
    (other / "chipwise").mkdir(parents=True)
    (other / "chipwise/codes.py").touch()
    text = said(python_section.check_codes, Ini(own(tmp_path, section.format(other=other))))
    assert (
        f"from the chipwise in {other}," in text
        and f"in {python_section.CODES};" in text
        and "chipwise new-config" in text
    )


def test_a_module_of_the_machine_comes_first(tmp_path):
    """LinuxCNC 2.10 takes the [PYTHON] sections as one: with those of chipwise.inc behind its own, as install.md has,
    TOPLEVEL still imports the machine's module remap."""
    text = (ROOT / "configs/chipwise.inc.in").read_text().replace("@SHARE@/remap", python_section.CODES)
    second = text.split("\n[PYTHON]\n")[1].split("\n[CHIPWISE]\n")[0]
    path = [str(tmp_path / "elsewhere")]
    for line in (GOOD + second).splitlines():  # as python_plugin.cc of 2.10 does it
        key, _equals, value = (part.strip() for part in line.partition("="))
        if key == "PATH_PREPEND":
            path.insert(0, value)
        elif key == "PATH_APPEND":
            path.append(value)
    assert path.index("python") < path.index(python_section.CODES)
    assert (GOOD + second).index("TOPLEVEL = python/") < (GOOD + second).index(f"TOPLEVEL = {python_section.CODES}")


def test_no_python_section_and_no_codes(tmp_path):
    ini = tmp_path / "own.ini"
    ini.write_text(REMAPS)
    assert "no [PYTHON] section" in said(python_section.check_codes, Ini(str(ini)))
    ini.write_text("[HAL]\nHALFILE = x.hal\n")
    python_section.check_codes(Ini(str(ini)))


BALL = {2: ToolGeometry("ball"), 9: ToolGeometry("vee", tip_angle=60.0)}


@pytest.mark.parametrize(
    "table, unit, shapes, cell",
    [
        ("T1 P1 D3.0 ;small\nT2 P2 D2\n", "mm", {}, 0.1),
        ("T1 P1 D13.5\nT9 P9 ;a probe\n", "mm", {}, 0.15),
        ("T1 D6\nT2 D50\n", "mm", {}, 0.25),
        ("T1 P1 D0.5\n", "inch", {}, 25.4 * 0.5 / 90),
        ("", "mm", {}, 0.25),
        ("nonsense\n", "mm", {}, 0.25),
        (None, "mm", {}, 0.25),
        ("T1 P1 D12.3\nT2 P2 D6\n", "mm", BALL, 12.3 / 90),
        ("T1 P1 D12.3\nT2 P2 D7\n", "mm", BALL, 7 / 48),
        ("T9 P9 D8\nT3 P3 D2\n", "mm", BALL, 8 / 48),
        ("T1 P1 D7.2\n", "mm", None, 0.15),
    ],
)
def test_the_finest_cell_follows_the_tools(tmp_path, table, unit, shapes, cell):
    """A flat tool has 90 cells across at most, a round one, or one of unknown shape, 48; without a table all stocks
    have CELL."""
    if table is not None:
        (tmp_path / "my.tbl").write_text(table)
    path = tmp_path / "my.ini"
    path.write_text(f"[EMCIO]\nTOOL_TABLE = my.tbl\n[TRAJ]\nLINEAR_UNITS = {unit}\n")
    assert load.finest_cell(Ini(str(path)), {"CELL": 0.25, "FINEST_CELL": 0.1}, shapes) == pytest.approx(cell)


def test_a_geometry_file_that_cannot_be_used_leaves_the_shapes_unknown(tmp_path):
    (tmp_path / "tools.toml").write_text("[tool.1]\nshape = 3\n")
    assert load.tool_shapes(parse_settings({"TOOL_GEOMETRY": "tools.toml"}, str(tmp_path))) is None
    assert load.tool_shapes(parse_settings({}, str(tmp_path))) == {}


def block(uid, cuid, perms=0o600, key=load.STOCK_MAGIC):
    return {"key": key, "shmid": 1, "perms": perms, "size": 4096, "uid": uid, "cuid": cuid}


def test_a_map_of_another_user(monkeypatch):
    """Named with its owner, and with who may remove it; the user's own, made by root or not, is left to
    stock_tracker."""
    us = os.getuid()
    for blocks in ([], [block(us, us)], [block(us, 0)], [block(us + 1, us + 1, key=100)]):
        monkeypatch.setattr(load, "shared_memory", lambda blocks=blocks: blocks)
        load.check_map_key()
    for foreign in (block(us + 1, 0), block(us + 1, us + 1), block(us, us + 1), block(us, 0, 0o622)):
        monkeypatch.setattr(load, "shared_memory", lambda foreign=foreign: [foreign])
        monkeypatch.setattr(load.pwd, "getpwuid", lambda uid: SimpleNamespace(pw_name=f"user{uid}"))
        assert (
            f"belongs to user user{foreign['uid']}, whose LinuxCNC runs or was killed; end that LinuxCNC, then run "
            f"`ipcrm -M 0x43575354` as user{foreign['uid']} or as root" in said(load.check_map_key)
        )


@pytest.mark.parametrize(
    "display, ini, terminal, needed",
    [
        (":0", "/x.ini", False, True),
        ("", "/x.ini", False, False),
        (":0", "", False, False),
        (":0", "/x.ini", True, False),
    ],
)
def test_when_the_reason_gets_a_window(monkeypatch, display, ini, terminal, needed):
    """Started by LinuxCNC from a menu: there its own window begins with a hundred lines of settings."""
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("INI_FILE_NAME", ini)
    monkeypatch.setattr(start_window.os, "isatty", lambda _handle: terminal)
    started = []
    monkeypatch.setattr(start_window.subprocess, "Popen", lambda words, **_options: started.append(words))
    cli.fail(["load"], "chipwise: why")
    assert [words[-1] for words in started] == ["chipwise: why"] * needed
    cli.fail(["check"], "chipwise: why")
    assert len(started) == needed
