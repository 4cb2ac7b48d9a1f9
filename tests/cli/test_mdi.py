# SPDX-License-Identifier: GPL-2.0-or-later
"""entry/mdi.py: what a line is not run for, from the status of LinuxCNC.  tests/machine/test_enter_run.py has a real
one."""

import types
from dataclasses import replace

import pytest

from chipwise.cli import enter
from chipwise.errors import CycleError
from chipwise.entry import mdi

READY = mdi.State(tool=3, position=(1.0, 2.0, 3.0), program="/a.ngc")
NAMES = types.SimpleNamespace(STATE_ON=4, INTERP_IDLE=1)


def status(**changes):
    """A linuxcnc.stat of a machine in mm that is ready."""
    found = dict(
        linear_units=1.0,
        g5x_offset=(0.0,) * 9,
        tool_offset=(0.0,) * 9,
        g92_offset=(0.0,) * 9,
        rotation_xy=0.0,
        estop=0,
        task_state=4,
        joints=3,
        homed=(1, 1, 1) + (0,) * 13,
        interp_state=1,
        paused=False,
        queue=0,
        inpos=True,
        gcodes=(-1, 10, 170, 400, 210, 900),
        tool_in_spindle=3,
        position=(1.0, 2.0, 3.0) + (0.0,) * 6,
        file="/a.ngc",
    )
    return types.SimpleNamespace(**{**found, **changes})


def test_a_machine_that_is_ready():
    assert mdi.state_of(status(), NAMES) == READY
    mdi.check(READY, "mm")
    mdi.same(READY, replace(READY, position=(1.0, 2.0, 3.0005)))
    mdi.check(replace(READY, tool=0), "mm", cuts=False)  # M250 needs no tool


@pytest.mark.parametrize(
    "changes, words",
    [
        (dict(estop=1), "in E-stop; release it"),
        (dict(task_state=3), "is off; switch it on"),
        (dict(homed=(1, 1, 0)), "not homed; home all axes"),
        (dict(interp_state=2), "under way; wait for its end"),
        (dict(paused=True), "under way"),
        (dict(queue=1), "under way"),
        (dict(inpos=False), "the machine moves; wait until it is at rest"),
        (dict(gcodes=(210, 910)), "G91 is active"),
        (dict(tool_in_spindle=0), "no tool is in the spindle"),
        (dict(tool_in_spindle=-1), "no tool is in the spindle"),
        (dict(gcodes=(200, 900)), "it is in mm and LinuxCNC in in; give G21 in MDI, or use --unit in"),
    ],
)
def test_a_machine_that_is_not(changes, words):
    with pytest.raises(CycleError) as caught:
        mdi.check(mdi.state_of(status(**changes), NAMES), "mm")
    assert str(caught.value).startswith("chipwise: the line is not run: ") and words in str(caught.value)


def test_the_work_position():
    """Offset, rotation, G92 and tool length of a machine in inch: the tip of the tool in work coordinates, mm."""
    moved = status(
        linear_units=1 / 25.4,
        rotation_xy=90.0,
        g5x_offset=(10.0, 20.0, -5.0),
        tool_offset=(0.0, 0.0, 2.0),
        g92_offset=(1.0, 0.0, 0.0),
        position=(9.0, 22.0, 0.0),
    )
    assert mdi.state_of(moved, NAMES).position == pytest.approx((25.4 * (2 - 1), 25.4 * 1, 25.4 * 3))


@pytest.mark.parametrize("now", [dict(tool=4), dict(program="/b.ngc"), dict(position=(1.0, 2.0, 3.01))])
def test_a_machine_that_has_changed_since(now):
    with pytest.raises(CycleError, match="have changed since it was planned; enter it again"):
        mdi.same(READY, replace(READY, **now))


def test_no_linuxcnc(monkeypatch):
    monkeypatch.setattr(mdi, "named", lambda *names: [])
    with pytest.raises(CycleError, match="LinuxCNC is not running here; start it, or leave --run out"):
        mdi.read()


@pytest.mark.parametrize(
    "answer, now, sent",
    [
        ("y\n", READY, True),
        ("J\n", READY, True),
        ("\n", READY, False),
        ("n\n", READY, False),
        ("", READY, False),
        ("y\n", replace(READY, tool=4), False),
        ("y\n", replace(READY, idle=False), False),
    ],
)
def test_a_terminal_is_asked(monkeypatch, answer, now, sent):
    """Only y runs the line, and only on a machine that is as it was planned for."""
    lines = []
    monkeypatch.setattr(mdi, "read", lambda: now)
    monkeypatch.setattr(mdi, "send", lines.append)
    monkeypatch.setattr("sys.stdin", types.SimpleNamespace(isatty=lambda: True, readline=lambda: answer))
    options = types.SimpleNamespace(unit="mm", code="G79")
    if sent:
        enter.run_line(options, "G79 Q1 Z-1", READY)
    else:
        with pytest.raises(CycleError, match="the line is not run: "):
            enter.run_line(options, "G79 Q1 Z-1", READY)
    assert lines == (["G79 Q1 Z-1"] if sent else [])
