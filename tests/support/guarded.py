# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays that end where memory ends: whoever reads or writes behind them gets SIGSEGV.

Called by tests of the shared library, in a process of their own.
"""

import ctypes
import mmap

import numpy as np

libc = ctypes.CDLL(None, use_errno=True)
PROT_NONE = 0
kept: list[mmap.mmap] = []  # a mapping that is closed would take its array with it


def guarded(values):
    """A copy of `values` (n,) float64 whose end is that of a page; nothing may touch the next one."""
    values = np.ascontiguousarray(values, dtype=np.float64)
    pages = -(-values.nbytes // mmap.PAGESIZE)
    block = mmap.mmap(-1, (pages + 1) * mmap.PAGESIZE)
    kept.append(block)
    start = ctypes.addressof(ctypes.c_char.from_buffer(block))
    if libc.mprotect(ctypes.c_void_p(start + pages * mmap.PAGESIZE), ctypes.c_size_t(mmap.PAGESIZE), PROT_NONE):
        raise OSError(ctypes.get_errno(), "mprotect")
    array = np.frombuffer(block, np.float64, len(values), pages * mmap.PAGESIZE - values.nbytes)
    array[:] = values
    return array
