# SPDX-License-Identifier: GPL-2.0-or-later
"""Read an STL file, binary or ASCII -> triangles.

Called by model.py.  Normals and attributes of the file are not used: which side is outside plays no part for the drop cutter.
"""

import re
from typing import BinaryIO

import numpy as np

from chipwise.errors import CycleError

HEAD, RECORD = 84, 50               # bytes: of a binary file before the first triangle, of a triangle
MAX_TRIANGLES = 5_000_000
MAX_BYTES = HEAD + RECORD * MAX_TRIANGLES + (1 << 20)
PART = 200_000                      # triangles read at a time
TEXT_PART = 1 << 22                 # bytes

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def is_stl(head: bytes, size: int) -> bool:
    """Whether a file that begins so, of so many bytes, may be an STL file."""
    return _is_text(head) or size >= HEAD


def read_stl(file: BinaryIO, size: int) -> np.ndarray:
    """An open file of `size` bytes -> (n, 9) float32, x y z of the corners of each triangle, in the file's unit.

    Raises CycleError for a file that is cut off or damaged, and for more than MAX_TRIANGLES."""
    head = file.read(1024)
    count = int.from_bytes(head[80:HEAD], "little") if len(head) >= HEAD else 0
    if len(head) >= HEAD and size == HEAD + RECORD * count or not _is_text(head):
        return _binary(file, size, count)
    return _text(file)


def _is_text(head: bytes) -> bool:
    start = head.lstrip()[:1024].lower()
    return start.startswith(b"solid") and (b"facet" in start or b"endsolid" in start)


def _binary(file: BinaryIO, size: int, count: int) -> np.ndarray:
    if size < HEAD + RECORD * count:
        raise CycleError(f"the STL file is cut off: it says {count} triangles and has {max(0, size - HEAD) // RECORD}",
                         "export the model again")
    if count > MAX_TRIANGLES:
        raise CycleError(f"the model has {count} triangles, more than {MAX_TRIANGLES}", "export it with a larger tolerance")
    corners = np.empty((count, 9), np.float32)
    file.seek(HEAD)
    for begin in range(0, count, PART):
        number = min(PART, count - begin)
        data = file.read(RECORD * number)
        if len(data) < RECORD * number:
            raise CycleError("the STL file became shorter while it was read", "try again")
        corners[begin:begin + number] = np.frombuffer(data, _TRIANGLE)["corners"]
    return corners


def _text(file: BinaryIO) -> np.ndarray:
    file.seek(0)
    parts, rest, total = [], b"", 0
    while True:
        data = file.read(TEXT_PART)
        text = rest + data
        cut = text.lower().rfind(b"endfacet") + len(b"endfacet") if data else len(text)
        if not data and not _is_end(text):
            raise CycleError(f"the ASCII STL file is cut off after triangle {total}: the line endsolid is missing", "export the model again")
        if not data or cut >= len(b"endfacet"):
            parts.append(_corners(text[:cut], total))
            total += len(parts[-1])
            rest = text[cut:]
        else:
            rest = text
        if len(rest) > TEXT_PART:
            raise CycleError(f"the ASCII STL file is damaged after triangle {total}", "export the model again")
        if total > MAX_TRIANGLES:
            raise CycleError(f"the model has more than {MAX_TRIANGLES} triangles", "export it with a larger tolerance")
        if not data:
            break
    return np.concatenate(parts)


def _is_end(text: bytes) -> bool:
    """Whether the last solid ends in what comes behind the last whole facet: one endsolid is not enough, there may be several solids."""
    lines = text.lower().split(b"\n")
    last = max((k for k, line in enumerate(lines) if b"endsolid" in line), default=None)
    return last is not None and not any(line.split()[:1] in ([b"solid"], [b"facet"], [b"vertex"]) for line in lines[last + 1:])


def _corners(text: bytes, before: int) -> np.ndarray:
    """Whole facets of an ASCII file -> (n, 9) float32."""
    words = _VERTEX.findall(text)
    facets = len(re.findall(rb"endfacet", text, re.IGNORECASE))
    if len(words) != 3 * facets:
        raise CycleError(f"the ASCII STL file has facets without three vertices after triangle {before}", "export the model again")
    try:
        return np.array(words, "S").astype(np.float64).astype(np.float32).reshape(facets, 9)
    except ValueError:
        raise CycleError(f"the ASCII STL file has a vertex that is not three numbers after triangle {before}",
                         "export the model again") from None
