# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's buffers after a process that was ended while it read or wrote one.

Called by monitor/supervisor.py.  A semaphore guards each buffer, and LinuxCNC takes it without SEM_UNDO
(libnml/os_intf/_sem.c): a process that is killed at such a moment keeps it for ever, and nobody reads the status or
gives a command any more, LinuxCNC's own task included.
"""

import ctypes

STATUS = 1002
KEYS = 1001, STATUS, 1003  # linuxcnc.nml: emcCommand, emcStatus, emcError
_LAST_USER, _VALUE = 11, 12  # GETPID, GETVAL of <sys/sem.h>


class Step(ctypes.Structure):
    """struct sembuf of <sys/sem.h>."""

    _fields_ = [(name, ctypes.c_short) for name in ("number", "change", "flags")]


def held_by(pid):
    """Numbers of the semaphores that a process which does not run has taken and not given back."""
    libc = ctypes.CDLL(None)
    there = [number for number in (libc.semget(key, 1, 0) for key in KEYS) if number >= 0]
    return [
        number for number in there if libc.semctl(number, 0, _VALUE) == 0 and libc.semctl(number, 0, _LAST_USER) == pid
    ]


def give_back(pid):
    """Give back what a process that has ended still holds; -> how many it were."""
    held = held_by(pid)
    for number in held:
        ctypes.CDLL(None).semop(number, ctypes.byref(Step(0, 1, 0)), 1)
    return len(held)
