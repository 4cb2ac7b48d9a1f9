# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs with calls, loops and conditions: those that hold a move that has to change are written out first.

Called by run.py.

 1. Read the program with marks (marked_reader.py), find what has to change, and the outermost blocks that it is in.
 2. Write these blocks out (unroll.py), and read the new program with marks.  It has to make the same moves at the same
    feeds, with the same tools and stocks, and behind each block the same parameters and modes hold.
 3. Until nothing that has to change is in a block: which moves these are, the last digit may decide.
"""

from __future__ import annotations

import dataclasses
import math
import os
from typing import TYPE_CHECKING, Callable, Iterator, Sequence, TypeVar

import numpy as np

from chipwise.program.reader import Unreadable
from chipwise.program.executed_words import ENDS, LINE, STATES
from chipwise.host.temp_folder import OwnFolder, put
from chipwise.rewrite import read_back
from chipwise.rewrite import kept_codes
from chipwise.rewrite.marked_reader import AT, ITEM, LINE_NUMBER, WHAT, Followed, modes_of
from chipwise.rewrite.unroll import Unroller

if TYPE_CHECKING:
    from chipwise.program.executed_words import MarkItem
    from chipwise.rewrite.blocks import Block
    from chipwise.rewrite.edits import Edits
    from chipwise.rewrite.program import Program, Reads

_Figures = TypeVar("_Figures")  # those of flute.py or feed.py

ROUNDS = 5
SAME = 1e-9  # of parameters
STATE_MM = 0.001  # of the state behind a block: positions, lengths, speeds
FEED_SHARE = 1e-5  # the last digit of F


def has_blocks(program: Program) -> bool:
    """Whether a move's line does not say where in the program it is."""
    return bool(program.blocks.outermost)


def written_out(
    program: Program, found: tuple[Edits, _Figures], edits_of: Callable[[Program], tuple[Edits, _Figures]], reads: Reads
) -> tuple[Followed, tuple[Edits, _Figures]]:
    """-> (Followed program, its (Edits, Figures)): no step that they change is in a block.

    found: (Edits, Figures) of the Program; edits_of: Program -> (Edits, Figures).  Raises Unreadable, Different.
    """
    now, (edits, figures) = Followed(program, reads.machine, reads.stock, limits=reads.limits), found
    for _ in range(ROUNDS):
        blocks = {block for block in map(now.program.block_of, edits.changed()) if block}
        if not blocks:
            return now, (edits, figures)
        try:
            now = _without(now, blocks, reads)
        except Unreadable as error:
            error.line = now.line_of(error.line)
            raise
        edits, figures = edits_of(now.program)
    raise Unreadable(f"calls and loops cannot be written out in {ROUNDS} rounds", "write the program out without them")


def _without(now: Followed, blocks: set[Block], reads: Reads) -> Followed:
    """The Followed program without some Blocks [2]."""
    unroller = Unroller(now)
    data = unroller.write(blocks)
    with OwnFolder("rewrite") as folder:
        path = put(folder, os.path.basename(now.program.path), data)
        try:
            new = reads.program(path)
            after = Followed(new, reads.machine, reads.stock, now, unroller, limits=reads.limits)
        except Unreadable as error:
            raise read_back.Different(f"with its calls and loops written out it cannot be read ({error})") from error
    same_program(now.program, new)
    same_codes(now.program, after.program)
    _same_state(now.program, after.program)
    after.program = dataclasses.replace(after.program, path=now.program.path)
    return after


def same_program(first: Program, second: Program) -> None:
    """Raises Different where two Programs do not make the same moves, one for one, with the same tools, stocks and
    feeds."""
    one, two = (np.array(read_back.real_steps(p), int) for p in (first, second))
    if len(one) != len(two):
        raise read_back.Different(f"it has {len(two)} moves instead of {len(one)}")
    wrong = np.zeros(len(one), bool)
    for values in ("kind", "feed"):
        f, g = (getattr(p, values)[p.first[own]] for p, own in ((first, one), (second, two)))
        wrong |= np.abs(f - g) > FEED_SHARE * np.maximum(np.abs(f), 1.0)
    for at in (lambda p, own: p.end[p.first[own + 1] - 1], lambda p, own: p.end[np.maximum(p.first[own] - 1, 0)]):
        wrong |= np.abs(at(first, one) - at(second, two)).max(axis=1) > read_back.PATH_MM
    for k in np.flatnonzero((first.circle[one] >= 0) & ~wrong).tolist():
        a, b = first.circles[first.circle[one[k]]], second.circles[second.circle[two[k]]]
        wrong[k] = a.plane != b.plane or a.turns != b.turns or math.dist(a.centre, b.centre) > read_back.PATH_MM
    if wrong.any():
        raise read_back.Different(f"line {first.line_of(int(one[wrong.argmax()]))} has become another move")
    events = [
        [
            (int(np.searchsorted(p.first[own], event.at)), event.kind, np.round(event.values, 6).tolist())
            for event in p.events
        ]
        for p, own in ((first, one), (second, two))
    ]
    if events[0] != events[1]:
        raise read_back.Different("tools, stocks or dwells have changed")


def same_codes(first: Program, second: Program) -> None:
    """Raises Different where two Programs that have been read with marks do not run the same codes between the same
    moves."""
    one, two = _codes(first), _codes(second)
    for (line, *a), (_, *b) in zip(one, two):
        if a != b:
            raise read_back.Different(f"what line {line} does besides moving has changed")
    if len(one) != len(two):
        raise read_back.Different(f"{len(two)} lines do something besides moving instead of {len(one)}")


def _codes(program: Program) -> list[tuple[int, int, Sequence[tuple[object, ...]]]]:
    """[(line, moves before it, codes and their values)] of the lines that do something besides moving."""
    steps = program.first[read_back.real_steps(program)]
    result: list[tuple[int, int, Sequence[tuple[object, ...]]]] = []
    for mark in program.marks[(program.marks[:, WHAT] == LINE) & (program.marks[:, ITEM] >= 0)]:
        item, line = program.items[int(mark[ITEM])], int(mark[LINE_NUMBER])
        if "comment" in item:
            continue
        codes: list[tuple[object, ...]]
        try:
            codes = [(letter, round(value, 6)) for letter, value in kept_codes.kept(item, line)[0]]
        except Unreadable:
            codes = [("", sorted(item["g"]), item["m"], item["words"])]  # outside of what is written out
        if codes:
            result.append((line, int(np.searchsorted(steps, mark[AT])), codes))
    return result


def _same_state(first: Program, second: Program) -> None:
    """Raises Different where something else holds behind a block."""
    one, two = (
        {int(mark[LINE_NUMBER]): mark for mark in p.marks if mark[WHAT] == what}
        for p, what in ((first, ENDS), (second, STATES))
    )
    for line, mark in one.items():
        new = two.get(line)
        if new is None:
            raise read_back.Different(f"the block of line {line} is gone")
        for name, a, b, most in _pairs(first.items[int(mark[ITEM])], second.items[int(new[ITEM])]):
            if a is None or b is None or abs(a - b) > most:
                raise read_back.Different(f"behind the block of line {line} {name} is {b} instead of {a}")
        if modes_of(mark)._replace(cycle=0) != modes_of(new)._replace(cycle=0):
            raise read_back.Different(f"behind the block of line {line} other modes are in force")


def _pairs(one: MarkItem, two: MarkItem) -> Iterator[tuple[str, float | None, float | None, float]]:
    """(name, value, value, how much they may differ) of the parameters and the state behind a block."""
    for first, second, most in ((one["parameters"], two["parameters"], SAME), (one["state"], two["state"], STATE_MM)):
        for name in sorted({*first, *second}):
            yield name, first.get(name), second.get(name), most
