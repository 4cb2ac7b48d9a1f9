# SPDX-License-Identifier: GPL-2.0-or-later
"""What the operator reads at the start: that chipwise is there, and that a folder cannot be written."""

import types
import os

import pytest

from chipwise import ROOT, version
from chipwise.cli import load
from chipwise.monitor import start_line
from chipwise.settings import parse_settings

OWN = "make a folder of your own with chipwise new-config"


@pytest.fixture
def read_only(monkeypatch):
    """For whoever runs the tests: root may write everywhere."""
    monkeypatch.setattr(start_line.os, "access", lambda path, mode: not mode & os.W_OK)


def test_a_folder_that_can_be_written(tmp_path):
    assert start_line.forgetful(str(tmp_path)) == ""


@pytest.mark.parametrize(
    "folder, remedy",
    [
        (ROOT + "/configs", OWN),
        ("/usr/share/linuxcnc/aux_examples/chipwise", OWN),
        ("/etc/mill", "start a copy in a folder of your own"),
    ],
)
def test_a_folder_that_cannot(folder, remedy, read_only):
    assert (
        start_line.forgetful(folder)
        == f"{folder} cannot be written, so work offsets, tools and stock are forgotten at the end; {remedy}"
    )


def said(settings, folder, due=True):
    found = []
    return start_line.StartLine(parse_settings(settings, str(folder)), found.append, due), found


def test_once_when_the_screen_can_show_it(tmp_path, read_only):
    """Before its first command nobody reads messages; a screen that sends none for 10 s is there all the same."""
    line, found = said({"PANEL": "no"}, tmp_path)
    line.follow(0, now=100.0)
    assert found == []
    for commands in (1, 2):
        line.follow(commands, now=100.1)
    assert found == [start_line.forgetful(str(tmp_path)), f"version {version()} is running"]
    line, found = said({"PANEL": "no"}, tmp_path)
    for now in (100.0, 109.0, 111.0, 112.0):
        line.follow(0, now=now)
        assert bool(found) == (now > 110)
    assert len(found) == 2


def test_not_into_a_run(tmp_path):
    """A message is a command: the task could not tell any more which line a program was started from (glue/task.py)."""
    line, found = said({"PANEL": "no"}, tmp_path)
    line.follow(2, is_quiet=False, now=100.0)
    line.follow(2, is_quiet=False, now=200.0)
    assert found == []
    line.follow(2, is_quiet=True, now=200.1)
    assert found == [f"version {version()} is running"]


def test_what_is_quiet():
    """Three seconds at rest without a command."""
    status = types.SimpleNamespace(interp_state=1, echo_serial_number=5, poll=lambda: None)
    quiet = start_line.Quiet(types.SimpleNamespace(stat=lambda: status, error=OSError, INTERP_IDLE=1))
    assert [quiet(now) for now in (10.0, 12.9, 13.1)] == [False, False, True]
    status.echo_serial_number = 6
    assert not quiet(13.2) and not quiet(16.1) and quiet(16.3)
    status.interp_state = 2
    assert not quiet(20.0)
    status.interp_state = 1
    assert not quiet(21.0) and quiet(23.1)

    def gone():
        raise OSError

    status.poll = gone
    assert quiet(23.2)


def test_the_page_says_it_where_it_is_served(tmp_path):
    line, found = said({}, tmp_path)
    line.follow(1)
    assert found == []


def test_not_again_by_the_next_monitor(tmp_path):
    line, found = said({"PANEL": "no"}, tmp_path, due=False)
    line.follow(1)
    assert found == []


@pytest.mark.parametrize("ini, words", [("/etc/mill/mill.ini", "chipwise: /etc/mill cannot be written"), ("", "")])
def test_load_says_it_first(ini, words, read_only, monkeypatch, capsys):
    """Also for the machines without components of chipwise, which ask for nothing else."""
    monkeypatch.setattr(load, "file_name", lambda: ini)
    monkeypatch.setattr(load, "open_window", lambda text: None)
    load.run(type("Options", (), {"folder": True, "check": False}))
    assert capsys.readouterr().out[: len(words) or None] == words
