# SPDX-License-Identifier: GPL-2.0-or-later
"""How LinuxCNC's planner joins the moves of a path: speed at each joint, and the share of the acceleration that is left
to each move.

Called by times.py.  Source: tp.c and blendmath.c of LinuxCNC 2.9 (tpSetupTangent, tpChooseBestBlend,
tpComputeBlendVelocity, blendComputeParameters).

 1. Between G0 and a feed, at a turn back, at each joint of G61.1 and at each one of G61 that is not tangent, and where
    nothing follows, the path stops.  Under G64 a move that nothing follows has half the acceleration (times.py).
 2. Two moves that are nearly tangent pass at full speed; the faster they are asked to be, the more nearly tangent.
 3. Else the fastest of three: a slow corner, an arc between them, or a parabola, counted half, because it halves the
    acceleration of both moves.

Departs from the source: arcs of a helix have no arc blends, those of the others are as short as between lines.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chipwise.program import records

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats
    from chipwise.check.path_part import PathPart

PERIOD_S = 0.001  # servo period
# share of the acceleration that a corner may take which is passed as if it were tangent: tp.c, ratio of tangents
SLIGHT = 0.1
ALONG_ARC, CENTRIPETAL = 0.5, 0.75**0.5  # BLEND_ACC_RATIO_TANGENTIAL, BLEND_ACC_RATIO_NORMAL
PARABOLIC = 0.5  # share of the acceleration of moves that blend parabolically
BACK = np.cos(np.radians(178.0))  # cosine of a turn back
STRAIGHT = 1e-12  # 1 - cosine between chords of one direction
FLAT = 1e-5  # a direction in a plane
LEAST = 1e-9


@dataclass
class Moves:
    """Whole moves, (n,) or (n, 3); mm, mm/s, mm/s2: start and end tangents, inward: unit vector to an arc's centre at
    its start, radius (inf: straight), speed: as asked for, accel: along it, begins: index of the first segment of each,
    whole: number of the move of each segment."""

    kind: np.ndarray
    start: np.ndarray
    end: np.ndarray
    inward: np.ndarray
    radius: np.ndarray
    length: np.ndarray
    speed: np.ndarray
    accel: np.ndarray
    begins: np.ndarray
    whole: np.ndarray


def moves(part: PathPart, speed: Floats, accel: Floats) -> Moves:
    """Moves of the segments of a PathPart; speed, accel (n,): as asked for, along it."""
    kinds, direction = part.kinds, part.direction
    before = (direction[1:] * direction[:-1]).sum(axis=1)
    bend = np.concatenate(([True], 1.0 - before > STRAIGHT))
    arc = kinds == records.ARC
    begins = np.concatenate(([True], (np.diff(kinds) != 0) | (np.diff(part.lines) != 0))) | (
        bend & np.where(arc, part.first > 0, True)
    )
    at = np.flatnonzero(begins)
    last = np.append(at[1:], len(kinds)) - 1
    whole = np.cumsum(begins) - 1
    bends = np.flatnonzero(bend)
    later = np.append(bends, len(kinds))[np.searchsorted(bends, at, side="right")]
    earlier = bends[np.searchsorted(bends, last, side="right") - 1] - 1
    curved = arc[at] & (later <= last)
    other, sooner = direction[np.where(curved, later, at)], direction[np.where(curved, np.maximum(earlier, 0), last)]
    start, end = _unit(1.5 * direction[at] - 0.5 * other), _unit(1.5 * direction[last] - 0.5 * sooner)
    turn = np.linalg.norm(other - direction[at], axis=1)
    through = np.concatenate(([0.0], np.cumsum(part.length)))
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.where(curved, (through[np.where(curved, later, at + 1)] - through[at]) / turn, np.inf)
    along = np.bincount(whole, part.length)
    centripetal = np.sqrt(CENTRIPETAL * np.minimum(accel[at], 1e9) * np.minimum(radius, 1e9))
    return Moves(
        kinds[at],
        start,
        end,
        _unit(other - direction[at]),
        radius,
        along,
        np.minimum(speed[at], centripetal),
        accel[at],
        at,
        whole,
    )


def _unit(vectors: Floats) -> Floats:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(size, LEAST)


def joined(a: Moves, bounds: Floats, tolerance: float, override: float) -> tuple[Floats, Floats, Floats]:
    """(speed at the end of each move but the last, mm/s; s that a parabola saves there; share of the acceleration of
    each move) of Moves.

    bounds (3,): mm/s2 of the axes; tolerance: mm, of a PATH record; override: the largest feed override."""
    n = len(a.kind) - 1
    shares = np.where(a.kind == records.ARC, ALONG_ARC, 1.0)
    if n < 1:
        return np.zeros(0), np.zeros(0), shares
    rapid, arc = a.kind == records.RAPID, a.kind == records.ARC
    cosine = np.clip((a.end[:-1] * a.start[1:]).sum(axis=1), -1.0, 1.0)
    stop = (rapid[1:] != rapid[:-1]) | (cosine < BACK) | (tolerance == records.EXACT_STOP)
    most = np.minimum(a.speed[:-1], a.speed[1:]) * np.where(rapid[1:], 1.0, override)
    change = np.abs(a.start[1:] - a.end[:-1]) * (most / PERIOD_S + a.accel[1:])[:, None]
    scale = np.maximum((change / bounds).max(axis=1) / np.where(arc[1:] | arc[:-1], ALONG_ARC, 1.0), LEAST)
    tangent = scale < SLIGHT
    speed, slowed = np.where(tangent, most, most * SLIGHT / scale), np.minimum(scale, SLIGHT)
    stop |= (tolerance == records.EXACT_PATH) & ~tangent
    this, net = _parabola(a, max(tolerance, 0.0), shares)
    round_speed = _arc_speed(a, cosine, max(tolerance, 0.0), most)
    rounded = ~tangent & (round_speed >= np.maximum(speed, 0.5 * net))
    parabola = ~tangent & ~rounded & (0.5 * net >= speed) & ~stop
    speed = np.where(rounded, round_speed, speed)
    slowed = np.where(rounded | parabola | stop, 0.0, slowed)
    saved = np.where(parabola, this / (PARABOLIC * shares * a.accel)[:-1], 0.0)
    parts = np.minimum(np.where(parabola, PARABOLIC, 1.0), 1.0 - slowed)
    around = np.minimum(np.append(parts, 1.0), np.append(1.0, parts))
    return np.where(stop | parabola, 0.0, speed), saved, shares * around


def _parabola(a: Moves, tolerance: float, shares: Floats) -> tuple[Floats, Floats]:
    """(speed of the move before where a parabola begins, mean speed along it), mm/s."""
    accel = PARABOLIC * shares * a.accel
    reach = np.maximum(np.minimum(a.speed, np.sqrt(accel * a.length / 2.0)), LEAST)
    time = np.minimum(
        np.minimum((a.length / reach)[:-1], (a.length / reach)[1:]),
        np.maximum((reach / accel)[:-1], (reach / accel)[1:]),
    )
    this, following = np.minimum(reach[:-1], time * accel[:-1]), np.minimum(reach[1:], time * accel[1:])
    pull = _unit(a.start * a.accel[:, None] + a.inward * ((0.5 * a.speed) ** 2 / a.radius)[:, None])
    half = np.sqrt(np.clip((1.0 + (a.end[:-1] * pull[1:]).sum(axis=1)) / 2.0, 0.0, 1.0))
    if tolerance:
        limit = 2.0 * np.sqrt(accel[:-1] * tolerance / np.maximum(np.sqrt(1.0 - half**2), LEAST))
        this, following = np.minimum(this, limit), np.minimum(following, limit)
    return this, half * (this + following) / 2.0


def _arc_speed(a: Moves, cosine: Floats, tolerance: float, most: Floats) -> Floats:
    """mm/s on the arc that blends two moves, 0 without such an arc."""
    half, side = np.sqrt((1.0 + cosine) / 2.0), np.sqrt(np.maximum((1.0 - cosine) / 2.0, LEAST**2))
    short = np.minimum(a.length[:-1], a.length[1:]) / 2.0
    room = np.where(tolerance > 0.0, tolerance, short / 2.0)
    distance = np.minimum(short, side * room / np.maximum(1.0 - half, LEAST))
    speed = np.minimum(np.sqrt(CENTRIPETAL * np.minimum(a.accel[:-1], a.accel[1:]) * distance * half / side), most)
    helix = (a.kind == records.ARC) & (np.abs(a.start).min(axis=1) > FLAT) & (np.abs(a.inward).min(axis=1) < FLAT)
    return np.where(helix[1:] | helix[:-1], 0.0, speed)
