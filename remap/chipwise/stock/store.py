# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock in a file: what M253 saves and M254 restores.

Who calls it: cli/monitor.py (the files and the map), glue/stock_codes.py (names and reasons only).  Pure: no HAL, no
LinuxCNC; the map is any buffer that starts with struct chip_stock (components/core/stock.h).

A file holds, in this order
    16 bytes    "chipwise stock\\r\\n" (a transfer as text breaks it)
    4 bytes     length of the head, little endian
    head        JSON: version of the format, chipwise that wrote it (not in older files), cell and box (mm, machine
                coordinates), shape, rows and columns, mm3 removed
    cells       as in the map, ring included, zlib
    32 bytes    SHA-256 of everything before
write() makes a new file beside the old one and then takes its place: a write that is cut off leaves the old one.
read() trusts nothing: length, checksum, version, numbers and every cell are looked at before anything is given back.
"""

from __future__ import annotations

import glob
import hashlib
import json
import math
import os
import stat
import struct
import time
import zlib
from dataclasses import asdict, dataclass, replace
from dataclasses import fields as dataclass_fields
from typing import Any, NoReturn

import numpy as np

import chipwise
from chipwise.host.files import TooLong, open_regular, read_bytes, write_durable
from chipwise.clib import layout
from chipwise.clib.core import CELL_DTYPE
from chipwise.stock.reasons import BROKEN, DISK, NO_FILE, OTHER_VERSION, TOO_LARGE

MARK, VERSION = b"chipwise stock\r\n", 2
DIGEST = 32
MOST_HEAD = 4096  # bytes
MOST_WRITER = 32  # characters of the version of chipwise that wrote a file
MOST_NUMBER = 1 << 53  # of any whole number in a head
ENDING = ".stock"
UNFINISHED = ".new"
REMAINS_S = 300.0  # an unfinished file this old has no writer any more
KEPT = "kept" + ENDING  # [CHIPWISE]KEEP_STOCK
OPEN = "kept.open"  # beside it while a run with a stock has not ended in order


class StoreError(Exception):
    """A file that cannot be used; `reply` is the number of the reason, the text has the details."""

    def __init__(self, reply: int, detail: str):
        super().__init__(detail)
        self.reply = reply


def head_of(head: layout.Stock, removed: float) -> Head:
    """The Head of struct chip_stock; removed: mm3 that are cut of it."""
    return Head(
        head.cell,
        (head.x0, head.y0, head.z_min),
        (head.x_max, head.y_max, head.z_max),
        head.shape,
        head.nx,
        head.ny,
        removed,
        (head.half_x, head.half_y),
        head.turn,
    )


def slot_name(slot: int) -> str:
    """File of a slot, within STOCK_DIR."""
    return f"slot{slot}{ENDING}"


@dataclass(frozen=True)
class Head:
    """What describes the cells; mm, machine coordinates, mm3."""

    cell: float
    low: tuple
    high: tuple
    shape: int
    nx: int
    ny: int
    removed: float
    half: tuple = (0.0, 0.0)  # half the sides of the stock box
    turn: float = 0.0  # rad it is turned by; low..high is the upright box around it

    @property
    def count(self) -> int:
        """Cells, ring included."""
        return (self.nx + 2) * (self.ny + 2)


def check_head(head: Head) -> None:
    """Raise StoreError where the numbers cannot be those of a map."""
    numbers = [head.cell, head.removed, *head.low, *head.high, *head.half, head.turn]
    try:
        good = (
            len(head.low) == len(head.high) == 3
            and all(math.isfinite(v) and abs(v) <= layout.MAX_COORDINATE for v in numbers[2:])
            and math.isfinite(head.removed)
            and head.removed >= 0
            and layout.MIN_CELL <= head.cell <= layout.MAX_CELL
            and head.shape in list(layout.StockShape)
            and all(b - a >= layout.MIN_SIZE for a, b in zip(head.low, head.high))
            and len(head.half) == 2
            and _box_fits(head)
            and type(head.nx) is int
            and type(head.ny) is int
            and (head.nx, head.ny)
            == tuple(math.ceil((b - a) / head.cell - 1e-9) for a, b in zip(head.low[:2], head.high[:2]))
            and 0 < head.count <= layout.MAX_CELLS
        )
    except (TypeError, ValueError, OverflowError):
        good = False
    if not good:
        raise StoreError(BROKEN, f"its head has numbers no map can have: {head}")


def _box_fits(head: Head) -> bool:
    """Whether the box, turned, fills low..high (stock.c: box_fits)."""
    (a, b), c, s = head.half, abs(math.cos(head.turn)), abs(math.sin(head.turn))
    if not (a > 0 and b > 0):
        return False
    hull = (a * c + b * s, a * s + b * c) if head.turn else (a, b)
    room = [0.5 * (high - low) for low, high in zip(head.low[:2], head.high[:2])]
    return all(abs(want - have) <= 1e-9 * (1 + have) for want, have in zip(hull, room))


def check_cells(head: Head, cells: np.ndarray) -> None:
    """Raise StoreError where a cell cannot be one of this stock; `cells` (ny + 2, nx + 2)."""
    low, high = np.float32(head.low[2]), np.float32(head.high[2])
    top, cut, drop = cells["top"], cells["cut"], cells["drop"]
    tolerance = np.float32(1e-3 * (head.high[2] - head.low[2]) + 1e-6 * max(abs(low), abs(high)))
    good = bool(np.isfinite(top).all()) and bool((top >= low - tolerance).all()) and bool((top <= high).all())
    two = (drop & layout.RIM != 0) & (drop & layout.RIM_TWO != 0)
    good = good and not ((cut == 0) & (drop != 0)).any() and not ((cut == layout.FULL) & ~two).any()
    good = good and not (two & ((cut >> 5 == 0) | (cut >> 5 >= layout.RIM_GONE))).any()
    ring = [cells[0], cells[-1], cells[:, 0], cells[:, -1]]
    good = good and all((edge["top"] <= low).all() and not edge["cut"].any() for edge in ring)
    if not good:
        raise StoreError(BROKEN, "it has cells that cannot be in this stock")


def pack(head: Head, cells: np.ndarray) -> bytes:
    """Head and cells ((ny + 2, nx + 2), CELL_DTYPE) -> the bytes of a file."""
    fields = dict(asdict(head), version=VERSION, chipwise=chipwise.version())
    text = json.dumps(fields, sort_keys=True).encode()
    body = MARK + struct.pack("<I", len(text)) + text + zlib.compress(np.ascontiguousarray(cells).tobytes(), 1)
    return body + hashlib.sha256(body).digest()


def with_removed(head: Head, removed: float) -> Head:
    """The head after so many mm3 were cut of the stock."""
    return replace(head, removed=removed)


def unpack(data: bytes, most_cells: int = layout.MAX_CELLS) -> tuple[Head, np.ndarray]:
    """The bytes of a file -> (head, cells).  Raises StoreError."""
    start = len(MARK) + 4
    if len(data) < start + DIGEST or not data.startswith(MARK):
        raise StoreError(BROKEN, f"it does not begin as a stock file ({len(data)} bytes)")
    if hashlib.sha256(data[:-DIGEST]).digest() != data[-DIGEST:]:
        raise StoreError(BROKEN, f"its checksum is wrong ({len(data)} bytes)")
    (length,) = struct.unpack_from("<I", data, len(MARK))
    if length > min(MOST_HEAD, len(data) - start - DIGEST):
        raise StoreError(BROKEN, f"its head of {length} bytes is too long")
    head = _read_head(data[start : start + length])
    if head.count > most_cells:
        raise StoreError(TOO_LARGE, f"it has {head.count} cells, the map {most_cells}")
    size = head.count * CELL_DTYPE.itemsize
    unzip = zlib.decompressobj()
    try:
        raw = unzip.decompress(data[start + length : -DIGEST], size + 1)  # never more than it says
    except zlib.error as error:
        raise StoreError(BROKEN, f"its cells cannot be unpacked: {error}") from error
    if len(raw) != size or not unzip.eof or unzip.unused_data:
        raise StoreError(BROKEN, f"it has not the {head.count} cells its head speaks of")
    cells = np.frombuffer(raw, CELL_DTYPE).reshape(head.ny + 2, head.nx + 2)
    check_cells(head, cells)
    return head, cells


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")


_NUMBER, _WHOLE = "number", "whole number"
_KINDS = {
    "cell": _NUMBER,
    "removed": _NUMBER,
    "turn": _NUMBER,
    "low": 3,
    "high": 3,
    "half": 2,  # so many numbers
    "shape": _WHOLE,
    "nx": _WHOLE,
    "ny": _WHOLE,
}


def _has_type(value: Any, kind: Any) -> bool:
    """Whether a value of the head is of its kind, and a float can hold it; True is not a number, 1.0 is not a whole
    one."""
    if isinstance(kind, int):
        return type(value) is list and len(value) == kind and all(_has_type(part, _NUMBER) for part in value)
    if type(value) is int:
        return abs(value) < MOST_NUMBER
    return kind is _NUMBER and type(value) is float


def _name(writer: Any) -> str:
    """What can be printed of a chipwise's version."""
    return "".join(letter for letter in str(writer)[:MOST_WRITER] if letter.isalnum() or letter in ".+-~")


def _read_head(text: bytes) -> Head:
    try:
        fields = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise StoreError(BROKEN, "its head cannot be read") from error
    if not isinstance(fields, dict) or "version" not in fields:
        raise StoreError(BROKEN, "its head is not that of a stock")
    version, writer = fields.pop("version"), fields.pop("chipwise", "")
    if type(version) is not int or version != VERSION:
        raise StoreError(
            OTHER_VERSION,
            f"it has version {str(version)[:20]} (chipwise {_name(writer) or 'unknown'}), "
            f"this chipwise reads {VERSION}",
        )
    if type(writer) is not str or _name(writer) != writer:
        raise StoreError(BROKEN, "its head names no chipwise that can have written it")
    return checked_head(fields)


def checked_head(fields: Any) -> Head:
    """The Head of what JSON had of one.  Raises StoreError."""
    if not isinstance(fields, dict) or set(fields) != {field.name for field in dataclass_fields(Head)}:
        raise StoreError(BROKEN, "its head lacks or has fields it should not")
    if not all(_has_type(fields[name], kind) for name, kind in _KINDS.items()):
        raise StoreError(BROKEN, "its head has a field of another type than it should")
    head = Head(
        float(fields["cell"]),
        tuple(map(float, fields["low"])),
        tuple(map(float, fields["high"])),
        fields["shape"],
        fields["nx"],
        fields["ny"],
        float(fields["removed"]),
        tuple(map(float, fields["half"])),
        float(fields["turn"]),
    )
    check_head(head)
    return head


def _remove_remains(path: str) -> None:
    """What writers of this file have left that were killed."""
    for name in glob.glob(glob.escape(path) + ".*" + UNFINISHED):
        try:
            found = os.lstat(name)
            if stat.S_ISREG(found.st_mode) and time.time() - found.st_mtime > REMAINS_S:
                os.unlink(name)
        except OSError:
            pass  # a file that cannot be removed does no harm


def write(path: str, head: Head, cells: np.ndarray) -> None:
    """Save; the file at `path` is the old one or the new one at any moment.  Raises StoreError."""
    try:
        os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
        _remove_remains(path)
        write_durable(path, pack(head, cells), UNFINISHED)
    except OSError as error:
        raise StoreError(DISK, f"{path}: {error.strerror}") from error


def digest_of(path: str) -> bytes:
    """The checksum in a stock file, which names its content.  Raises OSError."""
    with open_regular(path, MOST_NUMBER) as file:
        file.seek(-min(DIGEST, os.fstat(file.fileno()).st_size), os.SEEK_END)
        return file.read(DIGEST)


def read(path: str, most_cells: int = layout.MAX_CELLS) -> tuple[Head, np.ndarray]:
    """-> (head, cells) of a file, for a map with room for so many.  Raises StoreError."""
    try:
        data = read_bytes(path, most_cells * CELL_DTYPE.itemsize + MOST_HEAD * 16)
    except FileNotFoundError as error:
        raise StoreError(NO_FILE, f"{path} does not exist") from error
    except TooLong as error:
        raise StoreError(TOO_LARGE, f"{path}: {error.strerror}") from error
    except OSError as error:
        raise StoreError(DISK, f"{path}: {error.strerror}") from error
    try:
        head, cells = unpack(data, most_cells)
    except StoreError as error:
        raise StoreError(error.reply, f"{path}: {error}") from error
    return head, cells
