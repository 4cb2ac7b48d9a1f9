# SPDX-License-Identifier: GPL-2.0-or-later
"""Names of arrays in annotations, for the checker only: nothing imports this when it runs, numpy.typing costs 15 ms.

What an array's rows and columns are, and their units, its function says in words, as "points (n, 3) mm": types have
neither.
"""

from typing import Any, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]  # float64, and float32 where there are millions
Ints = NDArray[np.integer[Any]]  # of any width
Bools = NDArray[np.bool_]
Records = NDArray[np.void]  # rows with fields, as those of the C structures
Corners = tuple[Sequence[float], Sequence[float]]  # of a box: the lowest (3,) and the highest (3,), mm
