# SPDX-License-Identifier: GPL-2.0-or-later
"""The verdict on a pocket of G79 P4: engagement by judge_engagement.c, all else by pocket_oracle.py; nothing of the
planner is in it.

A place with more than nominal + 10 degrees is one of three:
  corner  where the tool's centre has to turn within WINDOW by more than that: the last of the fillet stands at the very
          corner, so the tool meets the turn there whatever the path.  Allowed: the turn + 2 degrees, 1 mm of its path.
  neck    no circle of 1.5 tool radii about the tool: no trochoid fits.  Anything is allowed, if the plan names a place.
  other   anywhere else: a fault.
The entry's last turn is not judged.  Lengths mm, angles degrees.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.ops import polygonize, unary_union

from chipwise.cycles import pocket as cycle
from chipwise.errors import CycleError
from support import contour_oracle as contour
from support import engagement_judge, hole_oracle, pocket_oracle
from support.pocket_judge import case_of

OVER, P99, P99_NECK = 10.0, 3.0, 5.0
TURN_MORE, CORNER_MM = 2.0, 1.0
TROCHOID = 1.5  # tool radii
WINDOW = 0.2  # tool radii of the border of the tool's centre
NEAR = 0.35  # tool radii about a corner that belong to it
CHORD = 2e-4  # mm, of arcs of walls


@dataclass
class Verdict:
    """Degrees are above nominal; p99: of all; rest: without corners and necks; corner, neck, other: mm above nominal +
    10 there; full: mm of full slot where a trochoid fits; named, corners_named: what the plan says; faults: texts."""

    said: str = ""
    p99: float = 0.0
    rest: float = 0.0
    most: float = 0.0
    corner: float = 0.0
    neck: float = 0.0
    other: float = 0.0
    full: float = 0.0
    named: bool = False
    corners_named: bool = False
    faults: list = field(default_factory=list)


def pieces(moves, level):
    """(pieces (n, 7), judged (n,) bool) of the feeds that end at a level and of the ramps down to it: descents and the
    turn after a helix are not judged."""
    rows, judged, fell, final = [], [], False, _descents(moves, level)
    for number, e in enumerate(moves):
        if e.kind == "rapid" or abs(e.b[2] - level) > 1e-4 and number not in final:
            fell = fell or e.kind != "rapid" and e.a[2] - e.b[2] > 1e-3
            continue
        down, full = e.a[2] - e.b[2] > 1e-6, e.kind == "arc" and abs(abs(e.sweep[1]) - 2 * math.pi) < 1e-6
        if e.kind == "arc":
            rows.append((*e.a[:2], *e.b[:2], *e.centre, e.sweep[1]))
        elif math.dist(e.a[:2], e.b[:2]) > 0.0:
            rows.append((*e.a[:2], *e.b[:2], 0.0, 0.0, 0.0))
        else:
            fell = fell or e.a[2] - e.b[2] > 0.05
            continue
        judged.append(not down and not (full and fell))
        fell = e.a[2] - e.b[2] > 0.05
    return np.array(rows).reshape(-1, 7), np.array(judged, bool)


def _descents(moves, level):
    """Numbers of the feeds that go down one after the other and end at a level: what a ramp leaves under them is the
    entry's."""
    found, run = set(), []
    for number, e in enumerate(moves):
        if e.kind == "rapid" or not e.a[2] - e.b[2] > 1e-6:
            run = []
            continue
        run.append(number)
        if abs(e.b[2] - level) < 1e-4:
            found.update(run)
    return found


def corners(case):
    """(places (n, 2), turns (n,) in degrees) where the border of what the tool's centre reaches turns inward within
    WINDOW."""
    lines = [
        LineString(np.concatenate([_points(element) for element in loop] + [_points(loop[0])[:1]]))
        for loop in case.loops
    ]
    faces = [
        face
        for face in polygonize(unary_union(lines))
        if pocket_oracle.free(case.loops, np.array(face.representative_point().coords))[0]
    ]
    reach = unary_union(faces).buffer(-case.distance, 256)
    places, turns = [], []
    for face in getattr(reach, "geoms", [reach]):
        for ring in (face.exterior, *face.interiors) if isinstance(face, Polygon) and not face.is_empty else ():
            p = np.array(ring.coords)[:-1]
            p = p[np.hypot(*(p - np.roll(p, 1, axis=0)).T) > 1e-7]
            if len(p) < 3:
                continue
            if (ring is face.exterior) != ring.is_ccw:
                p = p[::-1]
            side = np.roll(p, -1, axis=0) - p
            length, heading = np.hypot(*side.T), np.arctan2(side[:, 1], side[:, 0])
            turn = np.degrees(np.remainder(heading - np.roll(heading, 1) + np.pi, 2 * np.pi) - np.pi)
            for k in np.flatnonzero(turn > 1.0):
                sum_, j, far = turn[k], k, length[k]
                while far < WINDOW * case.radius and (j := (j + 1) % len(p)) != k:
                    sum_, far = sum_ + turn[j], far + length[j]
                places.append(p[k])
                turns.append(sum_)
    return np.array(places).reshape(-1, 2), np.array(turns)


def _points(element):
    if element[0] == "L":
        return np.array([element[1:3]])
    radius = math.hypot(element[1] - element[5], element[2] - element[6])
    n = max(2, math.ceil(abs(element[7]) / (2 * math.acos(max(0.0, 1 - CHORD / max(radius, CHORD))))))
    return contour.point(element, np.arange(n) / n)


def narrow(case, p):
    """Which of places (n, 2) of the tool have no circle of TROCHOID tool radii about them."""
    wide, room = np.zeros(len(p), bool), (TROCHOID - 1.0) * case.radius + case.distance
    for share in np.linspace(0.0, 1.0, 6):
        for angle in np.arange(0, 2 * math.pi, math.pi / 12) if share else (0.0,):
            q = p + share * case.radius * np.array((math.cos(angle), math.sin(angle)))
            wide |= pocket_oracle.clearance(case.loops, q) >= room
    return ~wide


def verdict(request, seed=0, count=1500):
    """Verdict on what P4 makes of a request."""
    case = case_of(request)
    try:
        plan = cycle.pocket_plan(request)
    except CycleError as error:
        return Verdict(said=str(error), faults=[] if "fits nowhere" in str(error) else [f"refused: {error}"])
    moves = hole_oracle.walk(plan.moves, request.start)
    notes = [note[0] for note in plan.notes]
    found = Verdict(
        named=any(text.startswith("P4 cannot keep the engagement") for text in notes),
        corners_named=any(text.startswith("the engagement is above that of D") for text in notes),
        faults=pocket_oracle.judge(case, moves, request.ramp_angle, cycle.GAP_MM, plan.plunges, seed, count),
    )
    if any(text.startswith("residue") for text in found.faults) and not wide_rest(case, moves, seed, count):
        found.faults = [text for text in found.faults if not text.startswith("residue")]
    angles(
        found,
        case,
        engagement_judge.exact(*pieces(moves, case.floor), case.radius),
        math.degrees(math.acos(1 - request.step / request.tool_radius)),
    )
    return found


def wide_rest(case, moves, seed, count):
    """Places (n, 2) that stand and are further than pocket_oracle.TOLERANCE from what the tool sweeps at the floor."""
    stock = pocket_oracle.Stock(case, np.random.default_rng([seed, 79]), count)
    stock.run(moves)
    p = stock.point[stock.reached & (stock.height - case.floor > pocket_oracle.TOLERANCE)]
    gap = np.min([hole_oracle.distance(e, *p.T) for e in hole_oracle.cuts(moves, case.floor)], axis=0) - case.radius
    return p[gap > pocket_oracle.TOLERANCE]


def angles(found, case, rows, nominal):
    """Adds what the rows of the judge say about the engagement."""
    if not (rows[:, 4] > engagement_judge.AIR).any():
        return
    judge = engagement_judge.Engagement(rows)
    found.p99, found.most = math.degrees(judge.percentile(0.99)) - nominal, math.degrees(judge.most) - nominal
    above = np.degrees(rows[:, 4]) > nominal + OVER
    over = rows[above]
    if len(over):
        corner, tight = places_over(found, case, over, nominal)
        above[above] = corner | tight
    rest = rows[~above]
    found.rest = (
        math.degrees(engagement_judge.Engagement(rest).percentile(0.99)) - nominal
        if (rest[:, 4] > engagement_judge.AIR).any()
        else 0.0
    )
    if found.rest > (P99_NECK if found.named else P99):
        found.faults.append(
            f"99 % of the path outside corners and necks are below nominal + {found.rest:.1f} degrees only"
        )


def places_over(found, case, over, nominal):
    """Which of the rows above nominal + OVER are of a corner and which of a neck; adds the figures and faults of
    all."""
    angle, p = np.degrees(over[:, 4]), over[:, 1:3]
    places, turns = corners(case)
    gap = np.hypot(*(p[:, None] - places[None]).transpose(2, 0, 1)) if len(places) else np.full((len(p), 1), np.inf)
    turns = turns if len(places) else np.zeros(1)
    allowed = np.where(gap < NEAR * case.radius, turns[None], 0.0).max(axis=1) + TURN_MORE
    corner, tight = angle <= allowed, narrow(case, p)
    found.full = float(over[(over[:, 4] > engagement_judge.FULL) & ~corner & ~tight, 5].sum())
    found.corner, found.neck, found.other = (
        float(over[which, 5].sum()) for which in (corner, tight & ~corner, ~corner & ~tight)
    )
    if found.other > 0.0:
        worst = np.argmax(np.where(~corner & ~tight, angle, 0.0))
        found.faults.append(
            f"nominal + {angle[worst] - nominal:.1f} degrees at X{p[worst, 0]:.3f} Y{p[worst, 1]:.3f}, "
            f"{found.other:.1f} mm in all"
        )
    near = gap.argmin(axis=1)
    for k in np.unique(near[corner]):
        mm = float(over[corner & (near == k) & ~tight, 5].sum())
        if mm > CORNER_MM:
            found.faults.append(
                f"{mm:.1f} mm above nominal + 10 degrees in the corner at X{places[k, 0]:.3f} Y{places[k, 1]:.3f}"
            )
    if found.neck > 0.0 and not found.named and not found.corners_named:
        found.faults.append(f"{found.neck:.2f} mm in necks of which the plan says nothing")
    return corner, tight
