# SPDX-License-Identifier: GPL-2.0-or-later
"""A sub to be read as a pattern.  Made by glue/pattern.py; plain values."""

from dataclasses import dataclass
from typing import Optional

from chipwise.contour_sub.job import Job

DEPTH = "CHIPWISE_PATTERN_DEPTH"  # environment: how many patterns a process is in


@dataclass(frozen=True)
class PatternJob:
    """A sub, and the interpreter's state at its call.

    sub         the Job of a contour sub: where it is looked for, and what it may read
    mirrored    whether what the sub does will be mirrored
    spindle     (3, 4 or 5, rpm): M3, M4 or M5, and S
    coolant     (mist, flood)
    stock_top   mm, machine coordinates less the pattern's shift: nothing is above it; None: not known
    motion      0 to 3: the motion mode, for a first line without a G word
    axes        letters of the machine's axes that the sub may move; without Y it is a lathe, and the sub runs in G18
    abc         degrees of A, B and C where the sub begins, as the pattern has them
    orientation of the tool, for cutter compensation on a lathe
    per_rev     F is mm per revolution (G95)
    """

    sub: Job
    mirrored: bool = False
    spindle: tuple = (5, 0.0)
    coolant: tuple = (False, False)
    motion: int = 0
    stock_top: Optional[float] = None
    axes: str = "XYZ"
    abc: tuple = (0.0, 0.0, 0.0)
    orientation: int = 0
    per_rev: bool = False
