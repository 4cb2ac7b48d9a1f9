# SPDX-License-Identifier: GPL-2.0-or-later
"""P4 of G79: regions, levels and moves around the paths of constant engagement; pure, mm.

Called by cycles/pocket.py, which has the request, the notes and the descent to a level.

Below R a rapid here may also run across: up to LIFT_MM above the level, over ground that the level has cleared, with
the traverse clearance at the tool's side.  It rises from the level and goes down to LOW_MM above it so flat that it
need not stop there; the arc onto the next path goes down the rest, as a feed.  All else is as in pocket.py.

No path is given out that its certificate does not hold for (geometry/pocket/engage_proof.py).
"""

import math
from dataclasses import dataclass

import numpy as np

from chipwise.cycles.chop_lines import depth_levels
from chipwise.cycles.plan import Note
from chipwise.cycles.word_checks import EQUAL, check_moves
from chipwise.errors import Area, CycleError
from chipwise.geometry.base import chains, elements
from chipwise.geometry.base.clearance import gouge_depths
from chipwise.geometry.base.contour import ArcElement, LineElement
from chipwise.geometry.base.elements import Elements
from chipwise.geometry.pocket import engage, engage_proof

# Height of rapids over the floor of the level, where they run across and where they end, mm; their slope.
LIFT_MM, LOW_MM, SLOPE = 0.2, 0.015, 0.09

# Widest and narrowest step-over, in tool radii: with less the chips are as thin as what counts as air.
WIDEST, LEAST = 1.0, 0.05

# A region narrower than this holds no circle to begin with, in tool radii.
NARROWEST = 0.05

# A ramp along less than this is a plunge, in tool radii.
SHORTEST = 0.5

OTHER = "use P0, or a smaller tool"


def check(request):
    """Raise CycleError for a step-over that P4 cannot have."""
    if request.step > WIDEST * request.tool_radius + EQUAL:
        raise CycleError(
            "step-over D{d} is above half the tool diameter ({t}), which is the most of P4",
            "use D up to {most}, or P0",
            d=request.step,
            t=2 * request.tool_radius,
            most=WIDEST * request.tool_radius,
        )
    if request.step < LEAST * request.tool_radius - EQUAL:
        raise CycleError(
            "step-over D{d} is below a fortieth of the tool diameter ({t}), which is the least of P4",
            "use D of {least} or more, or P0",
            d=request.step,
            t=2 * request.tool_radius,
            least=LEAST * request.tool_radius,
        )


def mirrored_loops(loops):
    """Loops of parts with X negative: what climbs there is conventional here."""
    return tuple(tuple(_mirrored(part) for part in parts) for parts in loops)


def _mirrored(part):
    start, end = ((-x, y) for x, y in (part.start, part.end))
    if isinstance(part, ArcElement):
        return ArcElement(start, end, (-part.centre[0], part.centre[1]), not part.ccw, part.line)
    return LineElement(start, end, part.line)


def flipped(chain):
    """Elements with X negative."""
    turn = np.array((-1.0, 1.0))
    return Elements(
        chain.start * turn,
        chain.end * turn,
        chain.centre * turn,
        chain.radius,
        math.pi - chain.start_angle,
        -chain.sweep,
    )


@dataclass(frozen=True)
class Level:
    """z; segments, none where nothing stands; over, full: places with more engagement, and with all of it
    (engage_proof.Proof); left: share that stands before the first path, of what the tool reaches."""

    z: float
    segments: tuple
    over: tuple
    full: tuple
    left: float = 1.0


def levels(region, request):
    """The Levels of a region, from the top.  Raises CycleError where a certificate does not hold."""
    r, known, found = request, {}, []
    for z in depth_levels(r.clearance, r.bottom + r.floor_allowance, r.depth_step, r.stock_top):
        cleared = None if r.stock is None else r.stock.cleared(region.boundary, z, r.tool_radius, not r.climb)
        key = cleared.start.tobytes() + cleared.end.tobytes() if cleared else b""
        if key not in known:
            left = (
                engage_proof.left_mm2(region, r.tool_radius, cleared) / engage_proof.left_mm2(region, r.tool_radius)
                if cleared
                else 1.0
            )
            known[key] = (
                (*_segments(region, r, cleared if cleared else None), left) if left > 0.0 else ((), (), (), 0.0)
            )
        found.append(Level(z, *known[key]))
    return tuple(found)


def _segments(region, request, cleared):
    """Segments of one level, and places with more engagement and with all of it."""
    r = request
    angle = math.acos(1.0 - r.step / r.tool_radius)
    segments = engage.planned(
        region,
        engage.Cut(r.tool_radius, r.step, r.feed / 60.0, r.traverse_clearance, r.seam_overlap),
        cleared,
        0.0 if cleared is None else r.stock.cell,
    )
    proof = engage_proof.prove(region, segments, r.tool_radius, angle, cleared)
    side = 1.0 if r.climb else -1.0
    found = _fault(proof)
    if found:
        what, (x, y) = found
        raise CycleError(
            f"P4 found no path that keeps the engagement everywhere: it {what} at X{{x}} Y{{y}}",
            OTHER,
            left=Area(proof.left_mm2),
            x=side * x,
            y=y,
        )
    return engage_proof.slowed(region, segments, proof, r.tool_radius, angle, cleared), proof.over, proof.full


def _fault(proof):
    """(what a path would do that none may, where); None."""
    if proof.left_mm2 > 0.0:
        return "would leave {left}", proof.left_at
    if proof.rapid_at is not None:
        return "would meet stock on a rapid", proof.rapid_at
    if proof.plunge_at is not None:
        return "would plunge into stock", proof.plunge_at
    if proof.gouge > engage_proof.GOUGE_MM:
        return "would come nearer to a wall than the tool may", proof.gouge_at
    return None


def notes(done, climb, radius):
    """What the operator should know of the Levels of all regions: stock that was gone before, places where the
    engagement is above that of D, and how much of the path is a full slot."""
    over = [row for rows in dict.fromkeys(level.over for level in done) for row in rows]
    long = [row for row in over if row[2] > engage_proof.CORNER * radius]
    short = [row for row in over if row[2] <= engage_proof.CORNER * radius]
    found = ()
    gone = 1.0 - sum(level.left for level in done) / len(done)
    if gone > 0.005:
        found += (
            Note(f"P4 starts from the stock as it stands, {100 * gone:.0f} % of the pocket is cleared already", {}),
        )
    found += full_width_note(
        [row for rows in dict.fromkeys(level.full for level in done) for row in rows], 1.0 if climb else -1.0
    )
    if long:
        x, y, length, _ = max(long, key=lambda row: row[2])
        count, most = len(long), max(row[3] for row in long)
        found += (
            Note(
                f"P4 cannot keep the engagement of D in {count} narrow place{'s' if count > 1 else ''} (up to "
                f"{math.degrees(most):.0f} degrees) and feeds less there, "
                "the longest over {mm} from X{x} Y{y}",
                {"mm": length, "x": x if climb else -x, "y": y},
            ),
        )
    if short:
        x, y, _, most = max(short, key=lambda row: row[3])
        count = len(short)
        found += (
            Note(
                f"the engagement is above that of D in {count} corner{'s' if count > 1 else ''}, up to "
                f"{math.degrees(most):.0f} degrees at "
                "X{x} Y{y}",
                {"x": x if climb else -x, "y": y},
            ),
        )
    return found


def _tenths(length):
    """A length (mm) as it is worth being read."""
    return max(round(length, 1), 0.1)


def full_width_note(full, side=1.0):
    """Of places (x, y, mm, engagement) with full width; side: -1.0 if X is negative."""
    if not full:
        return ()
    x, y, length, _ = max(full, key=lambda row: row[2])
    count = len(full)
    return (
        Note(
            f"the tool cuts its full width over {{mm}} in {count} place{'s' if count > 1 else ''}, the longest over "
            f"{{most}} from X{{x}} Y{{y}}",
            {"mm": _tenths(sum(row[2] for row in full)), "most": _tenths(length), "x": side * x, "y": y},
        ),
    )


def clear(driver, region, planned):
    """All Levels of a region.  driver: pocket.py's, which has the mover and the link over to a start."""
    r, mover = driver.request, driver.mover
    count = sum(len(segment.elements) + 4 for level in planned for segment in level.segments)
    check_moves(len(mover.moves) + count, r, "use a larger J or D")
    above = None
    for level in planned:
        _level(driver, region, level, above)
        above = level.z


def _level(driver, region, level, above):
    """One Level; above: the one before."""
    r, mover, z, new = driver.request, driver.mover, level.z, True
    for segment in level.segments:
        chain = segment.elements if r.climb else flipped(segment.elements)
        if segment.kind == "entry":
            _enter(driver, region, segment, chain, z, above)
        elif segment.kind == "ramp":
            _ramp(driver, chain, z, above)
            new = True
        elif segment.kind == "over":
            new = False
            driver.over(tuple(chain.end[0].tolist()), above, None, False)
        else:
            if not new:
                mover.down(min(z + LIFT_MM, mover.z))
            if segment.kind == "rapid":
                across(mover, chain, z, r.clearance)
            else:
                if not new:
                    mover.plunge(z)
                if segment.kind == "cut" or mover.z - z > float(elements.lengths(chain).sum()) * math.tan(
                    math.radians(r.ramp_angle)
                ):
                    mover.down(z)
                _follow(mover, chain, segment.share, z if mover.z > z else None)
            new = True


def _follow(mover, chain, share, z):
    """Along a chain, at shares of the feed (None: at all of it)."""
    if share is None:
        mover.follow(chain, z)
        return
    mover.down(mover.z if z is None else z)
    ends = np.flatnonzero(np.diff(share) != 0.0) + 1
    for group in np.split(np.arange(len(chain)), ends):
        mover.follow(elements.take(chain, group), None, mover.feed * float(share[group[0]]))


def _ramp(driver, chain, z, above):
    """Down along a chain, to and fro, and back to its start."""
    r, mover = driver.request, driver.mover
    driver.over(tuple(chain.start[0].tolist()), above, above, False)
    angle, top, length = math.radians(r.ramp_angle), mover.z, float(elements.lengths(chain).sum())
    if angle >= math.radians(89.9) or length < SHORTEST * r.tool_radius:
        driver.plunges.append(mover.xy)
        mover.plunge(z)
        return
    passes = 2 * max(1, math.ceil((top - z) / (2.0 * length * math.tan(angle)) - 1e-9))
    check_moves(len(mover.moves) + passes * len(chain), r, "use a larger #<_chipwise_ramp_angle> or J")
    for number in range(1, passes + 1):
        mover.follow(
            chain if number % 2 else elements.reverse(chain),
            z if number == passes else top + (z - top) * number / passes,
            mover.descent_feed(math.atan2(top - z, passes * length)),
        )


def _enter(driver, region, segment, chain, z, above):
    """By a helix on a circle, and once round at the level."""
    r, mover = driver.request, driver.mover
    start, centre, radius = chain.start[0], tuple(chain.centre[0].tolist()), float(chain.radius[0])
    free = (
        gouge_depths(region.pocket.clearance_check, segment.elements.start[:1], region.distance + r.traverse_clearance)[
            0
        ]
        <= 0.0
    )
    driver.over(tuple(start.tolist()), above, above, bool(free))
    angle, ccw, top = math.radians(r.ramp_angle), bool(chain.sweep[0] > 0.0), mover.z
    if angle >= math.radians(89.9) or radius <= NARROWEST * r.tool_radius:
        driver.plunges.append(mover.xy)
        mover.plunge(z)
    else:
        feed = mover.descent_feed(angle)
        turns = max(1, math.ceil((top - z) / (2.0 * math.pi * radius * math.tan(angle)) - 1e-9))
        check_moves(len(mover.moves) + turns, r, "use a larger #<_chipwise_ramp_angle> or J")
        for turn in range(1, turns + 1):
            mover.arc(mover.xy, centre, ccw, z if turn == turns else top + (z - top) * turn / turns, feed)
    if radius > 0.0:
        mover.arc(mover.xy, centre, ccw)


def across(mover, chain, z, clearance):
    """Rapids along lines, lifted, and down to just over the floor."""
    length = elements.lengths(chain)
    total = float(length.sum())
    rise = min(LIFT_MM / SLOPE, total / 3.0)
    low, high = min(z + LOW_MM, clearance), min(z + SLOPE * rise, clearance)
    upto = np.cumsum(length)
    for station in sorted({rise, total - rise, *(float(s) for s in upto[:-1])}):
        k = min(int(np.searchsorted(upto, station)), len(chain) - 1)
        t = 1.0 - (float(upto[k]) - station) / float(length[k])
        x, y = chains.point(chain, k, t).tolist()
        share = min(station, total - station) / rise
        mover.rapid(
            x=x,
            y=y,
            z=high if share >= 1.0 else z + share * (high - z) if 2.0 * station < total else low + share * (high - low),
        )
    mover.rapid(x=float(chain.end[-1, 0]), y=float(chain.end[-1, 1]), z=low)
