# SPDX-License-Identifier: GPL-2.0-or-later
"""Read an STL file, binary or ASCII -> triangles.

Called by model.py.  Normals and attributes of the file are not used: which side is outside plays no part for the drop
cutter.
"""

import re
from typing import BinaryIO

import numpy as np

from chipwise.errors import CycleError

HEAD, RECORD = 84, 50  # bytes: of a binary file before the first triangle, of a triangle
MAX_TRIANGLES = 5_000_000
MAX_BYTES = HEAD + RECORD * MAX_TRIANGLES + (1 << 20)
PART = 200_000  # triangles read at a time
TEXT_PART = 1 << 22  # bytes
MOST_WORD = 64  # bytes of a number in an ASCII file: an array of words has room for the longest in each place
FARTHEST = 1e6  # of a coordinate of triangles that the header does not count: more is something else

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
_MARK = b"\xef\xbb\xbf"  # of UTF-8, before a text
_OTHERS = (
    (b"PK\x03\x04", "a ZIP archive, perhaps 3MF"),
    (b"\x1f\x8b", "packed by gzip"),
    (b"ISO-10303-21", "a STEP file"),
    (b"ply", "a PLY file"),
    (b"\xff\xfe", "text in UTF-16"),
    (b"\xfe\xff", "text in UTF-16"),
    (b"GIF8", "a GIF picture"),
    (b"II*\0", "a TIFF picture"),
    (b"MM\0*", "a TIFF picture"),
    (b"BM", "a BMP picture"),
    (b"RIFF", "a WebP picture"),
    (b"%PDF", "a PDF document"),
)
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def is_stl(head: bytes, size: int) -> bool:
    """Whether a file that begins so, of so many bytes, may be an STL file."""
    return _is_text(head) or size >= HEAD


def read_stl(file: BinaryIO, size: int) -> tuple[np.ndarray, np.ndarray, tuple]:
    """An open file of `size` bytes -> ((n, 9) float32, x y z of the corners of each triangle from an origin, (3,)
    float64, that), in the file's unit, and notes.

    Raises CycleError for a file that is cut off, damaged or of another kind, and for more than MAX_TRIANGLES."""
    head = file.read(1024)
    count = int.from_bytes(head[80:HEAD], "little") if len(head) >= HEAD else 0
    if len(head) >= HEAD and size == HEAD + RECORD * count:
        return _binary(file, size, count), np.zeros(3), ()
    if _is_text(head):
        return *_text(file), ()
    if size < HEAD + RECORD * count:
        _check_kind(head)
    corners, notes = _more_than_said(file, size, count)
    return corners, np.zeros(3), notes


def _is_text(head: bytes) -> bool:
    """A binary file has a 0 in the number of its triangles, if that is not above 2^24, whatever stands before it."""
    return head.removeprefix(_MARK).lstrip()[:5].lower() == b"solid" and b"\0" not in head


def _check_kind(head: bytes) -> None:
    """Raises CycleError for what is known to be another kind of file."""
    kind = next((kind for mark, kind in _OTHERS if head.startswith(mark)), None)
    if kind is None and not re.search(rb"[^\t\n\f\r -~\x80-\xff]", head):
        kind = "text"
    if kind is not None:
        raise CycleError(
            f"the file is {kind}, not an STL file", "export the model as STL, or save a picture as 16-bit grey PNG"
        )


def _more_than_said(file: BinaryIO, size: int, count: int) -> tuple[np.ndarray, tuple]:
    """Triangles of a binary file with more bytes behind its header than `count` triangles have, and a note that says
    what they are.

    They are triangles if they are a whole number of them, finite, none of them beyond FARTHEST, and not all zero (as
    padding is)."""
    over = size - HEAD - RECORD * count
    found = (size - HEAD) // RECORD
    if over > 0 and over % RECORD == 0:
        corners = _binary(file, size, found)
        more = corners[count:]
        if more.any() and (np.abs(more) <= FARTHEST).all():
            return corners, (f"the file has {found} triangles, its header says {count}: all {found} are read",)
        return corners[:count].copy(), (
            f"{over} bytes behind the {count} triangles that the header says are something else, and are not read",
        )
    notes = (
        f"{over} bytes behind the {count} triangles that the header says are not read; export the model again if a "
        f"part of it is missing",
    )
    return _binary(file, size, count), notes if over > 0 else ()


def _binary(file: BinaryIO, size: int, count: int) -> np.ndarray:
    if size < HEAD + RECORD * count:
        raise CycleError(
            f"the STL file is cut off: it says {count} triangles and has {max(0, size - HEAD) // RECORD}",
            "export the model again",
        )
    if count > MAX_TRIANGLES:
        raise CycleError(
            f"the model has {count} triangles, more than {MAX_TRIANGLES}", "export it with a larger tolerance"
        )
    corners = np.empty((count, 9), np.float32)
    file.seek(HEAD)
    for begin in range(0, count, PART):
        number = min(PART, count - begin)
        data = file.read(RECORD * number)
        if len(data) < RECORD * number:
            raise CycleError("the STL file became shorter while it was read", "try again")
        corners[begin : begin + number] = np.frombuffer(data, _TRIANGLE)["corners"]
    return corners


def _text(file: BinaryIO) -> tuple[np.ndarray, np.ndarray]:
    file.seek(0)
    parts, rest, total, origin = [], b"", 0, None
    while True:
        data = file.read(TEXT_PART)
        text = rest + data
        cut = text.lower().rfind(b"endfacet") + len(b"endfacet") if data else len(text)
        if not data and not _is_end(text):
            raise CycleError(
                f"the ASCII STL file is cut off after triangle {total}: the line endsolid is missing",
                "export the model again",
            )
        if not data or cut >= len(b"endfacet"):
            corners = _corners(text[:cut], total)
            if origin is None and len(corners):
                origin = np.nan_to_num(corners[0, :3], posinf=0.0, neginf=0.0)
            parts.append((corners - np.tile(np.zeros(3) if origin is None else origin, 3)).astype(np.float32))
            total += len(corners)
            rest = text[cut:]
        else:
            rest = text
        if len(rest) > TEXT_PART:
            raise CycleError(f"the ASCII STL file is damaged after triangle {total}", "export the model again")
        if total > MAX_TRIANGLES:
            raise CycleError(f"the model has more than {MAX_TRIANGLES} triangles", "export it with a larger tolerance")
        if not data:
            break
    return np.concatenate(parts), np.zeros(3) if origin is None else origin


def _is_end(text: bytes) -> bool:
    """Whether the last solid ends in what comes behind the last whole facet: one endsolid is not enough, there may be
    several solids."""
    lines = text.lower().splitlines()
    last = max((k for k, line in enumerate(lines) if b"endsolid" in line), default=None)
    return last is not None and not any(
        line.split()[:1] in ([b"solid"], [b"facet"], [b"vertex"]) for line in lines[last + 1 :]
    )


def _corners(text: bytes, before: int) -> np.ndarray:
    """Whole facets of an ASCII file -> (n, 9)."""
    words = _VERTEX.findall(text)
    facets = len(re.findall(rb"endfacet", text, re.IGNORECASE))
    if len(words) != 3 * facets:
        raise CycleError(
            f"the ASCII STL file has facets without three vertices after triangle {before}", "export the model again"
        )
    if any(len(word) > MOST_WORD for facet in words for word in facet):
        raise CycleError(
            f"the ASCII STL file has a number of more than {MOST_WORD} characters after triangle {before}",
            "export the model again",
        )
    try:
        return np.array(words, "S").astype(np.float64).reshape(facets, 9)
    except ValueError:
        raise CycleError(
            f"the ASCII STL file has a vertex that is not three numbers after triangle {before}",
            "export the model again",
        ) from None
