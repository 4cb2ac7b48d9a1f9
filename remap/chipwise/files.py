"""Read a file that somebody else has put there: regular, of a bounded size, without waiting.

Called by whatever runs beside the machine (settings, tool geometry, stock files).  Opening a FIFO or a device may wait for
ever or do something; /dev/zero has no end.
"""

import errno
import os
import stat


class NoRegularFile(OSError):
    """A folder, FIFO, socket or device where a file should be."""

    def __init__(self, path):
        super().__init__(errno.EINVAL, "it is not a regular file", path)


class TooLong(OSError):
    """More bytes than such a file can have."""

    def __init__(self, path, found, most):
        super().__init__(errno.EFBIG, f"it has {found} bytes, more than {most}", path)


def read_bytes(path, most):
    """The content of a regular file of at most `most` bytes.  Raises OSError, whose strerror says what is wrong."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):     # before it is opened: a device may do something then
            raise NoRegularFile(path)
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    except ValueError as error:                         # a NUL in the path
        raise OSError(errno.EINVAL, str(error), repr(path)) from error
    with open(handle, "rb") as file:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode):
            raise NoRegularFile(path)
        if found.st_size > most:
            raise TooLong(path, found.st_size, most)
        data = file.read(most + 1)                      # it may grow
    if len(data) > most:
        raise TooLong(path, len(data), most)
    return data


def printable(text):
    """The text without what no screen and no log can show: bytes of a path that are not UTF-8."""
    return text.encode("utf-8", "backslashreplace").decode()
