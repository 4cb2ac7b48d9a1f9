# SPDX-License-Identifier: GPL-2.0-or-later
"""Read diameters of tools from LinuxCNC's tool table, without LinuxCNC.  Called by cli/surface.py and cli/load.py."""

import re

from chipwise.errors import CycleError, braceless
from chipwise.files import read_bytes

MAX_BYTES = 1 << 20
_LINE = re.compile(r"^\s*(?:[A-Z][-+.\d]+\s+)*?T(\d+)\b", re.IGNORECASE)
_DIAMETER = re.compile(r"(?:^|\s)D([-+]?[\d.]+)", re.IGNORECASE)


def diameter_of(path: str, number: int) -> float:
    """Diameter of tool `number`, machine units.  Raises CycleError if the table or the tool cannot be used."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "replace") if path else ""
    except OSError as error:
        raise CycleError(f"tool table {braceless(path)}: {error.strerror}", "correct [EMCIO]TOOL_TABLE") from error
    for line in text.splitlines():
        words = line.partition(";")[0]
        found = _LINE.match(words)
        if found and int(found.group(1)) == number:
            diameter = _DIAMETER.search(words)
            value = float(diameter.group(1)) if diameter and diameter.group(1).count(".") < 2 else 0.0
            if not value > 0:
                raise CycleError(f"tool {number} has no diameter in the tool table", "give it a D there")
            return value
    raise CycleError(f"tool {number} is not in the tool table", "use the number of a tool that is")


def numbers(path: str) -> list:
    """Numbers of the tools of a table, in its order; none if it cannot be read."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "replace") if path else ""
    except OSError:
        return []
    return [int(found.group(1)) for found in map(_LINE.match, (line.partition(";")[0] for line in text.splitlines())) if found]


def largest_diameter(path: str) -> float:
    """The largest diameter in a table, machine units; 0 if there is none or it cannot be read."""
    largest = 0.0
    for number in numbers(path):
        try:
            largest = max(largest, diameter_of(path, number))
        except CycleError:          # a probe, say, without a diameter
            continue
    return largest
