# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays that grow where they are: a long program is never there twice.  Called by program.py and
expected_program.py."""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import DTypeLike

ROOM = 4096  # rows, and a sixteenth, that an array grows by at least


class Growing:
    """Rows of one type, added part by part."""

    def __init__(self, dtype: DTypeLike, *shape: int) -> None:
        """shape: of a row."""
        self._array, self._shape, self._count = np.empty((0, *shape), dtype), shape, 0

    def add(self, rows: Sequence[int] | np.ndarray) -> None:
        """rows (n, *shape)."""
        count = self._count + len(rows)
        if count > len(self._array):
            self._to(count + count // 16 + ROOM)
        self._array[self._count : count] = rows
        self._count = count

    def whole(self) -> np.ndarray:
        """The array (n, *shape); nothing can be added any more."""
        self._to(self._count)
        result = self._array
        del self._array
        return result

    def _to(self, count: int) -> None:
        self._array.resize(
            (count, *self._shape), refcheck=False
        )  # realloc(): the kernel moves large arrays without a copy
