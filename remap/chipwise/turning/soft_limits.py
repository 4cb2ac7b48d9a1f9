# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether the machine's soft limits let a plan be carried out: every point of every step, before anything moves.
Called by g26_plan.py.

LinuxCNC checks the end of each move when it is queued, and not where an arc bulges: it would stop in the cut.  An axis
is at the controlled point plus the work offset plus the tool's offset of G43, which is that of the tool table.  Lengths
mm, X a radius.
"""

from collections.abc import Iterable, Iterator, Sequence

from chipwise.errors import CycleError
from chipwise.pattern.isometry import arc_extremes
from chipwise.turning.blocks import controlled
from chipwise.turning.profile_function import Place
from chipwise.turning.state import Step

Limit = tuple[str, float, float]  # (name of an axis, lowest, highest mm)

SLACK_MM = 1e-6  # lines are rounded to this
_Y = 1  # the axis of an arc in G18
_PLANE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


def check(steps: Iterable[tuple[int, Step]], limits: Sequence[Limit], zero: Place, offsets: dict[int, Place]) -> None:
    """Raise CycleError for the first point of a step that is beyond a limit.

    steps    ((number, Step), ..) that are carried out
    limits   ((name, low, high), ..) of Z and of X, machine coordinates
    zero     (z, x) of the work coordinates, machine coordinates of the tool's tip
    offsets  {tool number: (z, x)}
    """
    for number, step in steps:
        shift = [a + b for a, b in zip(zero, offsets[step.used_tool.number])]
        for point in _points(step):
            for (name, low, high), value, more in zip(limits, controlled(step, *point), shift):
                if not low - SLACK_MM <= value + more <= high + SLACK_MM:
                    raise CycleError(
                        f"step {number}, {step.name}: {name} would be at {{value}} with T{step.used_tool.number}, "
                        f"beyond its limit of {{limit}}",
                        "move the work, or correct the work offset or the tool's offset",
                        value=value + more,
                        limit=low if value + more < low else high,
                    )


def _points(step: Step) -> Iterator[Place]:
    """(z, x) of the nose's centre where a coordinate may be largest or smallest."""
    at = step.start
    yield at
    for move in step.moves:
        if move.kind == "arc":
            start, end, centre = ((x, 0.0, z) for z, x in (at, (move.z, move.x), move.centre))
            yield from (
                (z, x) for x, _, z in arc_extremes(start, end, centre, _Y, 1 if move.ccw else -1, _PLANE).tolist()
            )
        at = move.z, move.x
        yield at
