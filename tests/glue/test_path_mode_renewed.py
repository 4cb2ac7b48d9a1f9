# SPDX-License-Identifier: GPL-2.0-or-later
"""glue/path_mode.py: motion gets the path mode that is shown once more where a program begins, because LinuxCNC may
have forgotten it there."""

import importlib
import sys
import types

import pytest

MODE = "G64 P0.010000000 Q0.020000000"


class Interp:
    """What path_mode sees of an interpreter."""

    length_units = "mm"
    active_settings = [1, 0.0, 0.0, 0.03, 0.04]

    def __init__(self, task=1, code=640):
        self.task, self.active_g_codes, self.lines = task, [code, 800], []

    def execute(self, line):
        self.lines.append(line)


@pytest.fixture(name="path_mode")
def make_path_mode(monkeypatch):
    canon = types.SimpleNamespace(
        CANON_UNITS=types.SimpleNamespace(CANON_UNITS_INCHES="inch"),
        GET_EXTERNAL_MOTION_CONTROL_TOLERANCE=lambda: 0.01,
        GET_EXTERNAL_MOTION_CONTROL_NAIVECAM_TOLERANCE=lambda: 0.02,
    )
    names = ("chipwise.glue.path_mode", "chipwise.glue.program_run")
    for name, module in (("emccanon", canon), ("interpreter", types.SimpleNamespace())):
        monkeypatch.setitem(sys.modules, name, module)
    before = {name: sys.modules.pop(name, None) for name in names}
    module = importlib.import_module(names[0])
    monkeypatch.setattr(
        module, "program_run", types.SimpleNamespace(skipped=lambda: False, may_be_skipped=lambda: False)
    )
    yield module
    for name, had in before.items():
        sys.modules.pop(name, None)
        if had is not None:
            sys.modules[name] = had


def test_each_program_begins_with_the_mode_that_is_shown(path_mode):
    interp = Interp()
    for another in (True, False, False, True):
        path_mode.renew(interp, another, ours=True)
    assert interp.lines == [MODE, MODE]


def test_a_program_without_a_code_of_ours_runs_as_without_chipwise(path_mode):
    """Its F word alone sends nothing; a code that comes later does."""
    interp = Interp()
    for another in (True, False):
        path_mode.renew(interp, another, ours=False)
    assert interp.lines == []
    path_mode.renew(interp, False, ours=True)
    assert interp.lines == [MODE]


def test_what_an_inside_of_ours_has_left_ends_with_any_program(path_mode):
    """An abort may have kept the mode of a sub in motion; within the program itself F words send nothing."""
    interp = Interp()
    path_mode.renew(interp, True, ours=True)
    inside = path_mode.PathMode(interp)
    inside.execute(path_mode.PATH + "4 P1")
    inside.execute(path_mode.CALLERS_PATH)
    del interp.lines[:]
    for another in (False, True, False, True):
        path_mode.renew(interp, another, ours=False)
    assert interp.lines == [MODE]


def test_an_exact_path_too(path_mode):
    """G61 keeps P and Q of the last G64, which LinuxCNC shows."""
    interp = Interp(code=610)
    path_mode.renew(interp, True, ours=True)
    assert interp.lines == ["G64 P0.030000000 Q0.040000000", "G61"]


def test_nothing_in_a_preview(path_mode):
    interp = Interp(task=0)
    path_mode.renew(interp, True, ours=True)
    assert interp.lines == []


def test_a_run_from_a_line_gets_it_behind_that_line(path_mode):
    interp = Interp()
    path_mode.program_run.skipped = lambda: True
    path_mode.renew(interp, True, ours=True)
    path_mode.renew(interp, False, ours=True)
    assert interp.lines == []
    path_mode.program_run.skipped = lambda: False
    for _ in range(2):
        path_mode.renew(interp, False, ours=True)
    assert interp.lines == [MODE]


def test_a_run_whose_first_line_is_not_known_gets_it_until_a_move_is_done(path_mode):
    interp = Interp()
    path_mode.program_run.may_be_skipped = lambda: True
    for another in (True, False, False):
        path_mode.renew(interp, another, ours=True)
    path_mode.program_run.may_be_skipped = lambda: False
    for _ in range(2):
        path_mode.renew(interp, False, ours=True)
    assert interp.lines == 4 * [MODE]
