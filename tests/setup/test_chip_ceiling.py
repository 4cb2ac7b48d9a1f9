# SPDX-License-Identifier: GPL-2.0-or-later
"""The ceiling of a tool from its largest chip (setup/chip_ceiling.py), and what chipwise setup makes of it."""

import pytest

from chipwise.setup.chip_ceiling import ceilings
from chipwise.tool_data.geometry import ToolGeometry
from support.check_runs import mill_with_tools
from support.setup_runs import chipwise_setup

TOOLS = {
    1: ToolGeometry(flutes=2, chip_load=0.05),
    2: ToolGeometry(flutes=4, chip_load=0.02),
    3: ToolGeometry(flutes=2),
    4: ToolGeometry(chip_load=0.1),
}


@pytest.mark.parametrize(
    "text, found",
    [
        ("G21 T1 M6 S8000 M3\nG1 X1 F400\n", {1: 2.0}),  # 0.05 x 2 x 8000 = 800 mm/min
        ("G21 T1 M6\nS8000\nF100 G1 X1\nF200 X2\nS4000\n", {1: 2.0}),  # slowest spindle, fastest F
        ("G21 S8000 F400\nT1 M6\nG1 X1\nT2\nM6\nS10000 G1 X2\n", {1: 2.0, 2: 2.0}),  # F goes on
        ("G20 T1M06 S8000\nG1 X1 F10\n", {1: 3.15}),
        ("G21 T1 M6 S8000\nG1 X1 F9999\n", {1: 1.0}),
        ("G21 T1 M6 S8000\nG1 X1 F10\n", {1: 10.0}),
        ("G21 S8000\nG1 X1 F400 (T2 M6 F1)\n", {1: 2.0, 2: 1.6}),  # no tool is called: whichever is in
        ("G21 T3 M6 S8000\nG1 F400\nT4 M6\nG1\n", {}),
        ("G21 T1 M6\nG1 X1 F400\n", {}),
        ("G21 T1 M6 S0\nG1 F400\n", {}),
        ("T1 M6 S8000 F[400]\n", {}),
        ("T1 M6 S#1 F400\n", {}),
        ("T1 M6 S8000 F400\nG93\n", {}),
        ("T1 M6 S8000 F400\no1 call\n", {}),
        ("T1 M6 S8000 F400 M98 P1\n", {}),
        ("T1 M6 S8..0 F4.0.0\n", {}),
    ],
)
def test_the_ceiling(tmp_path, text, found):
    (tmp_path / "part.ngc").write_text(text)
    assert ceilings(str(tmp_path / "part.ngc"), TOOLS, 1.0, 1 << 20) == pytest.approx(found, abs=0.005)


def test_set_up_has_it(tmp_path):
    """A slot at half of the chip's feed less a little: the air is 1.6 times as fast, not twice."""
    machine = mill_with_tools(tmp_path)
    text = "G21 G90 G94 G17\nT1 M6\nS8000 M3\nG0 Z5\nG0 X-10 Y30\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"
    stock = ["--stock", "0", "0", "-20", "100", "60", "0"]
    geometry = machine.with_name("tools.toml")
    before, content = chipwise_setup(tmp_path, text, *stock, machine=machine)[3]["tools"][0], geometry.read_text()
    assert "[tool.1]" in content
    geometry.write_text(content.replace("[tool.1]", "[tool.1]\nchip_load = 0.04\nflutes = 2", 1))
    status, out, _err, report = chipwise_setup(tmp_path, text, *stock, machine=machine)
    (tool,) = report["tools"]
    assert (
        status == 0
        and before["ceiling"] == 2
        and tool["ceiling"] == 1.6
        and "up to 1.6 times F, its largest chip" in out
    )
    assert before["time_with_s"] < tool["time_with_s"] < tool["time_s"]
