# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock of M250: words, or the WORKPIECE comment of the program, to a box or cylinder in machine coordinates.

Called by stock_codes.py.  Comments as in docs/user/codes.md:
    (WORKPIECE,BOX,XMIN=..,YMIN=..,ZMIN=..,XMAX=..,YMAX=..,ZMAX=..)
    (WORKPIECE,CYLINDER,AXIS=Z,X=..,Y=..,ZMIN=..,ZMAX=..,DIAMETER=..)
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Sequence

from chipwise.program import comments
from chipwise.stock import shape_comment
from chipwise.errors import CycleError
from chipwise.stock.shape_comment import BOX, CYLINDER
from chipwise.clib.layout import MAX_COORDINATE, MIN_SIZE

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.settings import Settings

CORNER_WORDS, SIZE_WORDS = "pqr", "ijk"


def box_from_words(state: State) -> tuple[list[float], list[float]] | None:
    """(low, high), mm, work coordinates, from P Q R I J K; None when none of them is given."""
    given = [letter for letter in CORNER_WORDS + SIZE_WORDS if state.number(letter) is not None]
    if not given:
        return None
    low = [state.needed(letter, f"minimum of the stock in {axis}") for letter, axis in zip(CORNER_WORDS, "XYZ")]
    size = [state.needed(letter, f"size of the stock in {axis}") for letter, axis in zip(SIZE_WORDS, "XYZ")]
    for letter, axis, value in zip(SIZE_WORDS, "XYZ", size):
        if not value > 0:
            raise CycleError(
                f"size of the stock in {axis}, {letter.upper()}{{size}}, is not above 0",
                f"give {letter.upper()} above 0",
                size=value,
            )
    return low, [a + b for a, b in zip(low, size)]


def parse_comment(text: str) -> tuple[list[float], list[float], int]:
    """Inside of a WORKPIECE comment -> (low, high, shape): shape_comment.parse."""
    return shape_comment.parse(text, "WORKPIECE", "stock")


def find_comment(path: str, line_number: int) -> str | None:
    """Inside of the last WORKPIECE comment up to a line of a program, else of the first one; None without."""
    first = None
    try:
        with open(path, encoding="utf-8", errors="replace") as program:
            for number, line in enumerate(program, 1):
                here = comments.insides(line, "WORKPIECE")
                if here and number <= line_number:
                    first = here[-1]
                elif here and first is None:
                    first = here[0]
    except OSError:
        return None
    return first


def stock_of(state: State) -> tuple[list[float], list[float], int, float]:
    """(low, high, shape, turn) in mm and degrees, machine coordinates of the tool tip, for the stock this M250 asks
    for."""
    low: Sequence[float]
    high: Sequence[float]
    box, shape = box_from_words(state), BOX
    if box is None:
        text = find_comment(state.program(), state.line_number)
        if text is None:
            raise CycleError(
                "there are neither words nor a WORKPIECE comment",
                "give P Q R (corner) I J K (size), or add (WORKPIECE,BOX,XMIN=..,..) to the program",
            )
        low, high, shape = parse_comment(text)
        box = [v * state.unit_mm for v in low], [v * state.unit_mm for v in high]
    if shape == CYLINDER:
        (low, high), turn = cylinder_to_machine(state, *box), 0.0
    else:
        low, high, turn = to_machine(state, *box)
    more = allowance(state)
    return [low[0] - more, low[1] - more, low[2]], [v + more for v in high], shape, turn


def allowance(state: State) -> float:
    """How much larger than said the stock is taken to be, at its sides and top, mm."""
    value = state.parameter("_chipwise_allowance")
    if value is None:
        return state.settings["ALLOWANCE"]
    if not 0 <= value * state.unit_mm <= 100:
        raise CycleError(
            "allowance {a} is not a length from 0 to {most}",
            "set #<_chipwise_allowance> to how much larger the stock may be",
            a=value * state.unit_mm,
            most=100,
        )
    return value * state.unit_mm


def cylinder_to_machine(state: State, low: Sequence[float], high: Sequence[float]) -> tuple[list[float], list[float]]:
    """As to_machine(), of a cylinder along Z, which a rotation leaves as it is."""
    radius = (high[0] - low[0]) / 2
    x, y, bottom = state.machine_point([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    return [x - radius, y - radius, bottom], [x + radius, y + radius, bottom + high[2] - low[2]]


def to_machine(
    state: State, low: Sequence[float], high: Sequence[float]
) -> tuple[Sequence[float], Sequence[float], float]:
    """Work box -> (low, high, turn): the machine box, mm, and the degrees it is turned by about its middle."""
    turn = state.interp.rotation_xy
    if turn % 90 == 0:  # upright all the same
        corners = [state.machine_point(corner) for corner in itertools.product(*zip(low, high))]
        return tuple(map(min, zip(*corners))), tuple(map(max, zip(*corners))), 0.0
    middle = state.machine_point([(a + b) / 2 for a, b in zip(low, high)])
    half = [(b - a) / 2 for a, b in zip(low, high)]
    return (
        tuple(m - h for m, h in zip(middle, half)),
        tuple(m + h for m, h in zip(middle, half)),
        (turn + 180) % 360 - 180,
    )


def check_extent(low: Sequence[float], high: Sequence[float]) -> None:
    """Raise CycleError for a box that the stock tracker refuses: components/core/stock.h."""
    for axis, a, b in zip("XYZ", low, high):
        if not b - a >= MIN_SIZE:
            raise CycleError(
                f"the stock has {{size}} in {axis}, less than {{least}}",
                "give it a larger size",
                size=b - a,
                least=MIN_SIZE,
            )
        far = max(a, b, key=abs)
        if not abs(far) <= MAX_COORDINATE:
            raise CycleError(
                f"a corner of the stock is at {axis}{{far}} of the machine, more than {{most}} from its zero",
                "correct the words of M250, the comment or the work offset",
                far=far,
                most=MAX_COORDINATE,
            )


def check_fits(settings: Settings, low: Sequence[float], high: Sequence[float], turn: float = 0.0) -> list[float]:
    """Raise CycleError where the box is larger than the map; -> its size in X and Y there, mm."""
    room = settings["MAP_SIZE"]
    size = [b - a for a, b in zip(low, high)]
    if turn:
        c, s = abs(math.cos(math.radians(turn))), abs(math.sin(math.radians(turn)))
        size = [size[0] * c + size[1] * s, size[0] * s + size[1] * c]
    if size[0] > room[0] + 1e-9 or size[1] > room[1] + 1e-9:
        raise CycleError(
            "the stock of {x} by {y}"
            + (", turned by G10 R," if turn else "")
            + " is larger than the map of {mx} by {my}",
            "enlarge [CHIPWISE]MAP_SIZE in the INI file or use a smaller box",
            x=size[0],
            y=size[1],
            mx=room[0],
            my=room[1],
        )
    return size
