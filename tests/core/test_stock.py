# SPDX-License-Identifier: GPL-2.0-or-later
"""The stock map of the C core against closed forms, a slow reference model and algebra."""

import json
import math
import os

import numpy as np
import pytest

from chipwise.clib import core
from chipwise.stock import shared
from support.random_cases import random_count, random_seed, write_replay
from support import cuts, reference_stock as reference

KNOWN = {name: rest for name, *rest in cuts.known()}
# Share of the volume by which the core may miss it, per cell size in mm.
LIMIT = {0.1: 0.001, 0.25: 0.003}
BOX = ((-12.0, -12.0, -6.0), (12.0, 12.0, 0.0))
TOOLS = [(6, 0, 0), (4, 2, 0), (8, 1.5, 0), (8, 0, 90), (6, 0.5, 20)]


def cut(points, tool=(6, 0, 0), cell=0.25, box=BOX):
    """A stock after a chain of moves."""
    stock = core.Stock(*box, cell)
    cutter = core.Cutter(stock, core.Tool(*tool), points[0])
    for point in points[1:]:
        cutter.to(point)
    return stock


def heights(stock):
    """Mean height of every cell over the bottom (ny, nx), mm."""
    return shared.mean_heights(stock.cells, stock.head) - stock.head.z_min


# --- closed forms ------------------------------------------------------------


@pytest.mark.parametrize("cell", LIMIT)
@pytest.mark.parametrize("name", KNOWN)
def test_known_volume(name, cell):
    tool, points, volume = KNOWN[name]
    assert cuts.core_volume(tool, points, cell) == pytest.approx(volume, rel=LIMIT[cell])


@pytest.mark.parametrize("cell", LIMIT)
def test_helix_volume(cell):
    assert cuts.core_volume((6, 0, 0), cuts.helix(), cell) == pytest.approx(cuts.helix_volume(), rel=LIMIT[cell])


@pytest.mark.parametrize("cell", LIMIT)
@pytest.mark.parametrize(
    "name", ["slot 17 deg", "ball groove 31 deg", "vee groove 45 deg", "ramp 73 deg", "tapered groove 17 deg"]
)
def test_known_volume_in_servo_steps(name, cell):
    """The same way in steps of 0.02 mm, as the realtime component cuts it."""
    tool, points, volume = KNOWN[name]
    count = math.ceil(np.linalg.norm(points[1] - points[0]) / 0.02)
    steps = points[0] + (points[1] - points[0]) * np.linspace(0, 1, count + 1)[:, None]
    assert cuts.core_volume(tool, steps, cell) == pytest.approx(volume, rel=LIMIT[cell])


def test_wrong_diameter_is_seen():
    """Sabotage: a tool 1 % too large for the core must fail the check above, at each cell size."""
    for name in ("slot 17 deg", "ramp 31 deg", "ball groove 45 deg", "plunge flat"):
        tool, points, volume = KNOWN[name]
        for cell, limit in LIMIT.items():
            wrong = (
                cuts.core_volume(tool, points, cell, diameter_error=0.01 * tool[0])
                if not tool[1]
                else cuts.core_volume((tool[0] * 1.01, tool[1] * 1.01, 0), points, cell)
            )
            assert abs(wrong / volume - 1.0) > limit, name


def test_reference_meets_the_closed_forms():
    """The judge is judged: needles 0.05 mm apart, within four of its own deviations (each
    0.01..0.03 %) and 0.02 % for the steps of a move."""
    own = reference.ReferenceStock(cuts.LOW, cuts.HIGH, 0.05)
    for name in (
        "slot 0 deg",
        "slot 17 deg",
        "ramp 31 deg",
        "ball groove 45 deg",
        "vee groove 73 deg",
        "plunge ball",
        "raster pocket 17 deg",
    ):
        tool, points, volume = KNOWN[name]
        allowed = 4 * own.error_mm3(90 if "raster" in name else 45, 3) + 2e-4 * volume
        assert cuts.reference_volume(tool, points, 0.05) == pytest.approx(volume, abs=allowed), name


def test_reference_profile_is_the_tool():
    for shape in TOOLS:
        tool, solid = core.Tool(*shape), reference.ReferenceTool(*shape)
        r = np.linspace(0.0, solid.radius, 200)
        assert [tool.height(x) for x in r] == pytest.approx(list(solid.surface(r)), abs=1e-6)


# --- random moves against the reference -------------------------------------


def random_case(random):
    """Tool and points of a random job in BOX; the tool is lifted or dives, leaves the box, too."""
    tool = TOOLS[random.integers(len(TOOLS))]
    points = [[*random.uniform(-11, 11, 2), float(random.uniform(-4, 1))]]
    for _ in range(random.integers(1, 6)):
        x, y, z = points[-1]
        kind = random.integers(4)
        if kind == 0:  # plunge or lift
            points.append([x, y, float(random.uniform(-5, 1))])
        elif kind == 1:  # ramp
            points.append([*random.uniform(-14, 14, 2), float(random.uniform(-5, 0))])
        else:  # level
            points.append([*random.uniform(-14, 14, 2), z])
    return {"tool": list(tool), "points": [[float(v) for v in p] for p in points]}


def judge_random(case, diameter_error=0.0):
    """None, or what is wrong: core at 0.1 mm cells against needles 0.06 mm apart."""
    points = np.array(case["points"])
    spacing = 0.06
    low, high = BOX
    got = cuts.core_volume(case["tool"], points, 0.1, diameter_error, low, high)
    want = cuts.reference_volume(case["tool"], points, spacing, low, high)
    toolpath = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1).sum()
    outline = 2 * toolpath + math.pi * case["tool"][0] * len(points)
    chance = 0.41 * spacing**1.5 * math.sqrt(outline) * 4.0  # mm3, one deviation, 4 mm deep
    allowed = 0.001 * want + 4.0 * chance
    if abs(got - want) <= allowed:
        return None
    return f"core {got:.4f} mm3, reference {want:.4f} mm3, allowed difference {allowed:.4f}"


def test_random_moves():
    seed, count = random_seed(), random_count(6)
    random = np.random.default_rng(seed)
    replay = os.environ.get("CHIPWISE_REPLAY")
    cases = [json.load(open(replay))] if replay else (random_case(random) for _ in range(count))
    for number, case in enumerate(cases):
        wrong = judge_random(case)
        if wrong:
            path = write_replay("stock_moves", case)
            pytest.fail(f"case {number} of seed {seed}: {wrong}; CHIPWISE_REPLAY={path} repeats it")


def test_random_judge_sees_a_wrong_tool():
    """Sabotage: 2 % more diameter must be seen in most jobs that cut at all."""
    random = np.random.default_rng(5)
    cases = [random_case(random) for _ in range(5)]
    seen = sum(judge_random(case, 0.02 * case["tool"][0]) is not None for case in cases)
    assert seen >= 3


# --- algebra -----------------------------------------------------------------

ZIGZAG = [[-8, -6, -2], [8, -6, -2], [8, -3, -3], [-8, 0, -3], [-2, 5, -1], [9, 9, -4], [9, 9, 1]]


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("cell", [0.1, 0.25, 0.7])
def test_removed_and_left_are_the_box(tool, cell):
    """Also with a box whose size is not a multiple of the cell."""
    low, high = (-12.03, -11.9, -6.1), (12.22, 12.01, 0.05)
    stock = cut(ZIGZAG, tool, cell, (low, high))
    whole = float(np.prod(np.subtract(high, low)))
    assert stock.head.removed + stock.volume() == pytest.approx(whole, rel=2e-5)
    assert stock.head.removed > 0.0


@pytest.mark.parametrize("tool", TOOLS)
def test_cells_never_rise(tool):
    stock = core.Stock(*BOX, 0.25)
    cutter = core.Cutter(stock, core.Tool(*tool), ZIGZAG[0])
    random = np.random.default_rng(random_seed())
    before = heights(stock).copy()
    rounding = 2 * stock.head.drop_unit + 1e-6
    for point in [*ZIGZAG[1:], *[[*random.uniform(-13, 13, 2), random.uniform(-5, 0)] for _ in range(30)]]:
        assert cutter.to(point) >= -rounding
        after = heights(stock)
        assert (after <= before + rounding).all()
        before = after.copy()


@pytest.mark.parametrize("tool", TOOLS)
def test_cut_again_changes_nothing(tool):
    stock = core.Stock(*BOX, 0.25)
    cutter = core.Cutter(stock, core.Tool(*tool), [-8, -5, -3])
    first = cutter.to([8, 4, -3])
    for point in ([-8, -5, -3], [8, 4, -3]):
        assert cutter.to(point) == pytest.approx(0.0, abs=1e-4 * first)


def test_plunge_then_retract():
    stock = core.Stock(*BOX, 0.25)
    cutter = core.Cutter(stock, core.Tool(6), [1, 2, 1])
    assert cutter.to([1, 2, -3]) == pytest.approx(27 * math.pi, rel=0.003)
    assert cutter.to([1, 2, 1]) == 0.0


def test_air_cuts_nothing():
    stock = core.Stock(*BOX, 0.25)
    cutter = core.Cutter(stock, core.Tool(6), [-30, 0, -3])
    assert cutter.to([-30, 20, -3]) == 0.0
    assert cutter.to([-30, 20, 0.5]) == 0.0
    assert cutter.to([30, 20, 0.5]) == 0.0
    assert stock.volume() == pytest.approx(24 * 24 * 6)


@pytest.mark.parametrize("tool", TOOLS)
def test_order_does_not_matter(tool):
    """Level cuts in any order remove the same, within the 0.3 % of a 0.25 mm cell."""
    moves = [([-8, -6, -2], [8, -6, -2]), ([-8, 6, -3], [8, 1, -3]), ([0, -9, -1], [2, 9, -1])]
    volumes = []
    for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0)):
        stock = core.Stock(*BOX, 0.25)
        for i in order:
            core.Cutter(stock, core.Tool(*tool), moves[i][0]).to(moves[i][1])
        volumes.append(stock.head.removed)
    assert max(volumes) / min(volumes) - 1.0 < 0.003


@pytest.mark.parametrize("cell", LIMIT)
def test_layers_share_a_wall(cell):
    """A slot cut in four layers is the slot cut at once: the walls lie on each other."""
    _, points, volume = KNOWN["slot 17 deg"]
    layers = [np.array([x, y, z]) for z in (-0.5, -1.0, -1.5, -2.0) for x, y, _ in points]
    assert cuts.core_volume((6, 0, 0), layers, cell) == pytest.approx(volume, rel=LIMIT[cell])


@pytest.mark.parametrize("tool", TOOLS)
def test_turned_and_mirrored(tool):
    """A quarter turn and a mirror map cells onto cells: the map is the same, turned."""
    path = np.array(ZIGZAG, float)
    plain = heights(cut(path, tool))
    x, y, z = path.T
    for turned, back in (
        (np.column_stack([-y, x, z]), lambda h: np.rot90(h, 1)),
        (np.column_stack([-x, y, z]), lambda h: h[:, ::-1]),
        (np.column_stack([x, -y, z]), lambda h: h[::-1]),
        (np.column_stack([y, x, z]), lambda h: h.T),
    ):
        assert np.allclose(back(heights(cut(turned, tool))), plain, atol=2e-3)


def test_moved_by_whole_cells():
    """Translation by a multiple of the cell: the same map."""
    shift = np.array([100.25, -73.5, 10.0])
    box = tuple(np.add(b, shift) for b in BOX)
    assert np.allclose(heights(cut(ZIGZAG)), heights(cut(np.add(ZIGZAG, shift), box=box)), atol=2e-4)


@pytest.mark.parametrize("shift", [(0.1, 0.05), (0.125, 0.125), (0.01, 0.24)])
def test_moved_by_part_of_a_cell(shift):
    """Any other translation: the same volume within 0.3 %."""
    volume = cut(ZIGZAG).head.removed
    moved = cut(np.add(ZIGZAG, [*shift, 0.0])).head.removed
    assert moved == pytest.approx(volume, rel=0.003)


def test_refused_boxes_keep_the_stock():
    stock = cut(ZIGZAG)
    before = stock.volume()
    nan, inf = math.nan, math.inf
    for low, high in (
        ((nan, 0, 0), (1, 1, 1)),
        ((0, 0, 0), (1, inf, 1)),
        ((0, 0, 0), (0, 1, 1)),
        ((0, 0, 0), (1, 1, -1)),
        ((0, 0, 0), (1e6, 1e6, 1)),
        ((-1e308,) * 3, (1e308,) * 3),
    ):
        with pytest.raises(core.CoreError):
            stock.define(low, high)
        assert stock.volume() == before


# --- the cell of a stock ------------------------------------------------------------------------------------------


def test_a_small_stock_has_small_cells():
    """As small as the map's memory allows, between `finest` and `cell`, whatever box comes after which; refused only
    what the coarsest cells cannot hold."""
    rng = np.random.default_rng(20261123)
    stock = core.Stock((0, 0, -5), (300, 200, 0), core.CellSides(0.25, 0.1))
    capacity = stock.head.capacity
    for number in range(300):
        size = rng.uniform(0.05, 1.0, 2) ** 2 * (330, 230)
        turn = float(rng.choice([0.0, rng.uniform(-3, 3)]))
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        hull = (c * size[0] + s * size[1], s * size[0] + c * size[1])
        fits = core.library().chip_stock_cells(0.25, *hull)
        case = f"box {number}: {size[0]!r} by {size[1]!r} mm, turn {turn!r}"
        if not fits or fits > capacity:
            with pytest.raises(core.CoreError):
                stock.define((0, 0, -5), (*size, 0), turn=turn)
            continue
        stock.define((0, 0, -5), (*size, 0), turn=turn)
        head = stock.head
        cells = (head.nx + 2) * (head.ny + 2)
        assert 0.1 <= head.cell <= 0.25 and cells <= capacity, case
        if head.cell > 0.1 and head.cell < 0.25:
            finer = core.library().chip_stock_cells(head.cell - 0.002, *hull)
            assert finer > 0.985 * capacity, case  # hardly a smaller one would fit
        assert stock.volume() == pytest.approx(5 * size[0] * size[1], rel=1e-5), case


def test_without_a_finer_cell_all_stocks_have_the_same():
    finer = [core.CellSides(0.25, finest) for finest in (0.25, 0.3, 0.0, -1.0, math.nan, math.inf)]
    for cell in (0.25, *finer):
        assert core.Stock((0, 0, -5), (10, 10, 0), cell, capacity=100_000).head.cell == 0.25, cell
