# SPDX-License-Identifier: GPL-2.0-or-later
"""A machine, random deep programs and verdicts for the tests of `chipwise rewrite`.

Used by tests/rewrite/ and bench/bench_rewrite.py.  The verdict on depth is check_oracle.py's needles: they know neither
the product's height map nor how a path was shifted.
"""

import math
import random
from types import SimpleNamespace

import numpy as np

from support import ROOT, forked
from support.check_oracle import Needles
from support.forked import CHIPWISE

HEAD = "G21 G90 G17 G40 G49 G80 G94\n"
FLUTES = {1: 12.0, 2: 8.0, 3: 100.0, 4: 10.0}
TOOLS = (
    "[tool.1]\nshape = 'flat'\nflute_length = 12\n[tool.2]\nshape = 'ball'\nflute_length = 8\n"
    "[tool.3]\nshape = 'flat'\nflute_length = 100\n[tool.4]\nshape = 'bull'\ncorner_radius = 1\nflute_length = 10\n"
    "stick_out = 45\nholder_diameter = 30\n"
)
TABLE = "T1 P1 D6 Z30\nT2 P2 D6\nT3 P3 D10\nT4 P4 D8\n"


def make_machine(folder, tools=TOOLS, table=TABLE, unit="mm"):
    """INI file of a mill with the tools above."""
    folder.mkdir(exist_ok=True)
    (folder / "subs").mkdir(exist_ok=True)
    (folder / "tools.toml").write_text(tools)
    (folder / "mill.tbl").write_text(table)
    (folder / "mill_inch.tbl").write_text(table)
    name = "mill.ini" if unit == "mm" else "mill_inch.ini"
    text = (ROOT / "configs" / name).read_text()
    remap = ROOT / "remap"
    text = (
        text.replace("TOPLEVEL = remap/toplevel.py", f"TOPLEVEL = {remap}/toplevel.py")
        .replace("PATH_PREPEND = remap", f"PATH_PREPEND = {remap}")
        .replace("SUBROUTINE_PATH = nc_files:../nc_files", "SUBROUTINE_PATH = subs")
    )
    (folder / name).write_text(text)
    return folder / name


def rewrite(program, out, ini, *options, timeout=600):
    """Run the command; -> status, text on stdout and stderr."""
    done = forked.run([CHIPWISE, "rewrite", str(program), "-o", str(out), "--ini", str(ini), *options], timeout=timeout)
    errors = "\n".join(line for line in done.stderr.splitlines() if not line.startswith("FILTER_PROGRESS="))
    assert "Traceback" not in done.stdout + done.stderr and "internal error" not in errors
    return SimpleNamespace(status=done.returncode, said=done.stdout.strip(), errors=errors)


def check_status(program, ini):
    """(exit status, output) of `chipwise check`."""
    done = forked.run([CHIPWISE, "check", str(program), "--ini", str(ini)], timeout=600)
    return done.returncode, done.stdout


def deep_program(seed):
    """A program that cuts up to three times deeper than its flutes are long: strokes and arcs that cross, some
    sloped."""
    r = random.Random(f"deep {seed}")
    size = [r.uniform(40, 70), r.uniform(30, 50), r.uniform(20, 40)]
    low = [r.uniform(-3, 3), r.uniform(-3, 3)]
    lines = [
        HEAD.strip(),
        f"M250 P{low[0]:.3f} Q{low[1]:.3f} R{-size[2]:.3f} I{size[0]:.3f} J{size[1]:.3f} K{size[2]:.3f}",
    ]
    if r.random() < 0.5:
        z, y = -r.uniform(2, size[2] * 0.6), r.uniform(0, size[1])
        lines += ["T3 M6", "S8000 M3", f"G0 X-12 Y{y:.3f} Z5", f"G0 Z{z:.3f}", f"G1 X{size[0] + 12:.3f} F900", "G0 Z5"]
    tool = r.choice([1, 2, 4])
    flute = FLUTES[tool]

    def place():
        return r.uniform(low[0] - 8, low[0] + size[0] + 8), r.uniform(low[1] - 8, low[1] + size[1] + 8)

    def depth(share):
        return -r.uniform(flute * share, min(size[2] - 1, 3.2 * flute))

    lines += [f"T{tool} M6", "S9000 M3"]
    for _ in range(r.randint(1, 2)):
        x, y = place()
        lines.append(f"G0 X{x:.3f} Y{y:.3f} Z5")
        near = all(low[k] - 6.1 < v < low[k] + size[k] + 6.1 for k, v in enumerate((x, y)))
        lines.append(f"G1 Z{depth(0.5):.3f} F150" if near else f"G0 Z{depth(0.5):.3f}")
        for _ in range(r.randint(1, 5)):
            u, v = place()
            z = f" Z{depth(0.3):.3f}" if r.random() < 0.25 else ""
            feed = r.choice([300, 450, 600])
            if r.random() < 0.6:
                lines.append(f"G1 X{u:.3f} Y{v:.3f}{z} F{feed}")
            else:
                radius = math.hypot(u - x, v - y) * r.uniform(0.55, 1.5)
                lines.append(f"G{r.choice([2, 3])} X{u:.3f} Y{v:.3f}{z} R{radius:.4f} F{feed}")
            x, y = u, v
        lines.append("G0 Z5")
    return "\n".join([*lines, "M2"]) + "\n"


def neighbours(z):
    """(9, rows, columns): each needle with those beside it."""
    padded = np.pad(z, 1, mode="edge")
    return np.stack([padded[i : i + z.shape[0], j : j + z.shape[1]] for i in range(3) for j in range(3)])


def verdict(before, after, ini):
    """(deepest over the flutes mm, most cut more mm, most left mm, worst traverse mm) of a rewritten program.

    The stock that is left is compared but for single needles on a wall: they are on the edge of the tool's own path.
    """
    from chipwise.program.reader import Machine
    from chipwise.rewrite.program import read
    from chipwise.tool_data.geometry import load_tools

    machine, geometry = Machine(str(ini)), load_tools(str(ini.parent / "tools.toml"))
    one, _, _ = judged(read(str(before), machine), geometry)
    two, excess, rapid = judged(read(str(after), machine), geometry)
    lowest, highest = (pick(neighbours(one.z), axis=0) for pick in (np.min, np.max))
    return max(excess.values()), float((lowest - two.z).max()), float((two.z - highest).max()), rapid


def judged(program, geometry, spacing=0.2):
    """(needles after a Program, {tool: mm its deepest feed move is deeper than its flutes are long}, worst traverse
    mm)."""
    from chipwise.rewrite import sections

    needles, excess, rapid = None, {}, 0.0
    for section in sections.sections(program, geometry):
        if section.stock is not None:
            needles = Needles(section.stock.values[2:5], section.stock.values[5:8], spacing)
        if section.tool is None:
            continue
        shape, flute = section.tool.shape, section.tool.flute_length or math.inf
        for move in range(max(section.first, program.known_from), section.end):
            (depth,) = needles.move(
                (shape.diameter, shape.corner_radius, shape.tip_angle), program.start(move), program.end[move], (0.004,)
            )
            if program.kind[move] == 0:
                rapid = max(rapid, depth)
            else:
                number = section.tool.number
                excess[number] = max(excess.get(number, -math.inf), depth - flute)
    return needles, excess, rapid
