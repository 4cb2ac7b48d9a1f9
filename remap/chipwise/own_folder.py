# SPDX-License-Identifier: GPL-2.0-or-later
"""A folder for temporary files that does not outlive its process for long: what a killed one has left is removed by the next.

Called by whatever reads a program in a process of its own.  A folder belongs to the process that holds the lock of a file in it; the kernel
releases the lock however the process ends.
"""

import contextlib
import fcntl
import glob
import os
import shutil
import stat
import tempfile

NAME = "chipwise-"
LOCK = ".in-use"


class OwnFolder(tempfile.TemporaryDirectory):
    """A folder in $TMPDIR, with `kind` in its name; a context manager that gives its path.  Raises OSError."""

    def __init__(self, kind: str):
        remove_left_behind()
        super().__init__(prefix=f"{NAME}{kind}-", ignore_cleanup_errors=True)
        self._lock = _locked(self.name)

    def __enter__(self) -> str:
        return self.name

    def cleanup(self) -> None:
        """Remove it."""
        super().cleanup()
        self._lock.close()


def remove_left_behind() -> None:
    """Remove those folders of this user in $TMPDIR that no process holds any more."""
    for path in glob.glob(os.path.join(glob.escape(tempfile.gettempdir()), NAME + "*", LOCK)):
        folder = os.path.dirname(path)
        with contextlib.suppress(OSError):              # in use, or gone meanwhile
            with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
                if os.lstat(folder).st_uid == os.geteuid() and stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(folder, ignore_errors=True)           # not through a link


def _locked(folder):
    """The open file whose lock is held.  It gets its name when it is locked: no other process can find it without."""
    fresh = os.path.join(folder, LOCK + ".new")
    file = open(fresh, "wb")
    fcntl.flock(file, fcntl.LOCK_EX)
    os.rename(fresh, os.path.join(folder, LOCK))
    return file
