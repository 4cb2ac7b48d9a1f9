# SPDX-License-Identifier: GPL-2.0-or-later
"""glue/program_run.py: a run whose first line is not known, because another command came first.  A cycle in it must not
keep the task for its whole length once the machine has carried out a move."""

import importlib
import sys
import types

import pytest


@pytest.fixture(name="machine")
def make_machine(monkeypatch):
    """What milltask shows of itself, with another command in its buffer than the one that has started the run."""
    tran = types.SimpleNamespace(x=0.0, y=0.0, z=5.0)
    traj = types.SimpleNamespace(position=types.SimpleNamespace(tran=tran), inpos=True, queue=0)
    status = types.SimpleNamespace(
        motion=types.SimpleNamespace(traj=traj), task=types.SimpleNamespace(motionLine=3, mode="AUTO")
    )
    monkeypatch.setitem(sys.modules, "emctask", types.SimpleNamespace(emcstat=status))
    return status


@pytest.fixture(name="context")
def make_context(monkeypatch, machine):
    task = importlib.import_module("chipwise.glue.task")
    monkeypatch.setattr(task, "is_program", lambda: True)
    monkeypatch.setattr(task, "start_line", lambda: None)
    for name in ("emccanon", "interpreter"):
        monkeypatch.setitem(sys.modules, name, types.SimpleNamespace())
    context = importlib.import_module("chipwise.glue.program_run")
    monkeypatch.setattr(context, "named", types.SimpleNamespace(forget=lambda *a: None, mark=lambda *a: None))
    begun = iter([True] + 99 * [False])
    monkeypatch.setattr(task, "is_new_run", lambda: next(begun))
    context._Context.kind, context._Context.start = None, 0
    interp = types.SimpleNamespace(
        task=1, call_level=0, sub_context=[types.SimpleNamespace(filename="a.ngc")], filename="a.ngc"
    )
    assert context.enter(interp, {"n": 1})
    yield context
    context._Context.kind, context._Context.start = None, 0


def test_nothing_is_known_while_the_machine_stands(context, machine):
    assert context.may_be_skipped() and not context.skipped()
    machine.motion.traj.queue, machine.motion.traj.inpos = 2, False
    assert context.may_be_skipped()


@pytest.mark.parametrize("change", ("line", "place"))
def test_a_move_that_was_carried_out_ends_the_doubt(context, machine, change):
    """The same line as the run before has stopped at, at another place; or another line."""
    if change == "line":
        machine.task.motionLine = 4
    else:
        machine.motion.traj.position.tran.x = 200.0
    assert not context.may_be_skipped() and not context.skipped()
    machine.task.motionLine, machine.motion.traj.position.tran.x = 3, 0.0  # the machine may come back
    assert not context.may_be_skipped()


def test_a_machine_that_still_brakes_says_nothing(monkeypatch, context, machine):
    """The run before was aborted, and its brakes end while this one has begun."""
    task = context.task
    machine.motion.traj.inpos = False
    before = task.seen()
    machine.motion.traj.inpos, machine.motion.traj.position.tran.x = True, 0.4
    assert not task.has_moved(before)
    machine.task.motionLine = 0  # reset
    assert not task.has_moved(before)


def test_another_linuxcnc_shows_nothing(monkeypatch, context):
    monkeypatch.setitem(sys.modules, "emctask", types.SimpleNamespace())
    assert context.task.seen() is None and not context.task.has_moved((3, (0.0, 0.0, 0.0))) and context.may_be_skipped()
