# SPDX-License-Identifier: GPL-2.0-or-later
"""J left out, through LinuxCNC's interpreter: levels from the flute length and the stock of the program's own M250."""

import re

import pytest

from support.canon import run_preview, run_rs274
from support.goldens import compare_golden, motion_text

STOCK = "M250 P-40 Q-40 R-20 I80 J80 K20\n"
SUB = "o100 sub\nG0 X-15 Y-15\nG1 X15\nG1 Y15\nG1 X-15\nG1 Y-15\no100 endsub\n"
CYCLES = {
    "G13": "G13 X0 Y0 I10 Z-6 R12 F600",
    "G79": "G79 Q100 Z-6 R12 F600",
    "G77": "G77 Q100 P41 Z-6 R12 F600",
    "G78": "G78 Q100 P41 Z-6 R12 F600",
}
FROM_R = {-6, 0, 6}
LOW = CYCLES["G13"].replace("R12", "R1")


@pytest.fixture
def tools(tmp_path):
    path = tmp_path / "tools.toml"
    path.write_text("[tool.1]\nflute_length = 8\n")
    return path


def program(line, before=""):
    return f"{SUB}T1 M6\nG21 G0 X0 Y0 Z20\n{before}(begin)\n{line}\n(end)\nM2\n"


def levels(trace):
    """Z of the level cuts."""
    assert trace.error == ""
    return {round(e.b[2], 3) for e in trace.between("begin", "end") if e.kind != "rapid" and e.a[2] == e.b[2]}


def of(line, before, tools, **more):
    return levels(run_preview(program(line, before), TOOL_GEOMETRY=tools, **more))


@pytest.mark.parametrize("code", CYCLES)
def test_the_stock_of_the_program_counts(code, tools):
    line = CYCLES[code]
    assert of(line, "", tools) == FROM_R
    assert of(line, STOCK, tools) == {-6}
    assert of(line + " J6", STOCK, tools) == FROM_R  # J wins


def test_golden(tools):
    trace = run_preview(program(CYCLES["G13"].replace("Z-6", "Z-9"), STOCK), TOOL_GEOMETRY=tools)
    assert levels(trace) == {-9, -4.5}
    compare_golden(motion_text(trace), "g13_flute_stock")


@pytest.mark.parametrize("machine", ["mm", "in"])
@pytest.mark.parametrize(
    "before",
    [
        STOCK,
        "(WORKPIECE,CYLINDER,AXIS=Z,X=0,Y=0,ZMIN=-20,ZMAX=0,DIAMETER=80)\nM250\n",
        "G92 Z25\n" + STOCK.replace("R-20", "R-15") + "G92.1\n",
        "G10 L2 P2 X5 Z7 R30\n" + STOCK + "G55\nG54\n",
        "G20\nM250 P-1 Q-1 R-1 I2 J2 K1\nG21\n",
    ],
)
def test_units_offsets_and_comments(before, machine, tools):
    """The top of the stock is Z0 of G54, however it is said."""
    assert of(CYCLES["G13"], before, tools, machine=machine) == {-6}


def test_offset_of_the_cycle(tools):
    """The same stock in a system that lies 7 mm higher: its top is at Z-7 there, so 8 mm of flutes reach Z-15."""
    line = CYCLES["G13"]
    assert of(line.replace("Z-6", "Z-15"), STOCK + "G10 L2 P2 Z7\nG55\n", tools) == {-8}  # machine coordinates
    assert of(line.replace("Z-6", "Z-15.5"), STOCK + "G10 L2 P2 Z7\nG55\n", tools) == {-8.5, -4.25}


@pytest.mark.parametrize(
    "before", [STOCK + "M254 P1\n", STOCK.replace("K20", "K40"), "#<_chipwise_allowance> = 20\n" + STOCK]
)
def test_another_stock(before, tools):
    """One from a file, and one that is higher than R."""
    assert of(CYCLES["G13"], before, tools) == FROM_R


def test_unchanged_if_no_pass_is_saved(tools):
    """Line for line what it was without a stock."""
    for line in (LOW, LOW.replace("Z-6", "Z-14")):
        without, within = (run_rs274(program(line, before), TOOL_GEOMETRY=tools) for before in ("", STOCK))
        motions = [re.findall(r"(?:STRAIGHT|ARC)_.*", run.output) for run in (without, within)]
        assert len(motions[0]) > 5 and motions[0] == motions[1]


def test_no_program_can_set_it(tools):
    trace = run_preview(program(CYCLES["G13"], "#<_chipwise_stock_top> = -3\n"), TOOL_GEOMETRY=tools)
    assert "#<_chipwise_stock_top> is not known" in trace.error
    trace = run_preview(program(CYCLES["G13"], "#<_chipwise>stock_top> = -3\n"), TOOL_GEOMETRY=tools)
    assert trace.error
