# SPDX-License-Identifier: GPL-2.0-or-later
"""The program to standard output, byte for byte: all of it, or nothing.  Called by cli/filter.py.

AXIS opens the file behind a filter's standard output again at a touch-off, also if the filter has failed.  So a program
that is not complete must not run, whatever ended the filter:

 1. The file begins with a line M2 while the rest is written; the program's own beginning takes its place last.
 2. If anything fails (no room on the disk), the file is made empty.

Into a pipe or a terminal the program goes from its first byte to its last; there a reader sees the exit status.
"""

import fcntl
import os
import stat

BARRIER = b"M2 (chipwise: this program is not complete)\n"
BEGINNING = 4096  # within one page: written at once
PART = 1 << 20


class Changed(Exception):
    """The user's file is not the one that was judged."""


def put_program(handle, path, expected=None):
    """Write a file to a handle.  expected: os.stat_result of the file that was judged.  Raises OSError, Changed."""
    with open(path, "rb") as source:
        found = os.fstat(source.fileno())
        if expected is not None and _identity(found) != _identity(expected):
            raise Changed
        size = found.st_size
        if not stat.S_ISREG(os.fstat(handle).st_mode) or fcntl.fcntl(handle, fcntl.F_GETFL) & os.O_APPEND:
            _in_order(handle, source, size)
            return
        start = os.lseek(handle, 0, os.SEEK_CUR)
        try:
            _beginning_last(handle, start, source, size)
        except BaseException:
            os.ftruncate(handle, start)
            raise
        os.lseek(handle, start + size, os.SEEK_SET)


def _identity(found):
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _read(source, count):
    """So many bytes."""
    data = source.read(count)
    if len(data) < count:
        raise Changed
    return data


def _in_order(handle, source, size):
    while size:
        data = _read(source, min(PART, size))
        size -= len(data)
        view = memoryview(data)
        while view:
            view = view[os.write(handle, view) :]


def _beginning_last(handle, start, source, size):
    beginning = _read(source, min(BEGINNING, size))
    place = len(beginning)
    if size > place:
        _write_at(handle, BARRIER, start)
    while place < size:
        data = _read(source, min(PART, size - place))
        _write_at(handle, data, start + place)
        place += len(data)
    _write_at(handle, beginning, start)
    os.close(os.dup(handle))  # a network folder's errors come when a file is closed


def _write_at(handle, data, place):
    view = memoryview(data)
    while view:
        count = os.pwrite(handle, view, place)
        view, place = view[count:], place + count
