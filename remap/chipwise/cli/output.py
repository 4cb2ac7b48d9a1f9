# SPDX-License-Identifier: GPL-2.0-or-later
"""Output files of a command: checked before any work, written completely or not at all.

Called by the commands that write files.
"""

import os
import tempfile

from chipwise.cli import UsageError
from chipwise.errors import printable

PREFIX = '.chipwise-'       # of files that are not complete yet


def unwritable(path):
    """Why a file cannot be written, as (what, remedy); None if it can."""
    folder = os.path.dirname(path) or '.'
    if not os.path.isdir(folder):
        return f'{path}: there is no folder {folder}', 'make it, or use another one'
    if (os.path.exists(path) and not os.path.isfile(path)) or not os.access(path if os.path.exists(path) else folder, os.W_OK):
        return f'{path} cannot be written', 'name a file in a folder of yours'
    return None


def write_output(name, path, content):
    """Write a file of the subcommand `name`, text or bytes, whole or not at all.  Raises UsageError."""
    try:
        write_whole(path, content)
    except OSError as error:
        raise UsageError(printable(f'{name}: {path}: {error.strerror}; name a file in a folder of yours that has room')) from error


def is_same_file(path, other):
    """Whether two paths name one file that exists."""
    return os.path.exists(path) and os.path.exists(other) and os.path.samefile(path, other)


def is_same_output(path, other):
    """Whether two outputs, which need not exist yet, are one file; False for None and -."""
    return bool(path and other and path != '-') and os.path.realpath(path) == os.path.realpath(other)


def write_whole(path, content):
    """Write a file, text or bytes, with the rights of an ordinary one.  Raises OSError."""
    handle, scratch = tempfile.mkstemp(dir=os.path.dirname(path) or '.', prefix=PREFIX)
    try:
        with os.fdopen(handle, 'wb') as file:
            file.write(content if isinstance(content, bytes) else content.encode('utf-8', 'replace'))
        mask = os.umask(0o022)
        os.umask(mask)
        os.chmod(scratch, 0o666 & ~mask)
        os.replace(scratch, path)
    except BaseException:
        os.unlink(scratch)
        raise
