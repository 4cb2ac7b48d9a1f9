# SPDX-License-Identifier: GPL-2.0-or-later
"""Warns of G93 in a program as soon as it is opened.  Called by worker.py.

LinuxCNC 2.9 loses a level of remapping with every F under G93 while F is remapped, and the tenth ends the program with
"maximum nesting of remapped blocks exceeded" (docs/user/codes.md).  No Python of ours runs on such a line, so the program is
looked through when it is opened.
"""

import os
import re
import stat

READ_BYTES = 4_000_000      # a program sets its feed mode near its head; the monitor must not spend time on the rest
_COMMENT = re.compile(rb"\([^)\n]*\)|;[^\n]*")
_INVERSE_TIME = re.compile(rb"g\s*0*9\s*3(?![\s]*[0-9.])", re.IGNORECASE)


def inverse_time_line(path):
    """Number of the first line with G93 in a program, 0 without one or if the file cannot be read."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with open(handle, "rb") as program:
            text = program.read(READ_BYTES) if stat.S_ISREG(os.fstat(handle).st_mode) else b""
    except (OSError, ValueError):
        return 0
    if b"93" not in text.replace(b" ", b""):
        return 0
    for number, line in enumerate(text.split(b"\n"), 1):
        if b"3" in line and _INVERSE_TIME.search(_COMMENT.sub(b"", line)):
            return number
    return 0


class LoadedProgram:
    """Looks at each program once."""

    def __init__(self, inform, feed_is_remapped):
        """inform: function of a text for the operator; feed_is_remapped: whether the INI file has REMAP = F."""
        self.inform, self.feed_is_remapped, self.seen = inform, feed_is_remapped, None

    def follow(self, path):
        """path: the program that LinuxCNC has open, "" for none."""
        try:
            found = (path, os.stat(path).st_mtime_ns) if path else None
        except (OSError, ValueError):
            found = None
        if found == self.seen:
            return
        self.seen = found
        line = inverse_time_line(path) if found and self.feed_is_remapped else 0
        if line:
            self.inform(f"{os.path.basename(path)} uses G93 (line {line}), which LinuxCNC ends at the tenth F while F is remapped; "
                        "remove REMAP = F from the INI file")
