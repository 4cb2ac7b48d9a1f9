# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether a program may have no end, from its text alone.  Called by process.py, before anything that takes time."""

import re

from chipwise.program.program_file import MAX_BYTES
from chipwise.host.files import open_regular

_PART = 1 << 20

# The beginning of a line with an O-word, and M98, M99: conservative, a program without them has an end
_LOOPS = re.compile(rb"[\r\n][ \t]*/?[ \t]*(?:n[\d. \t]*)?o|m[ \t]*0*9[ \t]*[89]", re.IGNORECASE)


def may_loop(path):
    """Whether a program has loops or calls subs; some text of comments counts as such, too, and a file that cannot be
    read."""
    tail = b"\n"
    try:
        with open_regular(path, MAX_BYTES) as file:
            while part := file.read(_PART):
                if _LOOPS.search(tail + part):
                    return True
                tail = part[-256:]
    except OSError:
        return True
    return False
