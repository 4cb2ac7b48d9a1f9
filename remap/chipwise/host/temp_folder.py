# SPDX-License-Identifier: GPL-2.0-or-later
"""A folder for temporary files that does not outlive its process for long: what a killed one has left is removed by the
next.

Called by whatever reads a program in a process of its own.  A folder belongs to the process that holds the lock of a
file in it; the kernel releases the lock however the process ends.
"""

import contextlib
import errno
import fcntl
import glob
import os
import shutil
import signal
import stat
import tempfile
from typing import Iterator, Union

from chipwise.errors import CycleError

NAME = "chipwise-"
LOCK = ".in-use"


class FolderError(CycleError):
    """The folder for temporary files cannot be used."""


def folder_error(reason: str) -> FolderError:
    """The FolderError for what the system says."""
    return FolderError(
        "{reason} in the folder for temporary files",
        "make room there, or name another folder with TMPDIR",
        reason=reason,
    )


class OwnFolder(tempfile.TemporaryDirectory):
    """A folder in $TMPDIR, with `kind` in its name; a context manager that gives its path.  Raises FolderError."""

    def __init__(self, kind: str):
        with writing():
            remove_left_behind()
            super().__init__(prefix=f"{NAME}{kind}-", ignore_cleanup_errors=True)
            try:
                self._lock = _locked(self.name)
            except OSError:
                super().cleanup()
                raise

    def __enter__(self) -> str:
        return self.name

    def cleanup(self) -> None:
        """Remove it."""
        super().cleanup()
        self._lock.close()


def put(folder: str, name: str, content: Union[str, bytes]) -> str:
    """Write a file of an OwnFolder; -> its path.  Raises FolderError."""
    path = os.path.join(folder, name)
    with writing(), open(path, "wb") as file:
        file.write(content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content)
    return path


def check_room(folder: str, status: int) -> None:
    """Raise FolderError where a process that has ended by itself, with a status like that of Popen, found no room in
    its folder."""
    room = os.statvfs(folder)
    if status == -signal.SIGBUS or (status and not room.f_bavail):  # SIGBUS: of the tool table's file, which is mapped
        raise folder_error(os.strerror(errno.ENOSPC))


@contextlib.contextmanager
def writing() -> Iterator[None]:
    """Around what only writes to such a folder: its OSError becomes a FolderError."""
    try:
        yield
    except OSError as error:
        found_none = (
            error.errno == errno.ENOENT and error.filename is None
        )  # of module tempfile, which has tried several
        raise folder_error("nothing can be written" if found_none else error.strerror) from error


def remove_left_behind() -> None:
    """Remove those folders of this user in $TMPDIR that no process holds any more."""
    for path in glob.glob(os.path.join(glob.escape(tempfile.gettempdir()), NAME + "*", LOCK)):
        folder = os.path.dirname(path)
        with contextlib.suppress(OSError):  # in use, or gone meanwhile
            with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
                if os.lstat(folder).st_uid == os.geteuid() and stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(folder, ignore_errors=True)  # not through a link


def _locked(folder):
    """The open file whose lock is held.  It gets its name when it is locked: no other process can find it without."""
    fresh = os.path.join(folder, LOCK + ".new")
    file = open(fresh, "wb")
    fcntl.flock(file, fcntl.LOCK_EX)
    os.rename(fresh, os.path.join(folder, LOCK))
    return file
