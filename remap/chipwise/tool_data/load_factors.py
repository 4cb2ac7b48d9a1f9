# SPDX-License-Identifier: GPL-2.0-or-later
"""The factors measured / predicted power of tools in materials, in the file [CHIPWISE]SPINDLE_LOADS.  Called by
monitor/spindle_load.py and cli/load_factors.py.

    [3]                     tool number
    "6061" = 1.312          measured / predicted

A person may delete a line, a tool or the file: the next cut teaches it again.
"""

import contextlib
import json
import os
from typing import Iterator

from chipwise.errors import CycleError, braceless
from chipwise.host.files import locked, write_durable
from chipwise.host.toml_file import REMEDY, UNFINISHED, document

HEAD = (
    "# Measured over predicted power of the spindle, by tool and material. chipwise-monitor writes this file.\n"
    "# Delete a line, a tool or the file, and the next cut teaches it again.\n"
)
LEAST, MOST = 0.02, 50.0


def read(path: str) -> dict:
    """{(tool number, name of the material): factor}, {} without a file.  Raises CycleError that names it."""
    found = {}
    for tool, materials in document(path).items():
        if not (tool.isdecimal() and isinstance(materials, dict)):
            raise CycleError(braceless(f"{path}: [{tool}] is not a tool number"), REMEDY)
        for name, factor in materials.items():
            if isinstance(factor, bool) or not isinstance(factor, (int, float)) or not LEAST <= factor <= MOST:
                raise CycleError(
                    braceless(f"{path}: [{tool}] {name} is not a factor from {LEAST:g} to {MOST:g}"), REMEDY
                )
            found[int(tool), name] = float(factor)
    return found


def write(path: str, factors: dict) -> None:
    """Raises OSError."""
    lines = [HEAD]
    for tool in sorted({tool for tool, _name in factors}):
        lines.append(f"\n[{tool}]\n")
        lines += [
            f"{json.dumps(name)} = {factor:.4g}\n"
            for (number, name), factor in sorted(factors.items())
            if number == tool
        ]
    write_durable(path, "".join(lines).encode("utf-8"), UNFINISHED)


@contextlib.contextmanager
def changing(path: str, waits: bool = True) -> Iterator[dict]:
    """The factors as they are in the file now, written at the end: one writer at a time.  Raises OSError (as
    files.locked) and CycleError."""
    with locked(os.path.dirname(os.path.abspath(path)), waits):
        found = read(path)
        yield found
        write(path, found)
