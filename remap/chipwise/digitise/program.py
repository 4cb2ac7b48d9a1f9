# SPDX-License-Identifier: GPL-2.0-or-later
"""A program that repeats a trace: a ball tool as large as the stylus follows the ball centres.

Called by cli/digitise.py.  Points are left out as long as the path stays within the chord error (Douglas and Peucker's
rule).  An allowance raises the path along Z, which never cuts into the model.  Lines are joined over the clearance
plane.
"""

from __future__ import annotations

import numpy as np

DIGITS = 4  # of a coordinate in mm


def thinned(points: np.ndarray, chord: float) -> np.ndarray:
    """Indices of the points (n, 3) to keep, so that no other is further than `chord` (mm) from the path."""
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        along, rest = points[b] - points[a], points[a + 1 : b] - points[a]
        share = np.clip(rest @ along / max(float(along @ along), 1e-18), 0.0, 1.0)
        off = np.linalg.norm(rest - share[:, None] * along, axis=1)
        worst = int(np.argmax(off))
        if off[worst] > chord:
            middle = a + 1 + worst
            keep[middle] = True
            parts += [(a, middle), (middle, b)]
    return np.flatnonzero(keep)


def lines(centres: np.ndarray, start: np.ndarray, chord: float) -> list[np.ndarray]:
    """The lines of a trace, (n, 3) mm each, thinned; of a single point there is none."""
    borders = [*np.flatnonzero(start), len(centres)]
    found = [centres[a:b] for a, b in zip(borders, borders[1:]) if b - a > 1]
    return [line[thinned(line, chord)] for line in found]


def _words(point: np.ndarray) -> str:
    return " ".join(f"{axis}{value:.{DIGITS}f}" for axis, value in zip("XYZ", point))


def program(paths: list[np.ndarray], radius: float, allowance: float, clearance: float, feed: float, name: str) -> str:
    """G-code of paths of ball centres (mm) for a ball tool of `radius`: its tip is `radius` below, plus the allowance.

    clearance: above the highest tip, mm; feed: mm/min."""
    tips = [path - (0.0, 0.0, radius - allowance) for path in paths]
    plane = max(float(tip[:, 2].max()) for tip in tips) + clearance
    text = [
        f"(chipwise digitise: {name})",
        f"(ball tool of diameter {2 * radius:g} mm, allowance {allowance:g} mm)",
        "G21 G90 G94 G17 G40 G64 P0.001",
        f"F{feed:g}",
        f"G0 Z{plane:.{DIGITS}f}",
    ]
    for tip in tips:
        text += [f"G0 X{tip[0, 0]:.{DIGITS}f} Y{tip[0, 1]:.{DIGITS}f}"]
        text += [f"G1 {_words(point)}" for point in tip]
        text += [f"G0 Z{plane:.{DIGITS}f}"]
    return "\n".join([*text, "M2", ""])
