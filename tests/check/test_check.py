# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check: whole programs through LinuxCNC's interpreter; findings and figures."""

import math
import os
import re

import pytest

from support import ROOT
from support.check_runs import HEAD, STOCK, SLOT, TOOLS, TABLE, chipwise_check, mill_with_tools


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def rules(report):
    return [(f["rule"], f["line"]) for f in report["programs"][0]["findings"]]


def test_clean_slot_and_its_figures(tmp_path):
    status, out, _err, report = chipwise_check(tmp_path, {"slot.ngc": SLOT})
    assert status == 0 and "no findings" in out
    (tool,) = report["programs"][0]["tools"]
    assert tool["volume_mm3"] == pytest.approx(100 * 6 * 4, rel=0.002)
    assert tool["depth_mm"] == pytest.approx(4, abs=0.001) and tool["depth_line"] == 7
    assert tool["peak_rate_mm3_min"] == pytest.approx(400 * 24, rel=0.03)
    assert tool["least_flute_length_mm"] == 4.0
    rapids = 9 / 100 + 9 / 100  # s: Z from 5 to -4 and back; the path to the first place is not known
    assert tool["feed_s"] == pytest.approx(120 / 400 * 60 + rapids, abs=0.01)
    assert tool["planned_s"] > tool["feed_s"]
    load = report["programs"][0]["load"]
    assert sum(load["mm3_min"]) * load["bin_s"] / 60 == pytest.approx(tool["volume_mm3"], rel=0.001)


def test_each_rule(tmp_path, machine):
    body = HEAD + STOCK
    cases = {
        "flute": "T1 M6\nG0 X-10 Y30 Z5\nG0 Z-12\nG1 X110 F600\nG0 Z5\nM2\n",
        "rapid": "T1 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG0 X110\nG0 Z5\nM2\n",
        "holder": "T5 M6\nG0 X-20 Y30 Z5\nG0 Z-15.5\nG1 X110 F600\nG0 Z5\nM2\n",
        "rate": "T6 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\nM2\n",
        "tool": "T3 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\nM2\n",
        "flute-unknown": "T2 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\nM2\n",
    }
    lines = {"flute": 6, "rapid": 6, "holder": 6, "rate": 6, "tool": 3, "flute-unknown": 3}
    values = {"flute": 12, "rapid": 4, "holder": 0.5, "rate": 24000}
    for rule, text in cases.items():
        status, out, _err, report = chipwise_check(tmp_path, {"part.ngc": body + text}, machine=machine)
        assert status == 1 and rules(report) == [(rule, lines[rule])], out
        finding = report["programs"][0]["findings"][0]
        if rule in values:
            assert finding["value"] == pytest.approx(values[rule], rel=0.03)
            assert -15 <= finding["x"] <= 110 and finding["y"] == pytest.approx(30, abs=1e-6)
        assert finding["text"] in out and "; " in finding["text"]


def test_rates_are_said_in_cm3_per_minute(tmp_path):
    """The tool's own limit in the old unit still holds, and is named once; JSON has mm3/min."""
    machine = mill_with_tools(tmp_path)
    (machine.parent / "tools.toml").write_text(TOOLS.replace("max_rate = 5", "max_removal_rate = 5000"))
    status, out, err, report = chipwise_check(
        tmp_path,
        {"part.ngc": HEAD + STOCK + "T6 M6\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F600\nG0 Z5\nM2\n"},
        machine=machine,
    )
    assert err.splitlines() == [
        "chipwise: tools.toml: tool 6: max_removal_rate is in mm3/min; write max_rate = 5 (cm3/min)"
    ]
    (finding,) = report["programs"][0]["findings"]
    assert status == 1 and finding["value"] == pytest.approx(24000, rel=0.03)
    assert re.search(
        r"removes 2[34]\.?\d* cm3/min at X\S+ Y30 Z-4, the tool's max_rate is 5; lower F, or use M251", finding["text"]
    )
    assert re.search(r"mean [12]\d\.?\d* and peak 2[34]\.?\d* cm3/min at F", out) and "mm3/min" not in out


def test_a_plunge_by_traverse_is_as_deep_as_it_goes(tmp_path, machine):
    """Whatever the model's steps; and what traverses remove is not in the mean of the feeds, which is that of the slot:
    24 mm2 at F400."""
    text = (
        HEAD
        + STOCK
        + "T1 M6\nS8000 M3\nG0 X20 Y30 Z5\nG0 Z-4\nG1 X80 F400\nG0 Z5\n"
        + "X50 Y0\nX40\n" * 3
        + "X85 Y50\nZ-2.7\nM2\n"
    )
    _, _, _, report = chipwise_check(tmp_path, {"a.ngc": text}, machine=machine)
    found = {f["line"]: f for f in report["programs"][0]["findings"]}
    assert [f["rule"] for f in found.values()] == ["rapid"] * 2
    assert (found[6]["value"], found[6]["z"]) == pytest.approx((4, -4), rel=0.005) and (
        found[16]["value"],
        found[16]["z"],
    ) == pytest.approx((2.7, -2.7), rel=0.005)
    (tool,) = report["programs"][0]["tools"]
    assert (
        tool["mean_rate_mm3_min"] == pytest.approx(24 * 400, rel=0.02)
        and tool["mean_rate_mm3_min"] <= 1.02 * tool["peak_rate_mm3_min"]
    )


def test_exactly_the_flute_length_is_no_finding(tmp_path, machine):
    text = HEAD + STOCK + "T1 M6\nG0 X-10 Y30 Z5\nG0 Z-10\nG1 X110 F600\nG0 Z5\nM2\n"
    assert chipwise_check(tmp_path, {"part.ngc": text}, machine=machine)[0] == 0


def test_wall_in_levels_is_no_finding_and_its_allowance_is(tmp_path, machine):
    """A wall three flute lengths deep: cut in levels it is clean; 0.05 mm left on it and taken in one pass is not."""
    levels = "".join(f"G0 X-10\nG0 Z-{z}\nG1 X110 F600\nG0 Z5\n" for z in (9, 18))
    text = HEAD + STOCK + "T1 M6\nG0 X-10 Y30 Z5\n" + levels
    assert chipwise_check(tmp_path, {"part.ngc": text + "M2\n"}, machine=machine)[0] == 0
    finish = "G0 X-10 Y30.05\nG0 Z-18\nG1 X110\nG0 Z5\nM2\n"
    status, _out, _err, report = chipwise_check(tmp_path, {"part.ngc": text + finish}, machine=machine)
    assert status == 1 and report["programs"][0]["findings"][0]["value"] == pytest.approx(18, abs=0.01)


def test_offsets_rotation_inch_subs_loops_and_tool_length(tmp_path, machine):
    """The same slot seen through everything LinuxCNC knows has the same volume and depth, and its place in work
    coordinates."""
    forms = {
        "offset": "G10 L2 P2 X7 Y3 Z-11 R0\nG55\n{stock}T1 M6\nG43\nG0 X-10 Y30 Z5\nG0 Z-12\nG1 X110 F600\nG0 Z5\n"
        "G10 L2 P2 X0 Y0 Z0\nM2\n",
        "g92": "G0 X0 Y0 Z0\nG92 X3 Y4 Z5\n{stock}T1 M6\nG0 X-10 Y30 Z5\nG0 Z-12\nG1 X110 F600\nG0 Z5\nG92.1\nM2\n",
        "turned": "G10 L2 P1 X0 Y0 R30\n{stock}T1 M6\nG0 X-10 Y30 Z5\nG0 Z-12\nG1 X110 F600\nG0 Z5\nG10 L2 P1 R0\nM2\n",
        "inch": "{stock}T1 M6\nG20\nG0 X[-10/25.4] Y[30/25.4] Z[5/25.4]\nG0 Z[-12/25.4]\nG1 X[110/25.4] F[600/25.4]\n"
        "G0 Z1\nM2\n",
        "loop": "{stock}T1 M6\nG0 X-10 Y30 Z5\nG0 Z-12\nF600\n#1 = -10\no1 while [#1 LT 110]\n#1 = [#1 + 0.5]\nG1 X#1\n"
        "o1 endwhile\nG0 Z5\nM2\n",
        "sub": "{stock}T1 M6\nG0 X-10 Y30 Z5\no<slot> call\nG0 Z5\nM2\n",
        "relative": "{stock}T1 M6\nG0 X-10 Y30 Z5\nG91\nG0 Z-17\nG1 X120 F600\nG0 Z17\nG90\nM2\n",
    }
    (machine.parent / "subs" / "slot.ngc").write_text("o<slot> sub\nG0 Z-12\nG1 X110 F600\no<slot> endsub\nM2\n")
    for name, form in forms.items():
        text = HEAD + form.format(stock=STOCK)
        status, out, _err, report = chipwise_check(tmp_path, {name + ".ngc": text}, machine=machine)
        program = report["programs"][0]
        assert status == 1 and [f["rule"] for f in program["findings"]] == ["flute"], (name, out)
        assert program["tools"][0]["volume_mm3"] == pytest.approx(100 * 6 * 12, rel=0.004), name
        finding = program["findings"][0]
        assert finding["value"] == pytest.approx(12, abs=0.01), name
        assert (finding["y"], finding["z"]) == pytest.approx((30, -12), abs=1e-3), name


@pytest.mark.parametrize(
    "plane, arc, volume",
    [
        ("G17", "G1 X30 Y30 F300\nG2 X30 Y30 I10 J0", math.pi * (13**2 - 7**2) * 4),
        ("G17", "G1 X30 Y30 F300\nG3 X30 Y30 I10 J0 P2", math.pi * (13**2 - 7**2) * 4),
    ],
)
def test_arcs(tmp_path, plane, arc, volume):
    text = HEAD + STOCK + f"T1 M6\nG0 X30 Y30 Z5\n{plane}\nG1 Z-4 F300\n{arc}\nG0 Z5\nM2\n"
    status, _out, _err, report = chipwise_check(tmp_path, {"arc.ngc": text})
    assert status == 0 and report["programs"][0]["tools"][0]["volume_mm3"] == pytest.approx(volume, rel=0.003)


@pytest.mark.parametrize(
    "plane, words, place", [("G18", "X60 Z-1 I10 K0", (60, 30)), ("G19", "Y50 Z-1 J10 K0", (40, 50))]
)
def test_arcs_in_other_planes(tmp_path, plane, words, place):
    """A half circle below Z-1, deepest in its middle: Z-11."""
    code = "G2" if plane == "G19" else "G3"
    for code in ("G2", "G3"):
        text = HEAD + STOCK + f"T1 M6\nG0 X40 Y30 Z5\nG1 Z-1 F300\n{plane}\n{code} {words}\nG17\nG0 Z5\nM2\n"
        report = chipwise_check(tmp_path, {"arc.ngc": text})[3]
        depths = sorted({round(report["programs"][0]["tools"][0]["depth_mm"], 1)})
        if depths[0] > 5:
            assert depths[0] == pytest.approx(11, abs=0.3)
            return
    pytest.fail("neither direction of the arc goes below the stock's top")


def test_volumetric_feed_shortens_the_time(tmp_path):
    text = SLOT.replace("G0 X-10", "M251 P2 Q30 E5000\nG0 X-10").replace("G0 Z5\nM2", "G0 Z5\nM252\nM2")
    (tool,) = chipwise_check(tmp_path, {"slot.ngc": text})[3]["programs"][0]["tools"]
    in_stock = 100 / (12000 / 24) * 60  # 24 mm2 at the 12 cm3/min of tool 1, which is less than Q
    assert tool["volumetric_s"] == pytest.approx(in_stock + 20 / 5000 * 60 + 0.18, rel=0.02)
    assert tool["volumetric_s"] < tool["feed_s"]


def test_stock_from_the_option(tmp_path):
    text = SLOT.replace(STOCK, "")
    status, out, _err, report = chipwise_check(tmp_path, {"slot.ngc": text})
    assert status == 1 and "the stock is assumed from its path: --stock -13 27 -4 113 33 0" in out
    assert (
        rules(report) == [("rapid", 5)] and "retract higher, or use G1 (on the assumed stock)" in out
    )  # G0 Z-4 at X-10
    assert report["programs"][0]["stock"] == {"min": [-13, 27, -4], "max": [113, 33, 0], "source": "assumed"}
    status, _out, _err, report = chipwise_check(
        tmp_path, {"slot.ngc": text}, "--stock", "0", "0", "-20", "100", "60", "0"
    )
    assert status == 0 and report["programs"][0]["tools"][0]["volume_mm3"] == pytest.approx(2400, rel=0.002)


def test_the_stock_of_the_program_and_the_option(tmp_path):
    """The program's own counts, and a line says so; after its first move the option's ends there."""
    option = ["--stock", "0", "0", "-20", "20", "60", "0"]
    status, out, _err, report = chipwise_check(tmp_path, {"slot.ngc": SLOT}, *option)
    (own,) = chipwise_check(tmp_path, {"slot.ngc": SLOT})[3]["programs"]
    (program,) = report["programs"]
    assert status == 0 and program["tools"] == own["tools"] and not own["notes"]
    line = 1 + SLOT.splitlines().index(STOCK.strip())
    assert program["notes"] == [[line, "--stock is not used: the program defines its stock with M250"]]
    assert f"line {line}: --stock is not used" in out
    late = SLOT.replace(STOCK, "").replace("T1 M6\n", "T1 M6\nG0 X-30 Y-30 Z30\n" + STOCK)
    _status, out, *_ = chipwise_check(tmp_path, {"late.ngc": late}, *option)
    assert "the stock of --stock ends: the program defines its own with M250" in out


def test_inch_machine(tmp_path):
    text = "G20 G90 G17\nT1 M6\nG0 X-.5 Y1 Z.2\nG0 Z-.2\nG1 X4.5 F10\nG0 Z.2\nM2\n"
    ini = os.path.join(ROOT, "configs", "mill_inch.ini")
    status, out, _err, report = chipwise_check(
        tmp_path, {"slot.ngc": text}, "--stock", "0", "0", "-.5", "4", "2", "0", machine=ini
    )
    (tool,) = report["programs"][0]["tools"]
    assert status == 0 and " in" in out
    assert tool["depth_mm"] == pytest.approx(0.2 * 25.4, abs=1e-3)
    assert tool["volume_mm3"] == pytest.approx(4 * 0.2 * 25.4**2 * tool["diameter_mm"], rel=0.005)


def test_a_small_tool_has_small_cells(tmp_path, machine):
    """A 0.8 mm tool on cells of 0.25 mm: they are made smaller; what cannot be made smaller is said."""
    (machine.parent / "mill.tbl").write_text(TABLE + "T7 P7 D0.8\nT8 P8 D.05\n")
    (machine.parent / "tools.toml").write_text(TOOLS + "[tool.7]\nflute_length = 3\n[tool.8]\nflute_length = 1\n")
    text = SLOT.replace("T1 M6", "T7 M6").replace("Z-4", "Z-1")
    status, out, _err, report = chipwise_check(tmp_path, {"small.ngc": text}, machine=machine)
    program = report["programs"][0]
    assert status == 0 and program["cell_mm"] == pytest.approx(0.1), out
    assert program["tools"][0]["volume_mm3"] == pytest.approx(100 * 0.8, rel=0.01)
    for tool, options, said in (("T7", ["--cell", "0.25"], "use --cell 0.1"), ("T8", [], "too small")):
        status, out, _err, _report = chipwise_check(
            tmp_path, {"small.ngc": text.replace("T7", tool)}, *options, machine=machine
        )
        assert status == 2 and said in out


def test_the_place_before_the_first_z_is_not_guessed(tmp_path):
    """The stock lies above machine zero; X and Y are given before the first Z. Later the same traverse is a finding."""
    body = "M250 P0 Q0 R0 I100 J60 K20\nT1 M6\n{}G0 X50 Y30\nG0 Z25\nG1 Z18 F300\nG0 Z25\nG0 X50 Y10\n{}M2\n"
    for first, last, expected in (("", "", 0), ("", "G0 Z15\n", 1), ("G0 Z15\n", "", 1)):
        status, out, *_ = chipwise_check(tmp_path, {"part.ngc": HEAD + body.format(first, last)})
        assert status == expected, out


def test_the_machine_is_left_alone(tmp_path, machine):
    parameters = machine.parent / "mill.var"
    parameters.write_text("5161 0\n5221 1.5\n5222 2.5\n5223 0\n")
    before = parameters.read_bytes(), sorted(os.listdir(machine.parent))
    _status, _out, _err, report = chipwise_check(tmp_path, {"slot.ngc": SLOT}, machine=machine)
    assert (parameters.read_bytes(), sorted(os.listdir(machine.parent))) == before
    assert report["programs"][0]["tools"][0]["depth_place"][1] == pytest.approx(30)  # of the work offset 1.5, 2.5
