# SPDX-License-Identifier: GPL-2.0-or-later
"""What the cycles did, for a program that watches a run.

A cycle calls record('hole', chopped=True, largest_piece_mm=7.5).  The line, one JSON object, is appended to
  1. the file that CHIPWISE_REPORT names,
  2. else, in a headless run (CHIPWISE_PROGRAM is set), a file in HOME,
  3. else, while chipwise-display runs (begin() .. end()), a file in HOME that it reads at the end of each program,
  4. else nowhere.
Called by remap/ while the task reads ahead (`self.task == 1`), never in the preview; read by bin/chipwise-headless.
"""

import json
import os
from typing import Any, Optional

VARIABLE = "CHIPWISE_REPORT"
HEADLESS = "CHIPWISE_PROGRAM"
DEFAULT = "~/.chipwise-report.jsonl"
DISPLAY = "~/.chipwise-display.jsonl"  # exists while a display reads it
LARGEST = 1 << 20  # bytes of it


def path() -> Optional[str]:
    """Path of the report, None if nobody reads one."""
    found = os.environ.get(VARIABLE)
    if not found and os.environ.get(HEADLESS):
        found = os.path.expanduser(DEFAULT)
    if not found and os.path.isfile(os.path.expanduser(DISPLAY)):
        found = os.path.expanduser(DISPLAY)
    return found or None


def begin() -> None:
    """A display reads the report from now on."""
    try:
        with open(os.path.expanduser(DISPLAY), "w"):
            pass
    except OSError:
        pass


def end() -> None:
    """The display has ended."""
    try:
        os.unlink(os.path.expanduser(DISPLAY))
    except OSError:
        pass


def record(kind: str, **figures: Any) -> None:
    """Append one line; a report that cannot be written never stops a cycle."""
    name = path()
    if name is None:
        return
    try:
        line = json.dumps(dict(figures, kind=kind), default=str) + "\n"
        handle = os.open(name, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            if os.fstat(handle).st_size < LARGEST:
                os.write(handle, line.encode())
        finally:
            os.close(handle)
    except (OSError, TypeError, ValueError):
        pass


def read(name: Optional[str]) -> list[dict]:
    """-> list of the dicts recorded in a file; [] if it does not exist, or for None."""
    if name is None:
        return []
    try:
        with open(name) as handle:
            return [json.loads(line) for line in handle if line.strip()]
    except FileNotFoundError:
        return []
