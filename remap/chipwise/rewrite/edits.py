# SPDX-License-Identifier: GPL-2.0-or-later
"""What takes the place of a program's steps: made by flute.py and feed.py, written by text.py.

Lengths mm, machine coordinates of the tool's tip; feeds mm/min.
"""

from dataclasses import dataclass, field
from typing import Optional

from chipwise.check.records import ARC, RAPID
from chipwise.rewrite.program import Circle


@dataclass(frozen=True)
class Move:
    """A move to be written: kind RAPID, FEED or ARC; end (3,) mm; circle of an ARC; feed, None: the one in force."""

    kind: int
    end: tuple
    feed: Optional[float] = None
    circle: Optional[Circle] = None


@dataclass
class Edits:
    """By number of step: `instead` the Moves in its place, `after` those behind it, `feeds` a feed in its line's text; and
    `notes`, said in a comment before the first of them."""

    instead: dict = field(default_factory=dict)
    after: dict = field(default_factory=dict)
    feeds: dict = field(default_factory=dict)
    notes: dict = field(default_factory=dict)

    def changed(self):
        """Numbers of the steps that change."""
        return {*self.instead, *self.after, *self.feeds}

    def __bool__(self):
        return bool(self.instead or self.after or self.feeds)


def original(program, step):
    """A step of a program as a Move."""
    last = int(program.first[step + 1]) - 1
    kind = program.kind_of(step)
    circle = program.circles[program.circle[step]] if kind == ARC else None
    return Move(kind, tuple(program.end[last].tolist()), None if kind == RAPID else float(program.feed[last]), circle)
