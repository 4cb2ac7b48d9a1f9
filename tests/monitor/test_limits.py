# SPDX-License-Identifier: GPL-2.0-or-later
"""The pins of chipwise-monitor for material and spindle."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from chipwise.tool_data.chip_loads import chip_limit, default_chip
from chipwise.cli.load import feed_parameters
from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.tool_data.materials import Material, find_material
from chipwise.monitor import worker
from chipwise.monitor.limits import DEFAULT, NO_MATERIAL, UNBENT, UNFORCED, Limits
from chipwise.monitor.saying import Saying
from chipwise.monitor.tool_shape import Cutting, Tool, tool_shape
from chipwise.settings import parse_settings, power_at
from chipwise.clib import core, layout
from chipwise.tool_data.geometry import ToolGeometry
from support.feed_cases import POWER, TORQUE, given
from support.tooth_oracle import ANGLES, chip_and_torque


def limits(**keys):
    """(Limits, its pins, what waits to be said)."""
    pins, saying = {}, Saying(None)
    return Limits(pins, parse_settings(keys), saying), pins, saying.texts


def opened(watch, text, material="", is_read=True):
    """A program is opened, with this material in its set-up."""
    watch.program(text)
    watch.set_up(material, is_read)


def test_the_material_of_a_program():
    watch, pins, said = limits(MATERIAL="C45")
    watch.program(b"(MATERIAL,NAME=6061)\nG0 X0")
    assert (pins["specific-force"], pins["force-exponent"]) == (800, 0.25)
    watch.program(b"G0 X0")
    assert (pins["specific-force"], pins["force-exponent"]) == (1500, 0.22) and not said


def test_what_is_not_known_is_said_once():
    watch, pins, said = limits(SPINDLE_POWER="800")
    for _ in range(3):
        opened(watch, b"G0 X0")
    assert said == [NO_MATERIAL] and pins["specific-force"] == 0.0
    opened(watch, b"(MATERIAL,NAME=unobtainium)")
    assert len(said) == 2 and "the material unobtainium is not known" in said[1] and pins["specific-force"] == 0.0
    watch, pins, said = limits()
    opened(watch, b"\xff\xfe")
    assert not said and pins["specific-force"] == 0.0


def test_the_material_of_a_set_up_while_it_is_in_force():
    """Comment, set-up, INI; nothing is said to lack before the set-up was read, nor of a default chip that waits to be
    said."""
    watch, pins, _said = limits(SPINDLE_POWER="800")
    opened(watch, b"G0 X0", is_read=False)
    watch.default_chip(3, Tool(6.0, cutting=Cutting(flutes=2)), 1.0)
    watch.set_up("C45", True)
    assert (
        not watch.saying.texts
        and (pins["specific-force"], pins["force-exponent"]) == (1500, 0.22)
        and watch.material.name == "C45"
    )
    assert watch.default_chip(3, Tool(6.0, cutting=Cutting(flutes=2)), 1.0) == 0.025
    watch.set_up("C45", True)
    assert watch.saying.texts == [DEFAULT.format(tool=3, chip=0.025, material="C45")]
    watch.set_up("", True)
    assert pins["specific-force"] == 0.0 and watch.material is None and watch.saying.texts[1:] == [NO_MATERIAL]
    opened(watch, b"(MATERIAL,NAME=6061)", "C45")
    assert watch.material.name == "6061"
    watch, pins, _said = limits(MATERIAL="6061")
    opened(watch, b"", "C45")
    assert watch.material.name == "C45"
    watch.program(b"")  # another one, without a set-up
    assert watch.material.name == "6061" and not watch.saying.texts
    watch.set_up("unobtainium", True)
    assert "the material unobtainium is not known" in watch.saying.texts[0] and pins["specific-force"] == 0.0


def test_the_power_of_the_spindle():
    watch, pins, _said = limits(SPINDLE_POWER="6000:400, 24000:800")
    for speed, power in ((0, 0.0), (3000, 200.0), (6000, 400.0), (-15000, 600.0), (24000, 800.0), (30000, 800.0)):
        watch.speed(speed)
        assert pins["max-power"] == pytest.approx(power)
    assert power_at((), 5000.0) == 0.0 and power_at(((0.0, 800.0),), 5000.0) == 800.0


def test_the_efficiency_of_the_spindle():
    """The plate's power less the losses; nothing else is scaled, and without a power there is still no limit."""
    watch, pins, _said = limits(SPINDLE_POWER="6000:400, 24000:800", SPINDLE_EFFICIENCY="0.75")
    for speed, power in ((3000, 150.0), (-15000, 450.0), (30000, 600.0)):
        watch.speed(speed)
        assert pins["max-power"] == pytest.approx(power)
    watch, pins, _said = limits(SPINDLE_EFFICIENCY="0.75")
    watch.speed(6000)
    assert pins["max-power"] == 0.0


@pytest.mark.parametrize("text", ["0", "-0.5", "1.01", "80", "x", "nan"])
def test_efficiencies_that_are_none(text):
    with pytest.raises(CycleError, match=r"SPINDLE_EFFICIENCY = .* is not a share above 0, 1 at most"):
        parse_settings({"SPINDLE_EFFICIENCY": text})


@pytest.mark.parametrize("turns", [500, 4000, 7600, 7700, 15000, -24000])
def test_the_spindle_below_and_above_its_base_speed(monkeypatch, tmp_path, turns):
    """From the INI to the feed in a slot of D10: 1 Nm up to 800 W / (2 pi 1 Nm) = 7639 1/min and 800 W above, at the
    edges one by one."""
    torque, power, depth, flutes = 1.0, 800.0, 3.0, 3
    (tmp_path / "mill.ini").write_text("[TRAJ]\nLINEAR_UNITS = mm\n")
    monkeypatch.setenv("INI_FILE_NAME", str(tmp_path / "mill.ini"))
    keys = {"SPINDLE_POWER": f"{power:g}", "SPINDLE_TORQUE": f"{torque:g}", "MATERIAL": "6061"}
    watch, pins, _said = limits(**keys)
    watch.program(b"")
    watch.speed(turns)
    values = given(kind=2, requested=500.0, programmed=500.0, target=1e9, area=30.0, teeth=flutes, turns=turns / 60.0)
    values.max_power_w, values.specific_force_n_mm2, values.force_exponent_mc = (
        pins["max-power"],
        pins["specific-force"],
        pins["force-exponent"],
    )
    values.max_torque_nm = feed_parameters(Ini(), parse_settings(keys), 1.0, 500.0)["max-torque"]
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    mc = pins["force-exponent"]
    _chip, root = stock.tooth(core.Tool(10.0).limit(exponent=mc), (0.1, 0.2, -depth), (1.0, 0.0, 0.0), core.UNCUT)
    values.tooth_load_per_mm[0] = core.tooth_law(values).power_weight_per_mm * root ** (1.0 / (1.0 - mc))
    values.tooth_limit[0] = layout.ToothLimit.POWER
    out = core.feed(values, 1.0)
    per_tooth = out.scale * 500.0 / (flutes * abs(turns) / 60.0)
    met = chip_and_torque(np.full(len(ANGLES), depth), 5.0, per_tooth, flutes, pins["specific-force"], mc)[1]
    base = power / (2.0 * math.pi * torque) * 60.0
    assert met == pytest.approx(min(torque, torque * base / abs(turns)), rel=0.01)
    assert out.limit == (TORQUE if abs(turns) < base else POWER)


@pytest.mark.parametrize("text", ["-1", "x", "nan", "10001"])
def test_torques_that_are_none(text):
    with pytest.raises(CycleError, match=r"SPINDLE_TORQUE = .* is not a torque from 0"):
        parse_settings({"SPINDLE_TORQUE": text})


def test_a_torque_without_a_material_is_said():
    watch, _pins, said = limits(SPINDLE_TORQUE="1.2")
    opened(watch, b"G0 X0")
    assert said == [NO_MATERIAL]


@pytest.mark.parametrize(
    "text",
    [
        "0",
        "-5",
        "x",
        "6000:",
        "6000:400 6000:500",
        "9000:1 6000:2",
        "nan",
        "6000:0",
        " ".join(f"{k}000:100" for k in range(1, 10)),
    ],
)
def test_powers_that_are_none(text):
    with pytest.raises(CycleError, match=r"SPINDLE_POWER = .* is not a power above 0"):
        parse_settings({"SPINDLE_POWER": text})


def test_the_chip_of_a_tool(tmp_path):
    path = tmp_path / "t.toml"
    path.write_text("[tool.3]\nflutes = 2\nchip_load = 0.04\n[tool.4]\nflutes = 2\n")
    assert [tool_shape(number, 0.25, str(path), 1 / 25.4).cutting.max_chip for number in (3, 4, 5)] == [0.04, 0.0, 0.0]


def test_m251_without_q_where_no_limit_is_known():
    """Said once; not with a rate, nor for a stock that is not known."""
    told, pins = [], {"fault": 0, "ready": 1, "certain": 1, "mode": 2, "mrr-target": 6000.0, "tool-number": 3}
    look = SimpleNamespace(
        component=pins,
        falling_back=lambda now: now > 0,
        said_fault=0,
        said_tool=None,
        said_fallback=False,
        say=told.append,
        inform=told.append,
    )
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
    tool = Tool(6.0, cutting=Cutting(flutes=2))
    watch.program(b"G0 X0")
    assert watch.default_chip(3, tool, 1.0) == 0.0 and not said
    watch.program(b"(MATERIAL,NAME=6061)")
    assert [
        watch.default_chip(3, one, units)
        for one, units in (
            (tool, 1.0),
            (tool, 1.0),
            (Tool(6.0), 1.0),
            (Tool(), 1.0),
            (Tool(6.0 / 25.4, cutting=Cutting(flutes=2)), 1 / 25.4),
        )
    ] == [0.05, 0.05, 0.0, 0.0, 0.05]
    assert watch.saying.texts == [DEFAULT.format(tool=3, chip=0.05, material="6061")]
    watch, _pins, said = limits(MATERIAL="6061", DEFAULT_CHIP="no")
    watch.program(b"G0 X0")
    assert watch.default_chip(3, tool, 1.0) == 0.0 and not said


@pytest.mark.parametrize(
    "name, diameter, chip",
    [
        ("6061", 3.0, 0.025),
        ("6061", 12.0, 0.1),
        ("C45", 6.0, 0.025),
        ("GG20", 6.0, 0.025),
        ("1.4301", 10.0, 0.0333),
        ("TiAl6V4", 10.0, 0.025),
        ("6061", 50.0, 0.1),
    ],
)
def test_default_chips(name, diameter, chip):
    assert default_chip(diameter, 2, find_material(name)) == chip
    assert (
        default_chip(diameter, 2, Material("own", "", 300.0, 0.2)) == 0.0
        and default_chip(math.nan, 2, find_material(name)) == 0.0
    )


def test_chip_load_goes_before_the_default(tmp_path):
    settings = parse_settings({})
    assert chip_limit(6.0, ToolGeometry(flutes=2, chip_load=0.2), find_material("6061"), settings) == 0.2
    assert (
        chip_limit(6.0, ToolGeometry(flutes=2), find_material("6061"), settings) == 0.05
        and chip_limit(6.0, None, find_material("6061"), settings) == 0.0
    )
    assert chip_limit(6.0, ToolGeometry(flutes=2), find_material("6061"), parse_settings({"DEFAULT_CHIP": "no"})) == 0.0


def bent(tmp_path, text, number=3, diameter=6.0):
    (tmp_path / "tools.toml").write_text(f"[tool.{number}]\n{text}")
    return tool_shape(number, diameter, str(tmp_path / "tools.toml"), 1.0)


def test_the_bending_of_a_tool(tmp_path):
    """0.02 mm of 6 mm carbide that sticks out 30 mm: 3 E I / L^3 by hand; in inches the same."""
    shape = bent(tmp_path, 'flutes = 2\nstick_out = 30\nmaterial = "carbide"\ndeflection = 0.02\n')
    stiff = 3.0 * 580e3 * math.pi * 6.0**4 / 64.0 / 30.0**3
    assert (
        shape.shank.stiffness == pytest.approx(stiff)
        and shape.shank.max_force == pytest.approx(0.02 * stiff)
        and shape.shank.unbent == ""
    )
    inch = tool_shape(3, 6.0 / 25.4, str(tmp_path / "tools.toml"), 1.0 / 25.4)
    assert inch.shank.max_force == pytest.approx(shape.shank.max_force)


def test_what_the_bending_lacks_is_said_once(tmp_path):
    watch, _pins, _said = limits()
    watch.program(b"(MATERIAL,NAME=6061)")
    shape = bent(tmp_path, "flutes = 2\ndeflection = 0.02\n")
    for _ in range(3):
        watch.note_bending(3, shape)
    said = watch.saying.texts
    assert said == [UNBENT.format(tool=3, what="stick_out and material")] and shape.shank.max_force == 0.0
    whole = bent(tmp_path, 'flutes = 2\nstick_out = 30\nmaterial = "hss"\ndeflection = 0.02\n')
    watch.note_bending(3, whole)
    assert len(said) == 1
    watch.program(b"")
    watch.note_bending(3, whole)
    watch.note_bending(4, bent(tmp_path, "flutes = 2\n"))
    assert watch.saying.texts == [UNFORCED.format(tool=3)]
