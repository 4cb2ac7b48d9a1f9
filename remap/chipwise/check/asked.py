# SPDX-License-Identifier: GPL-2.0-or-later
"""Both ends of a process that reads the loaded program: an order as JSON on its standard input, the answer on its
standard output.

Called by monitor/answering.py and panel/look_ahead.py (start, end), and by the processes monitor/shadow_process.py,
monitor/comment_process.py, setup/job_process.py, setup/time_process.py and panel/look_ahead_process.py (take_order);
reasoned() is for those whose answer may be why there is none.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import IO, Any

from chipwise.errors import CycleError, unnamed
from chipwise.host.processes import die_with_parent, environment, limit_memory
from chipwise.host.temp_folder import OwnFolder
from chipwise.program.program_file import Unreadable


class Child(subprocess.Popen[bytes]):
    """The process, with pipes of bytes."""

    stdin: IO[bytes]
    stdout: IO[bytes]


def start(module: str) -> Child:
    """-> the process of a module of chipwise, in a group of its own.  Raises OSError."""
    return Child(
        [sys.executable, "-m", module, str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment(),
        start_new_session=True,
    )


def end(child: Child) -> None:
    """Kill the process, and what it has started, and wait for it."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def take_order(nice: int, memory_mb: int) -> dict[str, Any]:
    """In the process: -> the order.  From here on the process ends with its parent, others come first, and its memory
    may grow by so much."""
    die_with_parent(int(sys.argv[1]))
    order = json.load(sys.stdin)
    os.nice(nice)
    limit_memory(memory_mb)
    return order


def reasoned(
    answer: Callable[[dict[str, Any], str], dict[str, Any]], order: dict[str, Any], name: str
) -> dict[str, Any]:
    """The answer of a function of an order and a folder of that name; {"why": the reason} where the program or what
    belongs to it is refused."""
    with OwnFolder(name) as folder:
        try:
            return answer(order, folder)
        except Unreadable as error:
            return {"why": str(error)}
        except CycleError as error:
            return {"why": unnamed(error)}
