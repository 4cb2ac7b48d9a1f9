# SPDX-License-Identifier: GPL-2.0-or-later
"""Work that waits for a disk, in a thread: a disk may take seconds until something is surely on it, and the tool is
followed meanwhile.

Called by open_mark.py, spindle_load.py and stock_files.py, in the working process of chipwise-monitor.  If that process
is killed, what its thread has not written yet is lost: the one who begins the work says what that means.
"""

import threading


class Aside:
    """One work after the other."""

    def __init__(self):
        self._thread = None

    def begin(self, work):
        """Returns at once.  work: function, which reports its errors itself; one that is still at work is waited for
        before."""
        self.wait()
        self._thread = threading.Thread(target=work, daemon=True)
        self._thread.start()

    def is_begun(self):
        return self._thread is not None

    def is_busy(self):
        return self._thread is not None and self._thread.is_alive()

    def wait(self):
        """Until the work is done, if one was begun."""
        if self._thread:
            self._thread.join()
