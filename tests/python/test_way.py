"""The program's way ahead: a chain of lines, arcs and helices (components/core/way.c), and what the look-ahead makes of it."""

import math
import random

import numpy as np
import pytest

from chipwise.stock import core
from conftest import random_count, random_seed, write_replay

CELL = 0.25


def ends(piece):
    """(start, end, direction at the end) of a piece, computed here from its numbers."""
    way = core.Way()
    way.follow(1, piece.length, 0.0)
    way.append(1, piece)
    return way.at(0.0)[0], way.at(piece.length)[0], way.at(piece.length)[1]


def test_a_quarter_turn_rises_as_a_helix():
    """Centre (0, 0), start (5, 0, 1), 90 degrees counter-clockwise, 2 mm up: end (0, 5, 3)."""
    piece = core.arc((0, 0), (5, 0, 1), math.pi / 2, 2.0)
    assert piece.length == pytest.approx(math.hypot(5 * math.pi / 2, 2.0))
    start, end, direction = ends(piece)
    assert start == pytest.approx((5, 0, 1))
    assert end == pytest.approx((0, 5, 3))
    flat = 5 * math.pi / 2 / piece.length
    assert direction == pytest.approx((-flat, 0, 2.0 / piece.length))
    clockwise = core.arc((0, 0), (5, 0, 1), -math.pi / 2)
    assert ends(clockwise)[1] == pytest.approx((0, -5, 1))


def test_a_piece_without_length_is_none():
    assert core.line((1, 2, 3), (1, 2, 3)) is None
    assert core.line((1, 2, 3), (math.nan, 2, 3)) is None
    assert core.arc((1, 2), (1, 2, 3), 1.0) is None
    plunge = core.line((1, 2, 3), (1, 2, -3))
    assert ends(plunge)[1:] == (pytest.approx((1, 2, -3)), pytest.approx((0, 0, -1)))


def random_chain(generator, count):
    """[(start, end, piece)], each piece beginning where the one before ends."""
    at, chain = (0.0, 0.0, 0.0), []
    while len(chain) < count:
        if generator.random() < 0.5:
            end = tuple(a + generator.uniform(-3, 3) for a in at)
            piece = core.line(at, end)
        else:
            radius, phi = generator.uniform(0.2, 9), generator.uniform(0, 2 * math.pi)
            centre = at[0] + radius * math.cos(phi), at[1] + radius * math.sin(phi)
            angle, rise = generator.uniform(-6, 6), generator.choice([0.0, generator.uniform(-1, 1)])
            piece = core.arc(centre, at, angle, rise)
            turned = phi + math.pi + angle
            end = centre[0] + radius * math.cos(turned), centre[1] + radius * math.sin(turned), at[2] + rise
        chain.append((at, end, piece))
        at = end
    return chain


def walk(chain):
    """Follow a chain as the reader of the planner does: a few pieces known ahead, the last one taken back and read
    again in every step; every place must be on the piece it belongs to."""
    way, begin = core.Way(), 0.0
    known = 0
    for n, (start, end, piece) in enumerate(chain):
        for share in (0.0, 0.3, 1.0):
            if known > n + 1:
                way.retract()
                known -= 1
            way.follow(1000 + n, piece.length, share * piece.length)
            known = max(known, n)
            while known < min(len(chain), n + 5):
                way.append(1000 + known, chain[known][2])
                known += 1
            assert way.c.at == pytest.approx(begin + share * piece.length, abs=1e-6)
            assert way.at(begin)[0] == pytest.approx(start, abs=1e-6)
            assert way.at(begin + piece.length - 1e-9)[0] == pytest.approx(end, abs=1e-6)
            assert way.c.end == pytest.approx(begin + sum(p.length for _, _, p in chain[n:known]), abs=1e-6)
        begin += piece.length
    assert not (way.c.fresh and len(chain) > 1 and way.c.begin == 0.0)


def test_random_chains():
    seed = random_seed()
    for case in range(random_count(40)):
        generator = random.Random(f'{seed}/{case}')
        try:
            walk(random_chain(generator, generator.randint(1, 30)))
        except AssertionError as error:
            path = write_replay('way', {'seed': seed, 'case': case})
            pytest.fail(f'chain {case} of seed {seed}: {error}; {path}')


def test_another_chain_starts_anew():
    way = core.Way()
    first, other = core.line((0, 0, 0), (5, 0, 0)), core.line((5, 0, 0), (9, 0, 0))
    way.follow(7, first.length, 1.0)
    assert way.c.fresh == 1
    way.append(7, first)
    way.c.fresh = 0
    way.follow(7, first.length, 2.0)
    assert (way.c.fresh, way.c.at) == (0, 2.0)
    way.follow(9, other.length, 0.5)            # never heard of: aborted, or read too late
    assert (way.c.fresh, way.c.count, way.c.at) == (1, 0, 0.5)
    way.append(9, other)
    way.c.fresh = 0
    way.follow(9, other.length - 0.1, 0.6)      # the planner has changed it
    assert way.c.fresh == 1


def test_more_pieces_than_there_is_room_for():
    way = core.Way()
    pieces = [core.line((k * 0.1, 0, 0), (k * 0.1 + 0.1, 0, 0)) for k in range(400)]
    way.follow(0, pieces[0].length, 0.0)
    for key, piece in enumerate(pieces):
        way.append(key, piece)
    assert way.c.count == core.PIECES
    assert way.c.end == pytest.approx(core.PIECES * 0.1)
    assert way.at(way.c.end)[0] == pytest.approx((core.PIECES * 0.1, 0, 0))


def drive(stock, tool, pieces, follow):
    """Go along the pieces at 50 mm/s; -> (areas told at the tool, true dV/ds) per step, mm2."""
    ahead, step = core.Ahead(stock, tool), 0.05
    way, begin, told, true = core.Way(ahead.c.way), 0.0, [], []
    cutter = core.Cutter(stock, tool, pieces[0].origin)
    before = tuple(pieces[0].origin)
    for n, piece in enumerate(pieces):
        s = 0.0
        while s + step <= piece.length + 1e-9:
            s += step
            if follow:
                way.follow(n, piece.length, s)
                for k in range(n if way.c.count == 0 else n + way.c.count, len(pieces)):
                    way.append(k, pieces[k])
            now = ends_at(piece, s)
            removed = cutter.to(now)
            ahead.step(before, now, 0.001, 12.0)
            told.append([(level.distance, level.area) for level in
                         (ahead.look(12.0).level[i] for i in range(ahead.look(12.0).levels))])
            true.append(removed / step)
            before = now
        begin += piece.length
    return told, np.array(true)


def ends_at(piece, s):
    way = core.Way()
    way.follow(1, piece.length, 0.0)
    way.append(1, piece)
    return way.at(s)[0]


@pytest.mark.parametrize('follow', [True, False])
def test_an_arc_into_the_stock_is_announced(follow):
    """A line beside the stock, then an arc that turns into it, tangent: with the way known the load of the arc is
    announced 5 mm before; predicted from the line alone it is not."""
    stock = core.Stock((0, 3.2, -10), (60, 40, 0), CELL)
    pieces = [core.line((0, 0, -3), (30, 0, -3)), core.arc((30, 6), (30, 0, -3), math.pi / 2)]
    told, _true = drive(stock, core.Tool(6.0), pieces, follow)
    before_arc = told[int(25 / 0.05)]
    most = max(area for distance, area in before_arc if distance < 9.0)
    turned = 4.0 / 6.0                                  # rad of the arc, 9 mm on; the front beyond Y 3.2 is in stock
    begin = math.asin((3.2 - 6.0 * (1.0 - math.cos(turned))) / 3.0) - turned
    true = 3.0 * 3.0 * (1.0 - math.sin(begin))          # 8.77 mm2
    assert (most >= true) == follow, before_arc
