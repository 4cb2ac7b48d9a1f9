# SPDX-License-Identifier: GPL-2.0-or-later
"""How long a plan takes on the machine, s: each move from rest to rest, as exact path (G61) has it.  Called by
g26_plan.py, read_part.py and cli/turn.py.

Tool changes, the start of the spindle and the planning are not included, and are named apart."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from chipwise.turning.blocks import Block, blocks, controlled, feed_of, speed_at
from chipwise.turning.plan import Plan, lengths
from chipwise.turning.profile_function import Place
from chipwise.turning.request import Request
from chipwise.turning.state import Step

STILL_MM = 1e-9


@dataclass(frozen=True)
class Motion:
    """Limits of (Z, X), mm/s and mm/s2, and those of the path."""

    velocity: tuple[float, float] = (100.0, 100.0)
    acceleration: tuple[float, float] = (math.inf, math.inf)
    path_velocity: float = math.inf
    path_acceleration: float = math.inf

    def along(self, dz: float, dx: float) -> tuple[float, float]:
        """(mm/s, mm/s2) that a straight move in this direction may have."""
        length = math.hypot(dz, dx)
        shares = [abs(d) / length for d in (dz, dx)]

        def least(limits: tuple[float, float], path: float) -> float:
            return min([path, *(limit / share for limit, share in zip(limits, shares) if share > STILL_MM)])

        return least(self.velocity, self.path_velocity), least(self.acceleration, self.path_acceleration)

    def rapid(self, dz: float, dx: float) -> float:
        """s of a rapid."""
        return 0.0 if math.hypot(dz, dx) <= STILL_MM else _from_rest_to_rest(math.hypot(dz, dx), *self.along(dz, dx))


def _from_rest_to_rest(length: float, velocity: float, acceleration: float) -> float:
    """s of a move that begins and ends at rest."""
    if length * acceleration > velocity**2:
        return length / velocity + velocity / acceleration
    return 2 * math.sqrt(length / acceleration)


def seconds(step: Step, request: Request, motion: Motion) -> float:
    """s of a step's moves."""
    total, (z, x) = 0.0, step.start
    steady = not request.per_rev or bool(step.speed or step.used_tool.point_angle) or not request.css
    feed, speed = feed_of(step, request), speed_at(step, request, 0.0) if steady and request.per_rev else 1.0
    for (kind, length), move in zip(lengths(step), step.moves):
        dz, dx = move.z - z, move.x - x
        if kind == "rapid":
            total += motion.rapid(dz, dx)
        elif kind == "thread":
            total += 60.0 / step.speed * (length / move.pitch + 0.5)  # on average it waits half a turn for the index
        elif length > STILL_MM:
            velocity, acceleration = (
                motion.along(dz, dx) if kind == "feed" else (motion.path_velocity, min(motion.acceleration))
            )
            turns = speed if steady else speed_at(step, request, 0.5 * (abs(x) + abs(move.x)))
            total += _from_rest_to_rest(length, min(feed * turns / 60.0, velocity), acceleration)
        z, x = move.z, move.x
    return total


@dataclass(frozen=True)
class Times:
    """steps: s of every Step, 0 of one that is not needed; changes: of the tool; travel: s of the rapids between the
    place of the tool change and the work, and from step to step, None if nobody knows that place."""

    steps: tuple[float, ...]
    changes: int
    travel: float | None

    @property
    def total(self) -> float:
        return sum(self.steps) + (self.travel or 0.0)


def times(plan: Plan, request: Request, motion: Motion, home: Place | None = None) -> Times:
    """Times of a plan.  home: (z, x) mm of the controlled point where tools are changed, None where that is not
    known."""
    made = list(blocks(plan, request)) if request.speed or not request.per_rev else []
    return Times(
        tuple(seconds(s, request, motion) if s.needed else 0.0 for s in plan.steps),
        sum(block.change for block in made),
        _travel(plan, made, motion, home) if home else None,
    )


def _travel(plan: Plan, made: Iterable[Block], motion: Motion, home: Place) -> float:
    """s of the rapids between home and the work, and from step to step."""
    travel, at = 0.0, home
    for block in made:
        step = plan.steps[block.number - 1]
        first, last = (controlled(step, *place) for place in (step.start, (step.moves[-1].z, step.moves[-1].x)))
        at = home if block.change else at
        travel += motion.rapid(first[0] - at[0], 0.0) + motion.rapid(0.0, first[1] - at[1])
        if block.back:
            travel += motion.rapid(home[0] - last[0], 0.0) + motion.rapid(0.0, home[1] - last[1])
        at = last
    return travel
