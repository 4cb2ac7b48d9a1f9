# SPDX-License-Identifier: GPL-2.0-or-later
"""Climb cuts stay climb cuts in a mirrored pattern: closed level chains are run backwards.  Pure; mm.

Called by cycles/pattern.py with what the sub does, before the isometry.  A mirror turns the hand of a path over, the
reversal turns it back; the places where the tool has been are the same, so what it leaves is the same.

 1. A chain is a run of cutting moves of the sub itself at one height.  Traverses, straight plunges, cuts that change Z,
    moves of a cycle and codes end it.
 2. It is reversed whole, lead-in and lead-out too, if it ends where it begins, within the setting CLOSE_GAP, and has
    one feed: it is entered and left at the same place then, and its entry is as slow as it was.
 3. Every other cut across is left as it is, and named: threads and cuts that turn an axis too.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from chipwise.pattern.recorded import ARC, FEED, RAPID, THREAD, Code, Recorded, Step

SAME_MM = 1e-6  # shorter is nothing: rounding of the interpreter in inches
SAME_FEED = 1e-6  # relative
OPEN, SLOPING, FEEDS, TURNS, SYNCHRONISED = (
    "open",
    "changes Z",
    "two feeds",
    "turns an axis",
    "in step with the spindle",
)
_LEVEL, _SLOPE, _TURN, _SYNC, _END = range(5)


@dataclass(frozen=True)
class Left:
    """Cuts that are not reversed: their first and last line in the file of the sub, and why."""

    first: int
    last: int
    reason: str


def reversed_chains(recorded: Recorded, points, start, close_gap: float):
    """(Recorded, [Left]): its closed chains reversed, and what could not be.

    points: of recorded, or what takes their place (k, 3); start: (x, y, z) before them; close_gap: mm.
    """
    placed = _placed(recorded, points)
    steps: list = []
    left: list[Left] = []
    here = np.array(start, float)
    for kind, group in _groups(placed, here, bool(recorded.turns)):
        chain, end = placed[group], _end_of(placed[group], here)
        reason = _reason(kind, chain, here, end, close_gap)
        if reason is None:
            chain = _backwards(chain, here, end)
        elif reason:
            found = Left(_line(chain[0]), _line(chain[-1]), reason)
            left += [] if found in left else [found]
        steps += chain
        here = end
    return replace(recorded, steps=tuple(steps)), left


def _placed(recorded, points):
    """The steps with their ends and centres in points."""
    found, at = [], 0
    rows = list(map(tuple, np.asarray(points, float).tolist()))
    for step in recorded.steps:
        if isinstance(step, Code):
            found.append(step)
        elif step.kind == ARC:
            found.append(replace(step, end=rows[at], centre=rows[at + 1]))
            at += 2
        else:
            found.append(replace(step, end=rows[at]))
            at += 1
    return found


def _groups(steps, here, turning):
    """(kind, slice) of the longest runs of one kind; _END has one step each."""
    first, kind_before = 0, _END
    for k, step in enumerate(steps):
        kind = _kind(step, here, turning)
        if k > first and (kind != kind_before or kind == _END):
            yield kind_before, slice(first, k)
            first = k
        kind_before, here = kind, _end_of([step], here)
    if steps:
        yield kind_before, slice(first, len(steps))


def _kind(step, here, turning):
    """Principle 1, of a step that begins here; turning: whether the sub turns an axis."""
    if isinstance(step, Step) and step.kind == THREAD:
        return _SYNC if math.dist(step.end[:2], here[:2]) > SAME_MM else _END
    if isinstance(step, Code) or step.kind == RAPID or not step.own:
        return _END
    if turning:
        return _TURN
    rises = abs(step.end[2] - here[2]) > SAME_MM
    if step.kind == FEED:
        across = math.dist(step.end[:2], here[:2]) > SAME_MM
        return (_SLOPE if across else _END) if rises else _LEVEL
    return _SLOPE if rises or step.axis != 2 else _LEVEL


def _reason(kind, chain, here, end, close_gap):
    """Why a group stays as it is: "" if there is nothing to say of it, None if it is to be reversed."""
    if kind == _END:
        return ""
    if kind == _SLOPE:
        return SLOPING
    if kind in (_TURN, _SYNC):
        return TURNS if kind == _TURN else SYNCHRONISED
    if math.dist(here[:2], end[:2]) > max(close_gap, SAME_MM):
        return OPEN
    feeds = [step.feed for step in chain]
    return FEEDS if max(feeds) - min(feeds) > SAME_FEED * max(feeds) else None


def _line(step):
    """Line of a cut in the file of the sub; a thread has only that of the file it is read from."""
    return step.own or step.source


def _end_of(steps, here):
    """Where the tool is after steps."""
    return next((np.array(step.end) for step in reversed(steps) if isinstance(step, Step)), here)


def _backwards(chain, here, end):
    """A chain from here back to here, then to its end; between the two there is at most the gap."""
    begins = [tuple(here.tolist()), *(step.end for step in chain[:-1])]
    found = [replace(step, end=begin, turns=-step.turns) for step, begin in zip(reversed(chain), reversed(begins))]
    if math.dist(here, end) <= SAME_MM:
        return found[:-1] + [replace(found[-1], end=tuple(end.tolist()))]
    close = Step(FEED, chain[-1].line, tuple(end.tolist()), chain[-1].feed, own=chain[-1].own)
    return [close, *found, close]
