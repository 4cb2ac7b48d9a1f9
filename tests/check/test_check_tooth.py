# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check and setup: chip and power of the edges against closed forms, findings, and the time with M251
under them."""

import math
import re

import numpy as np
import pytest

from chipwise.check.tooth_load import Profile, ToothLoad, sums_of_edges
from chipwise.tool_data.materials import find_material
from chipwise.settings import parse_settings, spindle_limit
from chipwise.tool_data.geometry import ToolGeometry
from support.check_runs import HEAD, STOCK, chipwise_check, mill_with_tools
from support.setup_runs import chipwise_setup

D, TURNS, FLUTES = 6.0, 8000.0, 2
FULL = "T1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\n{on}G1 X110 F{feed}\n{off}G0 Z5\nM2\n"


def machine_of(tmp_path, keys="", power="", material=""):
    tmp_path.mkdir(exist_ok=True)
    machine = mill_with_tools(tmp_path)
    tools = machine.with_name("tools.toml")
    tools.write_text(tools.read_text().replace("[tool.1]", "[tool.1]\n" + keys, 1))
    machine.write_text(
        re.sub(
            r"(?m)^(\[CHIPWISE\])$",
            rf"\1\nSPINDLE_POWER = {power}\nMATERIAL = {material}",
            machine.read_text(),
            count=1,
        )
        if power
        else machine.read_text()
    )
    return machine


def text_of(feed, on="", off="", y=30.0):
    return HEAD + STOCK + FULL.format(feed=feed, on=on, off=off).replace("Y30", f"Y{y:g}")


@pytest.mark.parametrize("width", [0.3, 1.0, 3.0, 6.0])
def test_chip_and_power_at_f(tmp_path, width):
    """A side cut beside the edge of the stock, a slot: both at F within some per cent of the closed form."""
    feed, depth = 600.0, 4.0
    y = -D / 2 + width if width < D else 30.0
    _status, out, _err, report = chipwise_check(
        tmp_path,
        {"a.ngc": "(MATERIAL,NAME=6061)\n" + text_of(feed, y=y)},
        machine=machine_of(tmp_path, "flutes = 2\nchip_load = 0.2\n", "900"),
    )
    assert report["programs"][0]["findings"] == [], out
    (tool,) = report["programs"][0]["tools"]
    per_tooth, angle = feed / (TURNS * FLUTES), math.acos(1 - 2 * width / D)
    assert tool["peak_chip_mm"] == pytest.approx(
        per_tooth * (math.sin(angle) if width < D / 2 else 1.0), rel=0.12 if width < 1 else 0.05
    )
    phi = (np.arange(10000) + 0.5) / 10000 * angle
    force = (
        800.0
        * FLUTES
        * TURNS
        / 60
        * per_tooth**0.75
        * depth
        * D
        / 2
        * float(np.sum(np.sin(phi) ** 0.75))
        * angle
        / 10000
        / 1000
    )
    assert tool["peak_power_w"] == pytest.approx(force, rel=0.15 if width < 1 else 0.05)


@pytest.mark.parametrize(
    "keys, power, feed, rule, value, limit",
    [
        ("flutes = 2\nchip_load = 0.03\n", "", 800, "chip", 0.05, 0.03),
        ("flutes = 2\n", "400", 800, "power", 588.0, 400.0),
        ("flutes = 2\nchip_load = 0.03\n", "", 500, None, 0, 0),
    ],
)
def test_findings(tmp_path, keys, power, feed, rule, value, limit):
    machine = machine_of(tmp_path, keys, power, "6061")
    status, out, _err, report = chipwise_check(tmp_path, {"a.ngc": text_of(feed)}, machine=machine)
    found = report["programs"][0]["findings"]
    if rule is None:
        assert status == 0 and not found, out
        return
    assert [(one["rule"], one["line"]) for one in found] == [(rule, 7)] and status == 1, out
    assert (
        found[0]["value"] == pytest.approx(value, rel=0.04) and found[0]["limit"] == limit and found[0]["text"] in out
    )
    under = chipwise_check(tmp_path, {"a.ngc": text_of(feed, on="M251 Q900\n", off="M252\n")}, machine=machine)
    assert under[0] == 0, under[1]  # M251 keeps the limit


def test_what_is_not_known_is_not_judged_and_said(tmp_path):
    _status, out, _err, report = chipwise_check(
        tmp_path,
        {"a.ngc": text_of(9000).replace("S8000 M3\n", "")},
        machine=machine_of(tmp_path, "flutes = 2\nchip_load = 0.03\n"),
    )
    assert (
        not report["programs"][0]["findings"]
        and out.count("chip and power of tool 1 are not judged: the spindle speed is not known") == 1
    )
    assert report["programs"][0]["tools"][0]["peak_chip_mm"] is None


def test_the_time_of_m251_without_q(tmp_path):
    """A slot of 100 mm in which the chip allows F480, at F240 and a ceiling of F3000."""
    machine = machine_of(tmp_path, "flutes = 2\nchip_load = 0.03\n")
    times = []
    for line in ("", "M251 P2 E3000\n", "M251 P2 E3000 Q900\n"):
        _status, out, _err, report = chipwise_check(
            tmp_path, {"a.ngc": text_of(240, on=line, off="M252\n" if line else "")}, machine=machine
        )
        assert not report["programs"][0]["error"], out
        times.append(report["programs"][0]["tools"][0]["volumetric_planned_s"])
    assert times[1] == pytest.approx(times[2]) and 100 / 480 * 60 - 1 < times[1] < 100 / 480 * 60 + 3 and times[0] > 29


def test_set_up_names_the_limit(tmp_path):
    """The chip at F is above the limit: said, and its time counts."""
    stock, text = ["--stock", "0", "0", "-20", "100", "60", "0"], text_of(800).replace(STOCK, "")
    machine = machine_of(tmp_path, "flutes = 2\nchip_load = 0.03\n")
    _status, out, _err, report = chipwise_setup(tmp_path, text, *stock, machine=machine)
    (tool,) = report["tools"]
    assert (
        tool["slowed_by"] == ["chip"]
        and tool["chip_mm"] == pytest.approx(0.05, rel=0.03)
        and tool["chip_limit_mm"] == 0.03
    )
    assert "at F its largest chip is 0.05 mm, the limit 0.03 mm: M251 and a set-up go below F there" in out


@pytest.mark.parametrize(
    "geometry, depth, width, lean",
    [
        (ToolGeometry(), 2.0, 6.0, 1.0),
        (ToolGeometry(shape="ball"), 1.0, 2 * math.sqrt(5.0), math.sqrt(5.0) / 3),
        (ToolGeometry(shape="ball"), 5.0, 6.0, 1.0),
        (ToolGeometry(shape="vee", tip_angle=90.0), 2.0, 4.0, math.sqrt(0.5)),
        (ToolGeometry(shape="bull", corner_radius=1.0), 3.0, 6.0, 1.0),
    ],
)
def test_profiles(geometry, depth, width, lean):
    profile = Profile(D, geometry)
    assert np.interp(depth, profile.height, profile.lean) == pytest.approx(lean, abs=0.02)
    step = 1e-3
    assert (profile.section(depth) - profile.section(depth - step)) / step == pytest.approx(width, rel=0.02)


def test_a_plunge():
    """Straight down: the chip is the feed per tooth, the power that of the end."""
    load = ToothLoad(
        D, ToolGeometry(flutes=2, chip_load=0.03), find_material("6061"), parse_settings({"SPINDLE_POWER": "800"})
    )
    steps = np.array([[0.0, 0.0, -5.0]])
    loads = load.loads(steps, np.array([5.0]), np.array([math.pi * 9 * 5]), np.array([5.0]), np.array([True]))
    assert load.chips(loads, np.array([4.0]), TURNS)[0] == pytest.approx(4.0 * 60 / 16000)
    assert loads.power_area[0] == pytest.approx(math.pi * 9, rel=1e-3) and load.allowed(loads, TURNS)[
        0
    ] == pytest.approx(0.03 * 16000 / 60)


@pytest.mark.parametrize("angle", [90.0, 118.0])
def test_a_plunge_of_a_drill(angle):
    """Its edges lean: the chip is thinner by the sine of half the tip angle, and thin chips take more power."""
    drill = ToolGeometry(shape="vee", tip_angle=angle, flutes=2, chip_load=0.03)
    load = ToothLoad(D, drill, find_material("6061"), parse_settings({"SPINDLE_POWER": "800"}))
    steps, lean = np.array([[0.0, 0.0, -5.0]]), math.sin(math.radians(angle / 2))
    loads = load.loads(steps, np.array([5.0]), np.array([math.pi * 9 * 5]), np.array([5.0]), np.array([True]))
    assert load.chips(loads, np.array([4.0]), TURNS)[0] == pytest.approx(4.0 * 60 / 16000 * lean)
    assert loads.power_area[0] == pytest.approx(math.pi * 9 / lean * lean**0.75, rel=1e-3)


def test_a_tool_that_rubs(tmp_path):
    """A pass of 0.3 mm at F240: chips of 0.0065 mm, for the 100 mm that are cut; not in a slot."""
    machine = machine_of(tmp_path, "flutes = 2\nchip_load = 0.03\nchip_least = 0.01\n")
    _status, out, _err, report = chipwise_check(tmp_path, {"a.ngc": text_of(240, y=-D / 2 + 0.3)}, machine=machine)
    (tool,) = report["programs"][0]["tools"]
    assert (
        tool["rub_s"] == pytest.approx(100 / 4, rel=0.05)
        and f"tool 1 rubs for {tool['rub_s']:.1f} s, its largest chip is below chip_least 0.01 mm" in out
    )
    _status, out, _err, report = chipwise_check(tmp_path, {"a.ngc": text_of(240)}, machine=machine)
    assert report["programs"][0]["tools"][0]["rub_s"] < 0.5 and "tool 1 rubs" not in out


def test_the_default_chip_counts_in_the_time_and_is_no_finding(tmp_path):
    """A tool with flutes alone in a named material: M251 goes at the feed of 0.05 mm, F stays as it is."""
    machine, text = (
        machine_of(tmp_path, "flutes = 2\n"),
        "(MATERIAL,NAME=6061)\n" + text_of(1600, on="M251 P2 E3000\n", off="M252\n"),
    )
    _status, out, _err, report = chipwise_check(tmp_path, {"a.ngc": text}, machine=machine)
    (tool,) = report["programs"][0]["tools"]
    assert not report["programs"][0]["findings"] and tool["peak_chip_mm"] == pytest.approx(0.1, rel=0.03), out
    assert 100 / 800 * 60 - 1 < tool["volumetric_planned_s"] < 100 / 800 * 60 + 2 and tool["planned_s"] < 6


@pytest.mark.parametrize(
    "keys, speed, watts",
    [
        ({"SPINDLE_TORQUE": "0.4"}, 6000.0, 251.33),
        ({"SPINDLE_TORQUE": "0.4", "SPINDLE_POWER": "200"}, 6000.0, 200.0),
        ({"SPINDLE_POWER": "200"}, 6000.0, 200.0),
        ({"SPINDLE_TORQUE": "0.4", "SPINDLE_POWER": "800"}, 6000.0, 251.33),
        ({"SPINDLE_POWER": "250", "SPINDLE_EFFICIENCY": "0.8"}, 6000.0, 200.0),
        ({"SPINDLE_POWER": "3000:100 9000:400", "SPINDLE_EFFICIENCY": "0.5"}, 6000.0, 125.0),
        ({"SPINDLE_TORQUE": "0.4", "SPINDLE_EFFICIENCY": "0.5"}, 6000.0, 251.33),
        ({}, 6000.0, 0.0),
        ({"SPINDLE_TORQUE": "0.4"}, 0.0, 0.0),
    ],
)
def test_what_the_spindle_gives(keys, speed, watts):
    settings = parse_settings(keys)
    assert spindle_limit(settings, speed) == pytest.approx(watts, abs=0.01)
    load = ToothLoad(D, ToolGeometry(flutes=2), find_material("6061"), settings)
    loads = load.loads(
        np.array([[5.0, 0.0, 0.0]]), np.array([5.0]), np.array([5.0 * 24]), np.array([4.0]), np.array([True])
    )
    allowed = load.allowed(loads, speed or 6000.0)
    assert (
        load.powers(loads, allowed, 6000.0)[0] == pytest.approx(watts, abs=0.01)
        if watts
        else speed == 0.0 or np.isinf(allowed[0])
    )


BENDS = 'flutes = 2\nstick_out = 30\nmaterial = "carbide"\ndeflection = {most}\n'


def test_bending_at_f(tmp_path):
    """A slot of 4 mm: 1.044 kc fz^0.75 x 4 mm over 3 E I / L^3; a finding at F, none under M251, and set-up names
    it."""
    bent = 1.044 * 800.0 * 0.05**0.75 * 4.0 / (3.0 * 580e3 * math.pi * D**4 / 64.0 / 30.0**3)
    program = {"a.ngc": "(MATERIAL,NAME=6061)\n" + text_of(800)}
    status, out, _err, report = chipwise_check(
        tmp_path, program, machine=machine_of(tmp_path / "soft", BENDS.format(most=0.09))
    )
    assert status == 0 and report["programs"][0]["tools"][0]["peak_bending_mm"] == pytest.approx(bent, rel=0.03), out
    machine = machine_of(tmp_path / "hard", BENDS.format(most=0.05))
    status, out, _err, report = chipwise_check(tmp_path, program, machine=machine)
    (found,) = report["programs"][0]["findings"]
    assert (
        status == 1
        and (found["rule"], found["line"]) == ("bending", 8)
        and found["value"] == pytest.approx(bent, rel=0.03)
        and found["text"] in out
    )
    under = {"a.ngc": "(MATERIAL,NAME=6061)\n" + text_of(800, on="M251 Q900\n", off="M252\n")}
    assert chipwise_check(tmp_path, under, machine=machine)[0] == 0


def test_what_the_bending_lacks_is_said(tmp_path):
    machine = machine_of(tmp_path, "flutes = 2\ndeflection = 0.02\n")
    _status, out, _err, report = chipwise_check(
        tmp_path, {"a.ngc": "(MATERIAL,NAME=6061)\n" + text_of(800)}, machine=machine
    )
    assert (
        out.count("the bending of tool 1 is not judged: its stick_out and material is not known") == 1
        and not report["programs"][0]["findings"]
    )
    machine = machine_of(tmp_path / "other", BENDS.format(most=0.02))
    out = chipwise_check(tmp_path, {"a.ngc": text_of(800)}, machine=machine)[1]
    assert "the bending of tool 1 is not judged: no material is known" in out


@pytest.mark.parametrize(
    "share, edges, sum_",
    [
        (1.0, 2, 1.0),
        (1.0, 4, math.sqrt(2.0) * math.sqrt(0.5) ** 0.75),
        (0.25, 3, math.sin(math.acos(0.5)) ** 0.75),
        (1.0, 1, 1.0),
        (0.5, 6, None),
    ],
)
def test_sums_of_edges(share, edges, sum_):
    found = float(sums_of_edges(np.array([share]), edges, 0.75)[0])
    phi = np.radians(np.arange(0.0, 360.0 / edges, 0.01)[:, None] + 360.0 / edges * np.arange(edges))
    one = np.clip(np.sin(phi), 0.0, None) ** 0.75 * (phi <= math.acos(1.0 - 2.0 * share) + 1e-9)
    assert found == pytest.approx(float(np.abs((one * np.exp(1j * phi)).sum(axis=1)).max()), rel=0.01)
    assert sum_ is None or found == pytest.approx(sum_, rel=0.01)
