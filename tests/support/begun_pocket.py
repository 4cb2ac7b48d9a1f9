# SPDX-License-Identifier: GPL-2.0-or-later
"""A pocket that something was cut of before, and the verdict on P4 in it.

The stock is the map of the C core, cut move by move.  The verdict does not read it: the columns of pocket_oracle.py and
the engagement of judge_engagement.c are those of both tools' paths.  Lengths mm, angles degrees.
"""

import math
from dataclasses import replace

import numpy as np

from chipwise.clib.core import Cutter, Stock, Tool
from chipwise.cycles import pocket as cycle
from chipwise.order import MapPlace
from chipwise.planner import standing_stock
from chipwise.stock.store import head_of
from support import engagement_judge, engagement_verdict, hole_oracle, pocket_oracle
from support.pocket_judge import case_of

AROUND = 20.0  # mm of stock about what is cut
CHORD = 0.1  # mm, of arcs on the map
SHORT = 100.0  # mm in stock: one per cent of less is less than a corner takes, so that the 99 % say nothing


def place(origin=(0.0, 0.0, 0.0), turn=0.0):
    """Work coordinates on the machine: mm, rad."""
    return MapPlace(0, origin, turn)


def to_machine(where, point):
    c, s = math.cos(where.turn), math.sin(where.turn)
    x, y, z = point
    return c * x - s * y + where.origin[0], s * x + c * y + where.origin[1], z + where.origin[2]


def stock_after(moves, radius, where, cell, top=1.0):
    """The stock that a flat tool has left; 20 mm of it under the work coordinates."""
    ends = np.array([to_machine(where, p) for e in moves for p in pocket_oracle.on_path(e, 5.0)])
    (x0, y0), (x1, y1) = ends[:, :2].min(axis=0) - AROUND - radius, ends[:, :2].max(axis=0) + AROUND + radius
    stock, tool = Stock((x0, y0, where.origin[2] - 20.0), (x1, y1, where.origin[2] + top), cell), Tool(2.0 * radius)
    for e in moves:
        if e.kind == "rapid":
            continue
        cutter = Cutter(stock, tool, to_machine(where, e.a))
        for point in pocket_oracle.on_path(e, CHORD)[1:]:
            cutter.to(to_machine(where, tuple(point)))
    return stock


def standing(stock, where):
    """cycles.standing.Standing of a stock, as the planner makes it of the tracker's map."""
    return standing_stock.of_cells(head_of(stock.head, 0.0), stock.cells_and_ring, where)


def begun(request, moves, radius, where=None, cell=0.25):
    """The request with the stock that the moves of a tool have left."""
    where = place() if where is None else where
    return replace(request, stock=standing(stock_after(moves, radius, where, cell), where))


def length(moves):
    """mm at the feed"""
    return sum(
        e.radius * abs(e.sweep[1]) if e.kind == "arc" else math.dist(e.a, e.b) for e in moves if e.kind != "rapid"
    )


def as_the_smaller(moves, level, larger, smaller):
    """Pieces (n, 7) along which the smaller tool clears what the larger has cleared at a level: its path, both sides of
    that, and a circle about each of its ends."""
    more, rows = larger - smaller, []
    for e in moves:
        if e.kind == "rapid" or max(e.a[2], e.b[2]) > level + 1e-4:
            continue
        a, b = np.array(e.a[:2]), np.array(e.b[:2])
        if more > 0.0:
            rows += [(p[0] + more, p[1], p[0] + more, p[1], *p, 2.0 * math.pi) for p in (a, b)]
        if e.kind == "arc":
            out, centre = (a - e.centre, b - e.centre), np.array(e.centre)
            shares = [1.0 + k * more / e.radius for k in (-1, 0, 1)] if more > 0.0 else [1.0]
            rows += [
                (*(centre + share * out[0]), *(centre + share * out[1]), *centre, e.sweep[1])
                for share in shares
                if share > 1e-6
            ]
        elif math.dist(a, b) > 0.0:
            side = more * np.array((a[1] - b[1], b[0] - a[0])) / math.dist(a, b)
            rows += [(*(a + k * side), *(b + k * side), 0.0, 0.0, 0.0) for k in ((-1, 0, 1) if more > 0.0 else (0,))]
    return np.array(rows).reshape(-1, 7)


def verdict(request, before, radius, seed=0, count=4000):
    """(engagement_verdict.Verdict, moves) of P4 where a tool of a radius has made moves before."""
    case, plan = case_of(request), cycle.pocket_plan(request)
    moves = hole_oracle.walk(plan.moves, request.start)
    notes = [note[0] for note in plan.notes]
    found = engagement_verdict.Verdict(
        named=any(text.startswith("P4 cannot keep") for text in notes),
        corners_named=any(text.startswith("the engagement is above") for text in notes),
    )
    stock = pocket_oracle.Stock(case, np.random.default_rng([seed, 79]), count)
    stock.case = replace(case, radius=radius)
    stock.run(before)
    stock.case = case
    found.faults += [f"rapid {number} meets {depth:.3g} mm of stock" for number, depth in stock.run(moves)[:1]]
    found.faults += [f"residue at {p}" for p in _wide_rest(stock, before, radius, moves)[:1]]
    if any(e.kind != "rapid" for e in moves):
        found.faults += [
            f"gouge {deep:.3g} mm" for deep in (pocket_oracle.gouge(case, moves),) if deep > pocket_oracle.TOLERANCE
        ]
        found.faults += [
            f"move {n}: {what}"
            for n, what in pocket_oracle.entries(moves, request.ramp_angle, cycle.GAP_MM, plan.plunges, stock.plunged)[
                :1
            ]
        ]
        first, (own, judged) = (
            as_the_smaller(before, case.floor, radius, case.radius),
            engagement_verdict.pieces(moves, case.floor),
        )
        rows = engagement_judge.exact(
            np.concatenate((first, own)), np.concatenate((np.zeros(len(first), bool), judged)), case.radius
        )
        engagement_verdict.angles(found, case, rows, math.degrees(math.acos(1.0 - request.step / request.tool_radius)))
        if engagement_judge.Engagement(rows).length(engagement_judge.AIR) < SHORT:
            found.faults = [text for text in found.faults if not text.startswith("99 %")]
    return found, moves


def _wide_rest(stock, before, radius, moves):
    """Places (n, 2) that stand and are further than pocket_oracle.TOLERANCE from all that was swept at the floor."""
    case = stock.case
    p = stock.point[stock.reached & (stock.height - case.floor > pocket_oracle.TOLERANCE)]
    for one, size in ((before, radius), (moves, case.radius)):
        for e in hole_oracle.cuts(one, case.floor):
            p = p[hole_oracle.distance(e, *p.T) > size + pocket_oracle.TOLERANCE] if len(p) else p
    return p.tolist()
