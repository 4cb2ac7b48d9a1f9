# SPDX-License-Identifier: GPL-2.0-or-later
"""G24 and `chipwise surface`: a curved surface is cut in one direction, with pick feeds between the cuts.

Called by planner/plans.py and options/surface_program.py.  Pure but for the model's file; mm.  surface_moves.py has the
    moves.
    all cuts        over the whole model, in one level
    depth           in levels: each cut goes no lower than its level, and only where the stock needs it
    least           only where the stock reaches more than that above what the tool leaves of it: the rest that a larger
                    tool has left
The stock is the one that the requests before (`earlier`) have left.
"""

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np

from chipwise.clib.height_map import HeightMap, Shape, least_cell
from chipwise.cycles.plan import CyclePlan, Note, Report
from chipwise.cycles.surface_moves import LOWEST, PICK_FEED, ZIGZAG, Driver
from chipwise.cycles.word_checks import EQUAL, MAX_PASSES, MOST_MOVES, check_feeds, check_moves, check_step
from chipwise.errors import CycleError
from chipwise.surface import needed, raster, scallop
from chipwise.clib.drop_cutter import Mesh, Probe
from chipwise.surface.links import Obstacles
from chipwise.surface.model import Placing, check_size, read_model

LEAST_TOLERANCE = 1e-3  # mm
CELLS = 0.01, 10.0  # mm: of the stock's map
MAX_ALLOWANCE = 1000.0  # mm
OFF_MM = 0.01  # mm, that the holder keeps the tool up before the operator is asked to look
MOST_TRACKS = 20_000
LEAST_SCALLOP = 1e-3  # mm
LEAST_STOCK = 0.05  # mm: a level leaves what reaches no more than this above it
LINK_MOVES = 8  # of a link, about
_SHARE = 0.85  # of the progress, until the links are planned


@dataclass(frozen=True)
class SurfaceRequest:
    """A surface, in mm and absolute work coordinates.

    file, stamp  path of the model, and (time of change, size) of it: the plan is kept for them
    placing      model.Placing
    bottom       Z: the tip goes no lower; None: the bottom of the model
    clearance    clearance plane; None: CLEAR_MM above the model and the stock
    tool         check.sweep.Shape
    step         D: largest step-over
    scallop      height along the normal that the cuts may leave between them; None: all are as far apart as D allows
    direction    L: degrees
    allowance    I: left on the model, all over
    relief       K: tool relief
    link         P: 0 over the clearance plane, 1 the lowest safe link, 2 zigzag
    climb        one-way cuts have the stock on their right
    tolerance    how far the path may be above the lowest one
    stock_top    nothing is above it; None: the clearance plane, for all that is known, or with stock_is_model the top
                 of the model
    cell         of the stock's map
    margin       how far the tool's centre goes beyond the model in X and Y
    depth        largest depth of a level; None: one level
    least        only where the stock reaches more than this above what the tool leaves; None: LEAST_STOCK in levels,
                 else everywhere
    arcs         cuts along X or Y may have arcs of G18 and G19
    ramp_angle   degrees, into full stock of a level
    traverse_clearance  mm that a rapid keeps from stock at its side
    flute_length of the tool; 0: not known
    earlier      SurfaceRequests of the same model whose cuts have been taken from the stock, in their order
    feed         mm/min (mm per revolution under G95); plunge_feed: E, same unit; feed_per: "min" or "rev"
    start        (x, y, z) of the tool; None: above the first cut, on the clearance plane
    most_moves   a cycle of more is refused
    """

    file: str
    stamp: tuple
    placing: Placing
    bottom: float | None
    clearance: float | None
    tool: Shape
    step: float
    feed: float
    plunge_feed: float
    start: tuple | None
    direction: float = 0.0
    allowance: float = 0.0
    relief: float = 1.0
    link: int = PICK_FEED
    climb: bool = True
    tolerance: float = 0.01
    stock_top: float | None = None
    stock_is_model: bool = False
    cell: float = 0.25
    margin: float = 0.0
    most_moves: int = MOST_MOVES
    feed_per: str = "min"
    depth: float | None = None
    least: float | None = None
    scallop: float | None = None
    ramp_angle: float = 3.0
    traverse_clearance: float = 0.2
    arcs: bool = True
    flute_length: float = 0.0
    earlier: tuple = ()


@dataclass(frozen=True)
class SurfacePlan(CyclePlan):
    """A CyclePlan; cuts: number; sampled: drop-cutter points; low, high: the model's box, mm; clearance:
    mm; first: (x, y) of the first cut; beyond_flutes: cuts are deeper than the flutes are long"""

    cuts: int = 0
    sampled: int = 0
    low: tuple = field(default=())
    high: tuple = field(default=())
    clearance: float = 0.0
    first: tuple = field(default=())
    beyond_flutes: bool = False


CLEAR_MM = 5.0  # of the clearance plane above model and stock, if nobody says it


def check(r):
    """Raise CycleError for a request that cannot be done, whatever the model."""
    if r.tool.diameter <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=r.tool.diameter)
    check_step("step-over", "D", r.step, r.tool.diameter)
    if not 0 <= r.allowance <= MAX_ALLOWANCE:
        raise CycleError(
            "allowance I{i} is not from 0 to {most}", "use I of 0 or more", i=r.allowance, most=MAX_ALLOWANCE
        )
    if r.relief < 0:
        raise CycleError("tool relief K{k} is negative", "use K of 0 or more", k=r.relief)
    if r.link not in (PICK_FEED, LOWEST, ZIGZAG):
        raise CycleError(f"link P{r.link:g} is not known", "use P0, P1 or P2")
    if r.direction != int(r.direction) or abs(r.direction) > 360:
        raise CycleError(f"direction L{r.direction:g} is not a whole number of degrees from -360 to 360", "correct L")
    if not LEAST_TOLERANCE <= r.tolerance <= 1:
        raise CycleError(
            "tolerance {t} is not from {least} to {most}",
            "correct the tolerance",
            t=r.tolerance,
            least=LEAST_TOLERANCE,
            most=1.0,
        )
    if not CELLS[0] <= r.cell <= CELLS[1]:
        raise CycleError(
            "cell {c} is not from {least} to {most}", "correct --cell", c=r.cell, least=CELLS[0], most=CELLS[1]
        )
    if r.depth is not None and not r.depth > 0:
        raise CycleError("depth of a level {j} is not above 0", "use a depth above 0", j=r.depth)
    if r.scallop is not None and not r.scallop > 0:
        raise CycleError("scallop {h} is not above 0", "use a height above 0", h=r.scallop)
    if r.scallop is not None and r.scallop < LEAST_SCALLOP:
        raise CycleError("scallop {h} is below {least}", "use {least} or more", h=r.scallop, least=LEAST_SCALLOP)
    if r.least is not None and not r.least > 0:
        raise CycleError("rest of {l} is not above 0", "use a height above 0", l=r.least)
    check_feeds(r)


@lru_cache(maxsize=2)
def _model(file, stamp, placing):
    """The model: a run plans what its preview has read."""
    return read_model(file, placing)


def surface_plan(request, progress=None):
    """The whole cycle.  Raises CycleError, before any move, if it cannot be done."""
    check(request)
    return _planned(request, _box(request), progress)[0]


@lru_cache(maxsize=4)
def _planned(r, box, progress=None):
    """(SurfacePlan, the heights of the stock after it); box: of the stock, ((3,), (3,)) mm."""
    said = progress or (lambda share: None)
    model = _model(r.file, r.stamp, r.placing)
    check_size(model, r.tool.diameter)
    heights = _heights(r, model)
    probe = Probe(Mesh(model, r.tool.diameter / 2), r.tool, r.allowance, heights.bottom)
    tracks = _tracks(r, model, probe)
    cuts, sampled = raster.chains(probe, tracks, r.tool, _tolerance(r), lambda share: said(_SHARE * share), r.arcs)
    check_moves(sum(cut.moves for cut in cuts) + LINK_MOVES * len(cuts), r, "use a larger D or tolerance")
    stock = _stock_before(r, box)
    ridge = max(scallop.unseen(one.tool, one.step, stock.cell) for one in (*r.earlier, r))
    driver = Driver(
        r,
        heights.clearance,
        Obstacles(probe, r.tool, stock, ridge, r.traverse_clearance),
        probe,
        model.low[:2] - r.margin,
        model.high[:2] + r.margin,
    )
    count = _follow(driver, r, tracks, cuts, lambda share: said(_SHARE + (1 - _SHARE) * share))
    moves = driver.moves()
    notes = (
        tuple(Note(text, {}) for text in model.notes)
        + _holder_notes(probe, cuts)
        + _stock_notes(driver, r.flute_length)
    )
    if not count:
        notes += (
            Note("the stock is nowhere more than {l} above what this tool leaves: nothing is cut", {"l": _least(r)}),
        )
    figures = dict(cuts=count, sampled=sampled, moves=len(moves))
    first = driver.first or tuple(cuts[0].points[0, :2].tolist())
    return SurfacePlan(
        moves,
        notes,
        partial(Report, "surface", figures),
        count,
        sampled,
        tuple(model.low.tolist()),
        tuple(model.high.tolist()),
        heights.clearance,
        first,
        0 < r.flute_length < driver.deepest - OFF_MM,
    ), stock.height


# ---- heights and stock -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Heights:
    """mm: the floor, the clearance plane, and the top of the stock's map"""

    bottom: float
    clearance: float
    stock_top: float


def _heights(r, model):
    """_Heights of a request.  Raises CycleError for a clearance plane that is not clear."""
    bottom = float(model.low[2]) if r.bottom is None else r.bottom
    top = float(model.high[2]) + r.allowance
    stock_top = top if r.stock_top is None and r.stock_is_model else r.stock_top
    clearance = max(top, top if stock_top is None else stock_top) + CLEAR_MM if r.clearance is None else r.clearance
    if bottom >= clearance - EQUAL:
        raise CycleError(
            "final depth Z{z} is not below the clearance plane R{r}",
            "use Z below R or R above Z",
            z=bottom,
            r=clearance,
        )
    for what, height in (("model", top), ("stock", stock_top)):
        if height is not None and clearance < height - EQUAL:
            raise CycleError(
                f"clearance plane R{{r}} is below the top of the {what} ({{top}})",
                "use R above {top}",
                r=clearance,
                top=height,
            )
    return _Heights(bottom, clearance, clearance if stock_top is None else stock_top)


def _box(r):
    """The box of the stock: that of the cuts of a request and those before it, with the tools about them -> ((3,),
    (3,)) mm."""
    low, high = [], []
    for one in (*r.earlier, r):
        model, more = _model(one.file, one.stamp, one.placing), one.margin + one.tool.diameter
        heights = _heights(one, model)
        bottom = min(heights.bottom, float(model.low[2]))
        low.append((*(model.low[:2] - more), bottom - 1.0))
        high.append((*(model.high[:2] + more), max(heights.stock_top, bottom + 1e-3)))
    return tuple(np.min(low, axis=0).tolist()), tuple(np.max(high, axis=0).tolist())


def _stock_before(r, box):
    """HeightMap of the stock that the requests before have left."""
    stock = HeightMap(*box, max(r.cell, least_cell(*box)))
    if r.earlier:
        before = _planned(replace(r.earlier[-1], earlier=r.earlier[:-1], cell=r.cell), box)[1]
        stock.height[:] = before
    return stock


# ---- cuts --------------------------------------------------------------------------------------------------------


def _tolerance(r):
    """Of the path: it comes on top of the scallop."""
    return r.tolerance if r.scallop is None else min(r.tolerance, scallop.PATH_SHARE * r.scallop)


def _tracks(r, model, probe):
    """The cuts as tracks seen from above; of a zigzag over all of the model with the links between them."""
    low, high = model.low[:2] - r.margin, model.high[:2] + r.margin
    if raster.count_of(low, high, r.direction, r.step) > MOST_TRACKS:
        raise CycleError(
            f"step-over D{{d}} needs more than {MOST_TRACKS} cuts side by side", "use a larger D", d=r.step
        )
    if r.scallop is None:
        across = raster.evenly(low, high, r.direction, r.step)
    else:
        stations = scallop.Stations(probe, r.tool, low, high, r.direction)
        across = stations.across(r.step, r.scallop - _tolerance(r), MOST_TRACKS)
        if across is None:
            raise CycleError(
                f"a scallop of {{h}} needs more than {MOST_TRACKS} cuts side by side",
                "use a larger scallop",
                h=r.scallop,
            )
    tracks = raster.parallel(low, high, r.direction, across, r.climb)
    if r.link != ZIGZAG:
        return tracks
    tracks = tracks.backwards(np.arange(len(tracks.length)) % 2 == 1)
    return tracks if _in_segments(r) else raster.with_links(tracks)


def _in_segments(r):
    """Whether only what the stock needs is cut."""
    return r.depth is not None or r.least is not None


def _least(r):
    return LEAST_STOCK if r.least is None else r.least


def _follow(driver, r, tracks, cuts, said):
    """Adds all cuts to the Driver, or what the stock needs of them -> their number."""
    if not _in_segments(r):
        for number, cut in enumerate(cuts):
            driver.add(cut)
            said(number / len(cuts))
        return len(cuts)
    levels, count = _levels(r, cuts, driver.obstacles.stock), 0
    for number, level in enumerate(levels):
        for one in _wanted(driver, r, tracks, cuts, level):
            driver.add_segment(one.curve, level)
            count += 1
            check_moves(len(driver.mover.moves), r, "use a larger D, tolerance or depth")
        said((number + 1) / len(levels))
    return count


def _levels(r, cuts, stock):
    """The heights of the levels, falling (mm); [None] for one level that is the surface."""
    if r.depth is None:
        return [None]
    top, low = float(stock.height.max()), min(float(cut.points[:, 2].min()) for cut in cuts)
    count = max(1, math.ceil((top - low) / r.depth - 1e-6))
    if count > MAX_PASSES:
        raise CycleError(f"depth of a level {{j}} needs more than {MAX_PASSES} levels", "use a larger depth", j=r.depth)
    return [top - (top - low) * k / count for k in range(1, count + 1)]


def _wanted(driver, r, tracks, cuts, level):
    """The Segments of a level in the order they are cut: looked for track by track in a stock that each of
    them is taken out of."""
    obstacles, stock, found = driver.obstacles, driver.obstacles.stock, []
    before = stock.height.copy()
    direction = tracks.direction[0]
    for number, cut in enumerate(cuts):
        lowest = cut if level is None else needed.clipped(cut, level)
        raised = obstacles.held_up(lowest)[0]
        for one in needed.segments(stock, obstacles.tool, lowest, _least(r)) if raised is not lowest else ():
            driver.held_up(one.curve)
        mine = needed.segments(stock, obstacles.tool, raised, _least(r), number, direction)
        for one in mine:
            obstacles.cut(one.curve.points)
        found += mine
    stock.height[:] = before
    return needed.in_order(found, None if driver.mover is None else driver.mover.xy)


def _holder_notes(probe, cuts):
    """What the operator should know if the holder kept the tool away."""
    if not probe.has_holder:
        return ()
    points = np.concatenate([cut.points for cut in cuts])
    raised = probe.raised(points[:, :2])
    if raised.max() <= OFF_MM:
        return ()
    x, y = points[int(raised.argmax()), :2]
    return (
        Note(
            "the holder keeps the tool up to {h} above the surface, most at X{x} Y{y}; use a longer tool",
            {"h": float(raised.max()), "x": x, "y": y},
        ),
    )


def _stock_notes(driver, flute_length):
    """What the operator should know if there was stock beside the holder, or above the flutes."""
    notes = ()
    if driver.held > OFF_MM:
        x, y = driver.held_at
        notes += (
            Note(
                "stock beside the holder keeps the tool up to {h} higher, most at X{x} Y{y}; rough there first, or use "
                "a longer tool",
                {"h": driver.held, "x": x, "y": y},
            ),
        )
    if 0 < flute_length < driver.deepest - OFF_MM:
        notes += (
            Note(
                "the cuts are up to {d} deep, the flutes are {f} long; rough in levels first",
                {"d": driver.deepest, "f": flute_length},
            ),
        )
    return notes
