# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of the load log: CSV that any spreadsheet opens, appended to while somebody reads it.  Called by load_log.py.

1. Rows are added by one write at the end of the file.  What cannot be written whole is taken back; a line that a power
   cut has left without its end gets one.
2. A file whose first line is not that of the log is somebody else's, and stays as it is.
3. Above MOST_BYTES the file is renamed to NAME.old and a new one begins; one of an older chipwise, with fewer columns,
   to NAME.before.
4. NAME.running holds what is not in the files yet, renewed while a program runs.  After a kill or a power cut the next
   server adds it to them.
"""

import csv
import errno
import io
import json
import os
import re
import stat
from collections.abc import Mapping, Sequence

from chipwise.host.files import NoRegularFile, read_bytes, write_durable

Row = Mapping[str, object]  # by column
MOST_BYTES = 5_000_000
MOST_RUNNING = 1 << 20  # bytes of NAME.running
LEAST_COLUMNS = 10  # of a log: a file with fewer is somebody else's
_FORMULA = re.compile(r"(^|[;\t]\s*)(?=[=+\-@\t\r])")


class OtherColumns(OSError):
    """A file that is not a log."""

    def __init__(self, path: str) -> None:
        super().__init__(errno.EINVAL, "its first line is not that of this log", path)


class Damaged(OSError):
    """A NAME.running that cannot be used."""

    def __init__(self, path: str) -> None:
        super().__init__(errno.EINVAL, "it is not what the panel has kept, and is left out", path)


def operations_path(path: str) -> str:
    """load.csv -> load_operations.csv, "" -> ""."""
    name, ending = os.path.splitext(path)
    return f"{name}_operations{ending}" if path else ""


def safe(value: object) -> object:
    """A value for a spreadsheet: a text that begins like a formula is shown, not computed, also behind a semicolon or a
    tab, which may divide cells."""
    return _FORMULA.sub(r"\1'", value) if isinstance(value, str) else value


def _text(columns: Sequence[str], rows: Sequence[Row], head: bool = False) -> bytes:
    """CSV of dicts, as bytes."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns)
    if head:
        writer.writeheader()
    writer.writerows({name: safe(value) for name, value in row.items()} for row in rows)
    return text.getvalue().encode("utf-8", "replace")


def append(path: str, columns: Sequence[str], rows: Sequence[Row]) -> None:
    """Add rows, dicts by column, to a file.  Raises OSError."""
    if not rows:
        return
    if os.path.exists(path):
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            raise NoRegularFile(path)
        if _is_older(path, columns):
            os.replace(path, path + ".before")
        elif found.st_size > MOST_BYTES:
            _check_head(path, columns)
            os.replace(path, path + ".old")
    handle = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    try:
        before = os.fstat(handle).st_size
        if before:
            _check_head(path, columns)
        end = b"\r\n" if before and os.pread(handle, 1, before - 1) != b"\n" else b""
        content = end + _text(columns, rows, head=not before)
        if os.write(handle, content) != len(content):
            os.ftruncate(handle, before)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)
    finally:
        os.close(handle)


def _check_head(path: str, columns: Sequence[str]) -> None:
    """Raise OtherColumns unless the file begins with the names of the columns."""
    head = _text(columns, [], head=True)
    with open(path, "rb") as file:
        if file.read(len(head)).split(b"\n")[0].rstrip(b"\r") != head.rstrip():
            raise OtherColumns(path)


def _is_older(path: str, columns: Sequence[str]) -> bool:
    """Whether a file is a log with the columns of an older chipwise: some of ours are missing, the first and the last
    are there."""
    with open(path, "rb") as file:
        names = file.readline(len(_text(columns, [], head=True))).decode("utf-8", "replace").rstrip().split(",")
    return (
        len(names) > LEAST_COLUMNS
        and names != list(columns)
        and names == [name for name in columns if name in names]
        and names[-1] == columns[-1]
    )


def running_path(path: str) -> str:
    return path + ".running"


def keep_running(path: str, parts: Sequence[Sequence[Row]]) -> None:
    """Write what is not in the files yet; parts: [[columns, rows], ..].  Raises OSError."""
    write_durable(running_path(path), json.dumps(parts).encode(), ".unfinished")


def forget_running(path: str) -> None:
    """All of it is in the files.  Raises OSError."""
    try:
        os.unlink(running_path(path))
    except FileNotFoundError:
        pass


def left_running(path: str, *columns: Sequence[str]) -> list[list[Row]]:
    """The rows that a server has left which was killed: a list for each of the columns.  Raises OSError."""
    if not os.path.exists(running_path(path)):
        return [[] for _ in columns]
    try:
        found = json.loads(read_bytes(running_path(path), MOST_RUNNING))
    except (ValueError, RecursionError):
        found = None
    if not (isinstance(found, list) and len(found) == len(columns) and all(map(_are_rows, found, columns))):
        raise Damaged(running_path(path))
    return found


def _are_rows(rows: object, columns: Sequence[str]) -> bool:
    """Whether something read from a file is a list of rows."""
    return isinstance(rows, list) and all(isinstance(row, dict) and set(row) <= set(columns) for row in rows)
