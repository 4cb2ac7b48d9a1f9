# SPDX-License-Identifier: GPL-2.0-or-later
"""G75: a sub as a pattern: mirrored, rotated, shifted, repeated.  PatternRequest -> CyclePlan; pure, mm.

Source: the patent abstract on registered patterns: a pattern defined in coordinates of its own is placed by shift and
rotation, and its mirror image likewise.  Departs from it: copies, and what each copy may rest on is checked.

Copy c = 0, 1, ..: mirror about the pattern's origin, rotate by rotation + c turn, shift by (X + c I, Y + c J, Z).  On a
lathe: mirror X or Z, shift by (X + c I, Z + c J).

 1. A copy begins where the one before it has ended.  What the sub does from there is read for the first two copies
    (read_pattern).  A coordinate that both runs have from their start belongs to the start of every copy; all others
    belong to the pattern.  A sub that depends on its start in another way (G91 in its first moves) is read for each
    copy.
 2. If the pattern is mirrored as a whole and climb is to be kept, the sub's own closed chains run backwards
    (pattern/climb.py).
 3. From the second copy on the first move has to be a traverse, and if it goes across, above the cuts of the sub; on a
    lathe, if it goes along, from outside of the box of its cuts.
 4. A rotary axis turns as the sub has it, in the other direction where the isometry turns it over, as that of a
    mirrored part; a pattern that gives the axis another direction is refused.  A thread keeps its hand: refused where Z
    changes its sense.
"""

import math
from dataclasses import dataclass, replace
from typing import Callable, Optional

import numpy as np

from chipwise.cycles.plan import CyclePlan, Note, Report
from chipwise.cycles.reach import Reach
from chipwise.cycles.soft_limits import Travel
from chipwise.errors import CycleError, braceless
from chipwise.moves import CALLERS_PATH, Code, Copy, Rapid
from chipwise.pattern.climb import reversed_chains
from chipwise.pattern.copies import Copier
from chipwise.pattern.isometry import IDENTITY, Isometry, placed, placed_in_zx, turned
from chipwise.pattern.recorded import Recorded, Step

SAME_MM = 1e-7  # a coordinate read twice; the interpreter's doubles are better by far
MAX_COPIES = 100_000
MAX_TILT = (
    85.0  # degrees of a station on a machine whose tool does not turn: beyond it the cut has nothing of the pattern
)
NOTED_TILT = 0.01  # degrees; from here on there is a note
MIRRORS = (0, 1, 2, 3)
MOST_NAMED = 5  # cuts in a message


@dataclass(frozen=True)
class PatternRequest:
    """Words of the line; lengths mm, angles degrees.

    mirror: 0 none, 1 X, 2 Y, 3 both; start: (x, y, z) of the tool; chord: of arcs that cannot stay arcs; place: matrix
    and shift from the coordinates of the station to work coordinates; in_mirror: whether a pattern around this one
    mirrors it; close_gap: see climb.py; travel: fields of a Travel, None if nothing is known of the machine; pose: (A,
    B, C) that the tool turns to, None if it stays; reach: fields of a Reach, where the machine is a robot; abc: (A, B,
    C) of the work before the pattern; lathe: shift, step and mirror are in X and Z.
    """

    shift: tuple
    start: tuple
    chord: float
    most_moves: int
    rotation: float = 0.0
    mirror: float = 0
    copies: float = 1
    step: tuple = (0.0, 0.0)
    turn: float = 0.0
    station: float = 0
    place: tuple = (IDENTITY.matrix, IDENTITY.shift)
    in_mirror: bool = False
    travel: Optional[dict] = None
    pose: Optional[tuple] = None
    reach: Optional[dict] = None
    keep_climb: bool = False
    close_gap: float = 0.0
    abc: tuple = (0.0, 0.0, 0.0)
    lathe: bool = False


def pattern_plan(request: PatternRequest, read: Callable[[tuple, tuple, bool], Recorded]) -> CyclePlan:
    """read(start, abc, mirrored): what the sub does from a position, and angles of A, B and C, in its own coordinates.
    Raises CycleError."""
    check(request)
    copies = [copy_of(request, c) for c in range(int(request.copies))]
    mirrored = copies[0].mirrors
    travel = Travel(**request.travel) if request.travel else None
    runs_made: list = []
    turned_over = mirrored != request.in_mirror and not request.lathe
    runs, copier, moves, count = _Runs(lambda start, abc: read(start, abc, mirrored)), Copier(request.chord), [], 0
    here, abc, left = request.start, request.abc, []
    for c, isometry in enumerate(copies):
        start, senses = isometry.back(here), isometry.senses
        recorded, points = runs.at(start, turned(senses, abc))
        _check_axes(recorded, isometry, request)
        if c > 0:
            (_check_start_in_zx if request.lathe else _check_start)(recorded, points, start, c)
        if turned_over and request.keep_climb:
            recorded, left = reversed_chains(recorded, points, start, request.close_gap)
            points = recorded.points
        if travel:
            travel.check(recorded, points, start, isometry, c + 1)
            travel.check_turns(recorded, senses, c + 1)
        runs_made.append((c + 1, recorded, points, start, isometry))
        found = copier.moves(recorded, points, start, isometry) + ([Code(CALLERS_PATH)] if recorded.path else [])
        moves += found
        count += sum(len(move.moves) if isinstance(move, Copy) else 1 for move in found)
        if max(count, runs.least * len(copies)) > request.most_moves:
            raise CycleError(
                f"the pattern has more than {request.most_moves} moves",
                "use fewer copies, or raise [CHIPWISE]PLAN_MOVES",
            )
        here, abc = isometry.point(points[recorded.ends[-1]]), turned(senses, recorded.moves[-1].abc or recorded.abc)
    if request.pose:
        moves[0] = _turning(moves[0], request.pose)
    if request.reach and request.travel:
        onto = Isometry(request.travel["matrix"], request.travel["shift"])
        Reach(**request.reach).check(
            [(*made, onto.after(place)) for *made, place in runs_made], request.pose or request.reach["abc"]
        )
    notes = _notes(request, runs.first, mirrored, turned_over, left)
    return CyclePlan(tuple(moves), tuple(notes), lambda: Report("pattern", {"copies": len(copies), "moves": count}))


def _notes(request, first, mirrored, turned_over, left):
    """What the operator has to know of the pattern.  first: the Recorded of the first copy; turned_over: whether it has
    the other hand than the sub; left: cuts that are not reversed."""
    notes = [Note(braceless(text), {}) for text in first.messages]
    if turned_over and request.keep_climb:
        notes += _left_note(left)
    elif turned_over and first.own_cut:
        notes.append(
            Note(
                f"the cuts from line {first.own_cut} of the sub on are mirrored, climb cuts become conventional; the "
                f"cycles of chipwise "
                "keep theirs, #<_chipwise_keep_climb> = 1 reverses closed chains",
                {},
            )
        )
    elif request.lathe and mirrored != request.in_mirror and any(step.own for step in first.moves):
        own = next(step.own for step in first.moves if step.own)
        notes.append(
            Note(f"the cuts from line {own} of the sub on are mirrored: the tool has to cut in that direction", {})
        )
    if _tilt(request) > NOTED_TILT and not request.pose:
        notes.append(
            Note(
                f"station {request.station:g} is tilted by {_tilt(request):.2f} degrees, and the tool's axis stays as "
                f"it is",
                {},
            )
        )
    return notes


def check(request: PatternRequest):
    """Raise CycleError for words that cannot be carried out."""
    if request.mirror not in MIRRORS:
        raise CycleError(f"H{request.mirror:g} is not a mirror", "use H0 (none), H1 (X), H2 (Y) or H3 (both)")
    if not 1 <= request.copies <= MAX_COPIES:
        raise CycleError(f"L{request.copies:g} is not a number of copies", f"use a whole number from 1 to {MAX_COPIES}")
    tilt = _tilt(request)
    if tilt > MAX_TILT and not request.pose:
        raise CycleError(
            f"station P{request.station:g} is tilted by {tilt:.1f} degrees, more than {MAX_TILT:g}: the tool's axis "
            f"stays as it is",
            "see whether points 2 and 3 are interchanged",
        )
    if request.lathe:
        _check_lathe(request)
    if request.copies == 1 and (request.step != (0.0, 0.0) or request.turn):
        raise CycleError("I, J and K are for more than one copy", "add L, or use X, Y and R")


def _check_lathe(request: PatternRequest):
    """Raise CycleError for words that have no meaning on a lathe."""
    if request.rotation or request.turn:
        raise CycleError(
            f"{'R' if request.rotation else 'K'} on a machine without Y: the tool does not turn with the pattern",
            "leave it out; half a turn is H3",
        )
    if request.station:
        raise CycleError(f"station P{request.station:g} on a machine without Y", "use X and Z")


def _check_axes(recorded, isometry, request):
    """Principle 4."""
    for k, step in recorded.turns.items():
        where = f"line {step.source} of the sub" if step.source else "the sub"
        if request.pose or request.reach:
            raise CycleError(
                f"{where} turns axis {'ABC'[k]}, which is the tool's orientation",
                "leave the orientation to the station",
            )
        if not isometry.senses[k]:
            raise CycleError(
                f"{where} turns axis {'ABC'[k]}, and the pattern is turned so that this is another axis of the part",
                "use R0 or R180, mirrors and shifts" if k < 2 else "use a level station",
            )
    thread = recorded.thread
    if thread is None or request.pose:
        return
    where = f"line {thread.source} of the sub" if thread.source else "the sub"
    up = isometry.matrix[2][2]
    if up < 0:
        raise CycleError(
            f"{where} cuts a thread, and Z is mirrored: it would have the other hand",
            "write the thread the other way round, without H2 or H3",
        )
    if up < math.cos(math.radians(NOTED_TILT)):
        raise CycleError(
            f"{where} cuts a thread in a tilted station, and the spindle's axis stays as it is", "level the station"
        )


def _turning(move, pose):
    """The first move of the pattern, which turns the tool as well."""
    if not isinstance(move, Rapid):
        raise CycleError(
            f"the pattern begins with a cut: line {move.line} is the first move of the sub, and the tool has to turn "
            f"to the station",
            "begin the sub with G0 to its first position",
        )
    return replace(move, abc=tuple(pose))


def _left_note(left):
    """What of a mirrored sub is not reversed."""
    if not left:
        return []
    parts = [
        f"{cut.first}{f'-{cut.last}' if cut.last != cut.first else ''} ({cut.reason})" for cut in left[:MOST_NAMED]
    ]
    more = f" and {len(left) - MOST_NAMED} more" if len(left) > MOST_NAMED else ""
    return [
        Note(
            f"the cuts of lines {', '.join(parts)}{more} of the sub are mirrored and not reversed, climb cuts become "
            f"conventional",
            {},
        )
    ]


def _tilt(request):
    """Degrees between the station's Z and Z."""
    x, y, z = (row[2] for row in request.place[0])
    return math.degrees(math.atan2(math.hypot(x, y), z))


def copy_of(request: PatternRequest, c: int) -> Isometry:
    """The isometry of copy c."""
    x, y, z = request.shift
    if request.lathe:
        return placed_in_zx(int(request.mirror), (x + c * request.step[0], y, z + c * request.step[1]))
    return Isometry(*request.place).after(
        placed(
            int(request.mirror),
            request.rotation + c * request.turn,
            (x + c * request.step[0], y + c * request.step[1], z),
        )
    )


class _Runs:
    """What the sub does from any start (principle 1); read(start, abc): a run of it."""

    def __init__(self, read):
        self._read, self._template, self._before, self.first = read, None, None, None

    @property
    def least(self) -> int:
        """Moves that every copy has, as far as that is known."""
        return len(self._template.recorded.steps) if self._template and self._template.fits else 0

    def at(self, start, abc):
        """(Recorded, its points (k, 3)) from a start.  Two runs are compared if their axes turn alike."""
        if self._template and abc == self._before.abc and self._template.covers(start):
            return self._template.recorded, self._template.at(start)
        recorded = self._read(start, abc)
        self.first = self.first or recorded
        if self._before and self._before.abc == abc and self._template is None:
            self._template = Template(self._before, recorded)
        self._before = recorded
        return recorded, recorded.points


class Template:
    """The sub as two runs from different starts show it."""

    def __init__(self, first: Recorded, second: Recorded):
        self.recorded, points, others = first, first.points, second.points
        alike = [_outline(a) == _outline(b) for a, b in zip(first.steps, second.steps)]
        self.fits = len(first.steps) == len(second.steps) and all(alike) and points.shape == others.shape
        if self.fits:
            start, other = np.array(first.start), np.array(second.start)
            same, like_start = np.abs(points - others) <= SAME_MM, np.abs(points - start) <= SAME_MM
            moved_on = np.abs(start - other) > SAME_MM
            self.inherited = like_start & (np.abs(others - other) <= SAME_MM) & moved_on & ~same
            self.fits = bool((same | self.inherited).all())
            # coordinates of which both runs cannot tell whether they are the start's
            self._unclear = (same & like_start).any(axis=0) & ~moved_on
            self._start = start

    def covers(self, start) -> bool:
        """Whether the two runs show what the sub does from another start."""
        return self.fits and not (self._unclear & (np.abs(np.array(start) - self._start) > SAME_MM)).any()

    def at(self, start):
        """Its points from another start."""
        return np.where(self.inherited, np.array(start), self.recorded.points)


def _outline(step):
    """What two runs must have in common beside the points."""
    return (
        (step.kind, step.line, step.feed, step.axis, step.turns, step.pitch, step.abc)
        if isinstance(step, Step)
        else step
    )


def _check_start(recorded, points, start, c):
    """Principle 3."""
    first = recorded.moves[0]
    if recorded.cuts[0]:
        raise CycleError(
            f"copy {c + 1} begins with a cut: line {first.line} is the first move of the sub, and it is not G0",
            "begin the sub with G0 to its first position",
        )
    z = points[recorded.ends, 2]
    levels = z[recorded.cuts & (z <= np.append(start[2], z[:-1]))]
    if levels.size and start[2] <= levels.max() + SAME_MM and math.dist(points[0, :2], start[:2]) > SAME_MM:
        raise CycleError(
            "the sub ends at Z{end} of the pattern, no higher than its cuts at Z{level}: the traverse to the next copy "
            "would run "
            "there",
            "end the sub with G0 to a height above the stock",
            end=start[2],
            level=float(levels.max()),
        )


def _check_start_in_zx(recorded, points, start, c):
    """Principle 3 on a lathe."""
    first = recorded.moves[0]
    if recorded.cuts[0]:
        raise CycleError(
            f"copy {c + 1} begins with a cut: line {first.line} is the first move of the sub, and it is not G0",
            "begin the sub with G0 to its first position",
        )
    ends = points[recorded.ends][:, [0, 2]]
    touched = ends[recorded.cuts | np.append(recorded.cuts[1:], False)]  # the ends and the beginnings of its cuts
    here = np.array([ends[-1], [start[0], start[2]]])  # in the copy before, in this one
    inside = (
        touched.size
        and ((here >= touched.min(axis=0) - SAME_MM) & (here <= touched.max(axis=0) + SAME_MM)).all(axis=1).any()
    )
    if inside and abs(points[0, 2] - start[2]) > SAME_MM:
        raise CycleError(
            "the sub ends at Z{z}, {x} from the axis, among its own cuts: the traverse to the next copy would run "
            "there",
            "end the sub with G0 away from the work",
            x=abs(float(ends[-1, 0])),
            z=float(ends[-1, 1]),
        )
