# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten programs as other people's CAM writes them, with M250 and M251 put in as a user of chipwise would.

Called by bench/bench_claims.py and tests/machine/test_foreign.py; by hand `python3 -m support.foreign FOLDER [--seed
N]` in tests/ writes them.  Nothing is copied from any post processor: the style (line numbers, comments, spacing,
words, units) is what matters, and sizes, offsets, angles and rates come from the seed.  No size is a multiple of a
cell.

A Program is what the machine runs and what the judge has to know: blank in machine coordinates, tools with their
lengths.  The work offset is set by G10 L2, because nobody touches off in a simulation.
"""

import argparse
import random
from pathlib import Path

from support.foreign_flat import (
    fusion_adaptive,
    mastercam_inch,
    freecad_pocket,
    hsm_bull_boss,
    facing_rim,
    slots_three_depths,
)
from support.foreign_relief import estlcam_relief, vectric_vcarve, taper_two_tools, spiral_round

BUILDERS = (
    fusion_adaptive,
    mastercam_inch,
    freecad_pocket,
    estlcam_relief,
    vectric_vcarve,
    taper_two_tools,
    hsm_bull_boss,
    facing_rim,
    spiral_round,
    slots_three_depths,
)


def programs(seed=1):
    """{name: Program} of a seed; each has a generator of its own, so that one can change alone."""
    return {build.__name__: build(random.Random(f"{seed} {build.__name__}")) for build in BUILDERS}


def tool_table(tools, unit=1.0):
    """Text of a tool table; unit: mm per machine unit."""
    return "".join(
        f"T{n} P{n} Z{length / unit:.6f} D{tool.diameter / unit:.6f}\n" for n, (tool, length) in sorted(tools.items())
    )


def geometry_file(tools, more=None):
    """Text of a tool geometry file; more: {tool number: further lines}."""
    lines = []
    for n, (tool, _length) in sorted(tools.items()):
        lines.append(f"[tool.{n}]")
        if tool.corner and tool.angle:
            lines += ['shape = "tapered-ball"', f"corner_radius = {tool.corner:g}", f"tip_angle = {tool.angle:g}"]
        elif tool.angle:
            lines += ['shape = "vee"', f"tip_angle = {tool.angle:g}"]
        elif tool.corner >= 0.5 * tool.diameter:
            lines += ['shape = "ball"']
        elif tool.corner:
            lines += ['shape = "bull"', f"corner_radius = {tool.corner:g}"]
        else:
            lines += ['shape = "flat"']
        lines += [*(more or {}).get(n, []), ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--seed", default="1")
    options = parser.parse_args()
    folder = Path(options.folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, made in programs(options.seed).items():
        (folder / f"{name}.ngc").write_text(made.text)
        (folder / f"{name}.tbl").write_text(tool_table(made.tools))
        (folder / f"{name}.toml").write_text(geometry_file(made.tools))
        print(f"{name}: {len(made.text.splitlines())} lines")


if __name__ == "__main__":
    main()
