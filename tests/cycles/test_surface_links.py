# SPDX-License-Identifier: GPL-2.0-or-later
"""The links of P1 between random cuts of surface_plan(), judged apart (support/link_judge.py): no contact as LinuxCNC
rounds them, the relief, the lead-in, and that they are quick."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from support import drop_oracle, link_judge, surface_cases, surface_judge
from support.random_cases import random_count, random_seed

from chipwise.clib.height_map import HeightMap, Shape
from chipwise.cycles.surface import surface_plan
from chipwise.gcode_lines import chunks, texts
from chipwise.moves import CALLERS_PATH, Blend, Line, Rapid
from chipwise.surface.links import Obstacles
from chipwise.surface.model import Placing, read_model
from chipwise.surface.scallop import unseen

TOOLS = {"flat": Shape(6), "ball": Shape(6, 3), "bull": Shape(6, 1), "vee": Shape(6, 0, 60), "tapered": Shape(4, 1, 20)}
START = surface_cases.START
ENDS_MM = 4.0  # from the ends of a link: further away the relief is kept
KEPT = 0.4  # of it, where a corner is rounded


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return surface_cases.model_files(tmp_path_factory.mktemp("models"), dome=surface_cases.sphere(9.0, 48))


def request(file, tool, **fields):
    return surface_cases.request(file, **{"tool": TOOLS[tool], "step": 1.0, "link": 1, "tolerance": 0.03, **fields})


def depths_of(plan, r, seed, positions):
    return surface_judge.Needles(plan.low, plan.high, plan.high[2] + r.allowance, 3000, seed).follow(
        plan.moves, START, r.tool, positions
    )


def random_request(files, rng):
    depth = float(rng.choice([0, 1.5])) or None
    return request(
        files[rng.choice(sorted(files))],
        rng.choice(sorted(TOOLS)),
        direction=float(rng.integers(0, 360)),
        step=float(rng.uniform(0.6, 2.5)),
        relief=float(rng.choice([0.2, 0.5, 1.0, 2.0])),
        cell=float(rng.choice([0.15, 0.25, 0.4])),
        depth=depth,
        link=int(rng.choice([1, 2])) if depth else 1,
        allowance=float(rng.choice([0, 0.3])),
        climb=bool(rng.integers(0, 2)),
    )


def test_no_link_meets_stock_however_its_corners_are_rounded(files):
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(3)):
        r = random_request(files, rng)
        plan = surface_plan(r)
        for positions in (surface_judge.positions, link_judge.rounded_positions):
            depths = depths_of(plan, r, case, positions)
            assert max(depths) <= surface_judge.RIDGE, (random_seed(), case, r)


def test_stock_behind_the_end_of_a_cut_counts_further_down():
    """A wall of 3 mm that a flat tool has passed at 2 mm: away from it the tool may go level, but not down beside it,
    into what is left of it."""
    stock = HeightMap((-10, -10, 0), (10, 10, 3), 0.25)
    stock.height[:] = 0.0
    stock.height[:, :40] = 2.0  # up to X0
    obstacles = Obstacles(SimpleNamespace(has_holder=False), Shape(6), stock)
    end = np.array([2.0, 0.0, 2.0])
    assert obstacles.lowest_ahead((2.0, 0.0), (2.5, 0.0), end) == pytest.approx(2.0)
    assert obstacles.lowest_ahead((5.0, 0.0), (5.5, 0.0), end) < 0.1  # out of its reach
    stock.height[:, :40] = 3.0  # it has been cut away where the tool was
    assert obstacles.lowest_ahead((2.0, 0.0), (2.5, 0.0), end) == pytest.approx(2.0)


def test_a_ridge_thinner_than_a_cell_is_kept_above():
    """A plane cut with steep tools: above each place of it the tool stays clear of the ridges as they are, of which the
    map may not have a top."""
    rng, short = np.random.default_rng(random_seed()), 0.0
    for case in range(random_count(20)):
        tool = Shape(float(rng.uniform(2, 4)), float(rng.uniform(0.1, 0.5)), float(rng.choice([20, 60])))
        cell, step, direction = (
            float(rng.uniform(0.1, 0.4)),
            float(rng.uniform(0.3, 0.9)) * tool.diameter / 2,
            math.radians(rng.uniform(0, 360)),
        )
        along, across = (
            np.array([math.cos(direction), math.sin(direction)]),
            np.array([-math.sin(direction), math.cos(direction)]),
        )
        stock = HeightMap((-5, -5, -1), (5, 5, 5), cell)
        for k in range(-14, 15):
            middle = k * step * across
            stock.cut(tool, (*(middle - 9 * along), 0.0), np.array([(*(middle + 9 * along), 0.0)]))
        obstacles = Obstacles(
            SimpleNamespace(has_holder=False, floor=0.0, heights=lambda xy: np.zeros(len(xy))),
            tool,
            stock,
            unseen(tool, step, cell),
        )
        height, _radius = drop_oracle.profile(tool)
        places = rng.uniform(-2, 2, (20, 2))
        nearest = np.abs((places @ across / step) % 1.0 - 0.5) * step  # to the middle between two cuts
        true = np.maximum(height(step / 2) - height(nearest), 0.0)
        told = obstacles.lowest_at(places)
        short = max(short, float((true - told).max()) + obstacles.ridge)
        assert (told >= true - 0.02 * true.max() - 1e-4).all(), (random_seed(), case, tool, cell, step, direction)
    assert short > 0.02  # what the map alone has


def test_the_judge_sees_low_links_and_rounds_corners(files):
    r = request(files["step"], "bull")
    plan = surface_plan(r)
    low = [
        Rapid(move.x, move.y, None if move.z is None else move.z - 1.8) if isinstance(move, Rapid) else move
        for move in plan.moves
    ]
    needles = surface_judge.Needles(plan.low, plan.high, plan.high[2], 3000, 1)
    assert max(needles.follow(low, START, r.tool, link_judge.rounded_positions)) > 0.05
    corner, blend = np.array([20.0, 0.0, 0.0]), 0.4
    points, _radii = link_judge.rounded([np.zeros(3), corner, np.array([20.0, 30.0, 0.0])], blend)
    assert np.linalg.norm(points - corner, axis=1).min() == pytest.approx(blend, abs=5e-3)
    points, _radii = link_judge.rounded([np.zeros(3), corner, np.array([20.0, 0.1, 0.0])], blend)
    assert np.linalg.norm(points - corner, axis=1).min() == pytest.approx(0.05 * (math.sqrt(2) - 1), abs=1e-3)


@pytest.mark.parametrize("name, tool", [("waves", "ball"), ("step", "flat"), ("dome", "bull")])
def test_the_relief_is_kept_away_from_the_ends(files, name, tool):
    """Above model (brute force) and stock (needles), where corners are rounded all of it but a part."""
    r = request(files[name], tool, relief=1.0)
    plan = surface_plan(r)
    triangles = surface_cases.triangles_of(read_model(r.file, Placing()))
    height, radius = drop_oracle.profile(r.tool)
    needles, rng, seen = (
        surface_judge.Needles(plan.low, plan.high, plan.high[2], 3000, 1),
        np.random.default_rng(random_seed()),
        0,
    )
    for is_rapid, points in link_judge.rounded_positions(plan.moves, START)[2:-1]:
        far = points[
            (np.linalg.norm(points[:, :2] - points[0, :2], axis=1) > ENDS_MM)
            & (np.linalg.norm(points[:, :2] - points[-1, :2], axis=1) > ENDS_MM)
        ]
        if not is_rapid:
            one = [Line(*points[-1], feed=1.0)]
            needles.follow(one, points[0], r.tool)
            continue
        for x, y, z in far[rng.integers(0, len(far), min(len(far), 2))]:
            apart = np.hypot(*(needles.xy - (x, y)).T)
            stock = (needles.height - height(np.minimum(apart, radius)))[apart <= radius].max()
            model = drop_oracle.lowest(triangles, r.tool, x, y, plan.low[2])
            assert z >= max(stock, model) + KEPT * r.relief, (x, y, z, stock, model)
            seen += 1
    assert seen > 20


@pytest.mark.parametrize("name, tool", [("waves", "ball"), ("step", "bull"), ("dome", "flat")])
def test_links_are_quicker_than_over_the_clearance_plane(files, name, tool):
    """By another planner: at most 0.75 of the time on these small models, where every link is short;
    bench/bench_surface.py has larger ones."""
    seconds = []
    for link in (0, 1):
        plan = surface_plan(request(files[name], tool, link=link, step=0.5, feed=1500.0, plunge_feed=600.0))
        seconds.append(sum(map(link_judge.seconds, link_judge.links_of(plan.moves, START))))
    assert seconds[1] <= 0.75 * seconds[0]


def test_the_lead_in_goes_down_at_the_plunge_feed(files):
    r = request(files["waves"], "ball")
    slanted = 0
    for link in link_judge.links_of(surface_plan(r).moves, START):
        feed, (above, start) = link.after
        assert (
            above[2] > start[2]
            and feed * (above[2] - start[2]) / math.dist(above, start) <= r.plunge_feed * (1 + 1e-9)
            and feed <= r.feed
        )
        slanted += math.dist(above[:2], start[:2]) > 0.1
    assert slanted > 10


def test_path_modes_of_the_lines(files):
    """G64 with its tolerance in program units for the traverses of each link, then the caller's again."""
    plan = surface_plan(request(files["waves"], "ball"))
    blends = [move.tolerance for move in plan.moves if isinstance(move, Blend)]
    assert set(blends[::2]) == {0.7} and set(blends[1::2]) == {None} and len(blends) % 2 == 0
    mode = None
    for move in plan.moves:
        mode = move.tolerance if isinstance(move, Blend) else mode
        assert mode is None or isinstance(move, (Blend, Rapid))
    rows = [line for chunk in chunks(plan.moves, START, 25.4) for row in chunk for line in row[1].split("\n")]
    assert (
        sum(line == f"G64 P{0.7 / 25.4:.9f}" for line in rows) >= len(blends) // 2
        and rows.count(CALLERS_PATH) == len(blends) // 2
    )
    program = list(texts(plan.moves, START, 1.0, 4, "G64 P0.002"))
    assert program.count("G64 P0.002") == len(blends) // 2 and CALLERS_PATH not in program


def test_without_relief_nothing_is_rounded(files):
    plan = surface_plan(request(files["step"], "ball", relief=0.0))
    assert not any(isinstance(move, Blend) for move in plan.moves)
    assert max(depths_of(plan, request(files["step"], "ball"), 1, surface_judge.positions)) <= surface_judge.RIDGE


def test_links_stay_over_the_rectangle(files):
    """Seen from above no move leaves the rectangle around the model and the margin, links beside the first and the last
    cut included."""
    rng = np.random.default_rng(random_seed())
    for case in range(random_count(3)):
        margin = float(rng.choice([0.0, 1.5]))
        r = request(
            files[rng.choice(sorted(files))],
            rng.choice(sorted(TOOLS)),
            direction=float(rng.integers(0, 360)),
            step=2.0,
            climb=bool(rng.integers(0, 2)),
            margin=margin,
        )
        plan = surface_plan(r)
        places = np.array(
            [(move.x, move.y) for move in plan.moves if getattr(move, "x", None) is not None and move.y is not None]
        )
        assert len(places) > 20
        assert (places >= np.array(plan.low[:2]) - margin - 1e-5).all() and (
            places <= np.array(plan.high[:2]) + margin + 1e-5
        ).all(), (random_seed(), case)
