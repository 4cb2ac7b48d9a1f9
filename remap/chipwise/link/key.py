# SPDX-License-Identifier: GPL-2.0-or-later
"""The key that master and slave share: [TRACER_LINK]KEY_FILE, a file that only its owner can read, or KEY in the INI
file itself.

Called by cli/link.py.
"""

import os
import stat

from chipwise.errors import CycleError
from chipwise.ini import Ini, file_name

LEAST, MOST = 16, 4096  # bytes of a key


def _of_file(path):
    """The key in a file, without blanks and line ends around it.  Raises CycleError."""
    try:
        with open(path, "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(MOST + 1)
    except OSError as error:
        raise CycleError(
            f"key file {path}: {error.strerror}", "make it with: openssl rand -hex 32 > FILE; chmod 600 FILE"
        ) from error
    if not stat.S_ISREG(mode) or stat.S_IMODE(mode) & 0o077:
        raise CycleError(f"key file {path} can be read by others, mode {stat.S_IMODE(mode):o}", f"use chmod 600 {path}")
    return text.strip()


def key_of(path=None):
    """The key, from an INI file (default: INI_FILE_NAME) or, if there is none, b''.  Raises CycleError."""
    if not (path or file_name()):
        return b""
    ini = Ini(path)
    name, text = ini.text("TRACER_LINK", "KEY_FILE"), ini.text("TRACER_LINK", "KEY")
    if name:
        key = _of_file(os.path.join(os.path.dirname(os.path.abspath(ini.path)), os.path.expanduser(name)))
    elif text:
        key = text.encode()
    else:
        return b""
    if not LEAST <= len(key) <= MOST:
        raise CycleError(f"the key of the link has {len(key)} bytes", f"use {LEAST} to {MOST}")
    return key


def master_of(path=None):
    """[TRACER_LINK]MASTER: the only host that is listened to; '' without one.  Raises CycleError."""
    return Ini(path).text("TRACER_LINK", "MASTER") if path or file_name() else ""
