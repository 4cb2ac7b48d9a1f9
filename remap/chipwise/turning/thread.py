# SPDX-License-Identifier: GPL-2.0-or-later
"""The step that cuts threads: G33 passes whose depths make chips of equal area, from a run-in to a run-out.

Called by steps.py.  The flanks of the insert are those of the thread, so it goes straight in: the area that it has cut
at depth d grows with d^2, and pass k of n goes to depth * sqrt(k / n).  The last pass is made twice, for the spring of
the work.  Of several starts each begins a pitch farther away from the work than the one before, at the same index of
the spindle.

LinuxCNC begins a G33 move at the spindle's index, from rest (tp.c: sync_accel, 2.9.0~pre1): the tool is in step with
the spindle after v^2 / 2a, and it brakes over as much before its end.  Both lie beside the thread: the run-in before
it, the run-out in the undercut.

Lengths mm; positions are those of the nose's centre, in the frame of the tool's side (tool.py).  A thread that is cut
towards +Z is mirrored in Z, as other tools that cut towards +Z are.
"""

import math
from dataclasses import replace
from typing import NoReturn

from chipwise.errors import CycleError
from chipwise.turning import reach
from chipwise.turning.profile_function import (
    Graph,
    Interval,
    Piece,
    Place,
    above,
    clip,
    envelope,
    flat,
    highest,
    lower,
    mirrored,
    top,
    upper,
    value,
)
from chipwise.turning.path import Move, Path
from chipwise.turning.state import State, Step, oriented, roof
from chipwise.turning.thread_comment import Thread
from chipwise.turning.tool import LatheTool

# depth of the first pass at a pitch of 1 mm; it grows with the root of the pitch, as makers of inserts recommend
FIRST_MM = 0.3
SETTLE_S = 0.01  # after the run-up the axis still corrects: ten servo periods of 1 ms
SURPLUS = 1.25  # of the length in which the axis gets to its speed
SPRING_PASSES = 1
MAX_PASSES = 100
NOSE_OUTSIDE, NOSE_INSIDE = 0.1443, 0.0722  # largest nose radius / pitch: H/6 and H/12 of ISO 68-1
INCLUDED_DEG, ANGLE_DEG = 60.0, 1.0  # of a metric insert; it may differ by so much
FINISHED_MM = 0.05  # more stock on the cylinder is not finished
SAME_MM = 1e-6  # rounding


def thread(state: State, name: str, inside: bool) -> Step:
    """Every thread of a side, with the first tool of role THREAD for that side."""
    wanted = [t for t in state.order.part.threads if t.inside == inside]
    if not wanted:
        return Step(name, False, f"the drawing has no thread {'inside' if inside else 'outside'}")
    missing = [t for t in wanted if not any(_same(t, other) for other in state.order.blank.threads)]
    if not missing:
        return Step(name, False, "the blank has the same thread")
    tools = [t for t in state.order.tools.get("thread", ()) if t.inside == inside and not t.point_angle and not t.flat]
    if not tools:
        return Step(name, False, f"no tool for it: none of role THREAD works {'inside' if inside else 'outside'}")
    speed = min(t.speed for t in missing)
    parts = sorted((_Part(state, replace(t, speed=speed), tools[0]) for t in missing), key=lambda part: -part.thread.z1)
    threads = " and ".join(
        f"{2 * p.thread.x:.3f} x {p.thread.pitch:g} mm{' left-handed' if p.thread.left else ''}{_starts(p.thread)} in "
        f"{p.count} + {SPRING_PASSES} passes"
        for p in parts
    )
    step = Step(
        name,
        True,
        f"thread of {threads} at {speed:.0f} rpm",
        tools[0],
        f"{'inside' if inside else 'outside'}, in step with the spindle",
        min(p.thread.z0 for p in parts),
        max(p.thread.z1 for p in parts),
        speed=speed,
    )
    for part in parts:
        step.start, moves = part.moves()
        step.moves += moves
    return step


def _starts(t: Thread) -> str:
    """Text for several starts."""
    return f" with {t.starts} starts, each" if t.starts > 1 else ""


def _same(a: Thread, b: Thread) -> bool:
    """Whether two threads are the same one."""
    return (a.inside, a.left, a.starts, round(a.pitch, 6)) == (b.inside, b.left, b.starts, round(b.pitch, 6)) and max(
        abs(a.z0 - b.z0), abs(a.z1 - b.z1), abs(a.x - b.x)
    ) < FINISHED_MM


class _Part:
    """One thread: where its passes begin and end, and how deep they are.  Raises CycleError for a thread that cannot be
    cut."""

    def __init__(self, state: State, wanted: Thread, tool: LatheTool) -> None:
        self.state, self.thread, self.drive = state, wanted, state.order.drive
        self.forward = (
            self.drive.direction == 4
        ) == wanted.left  # M3 and towards -Z: right-handed, whichever side the tool is on
        _check_insert(wanted, tool)
        self.tool = replace(tool, towards=-1 if self.forward else 1)
        self.braking = self._braking()
        self.work, frame = state.work(self.tool, 0.0)
        self.framed, self.view = frame.tool, frame.view
        self.domain = frame.domain
        self.z0, self.z1 = (wanted.z0, wanted.z1) if self.forward else (-wanted.z1, -wanted.z0)
        crest = -wanted.x if wanted.inside else wanted.x
        self.crest, self.root = crest + tool.nose, crest - wanted.depth + tool.nose  # positions
        self.count, self.depths = self._depths()
        self.start, self.end = self._ends()
        self.far = self.start + (wanted.starts - 1) * wanted.pitch
        if wanted.inside:
            deepest = min(z if self.forward else -z for z in (self.far, self.end))
            self.work = replace(self.work, roof=roof(state, self.tool, deepest))

    def _braking(self) -> float:
        """mm that the axis needs to stop; it must be able to follow the spindle."""
        t, drive = self.thread, self.drive
        speed = t.speed * drive.override / 60.0 * t.lead
        if speed > drive.velocity:
            most = math.floor(60.0 * drive.velocity / (t.lead * drive.override))
            raise CycleError(
                f"{t.speed:.0f} rpm with a lead of {{p}} needs {{v}}/s along Z, its MAX_VELOCITY is {{most}}/s (line "
                f"{{line}})"
                + (f", spindle override {100 * drive.override:.0f} % included" if drive.override > 1 else ""),
                f"write SPEED={most} or less into the THREAD comment",
                p=t.lead,
                v=speed,
                most=drive.velocity,
                line=str(t.line),
            )
        return SURPLUS * speed * speed / (2 * drive.acceleration) + speed * SETTLE_S

    def _depths(self) -> tuple[int, list[float]]:
        """(number of passes, their depths from the crest)."""
        t = self.thread
        first = min(FIRST_MM * math.sqrt(t.pitch), self.tool.depth, t.depth)
        count = math.ceil((t.depth / first) ** 2 - 1e-9)
        if count > MAX_PASSES:
            raise CycleError(
                f"a first pass of {{first}} makes {count} passes, more than {MAX_PASSES} (line {{line}})",
                "raise depth of the threading tool in the tool geometry file",
                first=first,
                line=str(t.line),
            )
        return count, [t.depth * math.sqrt(k / count) for k in range(1, count + 1)] + [t.depth] * SPRING_PASSES

    def _ends(self) -> tuple[float, float]:
        """(z, z) where the passes begin and end, beside the thread: where the root touches neither part nor stock."""
        state, t = self.state, self.thread
        part, stock = self.view(state.part[t.inside]), self.view(state.stock[t.inside])
        a, b = self._zone(part)
        thick = max(
            (
                v[3]
                for v in above(
                    clip(stock, self.z0, self.z1), [flat(self.z0, self.z1, self.crest - self.tool.nose)], FINISHED_MM
                )
            ),
            default=0.0,
        )
        if thick:
            raise CycleError(
                "{h} of stock is left on the cylinder of the thread (line {line})",
                "give a finishing tool that reaches it",
                h=thick,
                line=str(t.line),
            )
        barrier = self.view(state.barrier[t.inside])
        solid = upper(upper(self._without(part, a, b), self._without(stock, a, b)), barrier)
        # above its tooth the insert is not wider, until the holder's box: what is higher counts as if it ended there
        solid = lower(solid, [flat(*self.domain, self.root - self.tool.nose + _tooth(self.tool))])
        holder = clip(reach.holder_height(upper(upper(part, stock), barrier), self.framed, 0.0), *self.domain)
        blocked = above(
            upper(
                upper(reach.dilated(solid, self.framed, 0.0, self.domain), holder),
                [flat(*self.domain, self.root - 1.0)],
            ),
            [flat(*self.domain, self.root)],
            SAME_MM,
        )
        width = self.tool.nose + t.depth / min(
            self.framed.left, self.framed.right
        )  # of the insert from its middle, at the crest
        before = min((v[0] for v in blocked if v[1] > 0.5 * (a + b)), default=math.inf) - b - width
        behind = a - width - max((v[1] for v in blocked if v[0] < 0.5 * (a + b)), default=-math.inf)
        self._check_room("run-in", before - (t.starts - 1) * t.pitch, b)  # the other starts begin farther away
        self._check_room("run-out", behind, a)
        return b + width + self.braking, a - width - self.braking

    def _check_room(self, what: str, room: float, z: float) -> None:
        """Refuse a thread that has no room beside it."""
        if room >= self.braking - SAME_MM:
            return
        t = self.thread
        share = SURPLUS / (2 * self.drive.acceleration)
        slow = math.floor(
            60.0
            * (math.sqrt(SETTLE_S**2 + 4 * share * max(room, 0.0)) - SETTLE_S)
            / (2 * share * t.lead * self.drive.override)
        )
        raise CycleError(
            f"the {what} of the thread needs {{need}} beside Z{{z}} at {t.speed:.0f} rpm, there is room for {{room}} "
            f"(line {{line}})",
            f"write SPEED={slow} or less into the THREAD comment, or make room there"
            if slow >= 20
            else "make room there: a wider undercut, nothing in front of the thread",
            need=self.braking,
            z=z if self.forward else -z,
            room=max(room, 0.0),
            line=str(t.line),
        )

    def _zone(self, part: Graph) -> Interval:
        """(a, b): where the part is above the root: the cylinder, and chamfers beside it, which the thread runs
        over."""
        low = self.root - self.tool.nose
        level = [flat(*self.domain, low)]
        a, b = next(
            v[:2]
            for v in above(upper(part, [flat(*self.domain, low - 1.0)]), level)
            if v[0] < 0.5 * (self.z0 + self.z1) < v[1]
        )
        for p in clip(part, a, b):
            if p.z0 >= self.z0 - SAME_MM and p.z1 <= self.z1 + SAME_MM or p.z1 - p.z0 < SAME_MM:
                continue
            outer, inner = (p.z0, p.z1) if p.z1 <= self.z0 + SAME_MM else (p.z1, p.z0)
            if (
                not value(p, outer) < value(p, inner) - 0.1 * (p.z1 - p.z0)
                or top(p, p.z0, p.z1) > self.crest - self.tool.nose + SAME_MM
            ):
                raise CycleError(
                    "beside the thread the part is above its root at Z{z} (line {line})",
                    "draw an undercut or a smaller diameter there",
                    z=inner if self.forward else -inner,
                    line=str(self.thread.line),
                )
        return a, b

    def _without(self, graph: Graph, a: float, b: float) -> list[Piece]:
        """A graph with the thread's zone down to its root."""
        low = [flat(a, b, self.root - self.tool.nose)]
        return envelope([clip(graph, -math.inf, a), lower(clip(graph, a, b), low), clip(graph, b, math.inf)])

    def moves(self) -> tuple[Place, list[Move]]:
        """(start, moves) of the passes, in the frame of the tool's side."""
        path = Path(self.work)
        high = max(self.crest, highest(self.work.contact, self.end, self.far)) + self.work.clearance
        path.link(self.start, high)
        begins = [self.start + k * self.thread.pitch for k in range(self.thread.starts)]
        for depth in self.depths:
            for z in begins:  # at the spindle's index: a pitch farther away is another start
                path.rapid(z, high)
                path.rapid(z, self.crest - depth)
                path.thread(self.end, self.crest - depth, self.thread.lead)
                path.rapid(self.end, high)
            path.rapid(self.start, high)
        path.home()
        return oriented(path, self.view is mirrored)


def _tooth(tool: LatheTool) -> float:
    """Height of the insert's tooth, mm."""
    return tool.edge * math.cos(math.radians(tool.included / 2))


def _check_insert(t: Thread, tool: LatheTool) -> None:
    """Refuse an insert that does not make this thread."""

    def wrong(fact: str, remedy: str, **lengths: float) -> NoReturn:
        raise CycleError(fact + " (line {line})", remedy, None, line=str(t.line), **lengths)

    other = f"use another insert than T{tool.number}, or give DEPTH in the THREAD comment"
    if t.standard and abs(tool.included - INCLUDED_DEG) > ANGLE_DEG:
        wrong(f"the insert has {tool.included:g} degrees between its edges, the thread 60", other)
    share = NOSE_INSIDE if t.inside else NOSE_OUTSIDE
    if t.standard and tool.nose > share * t.pitch + SAME_MM:
        wrong(
            "the nose radius {r} is more than {most}, the root of a pitch of {p}",
            other,
            r=tool.nose,
            most=share * t.pitch,
            p=t.pitch,
        )
    if _tooth(tool) < t.depth:
        wrong(
            "the edges of {e} are too short for a depth of {d}",
            f"use another insert than T{tool.number}",
            e=tool.edge,
            d=t.depth,
        )
    if tool.pitch and not tool.pitch[0] - SAME_MM <= t.pitch <= tool.pitch[1] + SAME_MM:
        wrong(
            f"the pitch {{p}} is not one of T{tool.number}, from {{a}} to {{b}}",
            "use another insert",
            p=t.pitch,
            a=tool.pitch[0],
            b=tool.pitch[1],
        )
