# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock in a file that grows while the machine cuts: what [CHIPWISE]KEEP_STOCK has after a power loss.

Called by monitor/live_stock.py (writes) and monitor/stock_files.py (reads).  Pure: no HAL, no LinuxCNC.

A file holds, in this order
    16 bytes    "chipwise kept 1\\n"
    records     4 bytes length of the payload, little endian; 16 bytes BLAKE2b over the sum of the record before and the
                payload; payload
and a payload
    H + JSON    first: version, number of this file, head of the stock (store.Head)
    C + JSON    cells: where and when (Note), then zlib of u32 indices and u64 cells; or "first": zlib of u64 cells from
                an index on
    B           all cells have been there once: the file is complete
 1. A new file is written under another name and takes its place when it is complete (create, Writer.publish): a cut
    leaves the old one.
 2. A record that is cut off, zeroed or damaged, and all behind it, do not count: each sum contains the one before, and
    the first one the number of the file, so that blocks of older files do not fit.
 3. Within a stock material only goes away.  So a file that lacks its last records has more material than is there,
    never less.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
import uuid
import zlib
from dataclasses import asdict, dataclass
from typing import BinaryIO, Iterator

import numpy as np

from chipwise.host.files import open_regular, read_bytes, sync_folder, write_durable
from chipwise.clib import layout
from chipwise.stock import store
from chipwise.clib.core import CELL_DTYPE
from chipwise.stock.reasons import BROKEN, DISK, NO_FILE, TOO_LARGE

MARK = b"chipwise kept 1\n"
SUM = 16  # bytes
BAND_CELLS = 1 << 19  # in one record: bounds the memory of reader and writer
MOST_PAYLOAD = 1 << 24  # bytes; a band of cells that cannot be compressed has 4 MB
MOST_GROWTH = 1 << 24  # bytes behind the complete stock: then a new file begins
MOST_FILE = 1 << 33  # bytes
NOTE = ".note"  # behind the name of a stock file
MOST_NOTE = 1 << 14  # bytes


@dataclass(frozen=True)
class Note:
    """What the machine did when cells were saved."""

    time: float = 0.0  # s since 1970
    removed: float = 0.0  # mm3 cut of the stock
    tip: tuple = ()  # mm, machine coordinates: the tool's tip; () where it is not known
    line: int = 0
    program: str = ""


def digest_of(path: str) -> str:
    """The checksum at the end of a file of store.py, in hex; "" if it cannot be read."""
    try:
        with open_regular(path, MOST_FILE) as file:
            file.seek(-store.DIGEST, os.SEEK_END)
            return file.read(store.DIGEST).hex()
    except OSError:
        return ""


def write_note(path: str, note: Note) -> None:
    """What a run that has ended in order knew of the stock in a file of store.py, beside it.  Raises OSError."""
    write_durable(path + NOTE, json.dumps({"of": digest_of(path), **asdict(note)}).encode(), store.UNFINISHED)


def read_note(path: str) -> Note | None:
    """The Note beside a file of store.py; None if there is none, or one of another file."""
    try:
        fields = json.loads(read_bytes(path + NOTE, MOST_NOTE))
        return _note(fields) if fields["of"] and fields["of"] == digest_of(path) else None
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _chained(before: bytes, payload: bytes) -> bytes:
    return hashlib.blake2b(before + payload, digest_size=SUM).digest()


def spoil(path: str) -> None:
    """Empty a file that cannot be deleted.  Raises OSError."""
    handle = os.open(path, os.O_WRONLY | os.O_TRUNC | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class Writer:
    """A file that is being written; every method may raise OSError, after which the file is as it was."""

    def __init__(self, path: str, head: store.Head):
        self.path, self._fresh = path, path + store.UNFINISHED
        os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
        self._file = os.open(self._fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        self._sum, self.size, self._complete = bytes(SUM), 0, 0
        self._band: tuple[np.ndarray, bytes] | None = None  # cells of the last band and what they are compressed
        try:
            self._write(MARK)
            self._record(b"H" + json.dumps({"version": 1, "number": uuid.uuid4().hex, "head": asdict(head)}).encode())
        except OSError:
            self.close()
            raise

    def _write(self, data: bytes) -> None:
        """Append; what did not fit is taken back."""
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._file, view) :]
        except OSError:
            os.ftruncate(self._file, self.size)
            os.lseek(self._file, self.size, os.SEEK_SET)
            raise
        self.size += len(data)

    def _record(self, payload: bytes) -> None:
        chained = _chained(self._sum, payload)
        self._write(struct.pack("<I", len(payload)) + chained + payload)
        self._sum = chained

    def band(self, first: int, cells: np.ndarray, note: Note) -> None:
        """Cells from an index on, uint64, of a file that is not complete; they may not change before publish().  Equal
        bands are compressed once: those of a new stock are, row by row."""
        if self._band is None or not np.array_equal(self._band[0], cells):
            self._band = cells, zlib.compress(np.ascontiguousarray(cells).data, 1)
        self._record(b"C" + json.dumps({**asdict(note), "first": first}).encode() + b"\n" + self._band[1])

    def changes(self, indices: np.ndarray, cells: np.ndarray, note: Note) -> None:
        """At most BAND_CELLS cells: where, and the uint64 they are now; of one that is there more than once the last
        counts."""
        data = indices.astype("<u4").tobytes() + cells.astype("<u8").tobytes()
        self._record(b"C" + json.dumps(asdict(note)).encode() + b"\n" + zlib.compress(data, 1))

    def publish(self) -> None:
        """The file is complete and takes its place."""
        self._band = None
        self._record(b"B")
        os.fsync(self._file)
        os.replace(self._fresh, self.path)
        sync_folder(self.path)
        self._complete = self.size

    def sync(self) -> None:
        """What has been written is on the disk."""
        os.fdatasync(self._file)

    @property
    def is_complete(self) -> bool:
        return self._complete > 0

    @property
    def is_long(self) -> bool:
        """A new file would be much shorter."""
        return self.size > 2 * self._complete + MOST_GROWTH

    def close(self) -> None:
        os.close(self._file)
        if not self._complete and os.path.exists(self._fresh):
            os.unlink(self._fresh)


def _payloads(file: BinaryIO) -> Iterator[bytes]:
    """The payloads of a file up to the first record that is not whole."""
    if file.read(len(MARK)) != MARK:
        return
    chained = bytes(SUM)
    while True:
        start = file.read(4 + SUM)
        if len(start) < 4 + SUM:
            return
        length = struct.unpack("<I", start[:4])[0]
        if not 0 < length <= MOST_PAYLOAD:
            return
        payload = file.read(length)
        if len(payload) < length or _chained(chained, payload) != start[4:]:
            return
        chained = start[4:]
        yield payload


def _unpacked(data: bytes, most: int) -> bytes:
    """zlib of at most `most` bytes."""
    work = zlib.decompressobj()
    found = work.decompress(data, most)
    if not work.eof or work.unconsumed_tail:
        raise ValueError("more cells than there are")
    return found


def _apply(cells: np.ndarray, payload: bytes) -> dict:
    """The cells of a record into the map; -> its note."""
    text, _newline, data = payload[1:].partition(b"\n")
    note = json.loads(text)
    first = note.pop("first", None)
    found = _unpacked(
        data, BAND_CELLS * 12 + 1
    )  # also of a small map: a cell that was cut while it was read is there more than once
    if first is None:
        count = len(found) // 12
        if len(found) != 12 * count:
            raise ValueError("no cells")
        cells[np.frombuffer(found, "<u4", count)] = np.frombuffer(found, "<u8", count, 4 * count)
    else:
        part = np.frombuffer(found, "<u8")
        if type(first) is not int or not 0 <= first <= cells.size - part.size:
            raise ValueError("no such cells")
        cells[first : first + part.size] = part
    return note


def _note(fields: dict) -> Note:
    note = Note(
        float(fields["time"]),
        float(fields["removed"]),
        tuple(map(float, fields["tip"])),
        int(fields["line"]),
        str(fields["program"]),
    )
    if (
        not all(math.isfinite(number) for number in (note.time, note.removed, *note.tip))
        or note.removed < 0
        or len(note.tip) not in (0, 3)
    ):
        raise ValueError("no note")
    return note


def _replay(file: BinaryIO, most_cells: int) -> tuple[store.Head, np.ndarray, Note]:
    head, cells, note, complete = None, np.zeros(0, np.uint64), Note(), False
    for payload in _payloads(file):
        kind = payload[:1]
        if head is None:
            fields = json.loads(payload[1:])
            head = store.checked_head(fields["head"])
            if head.count > most_cells:
                raise store.StoreError(TOO_LARGE, f"it has {head.count} cells, the map {most_cells}")
            cells = np.zeros(head.count, np.uint64)
        elif kind == b"C":
            note = _note(_apply(cells, payload))
        elif kind == b"B":
            complete = True
    if head is None or not complete:
        raise store.StoreError(BROKEN, "it is not complete")
    return store.with_removed(head, note.removed), cells, note


def read(path: str, most_cells: int = layout.MAX_CELLS) -> tuple[store.Head, np.ndarray, Note]:
    """-> (head, cells, the last note) of a file as far as it is whole, for a map with room for so many cells.  Raises
    StoreError."""
    try:
        with open_regular(path, MOST_FILE) as file:
            head, cells, note = _replay(file, most_cells)
    except FileNotFoundError as error:
        raise store.StoreError(NO_FILE, f"{path} does not exist") from error
    except OSError as error:
        raise store.StoreError(DISK, f"{path}: {error.strerror}") from error
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, zlib.error) as error:
        raise store.StoreError(BROKEN, f"{path}: {error}") from error
    except store.StoreError as error:
        raise store.StoreError(error.reply, f"{path}: {error}") from error
    shaped = cells.view(CELL_DTYPE).reshape(head.ny + 2, head.nx + 2)
    try:
        store.check_cells(head, shaped)
    except store.StoreError as error:
        raise store.StoreError(error.reply, f"{path}: {error}") from error
    return head, shaped, note
