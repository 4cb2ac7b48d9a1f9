# SPDX-License-Identifier: GPL-2.0-or-later
"""What every cycle returns: its moves, notes for the operator and figures for the report.

Made by hole.py, contour.py and pocket.py; read by planner/plans.py, which turns the notes into messages.
"""

from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, NamedTuple, Optional, Union

from chipwise.moves import Copy, Move


class Note(NamedTuple):
    """What the operator should know: a text with {names} of lengths, and the lengths in mm."""

    text: str
    lengths: Mapping[str, Any]


class Report(NamedTuple):
    """What a cycle did, for report.record(): "hole", "contour" or "pocket", and its figures."""

    kind: str
    figures: Mapping[str, object]


@dataclass(frozen=True)
class CyclePlan:
    """A planned cycle.

    moves    of moves.py, in order; Copies only in a pattern
    notes    for the operator
    report   makes the Report when it is wanted; None: there is nothing to report.  A function, because measuring the
             largest of very many pieces takes longer than the rest of the plan.
    """

    moves: tuple[Union[Move, Copy], ...]
    notes: tuple[Note, ...] = ()
    report: Optional[Callable[[], Report]] = field(default=None, compare=False)
