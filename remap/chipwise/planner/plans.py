# SPDX-License-Identifier: GPL-2.0-or-later
"""From an Order to its Outcome: the part of a cycle's work that takes time.  Pure; mm.

Called by planner/server.py, a process apart from the interpreter: all that a plan may depend on is in the Order, but
for the map of the stock tracker, of which the Order says where it is (order.MapPlace).
"""

from dataclasses import replace

from chipwise.contour_sub import read
from chipwise.program import find_sub
from chipwise.cycles import contour, contour_chop, hole, pattern, pocket, surface
from chipwise.cycles.plan import CyclePlan
from chipwise.errors import CycleError
from chipwise.geometry.base.chains import flat
from chipwise.geometry.base.contour import ContourError, backwards
from chipwise.gcode_lines import DECIMALS, chunks
from chipwise.order import Order, Outcome, Packed
from chipwise.pattern import run as pattern_run
from chipwise.pattern.recorded import Recorded
from chipwise.planner import program_clamps, standing_stock
from chipwise.turning import g26_plan as outcome
from chipwise.turning import reach

_DECIMALS = {"pattern": 9}  # what a sub has computed goes on exactly
TARGET_SAG_MM = 0.01  # of the chords of a contour that is shown
_CACHING = (hole, contour, contour_chop, pocket, surface, find_sub, read, reach, program_clamps)


def forget() -> None:
    """Give back the memory of earlier plans."""
    for module in _CACHING:
        for function in vars(module).values():
            if hasattr(function, "cache_clear"):
                function.cache_clear()


def make(order: Order) -> Outcome:
    """The Outcome of an Order.  Raises CycleError if it cannot be done."""
    if order.cycle == "turning":
        return outcome.make(order)
    plan = _CYCLES[order.cycle](order)
    obstacles, notes = program_clamps.in_force(order.clamps) if order.clamps else (None, [])
    if obstacles:
        keep = order.cycle == "pattern"
        plan = replace(
            plan,
            moves=obstacles.clear(
                plan.moves, order.start, order.unit, None if keep else order.fields.get("clearance"), keep
            ),
        )
    messages = tuple(
        CycleError(text, code=order.code, **lengths).text(order.unit) for text, lengths in (*notes, *plan.notes)
    )
    report = plan.report() if order.report and plan.report else None
    return Outcome(
        chunks(plan.moves, order.start, order.unit_mm, _DECIMALS.get(order.cycle, DECIMALS), order.axes),
        messages,
        report,
        targets=_targets(order) if order.targets and order.cycle in ("contour", "pocket") else (),
    )


def packed(outcome: Outcome) -> Outcome:
    """An Outcome for another process: its chunks are Packed, and a turned part's blocks have their lines there only."""
    turning = outcome.turning
    if turning is not None:
        runs = tuple(
            run._replace(block=run.block._replace(lines=()), chunks=Packed(run.chunks)) for run in turning.blocks
        )
        turning = turning._replace(blocks=runs)
    return replace(outcome, chunks=Packed(outcome.chunks), turning=turning)


def _targets(order: Order) -> tuple:
    """The loops of the sub as points, at the depth of the cycle; the plan has read them before."""
    bottom = order.fields["bottom"]
    return tuple(
        tuple((x, y, bottom) for x, y in flat(contour.elements, TARGET_SAG_MM).tolist())
        for contour in read.contours(read.read_shape(order.job))
    )


def _hole(order: Order) -> CyclePlan:
    return hole.hole_plan(hole.HoleRequest(**order.fields))


def _contour(order: Order) -> CyclePlan:
    shape = read.read_shape(order.job)
    loop = read.one_loop(shape)
    fields = dict(order.fields)
    loop = backwards(loop) if fields.pop("backwards", False) else loop
    try:
        return contour.contour_plan(contour.ContourRequest(shape=loop, **fields))
    except ContourError as error:
        raise read.shape_error(shape, error) from error


def _pocket(order: Order) -> CyclePlan:
    shape = read.read_shape(order.job)
    fields = dict(order.fields)
    place = fields.pop("map", None)
    if place is not None:
        fields["stock"] = standing_stock.standing(place, shape.loops, fields["tool_radius"])
    try:
        return pocket.pocket_plan(pocket.PocketRequest(loops=shape.loops, **fields))
    except ContourError as error:
        raise read.shape_error(shape, error) from error


def _pattern(order: Order) -> CyclePlan:
    job = order.job

    def read_from(start: tuple, abc: tuple, mirrored: bool) -> Recorded:
        return pattern_run.read_pattern(
            replace(job, mirrored=mirrored != job.mirrored, abc=abc, sub=replace(job.sub, position=start))
        )

    return pattern.pattern_plan(pattern.PatternRequest(**order.fields), read_from)


def _surface(order: Order) -> CyclePlan:
    fields = dict(order.fields)
    most = fields["most_moves"]
    earlier = tuple(surface.SurfaceRequest(**dict(pairs), most_moves=most) for pairs in fields.pop("earlier", ()))
    return surface.surface_plan(surface.SurfaceRequest(**fields, earlier=earlier))


_CYCLES = {"hole": _hole, "contour": _contour, "pocket": _pocket, "pattern": _pattern, "surface": _surface}
