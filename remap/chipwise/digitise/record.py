# SPDX-License-Identifier: GPL-2.0-or-later
"""The log of a trace, as LinuxCNC's halsampler writes it.

Called by cli/digitise.py.  A row is `in-contact ball-x ball-y ball-z` of tracer.comp, one period each, with the number
of the sample before it or not (halsampler -t); `overrun` between rows says that samples are missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chipwise.errors import CycleError
from chipwise.host.files import read_bytes

MOST_BYTES = 1 << 30
MOST_MM = 1e6
GAP_MM = 1.0  # neighbours further apart are not joined


@dataclass(frozen=True)
class Record:
    """Centres of the ball in contact, (n, 3) mm, in their order; `start` (n,) bool: not joined with the one before."""

    centres: np.ndarray
    start: np.ndarray
    rows: int
    overruns: int


def _numbers(line: bytes, number: int) -> list[float]:
    """The numbers of a row, without that of the sample.  Raises CycleError."""
    words = line.split()
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if len(found) not in (4, 5):
        text = line[:40].decode("ascii", "backslashreplace")
        raise CycleError(
            f"line {number} is not in-contact, ball-x, ball-y, ball-z but '{text}'",
            "sample these four pins with cfg=bfff",
        )
    return found[-4:]


def parse(data: bytes, per_mm: float) -> Record:
    """The bytes of a log, its lengths in units of which `per_mm` make a mm.  Raises CycleError."""
    rows, overruns, lines = [], 0, []
    for number, line in enumerate(data.splitlines(), 1):
        if line.strip() == b"overrun":
            overruns += 1
        elif line.strip():
            rows.append(_numbers(line, number))
            lines.append(overruns)
    table = np.array(rows, float).reshape(-1, 4)
    touching = table[:, 0] != 0
    centres = table[touching, 1:] / per_mm
    if not len(centres):
        raise CycleError("the log has no row in contact", "record while tracer.N.state is 2")
    bad = int((~(np.abs(centres) < MOST_MM).all(axis=1)).sum())
    if bad:
        raise CycleError(f"{bad} positions are not finite or further than 1e6 mm", "check the sensors and trace again")
    # rows in contact belong together while no row without contact and no overrun is between them
    part = np.cumsum(~touching) + np.array(lines, np.int64)
    start = np.diff(part[touching], prepend=-1) > 0
    start[1:] |= np.linalg.norm(np.diff(centres, axis=0), axis=1) > GAP_MM
    return Record(centres, start, len(table), overruns)


def read(path: str, per_mm: float) -> Record:
    """A log.  Raises CycleError, OSError."""
    return parse(read_bytes(path, MOST_BYTES), per_mm)
