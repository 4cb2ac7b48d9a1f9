# SPDX-License-Identifier: GPL-2.0-or-later
"""cycles/hole.py: 500 random holes before an oracle written apart, the rules, and the oracle's own failures."""

import dataclasses
import math
import random

import pytest

from chipwise.cycles import hole
from chipwise.errors import CycleError
from chipwise.geometry.slug import disc
from chipwise.moves import Arc
from support.random_cases import random_count, random_seed, write_replay
from support import hole_oracle as oracle
from support.hole_judge import judge, random_case, request


def test_random_holes(capsys):
    count, seed = random_count(500), random_seed()
    rng = random.Random(seed)
    chopped, raised, worst, worst_out, worst_gap = 0, 0, 0.0, -math.inf, -math.inf
    for number in range(count):
        r = random_case(rng)
        try:
            share, out, gap = judge(r, oracle.walk(hole.hole_plan(r).moves, r.start))
        except Exception as error:
            path = write_replay(f"hole_{seed}_{number}", dataclasses.asdict(r))
            raise AssertionError(f"seed {seed}, case {number}: {error}; replay {path}") from error
        if 2 * r.radius >= r.chop_size:
            chopped += 1
            worst = max(worst, share)
            raised += hole.chop_parts(r) > disc.patent_parts(2 * r.radius, r.chop_size)
        worst_out, worst_gap = max(worst_out, out), max(worst_gap, gap)
    with capsys.disabled():
        print(
            f"\n{count} holes: {chopped} of chop size, n raised {raised} times, largest piece {worst:.4f} H, "
            f"kerf outside {worst_out:.2e} mm, wall gap {worst_gap:.2e} mm"
        )
    assert chopped > count // 4


def test_replayed_case():
    """A saved case is enough to run it again."""
    import json

    r = request(chop_size=3.3, depth_step=1.5)
    again = hole.HoleRequest(**json.loads(json.dumps(dataclasses.asdict(r))))
    judge(dataclasses.replace(again, start=tuple(again.start)), oracle.walk(hole.hole_plan(r).moves, r.start))


@pytest.mark.parametrize(
    "r",
    [
        request(),
        request(chop_size=5.0),
        request(chop_size=4.0, tool_radius=0.3),
        request(chop_size=6.0, depth_step=2.0),
        request(radius=18.0, chop_size=9.0, tool_radius=2.5, ccw=False),
        request(radius=4.0, chop_size=8.0),
    ],
)
def test_no_piece_is_loose_before_it_is_small(r):
    elements = oracle.walk(hole.hole_plan(r).moves, r.start)
    # The ends of two lines touch the hole's circle in one point; the cell must see the bridge beside it.
    worst = oracle.largest_loose_ever(elements, (r.x, r.y), r.radius, r.tool_radius, r.bottom, r.radius / 200)
    assert worst < r.chop_size


def test_random_holes_are_never_loose_too_early():
    """The same over time, for a share of the random cases."""
    rng = random.Random(random_seed() + 1)
    for _ in range(max(1, random_count(500) // 50)):
        r = request(radius=rng.uniform(5, 20), tool_radius=rng.uniform(0.5, 1.5), depth_step=rng.choice([None, 2.0]))
        r = dataclasses.replace(r, chop_size=2 * r.radius * rng.uniform(0.22, 1.0))
        elements = oracle.walk(hole.hole_plan(r).moves, r.start)
        worst = oracle.largest_loose_ever(elements, (r.x, r.y), r.radius, r.tool_radius, r.bottom, r.radius / 130, 6)
        assert worst < r.chop_size, f"seed {random_seed() + 1}: {r}"


# ---- what is cut, and in which order -----------------------------------------------------------------------------


def lines_of(r):
    """The chop lines: ((x, y), (x, y)) of the long straight cuts at final depth, relative to the centre."""
    found = set()
    for e in oracle.cuts(oracle.walk(hole.hole_plan(r).moves, r.start), r.bottom):
        if e.kind == "feed" and math.dist(e.a[:2], e.b[:2]) > r.tool_radius + 1e-6:
            found.add(tuple(sorted((round(p[0] - r.x, 6), round(p[1] - r.y, 6)) for p in (e.a, e.b))))
    return found


@pytest.mark.parametrize("h, n", [(8, 3), (5, 5), (20, 2), (20.1, 1)])
def test_lines_of_the_patent(h, n):
    """n - 1 lines parallel to each axis, equally spaced, each ending one tool radius inside the circle."""
    lines = lines_of(request(chop_size=h))
    assert len(lines) == 2 * (n - 1)
    offsets = sorted(a[0] for a, b in lines if a[0] == b[0])
    assert offsets == pytest.approx([-10 + 20 * k / n for k in range(1, n)])
    for line in lines:
        for end in line:
            assert math.hypot(*end) == pytest.approx(10 - 1, abs=1e-5)


def test_lines_first_then_the_circle():
    kinds = [e.kind for e in oracle.cuts(oracle.walk(hole.hole_plan(request(depth_step=2)).moves, (0, 0, 20)))]
    first_arc = kinds.index("arc")
    assert first_arc > 10 and kinds[first_arc:].count("feed") == 3  # only the plunges of three more passes


@pytest.mark.parametrize("ccw", [True, False])
def test_sense(ccw):
    assert all(m.ccw is ccw for m in hole.hole_plan(request(ccw=ccw)).moves if isinstance(m, Arc))


def test_depth_passes():
    assert hole.depth_levels(2, -6, None) == [-6]
    assert hole.depth_levels(2, -6, 4) == [-2, -6]
    assert hole.depth_levels(2, -6, 3) == pytest.approx([2 - 8 / 3, 2 - 16 / 3, -6])
    assert hole.depth_levels(2, -6, 100) == [-6]


def test_plunges_stay_off_the_wall():
    """If there is room, no plunge is nearer to the wall's path than a tool radius."""
    for r in (request(), request(chop_size=0), request(depth_step=2), request(radius=4.5, finished=10.0, step=1.5)):
        path = hole.finished_radius(r) - r.tool_radius
        for e in oracle.cuts(oracle.walk(hole.hole_plan(r).moves, r.start)):
            if e.a[:2] == e.b[:2] and e.kind == "feed":
                assert math.dist(e.b[:2], (r.x, r.y)) < path - 0.4 * r.tool_radius


@pytest.mark.parametrize(
    "changes",
    [
        dict(radius=3.0, finished=9.0, step=2.0, tool_radius=1.5),
        dict(radius=9.0, finished=9.0, step=3.0, tool_radius=1.5),
        dict(radius=20.0, finished=31.0, step=3.0, tool_radius=1.5),
        dict(radius=2.0, finished=9.0, step=1.0, tool_radius=1.5),
        dict(radius=2.0, tool_radius=1.5),
        dict(radius=3.0, tool_radius=1.5, depth_step=2.0),
        dict(radius=1.51, tool_radius=1.5, depth_step=2.0),
        dict(radius=1.506, tool_radius=1.5, finished=1.506, step=1.0),
    ],
)
def test_pocket_leaves_nothing(changes):
    r = request(**changes)
    elements = oracle.walk(hole.hole_plan(r).moves, r.start)
    judge(r, elements)
    size = hole.finished_radius(r)
    assert oracle.loose_pieces(elements, (r.x, r.y), size, r.tool_radius, r.bottom, size / 150) == []


def test_pocket_rings():
    r = request(radius=4.0, finished=10.0, step=2.5, tool_radius=2.0)
    assert hole.pocket_rings(r) == pytest.approx([2.0, 4.5, 7.0, 8.0])
    r = request(radius=9.0, finished=10.0, step=2.5, tool_radius=2.0)  # a core would be left: rings inside first
    assert hole.pocket_rings(r) == pytest.approx([2.0, 4.5, 7.0, 8.0])


def test_deterministic_and_cached():
    assert hole.hole_plan(request()).moves is hole.hole_plan(request()).moves


# ---- refusals ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes, text",
    [
        (dict(tool_radius=0.0), "tool diameter 0 mm is not above 0 mm; load a tool with a diameter"),
        (dict(radius=-2.0), "radius I-2 mm is not above 0; use the radius of the hole"),
        (
            dict(radius=1.0005),
            "radius I1.0005 mm is less than 0.005 mm larger than the tool radius 1 mm; use a larger I or a smaller "
            "tool",
        ),
        (dict(radius=1.0), "radius I1 mm is not larger than the tool radius 1 mm; use I above 1 mm or a smaller tool"),
        (dict(bottom=3.0), "final depth Z3 mm is not below the clearance plane R2 mm; use Z below R or R above Z"),
        (dict(bottom=2.0), "final depth Z2 mm is not below the clearance plane R2 mm; use Z below R or R above Z"),
        (dict(chop_size=-1.0), "chop size -1 mm is negative; set #<_chipwise_chop_size> to 0 (never chop) or more"),
        (dict(depth_step=0.0), "depth per pass J0 mm is not above 0; use J above 0"),
        (
            dict(depth_step=0.001),
            "depth per pass J0.001 mm needs more than 1000 passes from R to Z; use a larger J, or correct Z; without J "
            "it is the flute length",
        ),
        (dict(feed=0.0), "no feed is set; give F on this line or before"),
        (dict(plunge_feed=0.0), "plunge feed E0 mm/min is not above 0; use E above 0, or leave it out for F/2"),
        (
            dict(finished=5.0, step=1.0),
            "finished radius K5 mm is smaller than the first radius I10 mm; use K of 10 mm or more",
        ),
        (dict(finished=15.0), "finished radius K15 mm without a radial step Q; add Q of at most 2 mm"),
        (dict(finished=15.0, step=0.0), "radial step Q0 mm is not above 0; use Q above 0, up to 2 mm"),
        (
            dict(finished=15.0, step=2.5),
            "radial step Q2.5 mm is larger than the tool (2 mm) and would leave rings; use Q up to 2 mm",
        ),
        (dict(finished=15.0, step=1e-4), "radial step Q0.0001 mm needs more than 1000 rings; use a larger Q"),
        (dict(step=1.0), "step Q1 mm without a finished radius K; add K, or leave Q out"),
    ],
)
def test_refused(changes, text):
    with pytest.raises(CycleError) as caught:
        hole.hole_plan(request(**changes)).moves
    assert str(caught.value) == "chipwise: " + text


def test_message_in_inches():
    with pytest.raises(CycleError) as caught:
        hole.hole_plan(request(radius=0.508, tool_radius=3.175)).moves
    assert caught.value.text("in") == (
        "chipwise: radius I0.02 in is not larger than the tool radius 0.125 in; use I above 0.125 in or a smaller tool"
    )


# ---- the oracle must be able to fail ------------------------------------------------------------------------------


def sabotage(r, change):
    """The hole's elements with each element replaced by change(index, element): an element, or None to drop it."""
    elements = oracle.walk(hole.hole_plan(r).moves, r.start)
    return [new for i, e in enumerate(elements) if (new := change(i, e)) is not None]


def moved(e, dx=0.0, scale=1.0, centre=(10.0, -5.0)):
    """An element scaled about the hole's centre and shifted."""

    def at(p):
        return (centre[0] + (p[0] - centre[0]) * scale + dx, centre[1] + (p[1] - centre[1]) * scale) + tuple(p[2:])

    return dataclasses.replace(e, a=at(e.a), b=at(e.b), centre=None if e.centre is None else at(e.centre))


def is_line(e):
    return e.kind == "feed" and math.dist(e.a[:2], e.b[:2]) > 2


def test_oracle_accepts_the_honest_trace():
    judge(request(), sabotage(request(), lambda i, e: e))


@pytest.mark.parametrize(
    "name, change, complaint",
    [
        ("one line missing", lambda i, e: None if is_line(e) and e.a[0] == e.b[0] and e.a[0] > 10 else e, "piece of"),
        ("lines 2 um too long", lambda i, e: moved(e, scale=9.002 / 9) if is_line(e) else e, "outside the hole"),
        ("circle 2 um too small", lambda i, e: moved(e, scale=8.998 / 9) if e.kind == "arc" else e, "wall missed"),
        ("everything shifted by 2 um", lambda i, e: moved(e, dx=0.002), "outside the hole"),
        ("no circle", lambda i, e: None if e.kind == "arc" and e.radius > 5 else e, "wall missed"),
        (
            "circle not closed",
            lambda i, e: oracle.split(e, 40)[0] if e.kind == "arc" and e.radius > 5 else e,
            "wall missed",
        ),
        ("rapid at depth", lambda i, e: dataclasses.replace(e, kind="rapid") if is_line(e) else e, "rapid below"),
        ("last pass too high", lambda i, e: dataclasses.replace(e, b=e.b[:2] + (max(e.b[2], -5.9),)), "wall missed"),
        (
            "ends elsewhere",
            lambda i, e: dataclasses.replace(e, b=e.b[:2] + (5.0,)) if e.kind == "rapid" and e.b[2] == 2 else e,
            "does not end",
        ),
    ],
)
def test_oracle_rejects(name, change, complaint):
    with pytest.raises(AssertionError, match=complaint):
        judge(request(), sabotage(request(), change))


def test_oracle_sees_a_strip_that_is_loose_too_early():
    """Circle before lines: the whole slug is loose first."""
    r = request()
    elements = oracle.walk(hole.hole_plan(r).moves, r.start)
    arcs = [e for e in elements if e.kind == "arc"]
    order = arcs + [e for e in elements if e.kind != "arc"]
    worst = oracle.largest_loose_ever(order, (r.x, r.y), r.radius, r.tool_radius, r.bottom, 0.05)
    assert worst > r.chop_size
    # skipping a column: the middle line of three along Y last
    r = request(chop_size=6.0)  # n = 4
    elements = oracle.walk(hole.hole_plan(r).moves, r.start)
    lines = [e for e in elements if is_line(e)]
    along_second = [e for e in lines if (e.a[0] == e.b[0]) == (lines[-1].a[0] == lines[-1].b[0])]
    assert len(along_second) == 3
    worst = oracle.largest_loose_ever(
        [e for e in lines if e is not along_second[1]], (r.x, r.y), r.radius, r.tool_radius, r.bottom, 0.05
    )
    assert worst > r.chop_size
