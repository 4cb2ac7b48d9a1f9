# SPDX-License-Identifier: GPL-2.0-or-later
"""The lines of a program's text: one block of bytes, and where each line begins.  Long programs have millions.

Called by program.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Iterator, overload

import numpy as np

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools

BATCH = 8192  # lines whose beginnings are made numbers at a time


class Lines(Sequence[str]):
    """The lines of bytes, with their ends.  As LinuxCNC: only a line feed ends a line."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        begins = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n")) + 1
        ends = begins if data.endswith(b"\n") or not data else np.append(begins, len(data))
        self._begin = np.concatenate((np.zeros(1, int), ends)).astype(np.int32 if len(data) < 1 << 31 else np.int64)

    def __len__(self) -> int:
        return len(self._begin) - 1

    @overload
    def __getitem__(self, k: int) -> str: ...

    @overload
    def __getitem__(self, k: slice) -> list[str]: ...

    def __getitem__(self, k: int | slice) -> str | list[str]:
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        number = k + len(self) if k < 0 else k
        if not 0 <= number < len(self):
            raise IndexError(k)
        return self.text(self.data[self._begin[number] : self._begin[number + 1]])

    def __iter__(self) -> Iterator[str]:
        for own in self.parts():
            yield self.text(own)

    def having(self, characters: bytes) -> Bools:
        """(n + 1,) bool: by number from 1, the lines that have one of some bytes."""
        code, result = np.frombuffer(self.data, np.uint8), np.zeros(len(self) + 1, bool)
        for character in characters:
            result[self._begin.searchsorted(np.flatnonzero(code == character), side="right")] = True
        return result

    def parts(self) -> Iterator[bytes]:
        """Each line as bytes."""
        for first in range(0, len(self), BATCH):
            begin = self._begin[first : first + BATCH + 1].tolist()
            for a, b in zip(begin[:-1], begin[1:]):
                yield self.data[a:b]

    @staticmethod
    def text(line: bytes) -> str:
        return line.decode("utf-8", "surrogateescape")
