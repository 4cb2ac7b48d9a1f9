# SPDX-License-Identifier: GPL-2.0-or-later
"""Where on the path of a program the tool is.  Pure; mm, machine coordinates of the tool's tip.

Called by look_ahead.py, which follows the tool on the path that look_ahead_process.py has made (check/drawn_path.py).

follow(): the next place on the path at which the tip is, among the segments that the machine can have got to since the
last one; the line that the machine runs has to be one of the segment's.
"""

from collections.abc import Sequence

import numpy as np

from chipwise.check.drawn_path import Path

NEAR_MM = 1.0  # the tip is that far from the path at most: G64 rounds corners
SAME_MM = 0.05  # of two places as near as that the earlier one counts


def follow(path: Path, done: float, tip: Sequence[float], line: int, reach: float) -> float | None:
    """Length of path at which the tip is, mm; None if it is not near the path.

    done   the same at the look before; reach: mm that the machine can have gone since
    tip    (3,) mm; line: that the machine runs, 0: not known
    """
    first = max(1, int(np.searchsorted(path.s, done - NEAR_MM)))
    last = int(np.searchsorted(path.s, done + reach, side="right"))
    found = on_segments(path, first, last + 1, tip, line)
    return None if found is None else max(done, found)


def anywhere(path: Path, done: float, tip: Sequence[float], line: int) -> float | None:
    """As follow(), on the whole path: what is behind `done` counts before what is in front of it."""
    at = path.after(done)
    found = on_segments(path, max(1, at - 1), len(path.s), tip, line)
    return found if found is not None else on_segments(path, 1, at, tip, line)


def on_segments(path: Path, first: int, last: int, tip: Sequence[float], line: int) -> float | None:
    """Length of path at the nearest place to the tip on the segments first .. last - 1; None without one that is near
    enough.  A segment has the number of the point at its end."""
    last = min(last, len(path.s))
    if first >= last:
        return None
    start = path.points[first - 1 : last - 1].astype(float)
    along = path.points[first:last] - start
    square = np.maximum((along * along).sum(axis=1), 1e-12)
    to_tip = np.asarray(tip, float) - start
    share = np.clip((to_tip * along).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(to_tip - share[:, None] * along, axis=1)
    if line > 0:
        distance[(path.low[first:last] > line) | (path.high[first:last] < line)] = np.inf
    least = distance.min()
    if not least <= NEAR_MM + path.step:
        return None
    at = int(np.argmax(distance <= least + SAME_MM))
    return float(path.s[first - 1 + at] + share[at] * np.sqrt(square[at]))
