# SPDX-License-Identifier: GPL-2.0-or-later
"""Draws docs/user/feed.svg: feed and removal rate over time on nc_files/slots.ngc, from a run of the simulated mill.

    /usr/bin/python3 tools/pictures/feed.py [LOG.npz]

Without a log it runs the program first (chipwise demo --log), about a minute.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
ROOT = DOCS.parent
PROGRAM = ROOT / "nc_files" / "slots.ngc"

WIDTH, HEIGHT, GAP, LEFT = 900, 130, 34, 64  # px of a panel
BIN_S = 0.05  # s of one point of the curves
CUTTING = (2, 3)  # motion.motion-type


def run(folder):
    """-> path of the log of one run."""
    log = Path(folder) / "run.npz"
    subprocess.run(
        [str(ROOT / "bin" / "chipwise"), "demo", str(PROGRAM), "--no-compare", "--log", str(log)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return log


def curves(path):
    """Log -> (t s, feed mm/min, rate cm3/min, target cm3/min, traverse?) in bins of BIN_S."""
    log = np.load(path)
    step = int(round(BIN_S / float(log["period"])))
    count = len(log["sample"]) // step - 1
    rows = np.arange(count + 1) * step
    distance = np.cumsum(np.sqrt(sum(np.diff(log[axis], prepend=log[axis][:1]) ** 2 for axis in "xyz")))
    feed = np.diff(distance[rows]) / BIN_S * 60
    rate = np.diff(log["removed_volume"][rows]) / BIN_S * 60 / 1000
    traverse = ~np.isin(log["motion_type"][rows[:-1] + step // 2], CUTTING)
    return np.arange(count) * BIN_S, feed, np.maximum(rate, 0), log["rate_target"][rows[:-1]] / 1000, traverse


def panel(t, values, top, most, colour, title):
    """One curve with its frame; values above `most` are cut off."""
    x = LEFT + t / t[-1] * (WIDTH - LEFT - 10)
    y = top + HEIGHT * (1 - np.minimum(values, most) / most)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    return [
        f'<rect x="{LEFT}" y="{top}" width="{WIDTH - LEFT - 10}" height="{HEIGHT}" fill="none" stroke="#bbb"/>',
        f'<text x="{LEFT}" y="{top - 7}" font-size="14">{title}</text>',
        f'<text x="{LEFT - 6}" y="{top + 12}" font-size="12" text-anchor="end">{most:g}</text>',
        f'<text x="{LEFT - 6}" y="{top + HEIGHT}" font-size="12" text-anchor="end">0</text>',
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.2"/>',
    ]


def main(arguments):
    with tempfile.TemporaryDirectory() as folder:
        t, feed, rate, target, traverse = curves(arguments[0] if arguments else run(folder))
    feed = np.where(traverse, np.nan, feed)
    shapes = panel(t, np.nan_to_num(feed), 30, 5000, "#06c", "feed, mm/min (rapids left out)")
    top = 30 + HEIGHT + GAP
    shapes += panel(t, rate, top, 40, "#c40", "removal rate, cm3/min; dashed: M251 Q30")
    y = top + HEIGHT * (1 - target.max() / 40)
    shapes.append(
        f'<line x1="{LEFT}" y1="{y:.1f}" x2="{WIDTH - 10}" y2="{y:.1f}" stroke="#333" stroke-dasharray="6 5"/>'
    )
    shapes.append(
        f'<text x="{WIDTH - 10}" y="{top + HEIGHT + 16}" font-size="12" text-anchor="end">{t[-1]:.0f} s</text>'
    )
    body = "\n".join(shapes)
    (DOCS / "user" / "feed.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{top + HEIGHT + 24}" '
        f'font-family="sans-serif"><rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n'
    )


if __name__ == "__main__":
    main(sys.argv[1:])
