# SPDX-License-Identifier: GPL-2.0-or-later
"""The measured load on a running machine whose spindle is spindle_sim: a tool that breaks, stock that is not as it is
defined, and what a cut teaches.

The pins are recorded every servo period, so times are those of the machine however busy the computer is.
"""

import math

import pytest

from support.operate import BOX, Shared

pytestmark = pytest.mark.machine

HAL = (
    "loadrt spindle_sim\\naddf spindle-sim.0 servo-thread\\nnet sim-spindle => spindle-sim.0.speed-cmd\\n"
    "net spindle-power volumetric-feed.0.power => spindle-sim.0.cut-power\\nnet spindle-load spindle-sim.0.load => "
    "volumetric-feed.0.spindle-load\\n"
)
TAUGHT = 1.25  # of tool 1, in the file; the default of spindle_sim
MILL = Shared(
    "spindle load",
    before=f"printf '{HAL}' > spindle.hal && printf '[1]\\n\"6061\" = {TAUGHT}\\n' > spindle_loads.toml",
    edit=r"s/^KEEP_STOCK = .*/&\nSPINDLE_LOAD_ACTION = hold/;s#^HALFILE = ../hal/chipwise.hal#&\n"
    r"HALFILE = spindle.hal#",
)
LOAD, ALARM, STOP, FACTOR = (
    "spindle-sim.0.quiet-load",
    "volumetric-feed.0.load-alarm",
    "chipwise-guard.0.stop",
    "chipwise-monitor.load-factor",
)
TURNS, FEED = 100.0, 10.0  # 1/s, mm/s
IDLE_W = 60.0 + 0.5 * TURNS + 0.001 * TURNS**2  # the default of spindle_sim
# A slot of tool 1, 6 mm with 2 edges, 4 mm deep in 6061: Kienzle's kc11 and mc, and the integral of sin^(1 - mc) over
# half a turn.
POWER_W = 1e-3 * 800.0 * (2.0 * TURNS) ** 0.25 * FEED**0.75 * 3.0 * 4.0 * 2.173
LAG_S = 0.3  # of the sensor
HALF_S = LAG_S * math.log(2.0)  # after the tool has broken: the sensor, without its noise, shows half of the load
FOUND_S = 0.1


def slot(tool, depth=4):
    """A slot through the box, with 2.5 s of air before it."""
    return (
        f"(MATERIAL,NAME=6061)\nG21 G90 G64 P0.01\nT{tool} M6\n{BOX}\nS{60 * TURNS:g} M3\nF{60 * FEED:g}\n"
        f"G0 X-30 Y20 Z5\nG0 Z-{depth}\nG1 X70\nG0 Z5\nM2\n"
    )


def sim(**settings):
    return [["hal", "setp", f"spindle-sim.0.{name.replace('_', '-')}", str(value)] for name, value in settings.items()]


def check_held(alarm, said, words):
    """The span of [stop, alarm] after the moment, and what was said."""
    assert alarm[0][1] == 1.0, f"the machine is not held: {alarm}"
    assert any(words in one for one in said), said


BREAKS = [
    *sim(noise=0.05, lag=LAG_S, factor=TAUGHT, break_time=3.0),
    ["start", slot(1)],
    ["until", "axis.x.pos-cmd", ">", 15.0],
    ["over", 0.5, LOAD],
    ["until", "spindle-sim.0.broken", "=", 1],
    ["over", HALF_S + FOUND_S, STOP, ALARM],
    ["errors", "the tool is broken"],
    ["abort"],
    *sim(break_time=0, mend=1),
    ["until", "spindle-sim.0.broken", "=", 0],
    *sim(mend=0),
]


@pytest.mark.scene(MILL, BREAKS)
def test_a_broken_tool_holds_the_machine(answers):
    """Within 0.1 s of the moment in which the sensor shows that half of the load has gone; its noise may show it a
    little earlier."""
    (low, high), alarm, said = answers[6][0], answers[8], answers[9]
    assert 0.9 * (IDLE_W + TAUGHT * POWER_W) < low <= high < 1.1 * (IDLE_W + TAUGHT * POWER_W), (low, high, POWER_W)
    check_held(alarm, said, "the tool is broken")
    assert alarm[1] == [0.0, 1.0]


MISSING = [
    *sim(noise=0.05, lag=LAG_S, factor=0),
    ["start", slot(1)],
    ["until", "volumetric-feed.0.power", ">", 0.9 * POWER_W],
    ["over", 2.5, STOP, ALARM],
    ["errors", "tool or stock are missing"],
    ["abort"],
    *sim(factor=TAUGHT),
]


@pytest.mark.scene(MILL, MISSING)
def test_stock_that_is_not_there(answers):
    alarm, said = answers[5:7]
    check_held(alarm, said, "tool or stock are missing")
    assert alarm[1] == [0.0, 2.0]


AIR = slot(1).replace(
    "M2\n", "G0 X0 Y60\nG0 Z-4\no1 repeat [200]\nG1 X60\nG1 X0\no1 endrepeat\nM2\n"
)  # after the slot beside the box, until it is stopped
IN_AIR = [
    *sim(noise=0.05, lag=LAG_S, factor=TAUGHT),
    ["start", AIR],
    ["until", "axis.y.pos-cmd", ">", 59.9],
    *sim(idle=360.0),
    ["until", LOAD, ">", IDLE_W + 150.0],
    ["over", 3.0, STOP, ALARM],
    ["errors", "where no stock is known"],
    ["abort"],
    *sim(idle=60.0),
]


@pytest.mark.scene(MILL, IN_AIR)
def test_stock_where_none_is_known(answers):
    """After a cut that has shown what the tool takes."""
    alarm, said = answers[7:9]
    check_held(alarm, said, "where no stock is known")
    assert alarm[1] == [0.0, 3.0]


TEACHES = [
    *sim(noise=0.1, lag=LAG_S, factor=1.4, seed=7),
    ["start", slot(3, 2)],
    ["finish"],
    ["until", FACTOR, ">", 0.0],
    ["messages", "times the predicted power with tool 3"],
    ["pins", ALARM],
    *sim(factor=TAUGHT, seed=1),
]


@pytest.mark.scene(MILL, TEACHES)
def test_one_cut_teaches_the_factor(answers):
    """With noise of 10 % and a sensor 0.3 s late: within 5 % of the spindle's."""
    errors, factor, alarm = answers[5], answers[6], answers[8]
    assert errors == [] and factor == pytest.approx(1.4, rel=0.05) and alarm == ["0"]
