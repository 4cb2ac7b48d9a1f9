# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise setup: what it proposes, against an oracle of its own and against values in closed form."""

import re
import statistics
from pathlib import Path

import numpy as np
import pytest

from chipwise.setup.rates import LargestMean, TimeByRate
from support import canon, foreign, foreign_styles, setup_oracle
from support.check_runs import mill_with_tools
from support.setup_runs import chipwise_setup

STYLES = ("fusion_adaptive", "mastercam_inch", "freecad_pocket", "vectric_vcarve")  # of foreign.py, besides the twenty
SEED = 7
WITHIN, WORST = 0.03, 0.08  # of the oracle: what the issue of a set-up is good for; the cells give 0.7 %


def machine_of(folder, program):
    """INI of a mill with the tools of a foreign_post.Program."""
    ini = canon.write_ini(folder, TOOL_GEOMETRY=str(folder / "geometry.toml"))
    ini.write_text(re.sub(r"(?m)^TOOL_TABLE =.*$", f"TOOL_TABLE = {folder}/tool.tbl", ini.read_text()))
    (folder / "geometry.toml").write_text(foreign.geometry_file(program.tools))
    (folder / "tool.tbl").write_text(foreign.tool_table(program.tools))
    return ini


def compared(folder, program):
    """[(set-up's rate, oracle's)] of the tools, mm3/min."""
    folder.mkdir()
    ini = machine_of(folder, program)
    status, out, _err, report = chipwise_setup(folder, program.text, machine=ini)
    assert status == 0 and report["stock"]["source"] == "program" and report["own_m251"], out
    trace = canon.run_preview(
        program.text, {number: tool.diameter for number, (tool, _) in program.tools.items()}, ini=ini
    )
    means = setup_oracle.largest_means(
        trace, program.text, program.blank, {number: tool for number, (tool, _) in program.tools.items()}
    )
    return [(tool["rate_1s_mm3_min"], means[tool["number"]]) for tool in report["tools"]]


def test_the_proposal_is_the_oracles(tmp_path):
    """24 programs in the manner of CAM systems, some with two tools."""
    few = foreign.programs(SEED)
    programs = {**foreign_styles.programs(SEED), **{name: few[name] for name in STYLES}}
    off, down = {}, []
    for name, program in programs.items():
        for found, wanted in compared(tmp_path / name, program):
            if wanted == 0 or found == 0:
                assert found == wanted, (name, found, wanted)
                down.append(name)
            else:
                off.setdefault(name, []).append(found / wanted - 1)
    every = [abs(value) for values in off.values() for value in values]
    print(f"median {statistics.median(every):.4f}, worst {max(every):.4f}", off, "only down:", down)
    assert len(programs) >= 20 and len(off) >= 20 and {"plunge_roughing", "mastercam_inch"} <= set(down)
    assert statistics.median(every) <= WITHIN and max(every) <= WORST, off


def test_the_oracle_sees_a_rate_that_is_off(tmp_path):
    """The same program at 1.1 times F is 10 % off: the comparison can fail."""
    program = foreign_styles.programs(SEED)["r_word_profile"]
    ((one, wanted),) = compared(tmp_path / "a", program)
    program.text = re.sub(r"F(\d+\.?\d*)", lambda m: f"F{1.1 * float(m.group(1)):.1f}", program.text)
    ((other, _),) = compared(tmp_path / "b", program)
    assert abs(one / wanted - 1) <= WORST < other / wanted - 1


# ---- closed form -----------------------------------------------------------------------------------------------------


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


HEAD = "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG0 Z5\n"
S_PER_MM = 60 / 400  # of the slot
SLOT = HEAD + "G0 X-10 Y30\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"
STOCK = ["--stock", "0", "0", "-20", "100", "60", "0"]


def test_a_slot(tmp_path, machine):
    """6 x 4 mm at 400 mm/min: 9.6 cm3/min; 7 mm before and 10 mm behind the stock in air."""
    status, out, _err, report = chipwise_setup(tmp_path, SLOT, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert status == 0 and report["stock"] == {"min": [0, 0, -20], "max": [100, 60, 0], "source": "option"}
    assert tool["rate_1s_mm3_min"] == tool["target_mm3_min"] == pytest.approx(9600, rel=0.01) and tool["ceiling"] == 2
    assert tool["diameter"] == 6 and tool["number"] == 1
    assert tool["air_s"] == pytest.approx(17 * S_PER_MM, rel=0.03)
    assert (
        17 * S_PER_MM / 2 < tool["time_s"] - tool["time_with_s"] < 23 * S_PER_MM / 2
    )  # air, and part of the tool's radius at both ends
    assert "not confirmed" in out and not list(tmp_path.glob("*.toml"))


AIR = SLOT.replace("G0 Z5\nM2", "G0 Z5\nG1 X-10\nG0 Z0.5\nG1 X110\nG0 Z5\nM2")


def test_feeds_above_the_stock(tmp_path, machine):
    """120 mm back above the stock at 400 mm/min twice, at 800 set up: with the axes' 100 mm/s and 500 mm/s2 1.4 s each;
    the slot as before."""
    above = 2 * (120 / 100 + 100 / 500)  # s
    _status, out, _err, report = chipwise_setup(tmp_path, AIR, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert tool["time_with_s"] - tool["time_air_s"] == pytest.approx(240 / (800 / 60) - above, abs=0.3)
    assert report["air"] is False and "with --air, which makes feeds above the stock as fast as the axes" in out
    _status, out, _err, report = chipwise_setup(tmp_path, AIR, "--air", *STOCK, machine=machine)
    assert report["air"] is True and "feeds above the stock as fast as the axes:" in out and "with --air" not in out
    Path(machine).write_text(
        Path(machine).read_text().replace("[CHIPWISE]", "[CHIPWISE]\nSETUP_AIR = yes\nAIR_CLEARANCE = 1")
    )
    _status, _out, _err, report = chipwise_setup(tmp_path, AIR, *STOCK, machine=machine)
    saved = report["tools"][0]["time_with_s"] - report["tools"][0]["time_air_s"]
    assert report["air"] is True and saved == pytest.approx(
        120 / (800 / 60) - 0.5 * above, abs=0.2
    )  # Z0.5 is not clear of it
    _status, out, _err, _report = chipwise_setup(tmp_path, SLOT, *STOCK, machine=machine)
    assert "air" in out and "with --air" not in out


def test_half_as_deep_is_twice_as_fast(tmp_path, machine):
    """A second slot of half the depth runs at the ceiling; the target is the first's."""
    text = SLOT.replace("G0 Z5\nM2", "G0 Z5\nX-10 Y10\nG0 Z-2\nG1 X110\nG0 Z5\nM2")
    _status, _out, _err, report = chipwise_setup(tmp_path, text, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert tool["target_mm3_min"] == pytest.approx(9600, rel=0.01)
    assert tool["time_s"] - tool["time_with_s"] == pytest.approx((120 + 20) * S_PER_MM / 2, rel=0.03)


def test_moves_down_do_not_count_and_drills_keep_f(tmp_path, machine):
    """A plunge removes 28.3 mm2 a mm at F300, more than the slot; a tool that only drills has no target."""
    plunge = HEAD + "G0 X20 Y30\nG1 Z-15 F1000\nG1 Z-1 F1000\nX80 F200\nG0 Z5\nM2\n"
    drill = HEAD + "G81 X20 Y20 Z-15 R2 F200\nX40\nX60\nG80\nM2\n"
    _status, _out, _err, report = chipwise_setup(tmp_path, plunge, *STOCK, machine=machine)
    assert report["tools"][0]["rate_1s_mm3_min"] == pytest.approx(6 * 200, rel=0.02)
    _status, out, _err, report = chipwise_setup(tmp_path, drill, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert (
        tool["target_mm3_min"] is None
        and tool["ceiling"] == 1
        and tool["time_with_s"] == tool["time_s"] > 10
        and "it only goes down, and keeps F" in out
    )


def test_a_ramp_down_keeps_its_feed(tmp_path, machine):
    """The same path level and falling by 1 in 100: the fall has no target, and no second of it is saved."""
    text = HEAD + "G0 X-10 Y30\nG0 Z-3\nG1 X110 Z-4.2 F400\nG0 Z5\nM2\n"
    _status, _out, _err, report = chipwise_setup(tmp_path, text, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert tool["target_mm3_min"] is None and tool["time_with_s"] == tool["time_s"]


def test_the_largest_rate_of_the_tool_geometry_is_the_target(tmp_path, machine):
    text = SLOT.replace("T1 M6", "T6 M6")
    _status, out, _err, report = chipwise_setup(tmp_path, text, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert (
        tool["rate_1s_mm3_min"] == pytest.approx(16000, rel=0.01)
        and tool["target_mm3_min"] == 5000
        and "the max_rate of its tool geometry" in out
    )
    assert tool["time_with_s"] > tool["time_s"] + 20  # 4000 mm3 at 5 cm3/min


def test_a_ceiling_of_the_ini_file(tmp_path, machine):
    Path(machine).write_text(Path(machine).read_text().replace("[CHIPWISE]", "[CHIPWISE]\nSETUP_CEILING = 3"))
    _status, _out, _err, report = chipwise_setup(tmp_path, SLOT, *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert tool["ceiling"] == 3 and 17 * S_PER_MM * 2 / 3 < tool["time_s"] - tool["time_with_s"] < 23 * S_PER_MM * 2 / 3


def test_where_the_stock_comes_from(tmp_path, machine):
    own = SLOT.replace("S8000", "M250 P0 Q0 R-20 I100 J60 K20\nS8000")
    for text, options, source in (
        (own, (), "program"),
        (own, ("--stock", "0", "0", "-9", "50", "60", "0"), "program"),
        (SLOT, STOCK, "option"),
        (SLOT, (), "assumed"),
        ("; Stock X:100 Y:60 Z:20\n" + SLOT, (), "comment"),
        ("(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-20,XMAX=100,YMAX=60,ZMAX=0)\n" + SLOT, (), "comment"),
    ):
        status, out, _err, report = chipwise_setup(tmp_path, text, *options, machine=machine)
        assert status == 0 and report["stock"]["source"] == source, out
        if source == "program":
            assert report["stock"]["min"] == [0, 0, -20] and report["stock"]["max"] == [100, 60, 0]


def test_names_of_tools(tmp_path, machine):
    (Path(machine).parent / "mill.tbl").write_text("T1 P1 D6 Z30 ;my cutter\nT2 P2 D6\n")
    text = "(T1 D=6. CR=0. - ZMIN=-4. - flat end mill)\n(T2 D=6. CR=0. - ZMIN=-4. - slot drill)\n" + SLOT.replace(
        "M2", "T2 M6\nG0 X0 Y10\nZ-1\nG1 X50 F300\nM2"
    )
    _status, out, _err, report = chipwise_setup(tmp_path, text, *STOCK, machine=machine)
    assert [tool["name"] for tool in report["tools"]] == [
        "my cutter",
        "slot drill",
    ] and "tool 2, 6 mm, slot drill" in out


def test_a_program_that_cannot_be_judged(tmp_path, machine):
    status, out, _err, report = chipwise_setup(tmp_path, SLOT.replace("T1 M6\n", ""), "--yes", machine=machine)
    assert (
        status == 2
        and report["error"]
        and not report["confirmed"]
        and "no tool is in the spindle" in out
        and not list(tmp_path.glob("*.toml"))
    )


# ---- rates.py --------------------------------------------------------------------------------------------------------


def test_the_largest_mean_of_random_moves():
    """Against the same window in steps of 0.1 ms, whatever the parts they come in."""
    rng = np.random.default_rng(5)
    seconds, volume = rng.exponential(0.05, 400), rng.exponential(3.0, 400)
    time, total = (np.concatenate(([0.0], np.cumsum(values))) for values in (seconds, volume))
    at = np.arange(0.0, time[-1] - 1.0, 1e-4)
    wanted = (np.interp(at + 1.0, time, total) - np.interp(at, time, total)).max() * 60
    for parts in (1, 7, 100):
        found = LargestMean()
        for some, gone in zip(np.array_split(seconds, parts), np.array_split(volume, parts)):
            found.add(some, gone)
        assert found.rate() == pytest.approx(wanted, rel=1e-4), parts


def test_the_time_with_a_target():
    """Ten seconds at 1000 and ten at 3000 mm3/min, at most 1500: 10 + 20 s; the bins are 5 % wide."""
    sums = TimeByRate()
    sums.add(np.full(20, 0.5), np.full(20, 500 / 60))
    sums.add(np.full(20, 0.5), np.full(20, 1500 / 60))
    assert sums.with_target(1500) == pytest.approx(30) and sums.with_target(1e6) == pytest.approx(20)


def test_a_tool_that_would_be_slower_keeps_f(tmp_path, machine):
    """A helix down at F400 removes 4 times what the turn at its bottom does at F100: with that as target it would take
    longer.  With air enough it is worth it."""
    helix = (
        "G0 X50 Y30\nG0 Z-4\n"
        + "".join(f"G3 X50 Y30 I-4 J0 Z{-4 - k} F400\n" for k in range(1, 9))
        + "G3 X50 Y30 I-4 J0 F100\nG0 Z5\n"
    )
    air = "G0 X-10 Y-90\nG1 X400 F60\n"
    _status, out, _err, report = chipwise_setup(tmp_path, HEAD + helix + "M2\n", *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert (
        tool["target_mm3_min"] is None
        and tool["ceiling"] == 1
        and tool["time_with_s"] == tool["time_s"]
        and "it keeps F: with that rate held it would take" in out
    )
    _status, out, _err, report = chipwise_setup(tmp_path, HEAD + helix + air + "M2\n", *STOCK, machine=machine)
    (tool,) = report["tools"]
    assert (
        tool["target_mm3_min"] == pytest.approx(tool["rate_1s_mm3_min"]) and tool["time_with_s"] < tool["time_s"] - 20
    )
