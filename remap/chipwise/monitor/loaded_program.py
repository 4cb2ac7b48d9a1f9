# SPDX-License-Identifier: GPL-2.0-or-later
"""Warns of G93 and M73 in a program as soon as it is opened, and gives limits.py its text.  Called by worker.py.

While F is remapped (read in LinuxCNC 2.9.0~pre1, docs/user/volumetric_feed.md):
 1. LinuxCNC loses a level of remapping with every F under G93, and the tenth ends the program with "maximum nesting of
    remapped blocks exceeded".  No Python of ours runs on such a line.
 2. At the return of a sub with M73 that has set another F, LinuxCNC sets F again itself, and the program ends with
    "BUG: remap_finished(): phase=0".  M70 and M72 do the same work without it.
So the program is looked through when it is opened.
"""

import os
import re
import stat

from chipwise.program.comments import REMARK
from chipwise.program.program_file import opened_name

READ_BYTES = 4_000_000  # a program sets its modes near its head; the monitor must not spend time on the rest


def _code(letter, tens, ones):
    """The pattern of a code of two digits, with blanks and zeros as LinuxCNC allows them."""
    return re.compile(rb"%s\s*0*%s\s*%s(?![\s]*[0-9.])" % (letter, tens, ones), re.IGNORECASE)


_RULES = (("G93", b"93", _code(b"g", b"9", b"3")), ("M73", b"73", _code(b"m", b"7", b"3")))


def _read(path):
    """The beginning of a program, b"" if it cannot be read."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with open(handle, "rb") as program:
            return program.read(READ_BYTES) if stat.S_ISREG(os.fstat(handle).st_mode) else b""
    except (OSError, ValueError):
        return b""


def lines_of(path):
    """{"G93": line, "M73": line}: the first line with each code in a program, without those that it has not."""
    return _lines_in(_read(path))


def _lines_in(text):
    found = {}
    dense = text.replace(b" ", b"")
    for code, digits, pattern in _RULES:
        if digits not in dense:
            continue
        for number, line in enumerate(text.split(b"\n"), 1):
            if digits[1:] in line and pattern.search(REMARK.sub(b"", line)):
                found[code] = number
                break
    return found


class LoadedProgram:
    """Looks at each program once."""

    def __init__(self, inform, feed_is_remapped, limits=None):
        """inform: function of a text for the operator; feed_is_remapped: whether the INI file has REMAP = F; limits:
        Limits, which gets the text."""
        self.inform, self.feed_is_remapped, self.limits = inform, feed_is_remapped, limits
        self.seen: object = ""  # (path, time of change) of the last look, None without a program, "" before the first

    def follow(self, path, speed=0.0):
        """path: the program that LinuxCNC has open, "" for none; speed: of the spindle, 1/min."""
        if self.limits:
            self.limits.speed(speed)
        try:
            found = (path, os.stat(path).st_mtime_ns) if path else None
        except (OSError, ValueError):
            found = None
        if found == self.seen:
            return
        self.seen = found
        text = _read(path) if found else b""
        if self.limits:
            self.limits.program(text)
        lines = _lines_in(text) if self.feed_is_remapped else {}
        name = opened_name(path)
        if "G93" in lines:
            self.inform(
                f"{name} uses G93 (line {lines['G93']}), which LinuxCNC ends at the tenth F while F is remapped; "
                "remove REMAP = F from the INI file"
            )
        if "M73" in lines:
            self.inform(
                f"{name} uses M73 (line {lines['M73']}), which LinuxCNC ends when it restores F while F is remapped; "
                "use M70 and M72, or remove REMAP = F from the INI file"
            )
