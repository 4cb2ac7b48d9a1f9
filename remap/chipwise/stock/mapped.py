# SPDX-License-Identifier: GPL-2.0-or-later
"""The memory of the stock map under its key.  Called by shared.py."""

import ctypes as C
import os

from chipwise.host.processes import is_ours, shared_memory

SHM_RDONLY = 0o10000  # of shmat: sys/shm.h
IPC_RMID = 0  # of shmctl: sys/ipc.h


class SharedStockError(Exception):
    """The map cannot be read; the text says what, which and what to do."""


def _size_of_ours(number):
    """Bytes of a block that is ours and that nobody else may write; SharedStockError for any other."""
    try:
        rows = shared_memory()
    except OSError as error:
        raise SharedStockError(f"chipwise: stock map: /proc/sysvipc/shm: {error.strerror}; mount /proc") from error
    for row in rows:
        if row["shmid"] == number:
            if is_ours(row):
                return row["size"]
            raise SharedStockError(
                f"chipwise: stock map: the memory belongs to user {row['uid']} and was made by user "
                f"{row['cuid']} with the rights {row['perms'] & 0o777:o}; start LinuxCNC again"
            )
    raise SharedStockError("chipwise: stock map: its memory has gone; start LinuxCNC again")


class Mapped:
    """The memory under a key, mapped without hal.shm: 2.10 gives a warning at each use of it, and its getbuffer() of
    2.9 leaves the shape of the buffer unset (halmodule.cc, shm_buffer_getbuffer)."""

    def __init__(self, key, read_only, least, removes):
        """least: bytes that it has at least; removes: whether it belongs to the LinuxCNC that runs, see close()."""
        self._libc = C.CDLL(None, use_errno=True)
        self._libc.shmat.restype = C.c_void_p
        self._libc.shmdt.argtypes = [C.c_void_p]
        number = self._libc.shmget(C.c_int(key), C.c_size_t(least), 0o600)
        self._number, self._removes = number, removes
        size = _size_of_ours(number) if number >= 0 else 0
        self._address = self._libc.shmat(number, None, SHM_RDONLY if read_only else 0) if number >= 0 else None
        if self._address in (None, C.c_void_p(-1).value):
            self._address = None
            raise SharedStockError(
                f"chipwise: stock map: there is no memory under the key {key:#x} "
                f"({os.strerror(C.get_errno())}); start a LinuxCNC with chipwise.hal"
            )
        self.memory = memoryview((C.c_char * size).from_address(self._address)).cast("B")

    def close(self):
        """A process of LinuxCNC, monitor or panel, that is the last to let the memory go removes it, as
        rtapi_shmem_delete() does: rtapi_app leaves a map that is in use then, and a later LinuxCNC with another size
        could not have it.  The second close() does nothing."""
        if self._address is None:
            return
        self.memory = None
        self._libc.shmdt(self._address)
        self._address = None
        if self._removes and any(row["shmid"] == self._number and row["nattch"] == 0 for row in shared_memory()):
            self._libc.shmctl(self._number, IPC_RMID, None)
