# SPDX-License-Identifier: GPL-2.0-or-later
"""How long cycles keep the task to themselves: never more than a share of a second, whatever they emit."""

import importlib
import sys
import types

import pytest

from chipwise import gcode_lines
from chipwise.moves import Line, Rapid


@pytest.fixture
def turn(monkeypatch):
    """chipwise.glue.task_share with a stand-in for LinuxCNC's module of constants and a clock by hand."""
    monkeypatch.setitem(sys.modules, "interpreter", types.SimpleNamespace(INTERP_EXECUTE_FINISH=3))
    queued = []
    monkeypatch.setitem(sys.modules, "emccanon", types.SimpleNamespace(DWELL=queued.append))
    monkeypatch.delitem(sys.modules, "chipwise.glue.task_share", raising=False)
    module = importlib.import_module("chipwise.glue.task_share")
    module.clock = 0.0
    module.queued = queued
    monkeypatch.setattr(module.time, "monotonic", lambda: module.clock)
    yield module
    sys.modules.pop("chipwise.glue.task_share", None)


def interp(task):
    return types.SimpleNamespace(task=task, feed_rate=7.0)


def emitted(module, cycles, task=1):
    """Moves executed between two turns of the task, over cycles of so many levels of so many moves."""
    counts, since = [], 0
    for levels, size in cycles:
        moves = [
            move
            for level in range(levels)
            for move in [
                Rapid(z=5.0),
                Line(z=-1.0 - level, feed=100.0),
                *(Line(x=float(k), feed=300.0) for k in range(1, size)),
            ]
        ]
        turn = module.TaskShare(interp(task))
        for chunk in gcode_lines.chunks(moves, (0.0, 0.0, 5.0), 1.0):
            if turn.is_over(chunk):
                assert [3] == list(turn.wait())
                counts.append(since)
                since = 0
            turn.count(chunk)
            since += sum(text.count("\n") + 1 for _, text in chunk)
    return [*counts, since]


@pytest.mark.parametrize(
    "cycles", [[(100, 300)], [(3, 40)] * 500, [(2, 15000)], [(1, 4000), (1, 19000), (1, 100)], [(200, 1)] * 40]
)
def test_moves_between_turns(turn, cycles):
    """At most TURN_MOVES, but for one chunk that is longer."""
    longest = max(size for _, size in cycles) + 2 + gcode_lines.CHUNK_MOVES
    counts = emitted(turn, cycles)
    assert max(counts) <= max(turn.TURN_MOVES, longest)
    assert sum(counts) == sum(levels * (size + 1) - 1 for levels, size in cycles)  # the first traverse goes nowhere


def test_small_cycles_do_not_rest(turn):
    """A cycle of some moves is emitted at once."""
    assert len(emitted(turn, [(10, 30)])) == 1


def test_waiting_adds_up_over_cycles(turn):
    """Ten cycles that wait 30 ms each: the task has its turn after the first 0.1 s."""
    yields, waited = 0, 0.0
    for _ in range(10):
        one = turn.TaskShare(interp(1))
        before = one.patience()
        if before < 0.03:
            yields += len(list(one.wait()))
            waited = 0.0
        turn.clock += 0.03
        waited += 0.03
        one._tick()
        assert waited <= turn.WAIT_S + 1e-9
    assert yields >= 2


def test_a_cycle_that_has_waited_asks_the_planner_shortly(turn):
    """The machine rests then: nothing is lost if the task has its turn soon."""
    one = turn.TaskShare(interp(1))
    assert one.patience() == turn.WAIT_S
    list(one.wait())
    assert one.patience() == turn.AGAIN_S < turn.WAIT_S / 2
    assert turn.TaskShare(interp(1)).patience() == turn.WAIT_S  # of the next cycle


def test_feed_survives_the_wait(turn):
    """LinuxCNC takes feed from the machine after the wait, which may be a ceiling: F is put back."""
    machine = interp(1)
    wait = turn.TaskShare(machine).wait()
    next(wait)
    assert turn.queued == [0.0]  # the move before is in the queue
    machine.feed_rate = 3000.0
    assert list(wait) == [] and machine.feed_rate == 7.0


def test_the_preview_never_yields(turn):
    assert len(emitted(turn, [(100, 300)], task=0)) == 1
    assert turn.TaskShare(interp(0)).patience() == turn.PREVIEW_STEP_S and list(turn.TaskShare(interp(0)).wait()) == []


def test_a_tool_that_linuxcnc_does_not_know(monkeypatch):
    """The file of the tool table has it, LinuxCNC has not read it again: no internal error."""
    monkeypatch.setitem(
        sys.modules, "interpreter", types.SimpleNamespace(INTERP_EXECUTE_FINISH=3, INTERP_OK=0, INTERP_ERROR=1)
    )
    monkeypatch.setitem(sys.modules, "emccanon", types.SimpleNamespace(CANON_UNITS=None))
    before = set(sys.modules)
    from chipwise.errors import CycleError

    turning = importlib.import_module("chipwise.glue.turning")

    def execute(line):
        raise SystemError(f"error return without exception set: {line}")

    state = types.SimpleNamespace(
        interp=types.SimpleNamespace(tool_table=[types.SimpleNamespace(toolno=1)], execute=execute), line_number=3
    )
    with pytest.raises(CycleError, match="LinuxCNC does not know tool 7, which is in the tool table file"):
        list(turning._change_tool(state, None, 7))
    for name in set(sys.modules) - before:
        if name.startswith("chipwise.glue"):
            del sys.modules[name]
