# SPDX-License-Identifier: GPL-2.0-or-later
"""Read a PNG picture as depth: white is the top, black the bottom.

Called by model.py.  Source: PNG specification (W3C), chunks IHDR, pHYs, IDAT; the filters are taken off in C (png.h).
Grey or colour, 8 or 16 bit, without interlace; colours count with their mean.
"""

import struct
import zlib
from dataclasses import dataclass
from typing import BinaryIO, Iterator

import numpy as np

from chipwise.errors import CycleError
from chipwise.clib.library import library

SIGNATURE = b"\x89PNG\r\n\x1a\n"
MAX_PIXELS = 2_500_000
MAX_BYTES = 1 << 26
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # by colour type; of grey or colour with alpha the alpha is left out
_COLOURS = {0: 1, 2: 3, 4: 1, 6: 3}
_AGAIN = "save the picture again as 16-bit grey PNG without interlace"


@dataclass(frozen=True)
class Picture:
    """height  (rows, columns) float32, 0 black .. 1 white, the first row at the top; bits: 8 or 16; pixel: mm, None:
    not said; aspect: width of a pixel over its height; transparent: some pixels are"""

    height: np.ndarray
    bits: int
    pixel: float | None
    aspect: float = 1.0
    transparent: bool = False


def read_png(file: BinaryIO) -> Picture:
    """An open file that begins with SIGNATURE -> Picture.  Raises CycleError."""
    head, data, pixel, aspect = b"", [], None, 1.0
    for kind, content in _chunks(file.read(MAX_BYTES)):
        if kind == b"IHDR":
            head = content
        elif kind == b"pHYs" and len(content) == 9:
            across, up, unit = struct.unpack(">IIB", content)
            pixel = 1000.0 / across if unit == 1 and across else None
            aspect = up / across if across and up else 1.0
        elif kind == b"IDAT":
            data.append(content)
    if len(head) != 13:
        raise CycleError("the PNG file has no head (IHDR)", _AGAIN)
    columns, rows, bits, colour, _method, _filter, interlace = struct.unpack(">IIBBBBB", head)
    if bits not in (8, 16) or colour not in _CHANNELS or interlace:
        raise CycleError(
            f"the PNG file has {bits} bit, colour type {colour}{' and interlace' if interlace else ''}, which is not "
            f"read",
            _AGAIN,
        )
    if columns < 2 or rows < 2 or columns * rows > MAX_PIXELS:
        raise CycleError(
            f"the picture has {columns} x {rows} pixels, not 2 x 2 to {MAX_PIXELS} together", "scale the picture"
        )
    height, transparent = _heights(b"".join(data), rows, columns, bits, colour)
    return Picture(height, bits, pixel, aspect, transparent)


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """(kind, content) of the chunks up to IEND."""
    at = len(SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        content, check = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if len(check) < 4:
            break
        if zlib.crc32(kind + content) != int.from_bytes(check, "big"):
            raise CycleError(f"the PNG file is damaged at byte {at} (check sum)", _AGAIN)
        if kind == b"IEND":
            return
        yield kind, content
        at += 12 + length
    raise CycleError("the PNG file is cut off", _AGAIN)


def _heights(data: bytes, rows: int, columns: int, bits: int, colour: int) -> tuple[np.ndarray, bool]:
    step = _CHANNELS[colour] * bits // 8
    expected = rows * (columns * step + 1)
    try:
        raw = zlib.decompressobj().decompress(data, expected + 1)
    except zlib.error:
        raw = b""
    if len(raw) != expected:
        raise CycleError("the PNG file is damaged: its pixels cannot be unpacked", _AGAIN)
    pixels = np.frombuffer(raw, np.uint8).copy()
    if not library().chip_png_unfilter(pixels.ctypes.data, rows, columns * step, step):
        raise CycleError("the PNG file is damaged: a row has an unknown filter", _AGAIN)
    plain = np.ascontiguousarray(pixels.reshape(rows, -1)[:, 1:])
    values, colours = plain.view(">u2" if bits == 16 else np.uint8).reshape(rows, columns, -1), _COLOURS[colour]
    most = 2**bits - 1
    return (values[:, :, :colours].mean(axis=2) / most).astype(np.float32), bool((values[:, :, colours:] < most).any())
