# SPDX-License-Identifier: GPL-2.0-or-later
"""What LinuxCNC's task knows and the interpreter does not: MDI or a program, another run of it, the line it starts
from.

Called by glue/program_run.py, in milltask only, but for is_here(), which glue/session.py asks when it is imported.

1. milltask's variable `taskplanopen` is 1 from the opening of a program to its end, abort or error, and 0 otherwise.
   LinuxCNC asks only whether it is 0, so is_new_run() turns the 1 it finds into a 2: a 1 that is found later is another
   run.
2. The Python module emctask of milltask shows the mode. 2.10 does not have it.
3. Run from line: the lines before the start line are executed and what they have queued is thrown away, but not while a
   remapped code waits for the machine.  The start line is in no status.  The task's command buffer holds the last
   command, at the first line of a run as a rule the one that has started it; on a busy computer another one may have
   come since.  Then a run has begun at its first line if a move of it has been carried out.
If one of these cannot be had the answer is that of an ordinary run of a program, as each function says.
Read in LinuxCNC 2.9.0~pre1, 2.9.4 and 2.10 (2026-08): emctaskmain.cc, emctask.cc, taskmodule.cc, emc_nml.hh, nmlmsg.hh.
"""

from __future__ import annotations

import ctypes
import math
import struct
from functools import lru_cache
from typing import Optional

from chipwise.host.processes import mappings

# line of the last move that was carried out, place of the machine or None while it moves
Seen = tuple[int, Optional[tuple[float, float, float]]]
_SEEN = 2
STILL = 1e-6  # machine units

_COMMAND_BUFFER = "/SYSV000003e9"  # linuxcnc.nml: emcCommand is shared memory with the key 1001
_MESSAGE = struct.Struct("<i4xqii")  # NMLmsg type, size; RCS_CMD_MSG serial_number; EMC_TASK_PLAN_RUN line
_PLAN_RUN, _PLAN_STEP = 507, 511  # emc.hh: EMC_TASK_PLAN_RUN_TYPE, EMC_TASK_PLAN_STEP_TYPE
_HEAD_BYTES = 512  # the message begins within


@lru_cache(maxsize=None)
def _open_flag() -> ctypes.c_int | None:
    """taskplanopen, None where this task has none."""
    try:
        return ctypes.c_int.in_dll(ctypes.CDLL(None), "taskplanopen")
    except (ValueError, OSError):
        return None


def is_here() -> bool:
    """Whether this interpreter is the task's, not that of a preview."""
    return _open_flag() is not None or _mode() != ""


def _mode() -> str:
    """Name of the task's mode, "" where it is not known."""
    try:
        import emctask

        return str(emctask.emcstat.task.mode)
    except (ImportError, AttributeError):
        return ""


def is_program() -> bool:
    """Whether a program runs, not MDI; without a flag: True where a mode says so or nothing does."""
    flag = _open_flag()
    return (flag is None or flag.value != 0) and not _mode().endswith("MDI")


def is_restoring() -> bool:
    """Whether neither a program nor MDI may be under way: LinuxCNC 2.9.4 has an abort followed by a line of its own
    that gives the interpreter back what was in force, F included, and what that line queues may be lost with the rest
    of the queue.  False where the flag is not known.  2.10 does not say the mode: there MDI counts as such a line, too,
    and what it has queued is queued once more."""
    flag = _open_flag()
    return flag is not None and flag.value == 0 and not _mode().endswith("MDI")


def is_new_run() -> bool:
    """Whether this is the first question since a run has begun; without a flag never."""
    flag = _open_flag()
    if flag is None or flag.value in (0, _SEEN):
        return False
    flag.value = _SEEN
    return True


def start_line() -> int | None:
    """The line that the run of a program was started from, 0 for the whole; None where another command has come since.

    To be asked once, as early in a run as possible.
    """
    block = _command_buffer()
    if not block:
        return 0
    for at in range(0, _HEAD_BYTES, 8):
        kind, size, serial, line = _MESSAGE.unpack_from(block, at)
        if size == _MESSAGE.size and serial > 0 and kind in (_PLAN_RUN, _PLAN_STEP):
            return line if kind == _PLAN_RUN else 0
    return None


def seen() -> Seen | None:
    """(line of the last move that was carried out, place of the machine or None while it moves), as the task has seen
    it last; None where this is not known."""
    try:
        import emctask

        traj, line = emctask.emcstat.motion.traj, int(emctask.emcstat.task.motionLine)
        place = traj.position
        return line, (place.tran.x, place.tran.y, place.tran.z) if traj.inpos and not traj.queue else None
    except (ImportError, AttributeError):
        return None


def has_moved(before: Seen | None) -> bool:
    """Whether a move has been carried out since seen() was `before`: what is read over by run from line carries out
    none."""
    now = seen()
    if before is None or now is None:
        return False
    (line, place), (line_before, place_before) = now, before
    if line > 0 and line != line_before:
        return True
    return place is not None and place_before is not None and math.dist(place, place_before) > STILL


def _command_buffer() -> bytes:
    """A copy of the head of the task's command buffer, b"" where it is not there."""
    for first, last, line in mappings():
        if _COMMAND_BUFFER in line:
            return ctypes.string_at(first, min(last - first, _HEAD_BYTES + _MESSAGE.size))
    return b""
