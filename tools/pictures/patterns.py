# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/patterns.svg: the path of nc_files/pattern.ngc, as LinuxCNC's interpreter runs it; and
docs/user/pattern_library.svg.

    /usr/bin/python3 tools/pictures/patterns.py

Blue: feed moves; grey dashes: traverses; crosses: the origins of the patterns, with the words of their lines.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "remap"))

import numpy as np  # noqa: E402

from chipwise.program import records  # noqa: E402
from chipwise.program.reader import Machine, Reader  # noqa: E402

PROGRAM = ROOT / "nc_files/pattern.ngc"
STOCK, EDGE = (0.0, 0.0, 120.0, 80.0), 8.0  # mm
SCALE = 6.0  # px per mm
NEAR_MM = 0.02  # points nearer to the last one are left out


def chains():
    """[(is a traverse, [(x, y), ..])] of the program, mm."""
    found, here = [], None
    with Reader(str(PROGRAM), Machine(str(ROOT / "configs/mill.ini"))) as reader:
        for block in reader:
            for row in block[block[:, 0] <= records.ARC]:
                rapid, there = bool(row[0] == records.RAPID), (float(row[2]), float(row[3]))
                if here is not None and np.hypot(there[0] - here[0], there[1] - here[1]) > NEAR_MM:
                    if not found or found[-1][0] != rapid:
                        found.append((rapid, [here]))
                    found[-1][1].append(there)
                    here = there
                here = there if here is None else here
    return found


def main():
    x0, y0, x1, y1 = STOCK
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x0 - EDGE} {-y1 - EDGE} {x1 - x0 + 2 * EDGE} '
        f'{y1 - y0 + 2 * EDGE}" '
        f'width="{(x1 - x0 + 2 * EDGE) * SCALE:g}" font-family="sans-serif" font-size="3.2">',
        f'<rect x="{x0 - EDGE}" y="{-y1 - EDGE}" width="{x1 - x0 + 2 * EDGE}" height="{y1 - y0 + 2 * EDGE}" '
        f'fill="#fff"/>',
        f'<rect x="{x0}" y="{-y1}" width="{x1 - x0}" height="{y1 - y0}" fill="#eef1f4" stroke="#888" '
        f'stroke-width="0.3"/>',
    ]
    for rapid, points in chains():
        style = (
            'stroke="#999" stroke-dasharray="1 1" stroke-width="0.25"'
            if rapid
            else 'stroke="#0a4fa0" stroke-width="0.6"'
        )
        lines.append(
            f'<polyline fill="none" {style} points="' + " ".join(f"{x:.2f},{-y:.2f}" for x, y in points) + '"/>'
        )
    for line in PROGRAM.read_text().splitlines():
        words = {word[0]: word[1:] for word in line.split()}
        if line.startswith("G75"):
            x, y = float(words["X"]), float(words["Y"])
            shown = " ".join(word for word in line.split()[1:] if word[0] not in "QXY") or "as it is"
            right = x > (x0 + x1) / 2 + 1
            lines.append(f'<path d="M{x - 1.5} {-y}h3M{x} {-y - 1.5}v3" stroke="#c03" stroke-width="0.35"/>')
            lines.append(
                f'<text x="{x + (-2 if right else 2)}" y="{-y - 2}" fill="#c03" '
                f'text-anchor="{"end" if right else "start"}">{shown}</text>'
            )
    (ROOT / "docs/user/patterns.svg").write_text("\n".join([*lines, "</svg>", ""]))
    subprocess.run(
        [
            str(ROOT / "bin/chipwise"),
            "patterns",
            "--ini",
            str(ROOT / "configs/mill.ini"),
            "-o",
            str(ROOT / "docs/user/pattern_library.svg"),
        ],
        check=True,
    )


if __name__ == "__main__":
    main()
