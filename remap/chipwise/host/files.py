# SPDX-License-Identifier: GPL-2.0-or-later
"""Read a file of unknown origin: regular, of a bounded size, without waiting.  Write one so that it is never half
there.

Called by whatever runs beside the machine (settings, tool geometry, stock files, stations).  Opening a FIFO or a device
may block or have an effect; /dev/zero has no end.
"""

import contextlib
import errno
import fcntl
import os
import stat
import tempfile
from typing import BinaryIO, Iterator

JOURNAL = "kept.journal"  # in STOCK_DIR: the stock while the machine works (stock/journal.py)


class NoRegularFile(OSError):
    """A folder, FIFO, socket or device where a file should be."""

    def __init__(self, path: str):
        super().__init__(errno.EINVAL, "it is not a regular file", path)


class TooLong(OSError):
    """More bytes than such a file can have."""

    def __init__(self, path: str, found: int, most: int):
        super().__init__(errno.EFBIG, f"it has {found} bytes, more than {most}", path)
        self.found, self.most = found, most


def open_regular(path: str, most: int) -> BinaryIO:
    """A regular file of at most `most` bytes, open for reading bytes.  Raises OSError, whose strerror has the
    reason."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):  # before it is opened: opening a device may have an effect
            raise NoRegularFile(path)
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    except ValueError as error:  # a NUL in the path
        raise OSError(errno.EINVAL, str(error), repr(path)) from error
    file = open(handle, "rb")
    try:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode):
            raise NoRegularFile(path)
        if found.st_size > most:
            raise TooLong(path, found.st_size, most)
    except OSError:
        file.close()
        raise
    return file


def read_bytes(path: str, most: int) -> bytes:
    """The content of a regular file of at most `most` bytes.  Raises as open_regular()."""
    with open_regular(path, most) as file:
        data = file.read(most + 1)  # it may grow
    if len(data) > most:
        raise TooLong(path, len(data), most)
    return data


def has_cr_alone(data: bytes) -> bool:
    """Whether the lines of a text end with CR alone: LinuxCNC reads them as one line."""
    return b"\r" in data.strip() and b"\n" not in data


@contextlib.contextmanager
def locked(folder: str, waits: bool = True) -> Iterator[None]:
    """One writer in a folder at a time.  Raises OSError; BlockingIOError where another one is at it and it does not
    wait."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        yield
    finally:
        os.close(handle)


def write_durable(path: str, content: bytes, unfinished: str, mode: int = 0o644) -> None:
    """Write a file: the one at `path` is the old one or the new one at any moment, also after a power cut.

    unfinished: how names of files end that are not complete; their beginning is the file's name.  mode: its rights.
    Raises OSError."""
    folder, fresh = os.path.dirname(os.path.abspath(path)), ""
    try:
        handle, fresh = tempfile.mkstemp(prefix=os.path.basename(path) + ".", suffix=unfinished, dir=folder)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(fresh, mode)
        os.replace(fresh, path)
        fresh = ""
        sync_folder(path)
    finally:
        if fresh and os.path.exists(fresh):
            os.unlink(fresh)


def sync_folder(path: str) -> None:
    """The names in the folder of a file are on the disk.  Raises OSError."""
    handle = os.open(os.path.dirname(os.path.abspath(path)), os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove_durable(path: str) -> None:
    """Make sure that a file is gone, also after a power loss.  Raises OSError."""
    try:
        os.unlink(path)
    except FileNotFoundError:
        return
    sync_folder(path)


def read_only(folder: str) -> str:
    """Why this user cannot write in a folder that is there, as words behind its name; "" if that is possible, or if it
    is not there."""
    if not os.path.isdir(folder) or os.access(folder, os.W_OK | os.X_OK):
        return ""
    return (
        "is on a disk that is read-only" if os.statvfs(folder).f_flag & os.ST_RDONLY else "is read-only for this user"
    )


def is_full(folder: str) -> bool:
    """Whether the disk of a folder that is there has no room left for this user."""
    return os.path.isdir(folder) and os.statvfs(folder).f_bavail == 0


def printable(text: str) -> str:
    """The text with bytes that are not UTF-8 (of a path) written as escapes, for screens and logs."""
    return text.encode("utf-8", "backslashreplace").decode()
