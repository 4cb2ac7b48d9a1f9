# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads a rewritten program back and compares it with the first one, before anything is kept.

Called by run.py.  Nothing here knows how the text was made.

 1. same_path: every step of the first path ends where steps of the second one do, in the same order, and what lies
    between lies on the step: to PATH_MM.
 2. same_feeds: every feed move has the F that was meant for it, rounded down.
 3. same_stock: no new traverse of the second path meets stock, the stock it leaves is that of the first within a cell,
    and both end at the same place.
    That it never cuts deeper than the flutes are long is proved by depth_proof.py.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Callable, Iterable, Sequence

import numpy as np

from chipwise.program.records import RAPID
from chipwise.check.simulate import SEGMENT_MM
from chipwise.rewrite import sections
from chipwise.clib import layout

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.clib.height_map import HeightMap, Shape
    from chipwise.rewrite.expected_program import Foreseen
    from chipwise.rewrite.program import Circle, Program
    from chipwise.tool_data.geometry import ToolGeometry

PATH_MM = 0.001
OVER_MM = 0.006  # OVER_MM of links.py, and the rounding of the text
HEIGHT_CELLS = 0.2  # of a cell
SIDE_MM = (
    layout.HEIGHT_SKIN
)  # by which walls may be somewhere else: where the model's steps are, and the text's last digit
FEED_BELOW = 0.03  # mm/min that F is lower by at most: the last digit, rounded down
FEED_ABOVE = 3e-4  # mm/min that it is higher by at most: that of an F below 1
FEED_SHARE = 1e-6  # the same of large ones


class Different(Exception):
    """The second program is not what it should be; str() says where."""


def _off(circle: Circle | None, begin: Floats, end: Floats, p: Floats) -> Floats:
    """Distance of points (n, 3) from a step."""
    if circle is not None:
        u, v = {1: (0, 1), 2: (1, 2), 3: (2, 0)}[circle.plane]
        radius = np.hypot(begin[u] - circle.centre[u], begin[v] - circle.centre[v])
        return np.abs(np.hypot(p[:, u] - circle.centre[u], p[:, v] - circle.centre[v]) - radius)
    d = end - begin
    length2 = float(d @ d)
    t = np.clip((p - begin) @ d / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(p))
    return np.sqrt(((p - begin - t[:, None] * d) ** 2).sum(axis=1))


def real_steps(program: Program) -> list[int]:
    """Numbers of the steps that go anywhere."""
    ends = program.end[program.first[1:] - 1]
    begins = np.array([program.start(int(k)) for k in program.first[:-1]]).reshape(-1, 3)
    return np.flatnonzero((np.abs(ends - begins).max(axis=1) > 1e-4) | (program.circle >= 0)).tolist()


def same_path(first: Program, second: Program) -> None:
    """Raises Different where two Programs do not make the same path."""
    waiting = real_steps(second)[::-1]
    for step in real_steps(first):
        a, b = int(first.first[step]), int(first.first[step + 1])
        begin, end, line = first.start(a), first.end[b - 1], first.line_of(step)
        circle = first.circles[first.circle[step]] if first.circle[step] >= 0 else None
        turned, wanted = 0.0, _turned(first, step, circle) if circle else 0.0
        while True:
            if not waiting:
                raise Different(f"line {line} is missing")
            own = waiting.pop()
            c, d = int(second.first[own]), int(second.first[own + 1])
            if (second.kind[c] == RAPID) != (first.kind[a] == RAPID):
                raise Different(f"line {line} has become another kind of move")
            off = float(_off(circle, begin, end, second.end[c:d]).max())
            if off > PATH_MM:
                raise Different(f"line {line} is off by {off:.4f} mm")
            turned += _turned(second, own, circle) if circle else 0.0
            if np.abs(second.end[d - 1] - end).max() <= PATH_MM and turned >= 0.5 * wanted:
                break
    if waiting:
        raise Different(f"there is more behind line {first.line_of(first.steps - 1)}")


def same_feeds(path: Foreseen, second: Program, without: Iterable[int] = ()) -> None:
    """Raises Different where a feed move of a Program does not have the F of a Foreseen that makes the same moves.
    without: numbers of lines whose F means nothing, as for G33."""
    wanted, found = path.feed.astype(float), second.feed
    counts = (path.kind != RAPID) & ~np.isnan(wanted) & ~np.isin(path.line, list(without))
    off = counts & ((found > wanted * (1 + FEED_SHARE) + FEED_ABOVE) | (found < wanted * (1 - FEED_SHARE) - FEED_BELOW))
    if off.any():
        k = int(off.argmax())
        raise Different(f"a move of line {path.line[k]} has F {found[k]:.5g} mm/min instead of {wanted[k]:.5g}")


def _turned(program: Program, step: int, circle: Circle) -> float:
    """Angle (rad) of a step about the centre of a circle."""
    a, b = int(program.first[step]), int(program.first[step + 1])
    points = np.concatenate((program.start(a)[None], program.end[a:b]))
    u, v = {1: (0, 1), 2: (1, 2), 3: (2, 0)}[circle.plane]
    angle = np.unwrap(np.arctan2(points[:, v] - circle.centre[v], points[:, u] - circle.centre[u]))
    return abs(float(angle[-1] - angle[0]))


def simulated(
    program: Program, geometry: dict[int, ToolGeometry], cell: float
) -> list[tuple[HeightMap, list[tuple[float, int, float]]]]:
    """[(height map after each stock, [(deepest traverse, its line, holder)])] of a program; kept with it."""
    if cell not in program.simulated:
        program.simulated[cell] = _simulated(program, geometry, cell)
    return program.simulated[cell]


def _simulated(
    program: Program, geometry: dict[int, ToolGeometry], cell: float, wider: float = 0.0
) -> list[tuple[HeightMap, list[tuple[float, int, float]]]]:
    """wider: mm by which the tools are larger all round, their tips where they are."""
    result: list[tuple[HeightMap, list[tuple[float, int, float]]]] = []
    for section, stock in sections.in_stock(program, sections.sections(program, geometry), cell):
        if not result or result[-1][0] is not stock:
            result.append((stock, []))
        a, b = section.first, section.end
        deepest, line, holder = -1.0, 0, 0.0
        shape = _wider(section.tool.shape, wider) if wider else section.tool.shape
        for owner, met in sections.cut_along(stock, shape, program.start(a), program.end[a:b], SEGMENT_MM):
            touch = np.where(program.kind[a:b][owner] == RAPID, met["depth"], 0.0)
            worst = int(touch.argmax())
            if touch[worst] > deepest:
                deepest, line = float(touch[worst]), int(program.line[a + owner[worst]])
            holder = max(holder, float(met["holder"].max()))
        result[-1][1].append((deepest, line, holder))
    return result


def _wider(shape: Shape, by: float) -> Shape:
    return replace(
        shape,
        diameter=shape.diameter + 2 * by,
        corner_radius=shape.corner_radius + by if shape.corner_radius or shape.tip_angle else 0.0,
    )


def line_below(program: Program, place: Sequence[float]) -> int:
    """The line of the feed move whose path in XY is nearest to a place (3,): shifted paths lie above the program's
    own."""
    feeds = np.flatnonzero(program.kind != RAPID)
    begin, end = program.end[np.maximum(feeds - 1, 0), :2], program.end[feeds, :2]
    d, p = end - begin, np.asarray(place[:2])
    length2 = (d * d).sum(axis=1)
    t = np.clip(((p - begin) * d).sum(axis=1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    off = np.hypot(*(begin + t[:, None] * d - p).T)
    return int(program.line[feeds[int(np.argmax(off <= off.min() + PATH_MM))]])


def same_stock(first: Program, second: Program, geometry: dict[int, ToolGeometry], cell: float) -> float:
    """Raises Different where the second program breaks a rule; -> worst holder contact (mm) that the first has not."""
    if np.abs(first.end[-1] - second.end[-1]).max() > PATH_MM:
        raise Different("the new program ends at another place")
    one, two, holder = simulated(first, geometry, cell), simulated(second, geometry, cell), 0.0
    for number, ((stock, before), (other, after)) in enumerate(zip(one, two, strict=True)):
        for own, new in zip(before, after, strict=True):
            if new[0] > (own[0] + cell if own[0] > OVER_MM else OVER_MM):
                raise Different(f"a traverse in line {new[1]} of the new program meets {new[0]:.3f} mm of stock")
            holder = max(holder, new[2] - own[2])
        lefts = []
        for own_stock, program in ((stock, first), (other, second)):
            wider = functools.partial(_simulated, program, geometry, cell, SIDE_MM)
            lefts.append(_Left(own_stock.height, wider, number))
        _same_heights(lefts[0], lefts[1], HEIGHT_CELLS * cell)
    return holder


@dataclass(frozen=True)
class _Left:
    """What a program leaves: height (ny, nx) mm; simulated: () -> what it leaves of each stock with tools SIDE_MM
    larger all round; number: of the stock."""

    height: np.ndarray
    simulated: Callable[[], list[tuple[HeightMap, list[tuple[float, int, float]]]]]
    number: int

    def wider(self) -> np.ndarray:
        """The height that larger tools leave."""
        return self.simulated()[self.number][0].height


def _same_heights(first: _Left, second: _Left, slack: float) -> None:
    """Raises Different where what two programs leave is not the same within a cell and `slack` (mm).

    On a steep side, SIDE_MM sideways are more than that in height, and a cell at the edge of the stock has no higher
    neighbour.  So heights that differ are compared again, after the program that has left more was simulated with wider
    tools.
    """
    low, high = sections.filtered(first.height, np.minimum), sections.filtered(first.height, np.maximum)
    if (second.height < low - slack).any() and (
        second.height < sections.filtered(first.wider(), np.minimum) - slack
    ).any():
        raise Different(f"the new program cuts {float((low - second.height).max()):.3f} mm more somewhere")
    if (second.height > high + slack).any() and (second.wider() > high + slack).any():
        raise Different(f"the new program leaves {float((second.height - high).max()):.3f} mm more somewhere")
