# SPDX-License-Identifier: GPL-2.0-or-later
"""CLAMP comments of the loaded program (monitor/comment_clamps.py) without a LinuxCNC, and the process that reads
them."""

import os
import types

import pytest

from chipwise.check import asked
from chipwise.errors import CycleError
from chipwise.monitor import comment_clamps as module
from chipwise.monitor import comment_process, saying
from chipwise.program.program_file import Unreadable
from chipwise.stock import reasons
from support.check_runs import mill_with_tools
from support.reading import Reading
from support.scenes import SCENE

LINUXCNC = types.SimpleNamespace(INTERP_IDLE=1, stat=None, error=OSError)
JAW = "(CLAMP,BOX,XMIN=40,YMIN=-12,ZMIN=-20,XMAX=60,YMAX=-2,ZMAX=8)\n"
PART = (
    "G90 G17\n(clamp, left side first)\n"
    + JAW
    + "G21 G54\nG0 X0 Y0 Z50\nM256 P2\n(CLAMP,CYLINDER,X=80,Y=75,ZMIN=-20,ZMAX=8,DIAMETER=10)\nG0 X1\n"
)
FOUND = [[0, 0, 0.0, [40.0, -12.0, -20.0], [60.0, -2.0, 8.0], "the clamp of line 3"]]


@pytest.fixture(name="mill", scope="module")
def make_mill(tmp_path_factory):
    mill = mill_with_tools(tmp_path_factory.mktemp("mill"))
    (mill.parent / "clamps.toml").write_text("[set_up.2.clamp.vice]\nbox = [1, 2, 3, 4, 5, 6]\n")
    return mill


def answered(mill, path, text, **scene):
    path.write_text(text)
    return comment_process.answer({"ini": str(mill), "program": str(path), "scene": SCENE | scene}, str(path.parent))


def test_where_they_are_on_the_machine(mill, tmp_path):
    """With the M256 before each; behind the last of them nothing is read."""
    path = tmp_path / "part.ngc"
    jaw, post = answered(mill, path, PART + "G1 X2 F1e99 G77\nno program\n", offset=[100.0, 0.0, 5.0])["clamps"]
    assert jaw == [0, 0, 0.0, [140.0, -12.0, -15.0], [160.0, -2.0, 13.0], "the clamp of line 3"]
    assert post == [1, 1, 0.0, [175.0, 70.0, -15.0], [185.0, 80.0, 13.0], "the clamp of line 7"]


def test_a_program_with_a_sub_is_read_to_its_end(mill, tmp_path):
    path = tmp_path / "part.ngc"
    assert answered(mill, path, PART + "M2\n")["clamps"] and comment_process.last_line(str(path)) == 7
    text = (
        "o100 sub\n(CLAMP,CYLINDER,X=#1,Y=75,ZMIN=-20,ZMAX=8,DIAMETER=10)\no100 endsub\n"
        + JAW
        + "G21 G0 X0 Y0 Z50\no100 call [3]\n"
    )
    path.write_text(text)
    assert comment_process.last_line(str(path)) is None


@pytest.mark.parametrize(
    "text, said",
    [
        (JAW.replace("XMIN", "XMINE") + "G0 X0\nM2\n", "BOX lacks XMIN"),
        (JAW.strip() + " (no)\nG0 X0\nM2\n", "another comment is behind"),
    ],
)
def test_a_comment_that_is_wrong(mill, tmp_path, text, said):
    with pytest.raises(Unreadable, match=said):
        answered(mill, tmp_path / "part.ngc", "G21\n" + text)


@pytest.mark.parametrize(
    "error, why",
    [
        (Unreadable("line 3 is bent", "straighten it"), "line 3 is bent; straighten it"),
        (CycleError("it is bent", "straighten it"), "it is bent; straighten it"),
    ],
)
def test_a_refusal_is_the_answer(error, why):
    def answer(order, folder):
        assert order == "order" and os.path.isdir(folder)
        raise error

    assert asked.reasoned(answer, "order", "clamps") == {"why": why}
    assert asked.reasoned(lambda order, _folder: order, "order", "clamps") == "order"


@pytest.fixture(name="scene")
def make_scene(tmp_path, monkeypatch):
    """(CommentClamps, its pins, the status, look(), what was said); the loaded program is part.ngc."""
    path = tmp_path / "part.ngc"
    path.write_text(PART)
    status = types.SimpleNamespace(file=str(path), interp_state=1, queue=0, inpos=True)
    monkeypatch.setattr(saying, "Quiet", lambda *_: lambda: True)
    monkeypatch.setattr(module.loaded, "scene", lambda _status: SCENE)
    pins, said = {"program-running": False, "request": 0}, []
    files = types.SimpleNamespace(stock=object(), laid=[])
    files.clamps = types.SimpleNamespace(
        dropped=set(), reply=reasons.DONE, waits=False, has=lambda _source: bool(files.laid and files.laid[-1])
    )

    def lay(_source, clamps):
        files.laid.append([clamp.name for _after, clamp in clamps])
        return files.clamps.reply

    files.lay_clamps = lay
    clamps = module.CommentClamps(pins, files, "mill.ini", said.append)
    clamps.reading = Reading()

    def look(times=2):
        for _ in range(times):
            clamps.follow(LINUXCNC, status)

    return clamps, pins, status, look, said


def test_they_are_in_force_from_the_opening_to_that_of_another_program(scene, tmp_path):
    clamps, pins, status, look, said = scene
    look()
    assert not clamps.has_read(status.file) and clamps.reading.order["program"] == status.file
    clamps.reading.answer = {"why": "", "clamps": FOUND}
    pins["request"] = 3
    look()
    assert not clamps.files.laid and not clamps.has_read(status.file)
    pins["request"], clamps.files.clamps.reply = 0, reasons.BUSY
    look()
    assert clamps.files.laid == [["the clamp of line 3"]] and not clamps.has_read(status.file) and not said
    clamps.files.clamps.reply = reasons.DONE
    look()
    assert clamps.has_read(status.file) and said == [
        "part.ngc: 1 clamp of its comments: the machine stops before a move comes too near"
    ]
    status.interp_state, pins["program-running"] = 2, True
    clamps.files.clamps.dropped = {"comments"}
    look()
    assert len(clamps.files.laid) == 1
    status.interp_state, pins["program-running"] = 1, False
    clamps.follow(LINUXCNC, status)
    clamps.files.clamps.dropped = set()
    look()
    assert clamps.files.laid == [["the clamp of line 3"]] * 2
    (tmp_path / "other.ngc").write_text("G0 X1\nM2\n")
    status.file = str(tmp_path / "other.ngc")
    look()
    assert (
        clamps.files.laid[-1] == [] and clamps.has_read(status.file) and clamps.reading.order["program"] != status.file
    )


def test_a_run_that_begins_before_they_are_read(scene):
    """It is said, and they count as soon as they are known."""
    clamps, pins, status, look, said = scene
    look()
    status.interp_state, pins["program-running"] = 2, True
    look()
    assert (
        said == ["part.ngc has begun before the clamps of its comments were read, so they are not in force yet"]
        and not clamps.files.laid
    )
    clamps.reading.answer = {"why": "", "clamps": FOUND}
    look()
    assert clamps.files.laid == [["the clamp of line 3"]] and "1 clamp of its comments" in said[-1]


@pytest.mark.parametrize(
    "why, reply, wanted",
    [
        ("XMIN is not a number (line 3)", reasons.DONE, "not in force: XMIN is not a number"),
        ("", reasons.NOT_TAKEN, "not in force: the stock tracker does not take"),
    ],
)
def test_why_they_are_not_in_force(scene, why, reply, wanted):
    clamps, _pins, status, look, said = scene
    look()
    clamps.files.clamps.reply = reply
    clamps.reading.answer = {"why": why, "clamps": FOUND}
    look()
    assert wanted in said[0] and clamps.has_read(status.file)
