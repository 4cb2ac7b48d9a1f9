# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks many programs: a process for each (batch/pool.py).  Called by cli/check.py; filter/work.py has a process of
its own."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from chipwise.batch.pool import on_processes
from chipwise.program.program_file import UNFINISHED
from chipwise.check.result import Result
from chipwise.check.answer import check
from chipwise.errors import of_unexpected, unnamed
from chipwise.host.temp_folder import FolderError

if TYPE_CHECKING:
    from chipwise.check.assume import Progress

SUFFIXES = (".ngc", ".nc", ".tap")


def programs_of(paths: list[str]) -> list[str]:
    """Paths of programs; of a folder those in it whose name ends as a program's does."""
    found = []
    for path in paths:
        if os.path.isdir(path):
            names = sorted(name for name in os.listdir(path) if name.lower().endswith(SUFFIXES))
            found += [os.path.join(path, name) for name in names]
        else:
            found.append(path)
    return found


def lines_of(path: str) -> int:
    """Lines of a program, at least 1: what progress is counted by."""
    count = 1
    try:
        if os.path.isfile(path):
            with open(path, "rb") as file:
                while part := file.read(1 << 20):
                    count += part.count(b"\n")
    except OSError:
        pass
    return count


def checked(program: str, progress: Progress | None, arguments: dict[str, Any]) -> Result:
    """The Result, also after an unexpected error."""
    try:
        return check(program, progress=progress, **arguments)
    except MemoryError:
        return failed(program, "it needs more memory than there is; use a larger --cell")
    except FolderError as error:
        return failed(program, unnamed(error))
    except Exception as error:  # one bad program never stops the rest
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        return failed(program, of_unexpected(error))


def failed(program: str, text: str) -> Result:
    """The Result of a program that was not checked to its end."""
    return Result(program, error=(text, 0), state=UNFINISHED)


def _check(program: str, progress: Progress, arguments: dict[str, Any]) -> Result:
    """checked(), with the share of its lines as progress."""
    lines = lines_of(program)
    return checked(program, lambda line: progress(line / lines), arguments)


def check_all(
    programs: list[str], jobs: int, progress: Progress | None = None, **arguments: Any
) -> Iterator[tuple[int, Result]]:
    """Yield (number, Result) of each program as it is ready; `jobs` at a time.  arguments: as for answer.check.

    progress: called with the share (0..1) of all that is done.
    """
    return on_processes(jobs, _check, programs, arguments, failed, progress)
