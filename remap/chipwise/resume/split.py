# SPDX-License-Identifier: GPL-2.0-or-later
"""The line of a program in which it goes on, and what is left of it.  Called by run.py.

1. If the approach is in a call, a loop or a condition, that block is written out first (rewrite/unroll.py).
2. A straight move goes on at any place, an arc at a vertex of its chords.
3. With cutter compensation it goes on where that begins; a line that does more than move is run again from its
   beginning, or from the approach if that is in its first step and it ends where it would have.
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.geometry.base.arc_sweep import arc_sweep
from chipwise.program.reader import Unreadable
from chipwise.program.records import ARC
from chipwise.resume import descent, walk
from chipwise.resume.place import Place
from chipwise.rewrite import read_back
from chipwise.rewrite import calls
from chipwise.rewrite.edits import Edits, original
from chipwise.rewrite.program import Circle, Reads
from chipwise.rewrite.text import Writer

ROUNDS = 6
_AXES = {1: (0, 1, 2), 2: (1, 2, 0), 3: (2, 0, 1)}  # of a Circle's plane: first, second, along


@dataclass
class Found:
    """followed: the Followed program; step: of it; line: its line; moves: what is left of the step, None: all of the
    line; approach: descent.Approach; own_line: of the user's program."""

    followed: object
    step: int
    line: int
    moves: list
    approach: descent.Approach
    own_line: int


class Split:
    """One Stopped of a Job."""

    def __init__(self, job, stopped):
        self.job, self.followed, self.stopped = job, job.followed, stopped
        self.path, self.at = stopped.path, stopped.at
        self.own_line = int(self.followed.program.line[self.path.move[min(self.at.segment, len(self.path.move) - 1)]])

    def found(self):
        """The Found.  Raises Unreadable, Different."""
        job, backs = self.job, self.stopped.backs
        clearance = job.settings["TRAVERSE_CLEARANCE"]
        for _ in range(ROUNDS):
            program = self.followed.program
            approach = descent.find(self.path, program, self.at, self.stopped.stock, clearance, backs)
            step, fraction = self._step_of(program, approach.at)
            block = program.block_of(step)
            if block:
                self._write_out(block)
                continue
            line = program.place_of(step)
            start = self._start(program, line)
            if start is None:
                return Found(self.followed, step, line, self._rest_of(program, step, fraction), approach, self.own_line)
            if start[0] == step and (fraction == 0 or self._ends_alike(program, line, step)):
                return Found(self.followed, step, line, None, approach, self.own_line)
            self.at, backs = self._place(program, self.path, *start), (0.0,)
        raise Unreadable("calls and loops cannot be written out", "write the program out without them", self.own_line)

    def _step_of(self, program, at):
        """(step, share of its moves that is done) of a Place; the next step where nothing of it is left."""
        segment = at.segment
        move = int(self.path.move[segment])
        step = int(program.step[move])
        first, end = int(program.first[step]), int(program.first[step + 1])
        before = self.path.share_before(segment)
        share = before + at.share * (float(self.path.share[segment]) - before)
        fraction = (move - first + share) / (end - first)
        if fraction > 1 - 1e-9 and step + 1 < program.steps:
            return step + 1, 0.0
        return step, 0.0 if fraction < 1e-9 else fraction

    def _place(self, program, path, step, fraction):
        """The Place of a share of a step."""
        first, end = int(program.first[step]), int(program.first[step + 1])
        moves = fraction * (end - first)
        move = min(first + int(moves), end - 1)
        share = moves - (move - first)
        own = np.flatnonzero(path.move == move)
        if not len(own):
            return Place(0, 0.0)
        k = int(own[min(int(np.searchsorted(path.share[own], share, side="right")), len(own) - 1)])
        before = path.share_before(k)
        return Place(k, (share - before) / (float(path.share[k]) - before))

    def _start(self, program, line):
        """(step, 0) where it has to go on instead [3]; None: the line can be divided."""
        modes = program.modes
        own = steps_of(program, line)
        if 1 <= line <= len(modes) and (
            modes[line - 1].cutter_side != 40 or line > 1 and modes[line - 2].cutter_side != 40
        ):
            first = line
            while first > 1 and modes[first - 2].cutter_side != 40:
                first -= 1
            return int(np.argmax(program.places[program.first[:-1]] >= first)), 0.0
        try:
            edits = Edits()
            edits.instead[own[0]] = [original(program, own[0])]
            _Check(program, edits, None).check(line)
        except Unreadable:
            return own[0], 0.0
        return None

    @staticmethod
    def _ends_alike(program, line, step):
        """Whether a line as it is, begun within its first step, gets to the same end.  The end of a move that enters
        compensation depends on its beginning."""
        modes = program.modes[line - 1]
        return modes.cutter_side == 40 and modes.distance == 90 and program.circle[step] < 0

    def _rest_of(self, program, step, fraction):
        """[Move]: what is left of a step; None where the whole line is."""
        first, end = int(program.first[step]), int(program.first[step + 1])
        if fraction == 0:
            line = program.place_of(step)
            return None if step == 0 or program.place_of(step - 1) != line else [original(program, step)]
        move = original(program, step)
        if move.kind != ARC:
            return [move]
        done = round(fraction * (end - first))
        return [move._replace(circle=self._circle(program, step, done / (end - first)))]

    @staticmethod
    def _circle(program, step, share):
        """The Circle of what is left of an arc."""
        circle, (a, b, along) = (
            program.circles[program.circle[step]],
            _AXES[program.circles[program.circle[step]].plane],
        )
        start, end = program.start(int(program.first[step])), program.end[int(program.first[step + 1]) - 1]
        centre = circle.centre
        sweep = arc_sweep(
            (start[a], start[b], start[along]), (end[a], end[b]), (centre[a], centre[b]), circle.turns, 1.0
        )
        turns = max(1, math.ceil(abs(sweep) * (1 - share) / (2 * math.pi) - 1e-9))
        return Circle(circle.plane, circle.centre, math.copysign(turns, circle.turns))

    def _write_out(self, block):
        """[1]"""
        job, old = self.job, self.followed.program
        step, fraction = self._step_of(old, self.at)
        real = list(read_back.real_steps(old))
        number = int(np.searchsorted(real, step))
        if number >= len(real):
            raise Unreadable("nothing moves behind the stop", "nothing is left to go on with")
        if real[number] != step:
            fraction = 0.0
        self.followed = calls._without(self.followed, {block}, Reads(job.machine, None, job.limits))
        new = self.followed.program
        first = int(self.path.move[0])
        before = int(np.searchsorted(real, old.step[first]))
        fresh = list(read_back.real_steps(new))
        path = walk.path_of(new, job.machine, job.geometry, int(new.first[fresh[min(before, len(fresh) - 1)]]))
        self.at, self.path = self._place(new, path, fresh[number], fraction), path


def steps_of(program, line):
    """[numbers of the steps that a line makes]."""
    return np.flatnonzero(program.places[program.first[:-1]] == line).tolist()


class _Check(Writer):
    """Whether a line can be written out."""

    def check(self, line):
        """Raises Unreadable."""
        self._check(line)
