# SPDX-License-Identifier: GPL-2.0-or-later
"""G24 and `chipwise surface`: a curved surface is cut in one direction, with pick feeds between the cuts.

Called by plans.py and cli/surface.py.  Pure but for the model's file; mm.
Source: the pick-feed abstract.  From the end Pe of a cut the tool goes up by the tool relief to Pa, to the foot Pb of Pa on the
clearance plane, to the foot Pc of Pd on it, and to Pd, the tool relief above the start Ps of the next cut; then to Ps.
Departs from it: Pa and Pd are not above the clearance plane; Pd is above the stock as it has been cut so far, if that is higher.
"""

from dataclasses import dataclass, field
from functools import lru_cache, partial

import numpy as np

from chipwise.check.sweep import Shape
from chipwise.cycles.mover import Mover
from chipwise.cycles.plan import CyclePlan, Note, Report
from chipwise.cycles.word_checks import EQUAL, MOST_MOVES, check_feeds, check_moves, check_step
from chipwise.errors import CycleError
from chipwise.moves import Line, Rapid
from chipwise.surface import raster
from chipwise.surface.drop import Mesh, Probe
from chipwise.surface.links import Obstacles
from chipwise.surface.model import Placing, read_model

PICK_FEED, LOWEST, ZIGZAG = 0, 1, 2
LEAST_TOLERANCE = 1e-3      # mm
MAX_ALLOWANCE = 1000.0      # mm
OFF_MM = 0.01               # mm, that the holder keeps the tool up before the operator is asked to look
MOST_TRACKS = 20_000
REST_MOVES = 10_000         # of a zigzag without a place to rest (lines.MOST_MOVES)
LIFT_MM = 0.1
_SHARE = 0.85               # of the progress, until the links are planned


@dataclass(frozen=True)
class SurfaceRequest:
    """A surface, in mm and absolute work coordinates.

    file, stamp  path of the model, and (time of change, size) of it: the plan is kept for them
    placing      model.Placing
    bottom       Z: the tip goes no lower; None: the bottom of the model
    clearance    clearance plane; None: CLEAR_MM above the model and the stock
    tool         check.sweep.Shape
    step         D: largest step-over
    direction    L: degrees
    allowance    I: left on the model, all over
    relief       K: tool relief
    link         P: 0 over the clearance plane, 1 the lowest safe link, 2 zigzag
    climb        one-way cuts have the stock on their right
    tolerance    how far the path may be above the lowest one
    stock_top    nothing is above it; None: the clearance plane, for all that is known, or with stock_is_model the top of the model
    cell         of the stock's map
    margin       how far the tool's centre goes beyond the model in X and Y
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


@dataclass(frozen=True)
class SurfacePlan(CyclePlan):
    """A CyclePlan; cuts: number; sampled: drop-cutter points; low, high: the model's box, mm; clearance:
    mm; first: (x, y) of the first cut"""

    cuts: int = 0
    sampled: int = 0
    low: tuple = field(default=())
    high: tuple = field(default=())
    clearance: float = 0.0
    first: tuple = field(default=())


CLEAR_MM = 5.0              # of the clearance plane above model and stock, if nobody says it


def check(r):
    """Raise CycleError for a request that cannot be done, whatever the model."""
    if r.tool.diameter <= 0:
        raise CycleError("tool diameter {d} is not above 0 mm", "load a tool with a diameter", d=r.tool.diameter)
    check_step("step-over", "D", r.step, r.tool.diameter)
    if not 0 <= r.allowance <= MAX_ALLOWANCE:
        raise CycleError("allowance I{i} is not from 0 to {most}", "use I of 0 or more", i=r.allowance, most=MAX_ALLOWANCE)
    if r.relief < 0:
        raise CycleError("tool relief K{k} is negative", "use K of 0 or more", k=r.relief)
    if r.link not in (PICK_FEED, LOWEST, ZIGZAG):
        raise CycleError(f"link P{r.link:g} is not known", "use P0, P1 or P2")
    if r.direction != int(r.direction) or abs(r.direction) > 360:
        raise CycleError(f"direction L{r.direction:g} is not a whole number of degrees from -360 to 360", "correct L")
    if not LEAST_TOLERANCE <= r.tolerance <= 1:
        raise CycleError("tolerance {t} is not from {least} to {most}", "correct the tolerance", t=r.tolerance, least=LEAST_TOLERANCE, most=1.0)
    check_feeds(r)


@lru_cache(maxsize=2)
def _model(file, stamp, placing):
    """The model: a run plans what its preview has read."""
    return read_model(file, placing)


@lru_cache(maxsize=4)
def surface_plan(request, progress=None):
    """The whole cycle.  Raises CycleError, before any move, if it cannot be done."""
    r, said = request, progress or (lambda share: None)
    check(r)
    model = _model(r.file, r.stamp, r.placing)
    bottom = float(model.low[2]) if r.bottom is None else r.bottom
    top = float(model.high[2]) + r.allowance
    stock_top = top if r.stock_top is None and r.stock_is_model else r.stock_top
    clearance = max(top, top if stock_top is None else stock_top) + CLEAR_MM if r.clearance is None else r.clearance
    _check_clearance(bottom, clearance, top, stock_top)
    probe = Probe(Mesh(model, r.tool.diameter / 2), r.tool, r.allowance, bottom)
    tracks = _tracks(r, model)
    cuts, sampled = raster.chains(probe, tracks, r.tool, r.tolerance, lambda share: said(_SHARE * share))
    check_moves(sum(map(len, cuts)) + 6 * len(cuts), r, "use a larger D or tolerance")
    driver = _Driver(r, clearance, _obstacles(r, model, probe, bottom, clearance if stock_top is None else stock_top))
    for number, cut in enumerate(cuts):
        driver.add(cut)
        said(_SHARE + (1 - _SHARE) * number / len(cuts))
    driver.mover.up()
    notes = tuple(Note(text, {}) for text in model.notes) + _holder_notes(probe, cuts)
    figures = dict(cuts=len(cuts), sampled=sampled, moves=len(driver.mover.moves))
    return SurfacePlan(tuple(driver.mover.moves), notes, partial(Report, "surface", figures), len(cuts), sampled,
                       tuple(model.low.tolist()), tuple(model.high.tolist()), clearance, tuple(cuts[0][0, :2].tolist()))


def _check_clearance(bottom, clearance, top, stock_top):
    """Raise CycleError for a clearance plane that is not clear."""
    if bottom >= clearance - EQUAL:
        raise CycleError("final depth Z{z} is not below the clearance plane R{r}", "use Z below R or R above Z", z=bottom, r=clearance)
    for what, height in (("model", top), ("stock", stock_top)):
        if height is not None and clearance < height - EQUAL:
            raise CycleError(f"clearance plane R{{r}} is below the top of the {what} ({{top}})", "use R above {top}", r=clearance, top=height)


def _tracks(r, model):
    """The cuts as tracks seen from above; of a zigzag with the links between them."""
    low, high = model.low[:2] - r.margin, model.high[:2] + r.margin
    if raster.count_of(low, high, r.direction, r.step) > MOST_TRACKS:
        raise CycleError(f"step-over D{{d}} needs more than {MOST_TRACKS} cuts side by side", "use a larger D", d=r.step)
    tracks = raster.parallel(low, high, r.direction, r.step, r.climb)
    if r.link != ZIGZAG:
        return tracks
    tracks = tracks.backwards(np.arange(len(tracks.length)) % 2 == 1)
    links = raster.between(tracks.end[:-1], tracks.start[1:])
    order = np.argsort(np.concatenate([np.arange(len(tracks.length)), np.arange(len(links.length)) + 0.5]), kind="stable")
    return raster.Tracks(*(np.concatenate([a, b])[order] for a, b in
                           ((tracks.start, links.start), (tracks.direction, links.direction), (tracks.length, links.length))))


def _obstacles(r, model, probe, bottom, stock_top):
    """Model and stock: the box of the cuts, with the tool about them, up to the top of the stock."""
    more = r.margin + r.tool.diameter
    top = max(stock_top, bottom + 1e-3)
    return Obstacles(probe, r.tool, (model.low[0] - more, model.low[1] - more, bottom - 1.0), (model.high[0] + more, model.high[1] + more, top), r.cell)


def _holder_notes(probe, cuts):
    """What the operator should know if the holder kept the tool away."""
    if not probe.has_holder:
        return ()
    points = np.concatenate(cuts)
    raised = probe.raised(points[:, :2])
    if raised.max() <= OFF_MM:
        return ()
    x, y = points[int(raised.argmax()), :2]
    return (Note("the holder keeps the tool up to {h} above the surface, most at X{x} Y{y}; use a longer tool", {"h": float(raised.max()), "x": x, "y": y}),)


class _Driver:
    """Adds one cut after the other to a Mover, with the links between them."""

    def __init__(self, request, clearance, obstacles):
        self.request, self.clearance, self.obstacles = request, clearance, obstacles
        self.mover, self.rested = None, 0

    def add(self, cut):
        """To the start of a cut (k, 3), and along it."""
        start = tuple(map(float, cut[0]))
        if self.mover is None:
            self._begin(start)
        elif self.request.link != ZIGZAG:
            self._link(start)
        elif len(self.mover.moves) - self.rested > REST_MOVES:
            self._rest()
        self._descend(start)
        self.mover.moves.extend(Line(x=x, y=y, z=z, feed=self.request.feed) for x, y, z in cut[1:].tolist())
        self.mover.at = tuple(map(float, cut[-1]))
        self.obstacles.cut(cut)

    def _begin(self, start):
        r = self.request
        self.mover = Mover(_Frame(r.start or (*start[:2], self.clearance), self.clearance, r.feed, r.plunge_feed))
        self.mover.over(start[:2])

    def _link(self, start):
        """Pe - Pa - Pb - Pc - Pd, or with P1 the lowest safe link."""
        mover, relief, end = self.mover, self.request.relief, self.mover.at
        level = self.clearance
        if self.request.link == LOWEST:
            level = min(level, self.obstacles.lowest(end, start, max(end[2], start[2])) + relief)
        lifted = min(end[2] + relief, level)
        if self.request.link == PICK_FEED and lifted > end[2] + EQUAL:
            mover.moves.append(Line(z=lifted, feed=self.request.feed))
        mover.moves.append(Rapid(z=level))
        mover.moves.append(Rapid(x=start[0], y=start[1]))
        mover.at = (start[0], start[1], level)

    def _rest(self):
        """Up by the relief and down again, in a long zigzag: the task serves nobody between two places where the tool may rest."""
        self.rested = len(self.mover.moves)
        level = min(self.mover.z + max(self.request.relief, LIFT_MM), self.clearance)
        self.mover.moves.append(Line(z=level, feed=self.request.feed))
        self.mover.at = (*self.mover.xy, level)

    def _descend(self, start):
        """Pc - Pd - Ps: by rapid to the relief above the start and above the stock there, then at E."""
        mover = self.mover
        if mover.z > start[2] + EQUAL:
            above = max(start[2], self.obstacles.lowest(start)) + self.request.relief
            if above < mover.z - EQUAL:
                mover.rapid(z=above)
            mover.plunge(start[2])


@dataclass(frozen=True)
class _Frame:
    """What a Mover asks of a request."""

    start: tuple
    clearance: float
    feed: float
    plunge_feed: float
