# SPDX-License-Identifier: GPL-2.0-or-later
"""The pins of chipwise-monitor for material and spindle."""
import math
from types import SimpleNamespace

import pytest

from chipwise.chip_loads import chip_limit, default_chip
from chipwise.errors import CycleError
from chipwise.materials import Material, find_material
from chipwise.monitor import worker
from chipwise.monitor.limits import DEFAULT, NO_MATERIAL, Limits
from chipwise.monitor.saying import Saying
from chipwise.monitor.tool_shape import Tool, tool_shape
from chipwise.settings import parse_settings, power_at
from chipwise.tools import ToolGeometry


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


def test_the_default_chip_of_a_tool():
    """By diameter and material, said once for each program; none without flutes, material or with DEFAULT_CHIP = no."""
    watch, _pins, said = limits()
    tool = Tool(6.0, flutes=2)
    watch.program(b"G0 X0")
    assert watch.default_chip(3, tool, 1.0) == 0.0 and not said
    watch.program(b"(MATERIAL,NAME=6061)")
    assert [watch.default_chip(3, one, units) for one, units in ((tool, 1.0), (tool, 1.0), (Tool(6.0), 1.0), (Tool(), 1.0), (Tool(6.0 / 25.4, flutes=2), 1 / 25.4))] == [0.05, 0.05, 0.0, 0.0, 0.05]
    assert watch.saying.texts == [DEFAULT.format(tool=3, chip=0.05, material="6061")]
    watch, _pins, said = limits(MATERIAL="6061", DEFAULT_CHIP="no")
    watch.program(b"G0 X0")
    assert watch.default_chip(3, tool, 1.0) == 0.0 and not said


@pytest.mark.parametrize("name, diameter, chip", [("6061", 3.0, 0.025), ("6061", 12.0, 0.1), ("C45", 6.0, 0.025), ("GG20", 6.0, 0.025), ("1.4301", 10.0, 0.0333), ("TiAl6V4", 10.0, 0.025), ("6061", 50.0, 0.1)])
def test_default_chips(name, diameter, chip):
    assert default_chip(diameter, 2, find_material(name)) == chip
    assert default_chip(diameter, 2, Material("own", "", 300.0, 0.2)) == 0.0 and default_chip(math.nan, 2, find_material(name)) == 0.0


def test_chip_load_goes_before_the_default(tmp_path):
    settings = parse_settings({})
    assert chip_limit(6.0, ToolGeometry(flutes=2, chip_load=0.2), find_material("6061"), settings) == 0.2
    assert chip_limit(6.0, ToolGeometry(flutes=2), find_material("6061"), settings) == 0.05 and chip_limit(6.0, None, find_material("6061"), settings) == 0.0
    assert chip_limit(6.0, ToolGeometry(flutes=2), find_material("6061"), parse_settings({"DEFAULT_CHIP": "no"})) == 0.0
