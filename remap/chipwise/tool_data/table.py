# SPDX-License-Identifier: GPL-2.0-or-later
"""Read diameters of tools from LinuxCNC's tool table, without LinuxCNC.  Called by cli/load.py,
options/surface_program.py, entry/planned.py, check/assume.py and others."""

import re

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes

MAX_BYTES = 1 << 20
_LINE = re.compile(r"^\s*(?:[A-Z][-+.\dE]+\s+)*?T(\d+)\b", re.IGNORECASE)
_DIAMETER = re.compile(r"(?:^|\s)D([-+]?[\d.]+(?:E[-+]?\d+)?)", re.IGNORECASE)


def _tools(path):
    """[(number, diameter in machine units, 0 if it has none)] of the lines of a table; none without a path.  Raises
    OSError."""
    text = read_bytes(path, MAX_BYTES).decode("utf-8", "replace") if path else ""
    lines = [line.partition(";")[0] for line in text.splitlines()]
    return [(int(found.group(1)), _diameter(words)) for words, found in zip(lines, map(_LINE.match, lines)) if found]


def _diameter(words):
    found = _DIAMETER.search(words)
    try:
        return float(found.group(1)) if found else 0.0
    except ValueError:
        return 0.0


def diameter_of(path: str, number: int) -> float:
    """Diameter of tool `number`, machine units.  Raises CycleError if the table or the tool cannot be used."""
    try:
        diameter = next((diameter for found, diameter in _tools(path) if found == number), None)
    except OSError as error:
        raise CycleError(f"tool table {braceless(path)}: {error.strerror}", "correct [EMCIO]TOOL_TABLE") from error
    if diameter is None:
        raise CycleError(f"tool {number} is not in the tool table", "use the number of a tool that is")
    if not diameter > 0:
        raise CycleError(f"tool {number} has no diameter in the tool table", "give it a D there")
    return diameter


def numbers(path: str) -> list:
    """Numbers of the tools of a table, in its order; none if it cannot be read."""
    try:
        return [number for number, _size in _tools(path)]
    except OSError:
        return []


def remarks(path: str) -> dict:
    """{tool number: what is behind the semicolon of its line}; none if the table cannot be read."""
    try:
        lines = read_bytes(path, MAX_BYTES).decode("utf-8", "replace").splitlines() if path else []
    except OSError:
        return {}
    parts = [line.partition(";") for line in lines]
    return {
        int(found.group(1)): remark.strip()
        for found, remark in ((_LINE.match(words), remark) for words, _, remark in parts)
        if found and remark.strip()
    }


def diameters(path: str) -> list:
    """[(tool number, diameter in machine units)] of the tools of a table that have one; none if it cannot be read."""
    try:
        return [(number, diameter) for number, diameter in _tools(path) if diameter > 0]
    except OSError:
        return []
