# SPDX-License-Identifier: GPL-2.0-or-later
"""One of many programs, rewritten: run.py with its errors as a result.

Called by cli/rewrite_folder.py in a process of its own, and by cli/cluster_runner.py.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Callable, Optional, TypedDict

from chipwise.program.reader import Unreadable
from chipwise.errors import of_unexpected, unnamed
from chipwise.host.temp_folder import FolderError
from chipwise.rewrite.read_back import Different
from chipwise.rewrite.run import rewritten

if TYPE_CHECKING:
    from chipwise.clib.arrays import Corners
    from chipwise.program.reader import Machine
    from chipwise.rewrite.run import Order


class Arguments(TypedDict, total=False):
    """Those of run.rewritten(), but for the program; the last three are limits of reader.Reader."""

    order: Order
    machine: Machine
    stock: Corners | None
    cpu_s: float
    quiet_s: float
    memory_mb: float


@dataclass
class Rewritten:
    """data, said: as in run.rewritten(); error: (text, line) if the program cannot be rewritten, else None."""

    program: str
    data: bytes = b""
    said: str = ""
    error: Optional[tuple[str, int]] = None


def failed(program: str, text: str) -> Rewritten:
    """The Rewritten of a program that nothing is written for."""
    return Rewritten(program, error=(text, 0))


def one(program: str, progress: Callable[[float], object], arguments: Arguments) -> Rewritten:
    """The Rewritten, also after an unexpected error.  arguments: those of run.rewritten()."""
    try:
        return Rewritten(program, *rewritten(program, progress=progress, **arguments))
    except Unreadable as error:
        return Rewritten(program, error=(str(error), error.line))
    except Different as error:
        return failed(program, f"{error}: nothing is written; please report it with the program")
    except FolderError as error:
        return failed(program, unnamed(error))
    except MemoryError:
        return failed(program, "the memory is not enough for it; use a larger --cell")
    except Exception as error:  # one bad program never stops the rest
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        return failed(program, of_unexpected(error))
