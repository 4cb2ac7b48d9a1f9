# SPDX-License-Identifier: GPL-2.0-or-later
"""Traverses of a rewritten program that stay too near to stock, whatever the map of the rewriting shows: they become
feed moves.

Called by run.py, after its last repeat.  Lengths mm, machine coordinates of the tool's tip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Sequence

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.program.records import FEED, RAPID
from chipwise.rewrite.depth_proof import SAME_MM
from chipwise.rewrite.edits import Move

if TYPE_CHECKING:
    from chipwise.clib.arrays import Floats, Ints
    from chipwise.rewrite.edits import Edits
    from chipwise.rewrite.program import Program


def feed_traverses(program: Program, edits: Edits, places: Sequence[tuple[float, ...]]) -> None:
    """The traverses of a Program with Edits that end at places (n, 3) become feed moves, at the F of the feed move that
    comes next, else of the one before.  Traverses of the program itself in loops, subs and cycles stay."""
    if not len(places):
        return
    for part in (edits.instead, edits.after):
        table = part.merged()[2]
        own = _ending_at(table.kind, table.end, places)
        table.feed[own] = _feeds(table.kind, table.feed, own, program)
        table.kind[own] = FEED
    kept = _ending_at(program.kind, program.end, places)
    kept = kept[kept >= program.known_from]
    replaced = set(edits.instead.steps.tolist())
    for move, feed in zip(kept.tolist(), _feeds(program.kind, program.feed, kept, program).tolist()):
        step = int(program.step[move])
        if step not in replaced and _is_plain(program, move):
            edits.instead[step] = [Move(FEED, tuple(program.end[move].tolist()), feed)]


def _is_plain(program: Program, move: int) -> bool:
    """Whether a traverse of the program itself can become a feed move where it is written."""
    try:
        program.check_shiftable(move, move + 1)
    except Unreadable:
        return False
    return program.block_of(int(program.step[move])) is None


def _ending_at(kind: Ints, end: Floats, places: Sequence[tuple[float, ...]]) -> Ints:
    """(k,) int: the traverses of moves that end at one of places."""
    rapid = np.flatnonzero(kind == RAPID)
    rapid = rapid[np.argsort(end[rapid, 0], kind="stable")]
    x, found = end[rapid, 0], [np.zeros(0, int)]
    for place in np.unique(places, axis=0):
        near = rapid[x.searchsorted(place[0] - SAME_MM) : x.searchsorted(place[0] + SAME_MM, side="right")]
        found.append(near[(np.abs(end[near] - place) <= SAME_MM).all(axis=1)])
    return np.unique(np.concatenate(found))


def _feeds(kind: Ints, feed: Floats, moves: Ints, program: Program) -> Floats:
    """(k,) mm/min for moves: that of the next feed move, else of the one before, else the program's least."""
    fed = np.flatnonzero((kind != RAPID) & (feed > 0.0))
    if not len(fed):
        return np.full(len(moves), program.feed[(program.kind != RAPID) & (program.feed > 0.0)].min())
    return feed[fed[np.minimum(fed.searchsorted(moves), len(fed) - 1)]]
