# SPDX-License-Identifier: GPL-2.0-or-later
"""Canonical forms of lines and arcs and their offset, as in JP H07-47256.

Called by reference_offset.py (the patent's own procedure) and raw.py (the kernel's raw offset).
Source: JP H07-47256, the paragraphs on Fig. 7, Fig. 8 and the flow chart of Fig. 3.

The patent's symbols: line ELa = unit normal Va = (Vx, Vy) to the right of travel and
distance Ve from the origin, positive where the origin lies left of travel; arc ELb =
centre Q = (x0, y0), radius r0 and direction CW / CCW.  Offset to the right by the tool
radius L: Ve + L, CCW r0 + L, CW r0 - L; to the left the signs change, so a negative L is
an offset to the left.

Departure: the patent registers an arc of negative radius and deletes it later; here the
radius keeps its sign in `radius` and the callers decide.
"""

from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base.elements import Elements
from chipwise.geometry.base.lines import dot, right_normal


@dataclass(frozen=True, eq=False)
class Canonical:
    """n canonical forms; rows of lines use normal and distance, rows of arcs the others.

    normal (n, 2) unit; distance (n,) mm; centre (n, 2) mm; radius (n,) mm; turn (n,)
    +1 counter-clockwise, -1 clockwise, 0 line.
    """

    normal: np.ndarray
    distance: np.ndarray
    centre: np.ndarray
    radius: np.ndarray
    turn: np.ndarray


def canonical(e: Elements):
    """Canonical forms of elements; the ends are not part of the form."""
    along = np.where(e.is_arc[:, None], [[1.0, 0.0]], e.end - e.start)
    normal = right_normal(along)
    return Canonical(normal, dot(normal, e.start), e.centre, e.radius, np.sign(e.sweep))


def offset_right(form: Canonical, distance):
    """Forms moved to the right of travel by `distance` (mm, scalar or (n,)), to the left
    where it is negative.  A radius <= 0 says that the arc has vanished."""
    on_line = form.turn == 0.0
    return Canonical(
        form.normal,
        np.where(on_line, form.distance + distance, form.distance),
        form.centre,
        np.where(on_line, 0.0, form.radius + form.turn * distance),
        form.turn,
    )
