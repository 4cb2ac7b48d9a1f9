# SPDX-License-Identifier: GPL-2.0-or-later
"""The program's path ahead: a chain of lines, arcs and helices (components/core/path.c), and what the look-ahead makes
of it."""

import math
import random

import numpy as np
import pytest

from chipwise.clib import core, layout
from support.random_cases import random_count, random_seed, write_replay

CELL = 0.25


def ends(segment):
    """(start, end, direction at the end) of a segment, computed here from its numbers."""
    path = core.ProgrammedPath()
    path.follow(1, segment.length, 0.0)
    path.append(1, segment)
    return path.at(0.0)[0], path.at(segment.length)[0], path.at(segment.length)[1]


def test_a_quarter_turn_rises_as_a_helix():
    """Centre (0, 0), start (5, 0, 1), 90 degrees counter-clockwise, 2 mm up: end (0, 5, 3)."""
    segment = core.arc((0, 0), (5, 0, 1), math.pi / 2, 2.0)
    assert segment.length == pytest.approx(math.hypot(5 * math.pi / 2, 2.0))
    start, end, direction = ends(segment)
    assert start == pytest.approx((5, 0, 1))
    assert end == pytest.approx((0, 5, 3))
    flat = 5 * math.pi / 2 / segment.length
    assert direction == pytest.approx((-flat, 0, 2.0 / segment.length))
    clockwise = core.arc((0, 0), (5, 0, 1), -math.pi / 2)
    assert ends(clockwise)[1] == pytest.approx((0, -5, 1))


def test_a_piece_without_length_is_none():
    assert core.line((1, 2, 3), (1, 2, 3)) is None
    assert core.line((1, 2, 3), (math.nan, 2, 3)) is None
    assert core.arc((1, 2), (1, 2, 3), 1.0) is None
    plunge = core.line((1, 2, 3), (1, 2, -3))
    assert ends(plunge)[1:] == (pytest.approx((1, 2, -3)), pytest.approx((0, 0, -1)))


def random_chain(generator, count):
    """[(start, end, segment)], each segment beginning where the one before ends."""
    at, chain = (0.0, 0.0, 0.0), []
    while len(chain) < count:
        if generator.random() < 0.5:
            end = tuple(a + generator.uniform(-3, 3) for a in at)
            segment = core.line(at, end)
        else:
            radius, phi = generator.uniform(0.2, 9), generator.uniform(0, 2 * math.pi)
            centre = at[0] + radius * math.cos(phi), at[1] + radius * math.sin(phi)
            angle, rise = generator.uniform(-6, 6), generator.choice([0.0, generator.uniform(-1, 1)])
            segment = core.arc(centre, at, angle, rise)
            turned = phi + math.pi + angle
            end = centre[0] + radius * math.cos(turned), centre[1] + radius * math.sin(turned), at[2] + rise
        chain.append((at, end, segment))
        at = end
    return chain


def walk(chain):
    """Follow a chain as the reader of the planner does: a few segments known lookahead, the last one taken back and
    read again in every step; every place must be on the segment it belongs to."""
    path, begin = core.ProgrammedPath(), 0.0
    known = 0
    for n, (start, end, segment) in enumerate(chain):
        for share in (0.0, 0.3, 1.0):
            if known > n + 1:
                path.retract()
                known -= 1
            path.follow(1000 + n, segment.length, share * segment.length)
            known = max(known, n)
            while known < min(len(chain), n + 5):
                path.append(1000 + known, chain[known][2])
                known += 1
            assert path.c.s == pytest.approx(begin + share * segment.length, abs=1e-6)
            assert path.at(begin)[0] == pytest.approx(start, abs=1e-6)
            assert path.at(begin + segment.length - 1e-9)[0] == pytest.approx(end, abs=1e-6)
            assert path.c.end_s == pytest.approx(begin + sum(p.length for _, _, p in chain[n:known]), abs=1e-6)
        begin += segment.length
    assert not (path.c.new_chain and len(chain) > 1 and path.c.begin_s == 0.0)


def test_random_chains():
    seed = random_seed()
    for case in range(random_count(40)):
        generator = random.Random(f"{seed}/{case}")
        try:
            walk(random_chain(generator, generator.randint(1, 30)))
        except AssertionError as error:
            path = write_replay("path", {"seed": seed, "case": case})
            pytest.fail(f"chain {case} of seed {seed}: {error}; {path}")


def test_another_chain_starts_anew():
    path = core.ProgrammedPath()
    first, other = core.line((0, 0, 0), (5, 0, 0)), core.line((5, 0, 0), (9, 0, 0))
    path.follow(7, first.length, 1.0)
    assert path.c.new_chain == 1
    path.append(7, first)
    path.c.new_chain = 0
    path.follow(7, first.length, 2.0)
    assert (path.c.new_chain, path.c.s) == (0, 2.0)
    path.follow(9, other.length, 0.5)  # never heard of: aborted, or read too late
    assert (path.c.new_chain, path.c.count, path.c.s) == (1, 0, 0.5)
    path.append(9, other)
    path.c.new_chain = 0
    path.follow(9, other.length - 0.1, 0.6)  # the planner has changed it
    assert path.c.new_chain == 1


def test_more_pieces_than_there_is_room_for():
    path = core.ProgrammedPath()
    segments = [core.line((k * 0.1, 0, 0), (k * 0.1 + 0.1, 0, 0)) for k in range(400)]
    path.follow(0, segments[0].length, 0.0)
    for key, segment in enumerate(segments):
        path.append(key, segment)
    assert path.c.count == layout.PATH_SEGMENTS
    assert path.c.end_s == pytest.approx(layout.PATH_SEGMENTS * 0.1)
    assert path.at(path.c.end_s)[0] == pytest.approx((layout.PATH_SEGMENTS * 0.1, 0, 0))


def drive(stock, tool, segments, follow):
    """Go along the segments at 50 mm/s; -> (areas told at the tool, true dV/ds) per step, mm2."""
    lookahead, step = core.Lookahead(stock, tool), 0.05
    path, begin, told, true = lookahead.path, 0.0, [], []
    cutter = core.Cutter(stock, tool, segments[0].origin)
    before = tuple(segments[0].origin)
    for n, segment in enumerate(segments):
        s = 0.0
        while s + step <= segment.length + 1e-9:
            s += step
            if follow:
                path.follow(n, segment.length, s)
                for k in range(n if path.c.count == 0 else n + path.c.count, len(segments)):
                    path.append(k, segments[k])
            now = ends_at(segment, s)
            removed = cutter.to(now)
            lookahead.step(before, now, 0.001, 12.0)
            told.append(
                [
                    (step.distance, step.area)
                    for step in (lookahead.profile(12.0).step[i] for i in range(lookahead.profile(12.0).steps))
                ]
            )
            true.append(removed / step)
            before = now
        begin += segment.length
    return told, np.array(true)


def ends_at(segment, s):
    path = core.ProgrammedPath()
    path.follow(1, segment.length, 0.0)
    path.append(1, segment)
    return path.at(s)[0]


@pytest.mark.parametrize("follow", [True, False])
def test_an_arc_into_the_stock_is_announced(follow):
    """A line beside the stock, then an arc that turns into it, tangent: with the path known the load of the arc is
    announced 5 mm before; predicted from the line alone it is not."""
    stock = core.Stock((0, 3.2, -10), (60, 40, 0), CELL)
    segments = [core.line((0, 0, -3), (30, 0, -3)), core.arc((30, 6), (30, 0, -3), math.pi / 2)]
    told, _true = drive(stock, core.Tool(6.0), segments, follow)
    before_arc = told[int(25 / 0.05)]
    most = max(area for distance, area in before_arc if distance < 9.0)
    turned = 4.0 / 6.0  # rad of the arc, 9 mm on; the front beyond Y 3.2 is in stock
    begin = math.asin((3.2 - 6.0 * (1.0 - math.cos(turned))) / 3.0) - turned
    true = 3.0 * 3.0 * (1.0 - math.sin(begin))  # 8.77 mm2
    assert (most >= true) == follow, before_arc
