# SPDX-License-Identifier: GPL-2.0-or-later
"""A tool that chipwise-monitor has not described yet, because it is starved (SIGSTOP): traverses wait, are guarded
then, and nothing hangs.

The times, to a servo period: tests/components/tracker_watch and tests/core/test_seldom.c."""

import pytest

from support.operate import BOX, Shared

pytestmark = pytest.mark.machine

STARVED = Shared("a new tool")
BESIDE = [
    ["mdi", "T1 M6"],
    ["mdi", BOX],
    ["mdi", "G0 X-30 Y20 Z10"],
    ["mdi", "G0 Z-3"],
    ["until", "stock-tracker.0.ready", "=", 1],
    ["errors"],
]
STOP, GO_ON = ["signal_monitor", "STOP"], ["signal_monitor", "CONT"]
WAITS = ["until", "chipwise-guard.0.waits", "=", 1]
INTO = "G21 G90\n{}\nG0 Y15\nG0 X30\nG0 Z10\nM2\n"  # a traverse that is free, then one into the stock
GUARD = [
    "pins",
    "chipwise-guard.0.waits",
    "chipwise-guard.0.stop",
    "motion.feed-inhibit",
    "motion.feed-hold",
    "stock-tracker.0.tool-awaited",
]
DONE = [GO_ON, ["until", "stock-tracker.0.tool-awaited", "=", 0]]
TOLD = "a traverse waits because chipwise-monitor has not described tool 8 yet"
DEAD = "chipwise-monitor does not answer"
RADIUS = 6.0  # of tool 8


@pytest.mark.parametrize("change", ["T8 M6", "M61 Q8"])
@pytest.mark.scene(
    STARVED,
    lambda change: [
        *BESIDE,
        STOP,
        ["start", INTO.format(change)],
        WAITS,
        ["errors", TOLD],
        ["position"],
        GUARD,
        GO_ON,
        ["until", "chipwise-guard.0.stop", "=", 1],
        ["errors", "rapid stopped"],
        GUARD,
        ["abort"],
        ["position"],
        ["pins", "stock-tracker.0.removed-volume"],
    ],
)
def test_a_traverse_waits_and_is_guarded_then(answers, change):
    """Nothing moves but what a period takes; a message says so; then the free traverse goes on, and the next one is
    stopped before the stock."""
    told, place, waits, _go, _stop, stopped, guard, _abort, last, removed = answers[9:]
    assert len(told) == 1 and TOLD in told[0]
    assert place == pytest.approx([-30, 20, -3], abs=0.05)
    assert waits == ["TRUE", "FALSE", "TRUE", "TRUE", "TRUE"] and guard == ["FALSE", "TRUE", "TRUE", "TRUE", "FALSE"]
    assert len(stopped) == 1 and "rapid stopped" in stopped[0] and "tool 8, 12.00 mm" in stopped[0]
    assert last[1] == pytest.approx(15, abs=1e-5) and -30 < last[0] < -RADIUS and removed == ["0"]


@pytest.mark.scene(
    STARVED,
    [*BESIDE, STOP, ["start", "G21 G90\nT8 M6\nG0 Y15\nG0 Z10\nG0 X30\nM2\n"], WAITS, GO_ON, ["finish"], ["position"]],
)
def test_a_program_goes_on_by_itself(answers):
    """As soon as the tool is described, without the operator."""
    assert [text for text in answers[-2] if TOLD not in text] == [] and answers[-1] == pytest.approx(
        [30, 15, 10], abs=1e-5
    )


@pytest.mark.scene(
    STARVED,
    [
        *BESIDE,
        STOP,
        ["start", INTO.format("T8 M6")],
        WAITS,
        ["errors", TOLD],
        ["watch_monitor"],
        ["until", "stock-tracker.0.fault-code", "=", 16],
        ["until", "axis.x.pos-cmd", ">", 29.9],
        ["errors", DEAD],
        GUARD,
        ["finish"],
        *DONE,
        ["errors"],
    ],
)
def test_a_monitor_that_stays_silent_holds_nothing_for_ever(answers):
    """After its timeout the fault that there is for it, as the message says; traverses go on without a guard."""
    told, said = answers[9], answers[-6]
    assert len(told) == len(said) == 1 and TOLD in told[0] and DEAD in said[0], (told, said)
    assert answers[-5] == ["FALSE"] * 5 and answers[-4] == [] == answers[-1]


@pytest.mark.parametrize("button", ["abort", "estop"])
@pytest.mark.scene(
    STARVED,
    lambda button: [
        *BESIDE,
        STOP,
        ["start", INTO.format("T8 M6")],
        WAITS,
        [button],
        ["until", "chipwise-guard.0.waits", "=", 0],
        GUARD,
        ["on"],
        ["errors"],
        ["mdi quietly", "G0 X-40"],
        WAITS,
        *DONE,
        ["finish"],
        ["position"],
        ["mdi", "G0 Z10"],
        ["position"],
    ],
)
def test_it_can_be_stopped_meanwhile(answers, button):
    """Nothing holds then; a traverse of MDI waits too, and goes on.  What LinuxCNC itself says of the button is read
    before."""
    assert answers[11][:4] == ["FALSE"] * 4
    assert answers[-3][0] == pytest.approx(-40, abs=1e-5) and answers[-3][2] == pytest.approx(-3, abs=1e-5)
    assert [text for text in answers[-2] if TOLD not in text] == [] and answers[-1] == pytest.approx(
        [-40, 20, 10], abs=0.05
    )


@pytest.mark.scene(
    STARVED,
    [
        *BESIDE,
        STOP,
        ["start", "G21 G90 F3000\nT8 M6\nG1 Y15\nG1 Z10\nG1 X30\nM2\n"],
        ["until", "axis.x.pos-cmd", ">", 29.9],
        GUARD,
        ["finish"],
        *DONE,
    ],
)
def test_a_feed_waits_for_none(answers):
    assert answers[9] == ["FALSE"] * 4 + ["TRUE"] and answers[10] == []


@pytest.mark.scene(
    STARVED,
    [
        *BESIDE,
        ["hal", "setp", "chipwise-guard.0.guard-rapid", "0"],
        STOP,
        ["mdi", "T8 M6"],
        ["mdi", "G0 X30"],
        GUARD,
        *DONE,
        ["hal", "setp", "chipwise-guard.0.guard-rapid", "1"],
    ],
)
def test_nothing_waits_without_a_guard(answers):
    assert answers[9] == [] and answers[10] == ["FALSE"] * 4 + ["TRUE"]


@pytest.mark.scene(
    STARVED,
    [
        *BESIDE,
        ["mdi", "T0 M6"],
        ["mdi", "G0 X30"],
        ["pins", "stock-tracker.0.ready", "stock-tracker.0.tool-awaited"],
        ["position"],
    ],
)
def test_a_tool_without_a_shape_is_known(answers):
    """T0 has no diameter: nothing can be guarded, and nothing waits, as long as the monitor has followed it."""
    assert (
        answers[-3] == [] and answers[-2] == ["FALSE", "FALSE"] and answers[-1] == pytest.approx([30, 20, -3], abs=1e-5)
    )
