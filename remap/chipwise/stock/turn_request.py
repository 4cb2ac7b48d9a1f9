# SPDX-License-Identifier: GPL-2.0-or-later
"""What M254 asks chipwise-monitor for with R180: which slot's stock, turned over about which axis, to which corner.

Written by glue/stock_codes.py while the machine waits at the code, read by stock/turn_over.py in the monitor: a
register carries one number, and this needs five.  The file stays, so a monitor that is started again in between serves
the same request.  No numpy: LinuxCNC's task must not load it.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass

from chipwise.clib.layout import MAX_COORDINATE
from chipwise.host.files import read_bytes, write_durable
from chipwise.stock import reasons

NAME = "turned.json"  # in STOCK_DIR
AXES = "X", "Y"
MOST_ALLOWANCE = 100.0  # mm
MOST_BYTES = 4096


@dataclass(frozen=True)
class TurnRequest:
    """slot: of M253; about: one of AXES; corner: the touched one as the part lies now, its smallest X and Y, its top;
    allowance: of the blank's sides.  mm, machine coordinates of the tool's tip."""

    slot: int
    about: str
    corner: tuple[float, float, float]
    allowance: float


def write(folder: str, request: TurnRequest) -> None:
    """Into STOCK_DIR, which is made if it is missing.  Raises OSError."""
    os.makedirs(folder, exist_ok=True)
    write_durable(os.path.join(folder, NAME), json.dumps(asdict(request)).encode() + b"\n", ".new")


def read(path: str) -> TurnRequest:
    """Raises OSError, ValueError for a file that write() has not written."""
    try:
        found = json.loads(read_bytes(path, MOST_BYTES))
        x, y, z = map(float, found["corner"])
        request = TurnRequest(found["slot"], found["about"], (x, y, z), float(found["allowance"]))
    except (KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error
    if not (
        type(request.slot) is int
        and request.slot in range(reasons.SLOTS)
        and request.about in AXES
        and all(abs(value) <= MAX_COORDINATE for value in request.corner)
        and 0.0 <= request.allowance <= MOST_ALLOWANCE
    ):
        raise ValueError(f"{request}")
    return request
