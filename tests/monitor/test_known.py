# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether the loaded program has been read, and whose the stock is (monitor/known.py), and what of it an assumed stock
says (monitor/shadow.py)."""

import contextlib
import shutil
import types

import pytest

from chipwise.monitor import known, saying
from chipwise.monitor import shadow as module
from chipwise.settings import parse_settings
from support.reading import Reading

PART = "/a/part.ngc"
LINUXCNC = types.SimpleNamespace(INTERP_IDLE=1, error=OSError, stat=None)


def shown(shadow=True, set_up=True, clamps=True, claims=False, has_stock=False, path=PART, **pins):
    """The two pins."""
    pins = dict.fromkeys(("stock-defined", "certain"), False) | {
        name.replace("_", "-"): value for name, value in pins.items()
    }
    known.show(
        pins,
        path,
        types.SimpleNamespace(has_read=lambda _path: shadow),
        types.SimpleNamespace(has_read=lambda _path: set_up, claims=claims, has_stock=lambda: has_stock),
        types.SimpleNamespace(has_read=lambda _path: clamps),
    )
    return pins[known.PROGRAM_READ], known.SOURCES[pins[known.STOCK_SOURCE]]


def test_all_have_read_it():
    assert shown()[0] == known.checksum(PART) > 0
    assert shown(shadow=False)[0] == shown(set_up=False)[0] == shown(clamps=False)[0] == shown(path="")[0] == 0
    assert shown(shadow=False, claims=True)[0] == known.checksum(PART)  # a set-up: nothing is assumed


def test_whose_the_stock_is():
    assert [
        shown(has_stock=job, stock_defined=defined, certain=certain)[1]
        for defined, certain, job in (
            (False, False, False),
            (False, True, True),
            (True, False, False),
            (True, True, False),
            (True, True, True),
        )
    ] == [None, None, "assumed", "program", "job"]


@pytest.fixture(name="scene")
def make_scene(tmp_path, monkeypatch):
    """(Shadow, its pins, look(), what was said); the loaded program is part.ngc."""
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\nM2\n")
    status = types.SimpleNamespace(file=str(part), interp_state=1, queue=0, inpos=True, poll=lambda: None)
    monkeypatch.setattr(saying, "Quiet", lambda *_: lambda: True)
    monkeypatch.setattr(module.loaded, "scene", lambda _status: {"tool": 1})
    monkeypatch.setattr(module.loaded, "place", lambda _scene: (1,))
    pins, said = dict.fromkeys(("stock-defined", "certain", "request", "new-part", "parts"), 0), []
    files = types.SimpleNamespace(working=contextlib.nullcontext)
    shadow = module.Shadow(pins, parse_settings({}), files, str(tmp_path / "mill.ini"), said.append)
    shadow.reading, shadow.written_to = Reading(), []
    monkeypatch.setattr(shadow, "_write", lambda *arguments: shadow.written_to.append(arguments))

    def look(times=1):
        for _ in range(times):
            shadow.follow(LINUXCNC, status, status.file)

    return shadow, pins, look, said


BOX = {"why": "", "low": [0, 0, -1], "high": [1, 1, 0]}
NONE = {"why": "the program feeds at one height only", "low": None}


def test_it_is_on_unless_the_ini_file_says_no(tmp_path):
    assert parse_settings({})["SHADOW"] and not parse_settings({"SHADOW": "no"})["SHADOW"]
    pins = {"new-part": 0}
    assert module.Shadow(pins, parse_settings({"SHADOW": "no"}), None, "mill.ini", None).has_read(PART)


@pytest.mark.parametrize("answer, times", [(BOX, 1), (NONE, 0)])
def test_it_is_read_when_the_stock_is_there_or_none_is_to_come(scene, answer, times):
    shadow, _pins, look, _said = scene
    look(2)
    program = shadow.loaded[0]
    assert not shadow.has_read(program)
    shadow.reading.answer = dict(answer)
    look()
    assert shadow.has_read(program) and not shadow.has_read(PART) and len(shadow.written_to) == times


def test_the_program_that_axis_opens_by_itself_is_no_part(scene, tmp_path):
    """AXIS's name in lines of G-code, at each start: it is not read, nothing is said of it, and nothing waits for it;
    one of the same name elsewhere is read."""
    shadow, _pins, look, said = scene
    for folder, reads in ((tmp_path / "share" / "axis" / "images", False), (tmp_path / "images", True)):
        folder.mkdir(parents=True)
        path = str(folder / "axis.ngc")
        shutil.copy(tmp_path / "part.ngc", path)
        status = types.SimpleNamespace(file=path, interp_state=1, queue=0, inpos=True, poll=lambda: None)
        shadow.follow(LINUXCNC, status, path)
        assert bool(shadow.loaded) is reads and shadow.has_read(path) is not reads, path
    assert said == []


@pytest.mark.parametrize("certain", [True, False])
def test_where_a_stock_is_known_nothing_is_said_of_none(scene, certain):
    """M250 by MDI, then a program without one: nobody needs to hear what lacks for another stock."""
    shadow, pins, look, said = scene
    pins["stock-defined"] = pins["certain"] = certain
    look()
    shadow.reading.answer = dict(NONE)
    look(3)
    assert bool(said) is not certain


def test_a_stock_that_is_known_keeps_nobody_waiting(scene):
    shadow, pins, look, _said = scene
    pins["stock-defined"] = pins["certain"] = True
    look()
    shadow.reading.answer = dict(BOX)
    look()
    assert shadow.has_read(shadow.loaded[0]) and not shadow.written_to


@pytest.mark.parametrize(
    "answers, certain, said_at_end",
    [
        ((False, False, True), False, "a stock is assumed"),
        ((False,) * 9, False, "does not hand over its map"),
        ((False,) * 9, True, ""),
    ],
)
def test_a_tracker_that_does_not_take_the_stock_is_asked_again(tmp_path, monkeypatch, answers, certain, said_at_end):
    """On a busy computer it answers late; three times, then a sentence.  Where it has a certain stock by now nothing is
    said."""
    monkeypatch.setattr(saying, "Quiet", lambda *_: lambda: True)
    pins, said = dict.fromkeys(("stock-defined", "certain", "request", "new-part", "parts"), 0), []
    files = types.SimpleNamespace(stock=types.SimpleNamespace(bounds=(0.1, 0.5), capacity=1_000_000))
    shadow = module.Shadow(pins, parse_settings({}), files, str(tmp_path / "mill.ini"), said.append)
    shadow.loaded, given, answers = (PART, (1,), (1,)), [], iter(answers)
    shadow.wanted = BOX | {
        "to_machine": [0.0, (0.0,) * 3, (0.0,) * 3],
        "tools": {},
        "spindle": None,
        "text": "its path",
    }

    def put(*found):
        given.append(found)
        pins["stock-defined"] = pins["certain"] = certain
        return next(answers)

    monkeypatch.setattr(shadow, "_put", put)
    while shadow.wanted is not None:
        answer, shadow.wanted = shadow.wanted, None
        shadow._write(answer, (1,), lambda: True)
    shadow.saying.speak(LINUXCNC)
    assert len(given) == 3 and (said_at_end in said[0] if said_at_end else said == [])
