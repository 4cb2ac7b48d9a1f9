# SPDX-License-Identifier: GPL-2.0-or-later
"""Output files of a command: checked before any work, written completely or not at all.

Called by the commands that write files.
"""

import os
import tempfile

from chipwise.options.machine import UsageError
from chipwise.errors import printable
from chipwise.host.files import read_only

PREFIX = ".chipwise-"  # of files that are not complete yet


def unwritable(path):
    """Why a file cannot be written, as (what, remedy); None if it can."""
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        return f"{path}: there is no folder {folder}", "make it, or use another one"
    if os.path.exists(path) and not os.path.isfile(path):
        return f"{path} cannot be written: it is not a file", "name a file in a folder of yours"
    if read_only(folder):
        return f"{path} cannot be written: {folder} {read_only(folder)}", "name a file in a folder of yours"
    if os.path.exists(path) and not os.access(path, os.W_OK):
        return f"{path} cannot be written: it is read-only for this user", "name a file in a folder of yours"
    return None


def write_output(name, path, content):
    """Write a file of the subcommand `name`, text or bytes, whole or not at all.  Raises UsageError."""
    try:
        write_whole(path, content)
    except OSError as error:
        raise UsageError(
            printable(f"{name}: {path}: {error.strerror}; name a file in a folder of yours that has room")
        ) from error


def check_outputs(refuse, outputs, inputs):
    """Refuse, before any work, an output that cannot be written, that is another one too, or that would replace what
    the command reads.

    refuse   function of a text, which raises
    outputs  {option: path}; None and - (standard output) are left out
    inputs   pairs (what it is, path or None)
    """
    seen = []
    for option, path in outputs.items():
        if not path or path == "-":
            continue
        trouble = unwritable(path)
        if trouble:
            refuse(f"{option} " + "; ".join(trouble))
        for other, taken in seen:
            if os.path.realpath(path) == os.path.realpath(taken):
                refuse(f"{other} and {option} are the same file, {path}; name another one")
        for what, source in inputs:
            if source and is_same_file(path, source):
                refuse(f"{option} {path} is {what} itself; name another file")
        seen.append((option, path))


def is_same_file(path, other):
    """Whether two paths name one file that exists."""
    return os.path.exists(path) and os.path.exists(other) and os.path.samefile(path, other)


def write_whole(path, content):
    """Write a file, text or bytes, with the rights of an ordinary one.  Raises OSError."""
    handle, scratch = tempfile.mkstemp(dir=os.path.dirname(path) or ".", prefix=PREFIX)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode("utf-8", "replace"))
        mask = os.umask(0o022)
        os.umask(mask)
        os.chmod(scratch, 0o666 & ~mask)
        os.replace(scratch, path)
    except BaseException:
        os.unlink(scratch)
        raise
