# SPDX-License-Identifier: GPL-2.0-or-later
"""The hand of a pattern: whether what is being planned will be mirrored; and its path mode.

Set by runner.py in a process of its own; read by the glue of the cycles and of G75.  Moves that a sub programs itself
stay mirrored
(runner.py finds them, and G75 warns) unless the operator has G75 run them backwards (climb.py).  A cycle in a mirrored
pattern plans the other hand, and the mirror makes it the programmed one again: a hole that is cut clockwise stays one,
a climb cut stays one.
"""

from typing import Optional

CALLERS = "chipwise: the caller's path mode"  # a comment

mirrored = False
emitting = False  # whether the moves that come now are those of a cycle (glue/emit.py)
path: Optional[tuple] = (
    None  # in a sub that is run as a pattern: (61, 61.1 or 64, P and Q in mm), or () for the caller's path mode
)
