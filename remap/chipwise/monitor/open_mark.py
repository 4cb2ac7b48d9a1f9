# SPDX-License-Identifier: GPL-2.0-or-later
"""The note that this run of LinuxCNC has a stock, or may have cut the one that was kept: if it is there at the next
start, that run did not end in order.

Called by stock_files.py.  A thread writes it (aside.py).  If the monitor is killed before it is on the disk, a power
loss is not seen at the next start.
"""

import os

from chipwise.host.files import printable, write_durable
from chipwise.monitor.aside import Aside
from chipwise.stock import store

TEXT = (
    b"A run of LinuxCNC with [CHIPWISE]KEEP_STOCK has a stock. If none runs, it did not end in order, and the "
    b"stock as saved last is in kept.journal.\n"
)


class OpenMark:
    """The file store.OPEN of one run."""

    def __init__(self, path):
        """path: function of the name of a file -> its path in STOCK_DIR."""
        self.path, self._aside = path, Aside()

    def write(self):
        """Once; returns at once."""
        if not self._aside.is_begun():
            self._aside.begin(self._write)

    def wait(self):
        """Until it is on the disk, if it was to be written."""
        self._aside.wait()

    def _write(self):
        path = self.path(store.OPEN)
        try:
            os.makedirs(os.path.dirname(path), exist_ok=True)
            write_durable(path, TEXT, store.UNFINISHED)
        except OSError as error:
            print(
                printable(
                    f"chipwise: {path} was not written: {error.strerror}; without it a power loss is not seen at the "
                    f"next start"
                ),
                flush=True,
            )
