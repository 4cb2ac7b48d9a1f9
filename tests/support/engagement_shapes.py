# SPDX-License-Identifier: GPL-2.0-or-later
"""The nine pockets on which paths of constant engagement are measured, for a tool of 6 mm: loops of parts, the boundary
first."""

import math

from chipwise.geometry.base.contour import LineElement
from support.pocket_random import circle, rectangle


def polygon(points):
    """Parts of a closed polygon."""
    points = [(float(x), float(y)) for x, y in points]
    return tuple(LineElement(points[k], points[(k + 1) % len(points)], k + 1) for k in range(len(points)))


def _star():
    return [
        (
            (30 if k % 2 == 0 else 14) * math.cos(math.pi * k / 5 + math.pi / 2),
            (30 if k % 2 == 0 else 14) * math.sin(math.pi * k / 5 + math.pi / 2),
        )
        for k in range(10)
    ]


# A slab-serif I, thin foot and head.
_LETTER = [
    (0, 0),
    (44, 0),
    (44, 9),
    (31, 12),
    (31, 58),
    (44, 61),
    (44, 70),
    (0, 70),
    (0, 61),
    (13, 58),
    (13, 12),
    (0, 9),
]

SHAPES = {
    "rectangle": (rectangle(0, 0, 60, 40),),
    "island": (rectangle(0, 0, 60, 60), circle(4.0, (30.0, 30.0))),
    "L": (polygon([(0, 0), (70, 0), (70, 25), (25, 25), (25, 60), (0, 60)]),),
    "comb of 9 mm slots": (
        polygon(
            [
                (0, 0),
                (63, 0),
                (63, 40),
                (54, 40),
                (54, 9),
                (45, 9),
                (45, 40),
                (36, 40),
                (36, 9),
                (27, 9),
                (27, 40),
                (18, 40),
                (18, 9),
                (9, 9),
                (9, 40),
                (0, 40),
            ]
        ),
    ),
    "star": (polygon(_star()),),
    "circle": (circle(25.0, (0.0, 0.0)),),
    "neck": (
        polygon(
            [
                (0, 0),
                (30, 0),
                (30, 15),
                (40, 15),
                (40, 0),
                (70, 0),
                (70, 40),
                (40, 40),
                (40, 25),
                (30, 25),
                (30, 40),
                (0, 40),
            ]
        ),
    ),
    "slot": (rectangle(0, 0, 70, 9),),
    "letter": (polygon(_LETTER),),
}
