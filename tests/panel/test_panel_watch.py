# SPDX-License-Identifier: GPL-2.0-or-later
"""What the pages of `chipwise panel` show: state, figures of a run, alarms."""

import json
import math

import numpy as np
import pytest

from chipwise.panel import machine, watch
from chipwise.panel.alarms import HISTORY, Alarms, StillActive
from chipwise.clib.layout import Fault, GuardReason
from support.panel_rig import Machine


@pytest.fixture
def seen(monkeypatch):
    """(machine, watch, look): look(seconds) passes time and looks."""
    clock = [100.0]
    monkeypatch.setattr(watch.time, "monotonic", lambda: clock[0])
    found = Machine()
    watching = watch.Watch(found)

    def look(seconds=0.1):
        clock[0] += seconds
        watching.look()
        return json.loads(watching.text)

    return found, watching, look


def test_figures_of_a_run(seen):
    """Those of the servo thread, however late the page looks; they stay until the next program."""
    found, _watching, look = seen
    found.values.update(
        motion_type=2.0,
        mode=2.0,
        target=7000.0,
        run_time=12.34,
        cut_time=6.0,
        air_time=2.0,
        fed_time=10.0,
        saved_time=6.66,
        mean_rate=6900.0,
        peak_rate=7010.0,
    )
    found.tasks["running"] = True
    look()
    run = look(5.0)["run"]
    assert run == {"seconds": 12.3, "peak": 7010.0, "mean": 6900.0, "air_share": 0.25, "saved": 6.7}
    found.tasks["running"] = False
    assert look()["run"] == run == look()["run"]


def test_a_servo_thread_that_makes_up_for_a_pause(seen):
    """600 mm3 in 5 s, whether the pins change in every look or not."""
    found, watching, look = seen
    found.values.update(
        motion_type=2.0, mode=2.0, target=7200.0, requested_vel=20.0, current_vel=20.0, mrr=7200.0, removed=0.0
    )
    found.tasks["running"] = True
    look()
    for k in range(50):
        if k % 10 == 9:
            found.values["removed"] += 120.0
        look()
    assert watching.log.tools.mean == pytest.approx(7200, rel=1e-6)
    assert watching.log.tools.rows()[0]["mean_cm3_min"] == pytest.approx(7.2, rel=0.03)


def test_no_volumetric_feed_saves_no_time(seen):
    found, _watching, look = seen
    found.tasks["running"] = True
    look()
    assert look()["run"]["saved"] is None


@pytest.mark.parametrize(
    "values, state, words",
    [
        ({}, "on", "calm"),
        ({"mrr": 5000.0, "target": 6000.0}, "on", "cutting"),
        ({"mrr": 6500.0, "target": 6000.0}, "on", "cutting"),
        ({"mrr": 5.0, "override": 0.5, "requested_vel": 20.0, "programmed_vel": 20.0}, "on", "limited"),
        ({"mrr": 5.0, "override": 0.5, "requested_vel": 40.0, "programmed_vel": 20.0}, "on", "cutting"),  # mode 2: at F
        ({"mrr": 5.0, "override": 0.5, "requested_vel": 40.0, "programmed_vel": 0.0}, "on", "limited"),
        ({"mrr": 6700.0, "target": 6000.0}, "on", "over"),
        ({"mrr": 9e9}, "on", "cutting"),
        ({}, "off", "off"),
        ({}, "estop", "off"),
        ({"guard_reason": float(GuardReason.RAPID_CONTACT)}, "off", "alarm"),
    ],
)
def test_background(seen, values, state, words):
    found, _watching, look = seen
    found.values.update(values)
    found.tasks["state"] = state
    assert look()["background"] == words


def test_guards_that_are_off(seen):
    found, _watching, look = seen
    found.values.update(guard_rapid=1.0, guard_flute=0.0)
    assert look()["guards"] == {"rapid": True, "flute": False}


def test_linuxcnc_that_does_not_answer(seen):
    found, _watching, look = seen
    found.tasks = None
    assert look()["task"] is None and look()["background"] == "off"


def test_the_end_of_linuxcnc(seen):
    found, watching, look = seen
    look()
    found.alive = False
    number = watching.number
    look(2.0)
    assert watching.ended and watching.wait(number, 60)[0] == number  # nobody waits for what does not come


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_numbers_that_are_none(value):
    assert machine.finite(value) == 0.0


def test_the_stock_is_looked_at_when_a_program_begins(seen):
    """Without a page, too: one that is opened later shows what the program has cut."""
    found, watching, look = seen
    found.cut((-10.0, 20.0, -4.0), (40.0, 20.0, -4.0))
    look()
    found.tasks["running"] = True
    look()
    ((_kind, content),) = watching.tiles.before(0)[0]
    mark = watching.tiles.before(0)[1]
    found.cut((40.0, 20.0, -4.0), (40.0, 33.0, -6.0))
    look()
    assert watching.tiles.before(mark)[0] == [] and watching.tiles.before(0)[0] == [(_kind, content)]
    found.tasks["running"] = False
    look()
    found.tasks["running"] = True
    look()
    assert watching.tiles.before(mark)[0][0][1] != content
    mark = watching.tiles.before(0)[1]
    found.values["removed"] += 10.0
    look()
    assert watching.tiles.before(mark)[0] == []
    found.values["removed"] = 0.0  # its M250: the same box, whole again
    look()
    ((_kind, content),) = watching.tiles.before(mark)[0]
    assert len(content) == 4


@pytest.mark.parametrize("looked", [True, False])
def test_a_program_that_has_cut_before_the_first_look_at_it(seen, looked):
    """The stock before it is that of the look before, if there was one."""
    found, watching, look = seen
    found.cut((-10.0, 20.0, -4.0), (40.0, 20.0, -4.0))
    if looked:
        look()
    found.tasks["running"] = True
    found.cut((40.0, 20.0, -4.0), (40.0, 33.0, -6.0))
    look()
    before = watching.tiles.before(0)[0]
    assert bool(before) == looked
    if looked:
        assert np.frombuffer(before[0][1][4:], "<u2").min() == round(65535 * 0.6)
    found.tasks["running"] = False
    look()
    found.tasks["running"] = True
    look()
    assert watching.tiles.before(0)[0] != []


def test_history_and_path(seen):
    found, watching, look = seen
    found.tasks["running"] = True
    for k in range(700):
        found.tip = (k * 0.15, 0.0, 0.0)
        look()
    assert len(watching.recent()) == 600 and watching.recent()[-1][0] - watching.recent()[0][0] == pytest.approx(59.9)
    path = watching.path_since(0, 0)
    assert path["count"] == len(path["points"]) == 350  # each second of 700: 0.2 mm or more apart
    again = watching.path_since(path["epoch"], path["count"] - 3)
    assert again["points"] == path["points"][-3:]
    found.tasks["running"] = False
    look()
    found.tasks["running"], found.tip = True, (7.0, 8.0, 9.0)
    look()
    assert watching.path_since(path["epoch"], path["count"])["points"] == [found.tip]


def test_a_program_that_begins_where_another_one_ran_at_the_look_before(seen):
    """It has figures, a path and operations of its own."""
    found, watching, look = seen
    found.tasks["running"] = True
    look(), look()
    epoch, shown = watching.path.epoch, []
    watching.ahead.look = lambda _dt, _scene, running, _pins, _wanted: shown.append(running)
    found.tasks["program"], found.tip = "/home/me/other.ngc", (7.0, 8.0, 9.0)
    found.values["run_time"] = 0.2
    for _ in range(3):
        state = look()
    assert shown == [False, True, True] and watching.path.epoch == epoch + 1 and watching.log.program == "other.ngc"
    assert state["run"]["seconds"] == 0.2 and watching.path_since(epoch, 0)["points"] == [found.tip]


# ---- alarms --------------------------------------------------------------------------------------------------------


def pins(**values):
    return {**Machine().values, "guard_line": 57.0, "line": 60.0, **values}


def test_an_alarm_from_its_begin_to_the_history():
    alarms = Alarms()
    rapid = pins(guard_reason=float(GuardReason.RAPID_CONTACT), guard_distance=3.1)
    assert alarms.step(rapid, False, 1.0) and not alarms.step(rapid, False, 2.0)
    (entry,) = alarms.entries
    assert entry["what"] == "rapid stopped 3.10 mm before stock (line 57, tool 3, 6.00 mm)"
    assert entry["remedy"].startswith("press Stop") and (entry["line"], entry["tool"], entry["time"]) == (57, 3, 1.0)
    with pytest.raises(StillActive, match="rapid stopped"):
        alarms.clear(entry["id"])
    alarms.clear()
    assert not entry["cleared"]
    assert alarms.step(pins(), False, 3.0) and not entry["active"]
    alarms.clear(entry["id"])
    assert entry["cleared"] and alarms.entries == [entry]
    alarms.step(rapid, False, 4.0)
    assert [one["id"] for one in alarms.entries] == [1, 2]
    with pytest.raises(KeyError):
        alarms.clear(77)


def test_a_move_of_mdi_has_no_line_of_the_program():
    alarms = Alarms()
    alarms.step(pins(guard_reason=float(GuardReason.RAPID_CONTACT), guard_distance=3.1), False, 1.0, auto=False)
    (entry,) = alarms.entries
    assert entry["what"] == "rapid stopped 3.10 mm before stock (MDI, tool 3, 6.00 mm)" and entry["line"] == 0


def test_the_depth_of_a_flute_excess_grows():
    alarms = Alarms()
    for depth in (12.0, 12.5):
        alarms.step(
            pins(guard_reason=float(GuardReason.FLUTE_EXCESS), guard_depth=depth, tool_flute_length=10.0), False, 1.0
        )
    (entry,) = alarms.entries
    assert entry["what"].startswith("cut stopped at 12.50 mm") and entry["item"] == "alarm_flute"
    alarms.step(pins(guard_reason=float(GuardReason.FLUTE_EXCESS), guard_depth=25.4, tool_flute_length=25.4), True, 1.0)
    assert entry["what"].startswith("cut stopped at 1.0000 in")


@pytest.mark.parametrize(
    "values, words",
    [
        ({"fault": 1.0, "fault_code": float(Fault.TOOL_DIAMETER)}, None),  # nothing cuts yet
        (
            {"fault": 1.0, "fault_code": float(Fault.TOOL_DIAMETER), "mode": 1.0},
            "the tool in the spindle has no diameter",
        ),
        ({"fault": 0.0, "fault_code": float(Fault.MAP)}, None),
        ({"fault": 1.0, "fault_code": float(Fault.MAP)}, "the stock map is incomplete"),
        ({"fault": 1.0, "fault_code": 99.0}, "fault 99 of the stock tracker"),
        ({"override_ignored": 1.0}, "the machine ignores the volumetric feed"),
    ],
)
def test_causes(values, words):
    alarms = Alarms()
    alarms.step(pins(**values), False, 1.0)
    assert [entry["what"][: len(words or "")] for entry in alarms.entries] == ([words] if words else [])


def test_the_history_has_an_end():
    alarms = Alarms()
    for k in range(HISTORY + 50):
        alarms.step(pins(override_ignored=float(k % 2)), False, float(k))
    assert len(alarms.entries) <= HISTORY
    for k in range(2 * HISTORY):
        alarms.step(pins(override_ignored=float(k % 2)), False, float(k))
    assert len(alarms.entries) == HISTORY


def test_the_share_of_each_limit(seen):
    """Only if a limit of the tooth has a bound; one below 0 does not count. A page that is opened later has them,
    too."""
    found, watching, look = seen
    found.values.update(mrr=4500.0, target=6000.0)
    look()
    assert json.loads(watching.text)["loads"] == {} == watching.recent()[-1][4]
    found.values.update(chip=0.024, max_chip=0.03, power=300.0, max_power=600.0, torque=0.4, max_torque=0.0)
    look()
    assert json.loads(watching.text)["loads"] == {"chip": 0.8, "power": 0.5, "rate": 0.75} == watching.recent()[-1][4]
    found.values.update(target=0.0, max_power=-1.0, force=30.0, max_force=40.0)
    look()
    assert json.loads(watching.text)["loads"] == {"chip": 0.8, "force": 0.75}


@pytest.mark.parametrize(
    "values, power",
    [
        ({}, None),
        ({"power": 300.0}, [300.0, None, 0.0, 0.0]),
        ({"max_power": 600.0}, [0.0, None, 0.0, 0.0]),
        (
            {"power": 300.0, "spindle_load": 0.4, "spindle_load_scale": 2000.0},
            [300.0, None, 0.0, 0.0],
        ),  # idle power is not known yet
        (
            {
                "power": 300.0,
                "spindle_load": 0.4,
                "spindle_load_scale": 2000.0,
                "load_idle": 350.0,
                "load_ratio": 1.5,
                "load_factor": 1.2,
            },
            [300.0, 450.0, 1.5, 1.2],
        ),
        (
            {"spindle_load": 340.0, "spindle_load_scale": 1.0, "load_idle": 350.0},
            [0.0, 0.0, 0.0, 0.0],
        ),  # noise: never below 0
        ({"spindle_load": -1.0, "spindle_load_scale": 1.0, "load_idle": 350.0}, None),
    ],
)
def test_the_power_that_is_measured(seen, values, power):
    found, watching, look = seen
    found.values.update(values)
    look()
    shown = json.loads(watching.text)["power"]
    assert (shown and list(shown.values())) == power
    assert watching.recent()[-1][5:] == (tuple(power[:2]) if power else (0.0, None))


def test_an_alarm_of_the_load_is_that_of_its_beginning():
    alarms = Alarms()
    alarms.step(pins(load_alarm=4.0, load_ratio=2.6, load_factor=1.3), False, 1.0)
    alarms.step(pins(load_alarm=4.0, load_ratio=3.9, load_factor=1.3, line=61.0), False, 2.0)
    (entry,) = alarms.entries
    assert (
        entry["what"]
        == "the spindle takes 2.0 times the load of this tool (line 60, tool 3): it is dull, or another tool or "
        "material"
    )
    assert entry["remedy"] == "press Stop and look at it" and (entry["line"], entry["active"]) == (60, True)
    alarms.step(pins(load_alarm=1.0), False, 3.0, auto=False)
    assert (
        alarms.entries[1]["what"] == "the load of the spindle has fallen in stock (MDI, tool 3): the tool is broken"
        and not entry["active"]
    )
