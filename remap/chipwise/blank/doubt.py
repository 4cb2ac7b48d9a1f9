# SPDX-License-Identifier: GPL-2.0-or-later
"""The doubt of a probed blank: a file beside its stock, for whoever restores it.

Written by cli/blank.py, read by monitor/stock_files.py and check/simulate.py.  It names the stock file it belongs to by
that file's checksum, so a slot that gets another stock has no doubt.
"""

from __future__ import annotations

import json
import math
from typing import Any

from chipwise.host.files import read_bytes, write_durable
from chipwise.stock import store

ENDING = ".doubt"  # behind the name of the stock file
MOST_BYTES = 4096
FIGURES = {"probed": 1.0, "doubt_mm": 1e5, "most_doubt_mm": 1e5}  # name: the most it can be


def write(path: str, figures: dict) -> None:
    """The doubt of the stock file at `path`, which has been written.  Raises OSError."""
    text = json.dumps({"of": store.digest_of(path).hex(), **{name: figures[name] for name in FIGURES}}, indent=1)
    write_durable(path + ENDING, text.encode() + b"\n", ".new")


def read(path: str) -> str | None:
    """What to say of the stock in the file at `path`; None if nothing is known of it."""
    found = figures_of(path)
    return sentence(found) if found else None


def figures_of(path: str) -> dict[str, float] | None:
    """{name of FIGURES: value} of the stock in the file at `path`; None if nothing is known of it."""
    try:
        found = json.loads(read_bytes(path + ENDING, MOST_BYTES))
        if found["of"] != store.digest_of(path).hex():
            return None
        values = {name: float(found[name]) for name in FIGURES}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return (
        values
        if all(0.0 <= value <= FIGURES[name] and math.isfinite(value) for name, value in values.items())
        else None
    )


def sentence(figures: dict[str, Any]) -> str:
    """Of the figures."""
    rest = 1.0 - figures["probed"]
    missing = f"; {max(rest, 0.01):.0%} of it was not probed and has the typed height" if rest > 5e-4 else ""
    return (
        f"it may be up to {figures['most_doubt_mm']:.2f} mm higher than the part, {figures['doubt_mm']:.2f} mm on "
        f"the average{missing}"
    )
