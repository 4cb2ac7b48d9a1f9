# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the new program back: it has to make the same moves from the place on, with the same tools, in the same modes,
and its head may not touch stock.

Called by run.py before anything is written.
"""

import math
import os

import numpy as np

from chipwise.program import records
from chipwise.program.reader import Unreadable
from chipwise.program.executed_words import STATES
from chipwise.host.temp_folder import OwnFolder, put
from chipwise.resume.state import Checks
from chipwise.rewrite.program import read
from chipwise.rewrite.read_back import Different, real_steps
from chipwise.rewrite.marked_reader import FEED, ITEM, LINE_NUMBER, WHAT, Followed
from chipwise.resume import clamps, walk
from chipwise.clib.core import Cutter, Tool

SAME_MM = 1e-4
FEED_SHARE = 1e-4
MODES = (
    170,
    180,
    190,
    200,
    210,
    900,
    910,
    901,
    911,
    610,
    611,
    640,
    400,
    410,
    420,
    430,
    490,
    980,
    990,
    *range(540, 594),
)


def compare(job, found, state, data, head, stock):
    """Raises Different, Unreadable.  data: bytes of the new program; head: number of its lines before the rest."""
    with OwnFolder("resume") as folder:
        path = put(folder, os.path.basename(job.file), data)
        try:
            new = read(path, job.machine, **job.limits)
            marked = Followed(new, job.machine, None, None, Checks(head, len(new.source)), job.limits)
        except Unreadable as error:
            raise Different(f"the new program cannot be read ({error})") from error
    first = _same_moves(found, new)
    _same_events(found, new, first)
    _same_state(state, marked.program, head)
    _clear(job, new, first, stock, found)
    clamps.keep_away(
        job,
        state.clamps,
        new,
        max(new.known_from, new.lead.named_from, 1),
        int(new.first[first]) if first < new.steps else len(new.kind),
        found.own_line,
    )


def _steps_left(found):
    """[numbers of the steps of the old program that are left]."""
    program = found.followed.program
    return [s for s in real_steps(program) if s >= found.step]


def _same_moves(found, new):
    """Raises Different where the rest does not move alike; -> the number of its first step."""
    old, left, own = found.followed.program, _steps_left(found), real_steps(new)
    begin = found.approach.place
    if left:
        last = old.end[int(old.first[left[0] + 1]) - 1]
        if np.abs(last - begin).max() <= 1e-4 and old.circle[left[0]] < 0:
            left = left[1:]  # nothing of it is left
    if len(own) <= len(left):
        raise Different(f"it has {len(own)} moves, {len(left)} are left")
    rest = own[len(own) - len(left) :]
    at = new.start(int(new.first[rest[0]])) if rest else new.end[-1]
    if np.abs(at - begin).max() > SAME_MM:
        raise Different("it does not begin where the program goes on")
    for k, (a, b) in enumerate(zip(left, rest)):
        line, i, j = old.line_of(a), int(old.first[a + 1]) - 1, int(new.first[b + 1]) - 1
        if old.kind[i] != new.kind[j] or np.abs(old.end[i] - new.end[j]).max() > SAME_MM:
            raise Different(f"line {line} has become another move")
        if old.kind[i] != records.RAPID and abs(old.feed[i] - new.feed[j]) > FEED_SHARE * old.feed[i]:
            raise Different(f"line {line} has become another feed")
        if old.circle[a] >= 0:
            c, d = old.circles[old.circle[a]], new.circles[new.circle[b]]
            if (
                c.plane != d.plane
                or _centres_apart(c, d) > 10 * SAME_MM
                or math.copysign(1, c.turns) != math.copysign(1, d.turns)
                or k
                and c.turns != d.turns
            ):
                raise Different(f"line {line} has become another arc")
            if k == 0 and not _same_rest(old, new, a, b, begin):
                raise Different(f"line {line} has become another arc")
    return rest[0] if rest else new.steps


def _centres_apart(one, two):
    """mm between the centres of two Circles in their plane."""
    return math.dist(*([circle.centre[k] for k in ((0, 1), (1, 2), (0, 2))[one.plane - 1]] for circle in (one, two)))


def _same_rest(old, new, a, b, begin):
    """Whether an arc is as long as what is left of another."""
    first, end = int(old.first[a]), int(old.first[a + 1])
    points = np.concatenate((old.start(first)[None], old.end[first:end]))
    k = int(np.argmin(np.abs(points - begin).max(axis=1)[:-1]))
    own = np.concatenate((begin[None], new.end[int(new.first[b]) : int(new.first[b + 1])]))
    sizes = [np.sqrt((np.diff(p, axis=0) ** 2).sum(axis=1)).sum() for p in (points[k:], own)]
    return abs(sizes[0] - sizes[1]) < 1e-3 * max(sizes) + 0.01


def _same_events(found, new, first):
    """Raises Different where tools, stocks or M251 are others behind the place."""
    old = found.followed.program
    left = _steps_left(found)
    sides = []
    for program, step, own in ((old, found.step, left), (new, first, [s for s in real_steps(new) if s >= first])):
        at = int(program.first[step]) if step < program.steps else len(program.kind)
        starts = program.first[own] if own else np.zeros(0, int)
        sides.append(
            [
                (len(own) - int(np.searchsorted(starts, event.at)), event.kind, np.round(event.values, 5).tolist())
                for event in program.events
                if event.at > at and event.kind != records.DWELL
            ]
        )
    if sides[0] != sides[1]:
        raise Different("tools, stocks or M251 have become others")


def _same_state(state, program, head):
    """Raises Different where other modes are in force when the rest begins."""
    found = np.flatnonzero((program.marks[:, WHAT] == STATES) & (program.marks[:, LINE_NUMBER] == head))
    if len(found) != 1:
        raise Different("its head does not end")
    item = program.items[int(program.marks[found[0], ITEM])]
    active = item["active"]
    for what, one, two in (
        ("modes", [g for g in state.g if g in MODES], [g for g in active["g"] if g in MODES]),
        (
            "spindle and coolant",
            [m for m in state.m if m in (3, 4, 5, 7, 8, 9, 49)],
            [m for m in active["m"] if m in (3, 4, 5, 7, 8, 9, 49)],
        ),
    ):
        if sorted(one) != sorted(two):
            raise Different(f"other {what} are in force: {sorted(two)} instead of {sorted(one)}")
    feed = float(program.marks[found[0], FEED])
    if abs(state.feed - feed) > FEED_SHARE * state.feed and state.feed > 0:
        raise Different(f"F is {feed:g} instead of {state.feed:g} mm/min")
    for k, name in enumerate(("S", "P of G64", "Q of G64"), 1):
        if abs(state.settings[k] - active["settings"][k]) > 1e-4 * max(1.0, abs(state.settings[k])) and not (
            k > 1 and 640 not in state.g
        ):
            raise Different(f"{name} is {active['settings'][k]:g} instead of {state.settings[k]:g}")
    for name, value in state.parameters.items():
        if abs(item["parameters"].get(name, 0.0) - value) > 1e-9 * max(1.0, abs(value)):
            raise Different(f"#{name} is {item['parameters'].get(name)} instead of {value}")


def _clear(job, new, first, stock, found):
    """Raises Unreadable where the head's moves meet stock."""
    index, tools = walk.tools_by_move(new, job.geometry)
    cells = np.array(stock.cells_and_ring)
    end = int(new.first[first]) if first < new.steps else len(new.kind)
    lead = max(new.known_from, new.lead.named_from, 1)
    try:
        for move in range(lead, end):
            _number, _diameter, tool, shape = tools[int(index[move])]
            start, to = new.start(move), new.end[move]
            if tool is None or np.abs(to - start).max() < 1e-9:
                continue
            if new.kind[move] == records.RAPID:
                wide = Tool(
                    shape.diameter + 2 * job.settings["TRAVERSE_CLEARANCE"],
                    min(shape.corner_radius, shape.diameter / 2),
                    shape.tip_angle,
                )
                met, most = Cutter(stock, wide, start).to(to), 1e-6
            else:
                met, most = (
                    Cutter(stock, tool, start).to(to),
                    max(1.0, 0.02 * math.pi * shape.diameter**2 / 4 * abs(start[2] - to[2])),
                )
            if met > most:
                raise Unreadable(
                    f"the approach to the place would meet {met:.3g} mm3 of stock",
                    "say where to go on with --line N",
                    found.own_line,
                )
    finally:
        stock.cells_and_ring[:] = cells
