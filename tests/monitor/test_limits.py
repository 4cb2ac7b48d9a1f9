# SPDX-License-Identifier: GPL-2.0-or-later
"""The pins of chipwise-monitor for material and spindle."""
from types import SimpleNamespace

import pytest

from chipwise.errors import CycleError
from chipwise.monitor import worker
from chipwise.monitor.limits import NO_MATERIAL, Limits
from chipwise.monitor.saying import Saying
from chipwise.monitor.tool_shape import tool_shape
from chipwise.settings import parse_settings, power_at


def limits(**keys):
    """(Limits, its pins, what waits to be said)."""
    pins, saying = {}, Saying(None)
    return Limits(pins, parse_settings(keys), saying), pins, saying.texts


def test_the_material_of_a_program():
    watch, pins, said = limits(MATERIAL="C45")
    watch.program(b"(MATERIAL,NAME=6061)\nG0 X0")
    assert (pins["specific-force"], pins["force-exponent"]) == (800, 0.25)
    watch.program(b"G0 X0")
    assert (pins["specific-force"], pins["force-exponent"]) == (1500, 0.22) and not said


def test_what_is_not_known_is_said_once():
    watch, pins, said = limits(SPINDLE_POWER="800")
    for _ in range(3):
        watch.program(b"G0 X0")
    assert said == [NO_MATERIAL] and pins["specific-force"] == 0.0
    watch.program(b"(MATERIAL,NAME=unobtainium)")
    assert len(said) == 2 and "the material unobtainium is not known" in said[1] and pins["specific-force"] == 0.0
    watch, pins, said = limits()
    watch.program(b"\xff\xfe")
    assert not said and pins["specific-force"] == 0.0


def test_the_power_of_the_spindle():
    watch, pins, _said = limits(SPINDLE_POWER="6000:400, 24000:800")
    for speed, power in ((0, 0.0), (3000, 200.0), (6000, 400.0), (-15000, 600.0), (24000, 800.0), (30000, 800.0)):
        watch.speed(speed)
        assert pins["max-power"] == pytest.approx(power)
    assert power_at((), 5000.0) == 0.0 and power_at(((0.0, 800.0),), 5000.0) == 800.0


@pytest.mark.parametrize("text", ["0", "-5", "x", "6000:", "6000:400 6000:500", "9000:1 6000:2", "nan", "6000:0", " ".join(f"{k}000:100" for k in range(1, 10))])
def test_powers_that_are_none(text):
    with pytest.raises(CycleError, match=r"SPINDLE_POWER = .* is not a power above 0"):
        parse_settings({"SPINDLE_POWER": text})


def test_the_chip_of_a_tool(tmp_path):
    path = tmp_path / "t.toml"
    path.write_text("[tool.3]\nflutes = 2\nchip_load = 0.04\n[tool.4]\nflutes = 2\n")
    assert [tool_shape(number, 0.25, str(path), 1 / 25.4).max_chip for number in (3, 4, 5)] == [0.04, 0.0, 0.0]


def test_m251_without_q_where_no_limit_is_known():
    """Said once; not with a rate, nor for a stock that is not known."""
    told, pins = [], {"fault": 0, "ready": 1, "certain": 1, "mode": 2, "mrr-target": 6000.0, "tool-number": 3}
    look = SimpleNamespace(component=pins, falling_back=lambda now: now > 0, said_fault=0, said_tool=None, said_fallback=False, say=told.append, inform=told.append)
    for now in (0.0, 1.0, 2.0):
        worker.Monitor.follow_faults(look, now)
    assert told == []
    pins["mrr-target"] = 0.0
    for now in (0.0, 1.0, 2.0):
        worker.Monitor.follow_faults(look, now)
    assert told == [worker.NO_LIMIT.format(tool=3)]
    pins["certain"] = 0
    for now in (0.0, 1.0, 2.0):
        worker.Monitor.follow_faults(look, now)
    assert told[1:] == [worker.NO_STOCK]
