# SPDX-License-Identifier: GPL-2.0-or-later
"""A tool whose feed the core commands by chip, power and torque, against an exact stock and its edges one by one
(support/tooth_oracle.py)."""

import math

import numpy as np
import pytest

from chipwise.clib import core
from support.feed_cases import CHIP, FALLBACK, POWER, TORQUE
from support.tooth_oracle import ACCEL, PERIOD, Z, Drive, Limits, Plane, beside, chip_and_torque, means

PEAK = 1.02  # largest mean over 10 ms, share of the limit: slots, side cuts, arcs
ROUGH_PEAK, ROUGH_OVER = 1.05, 0.002  # steps and crossing slots: peak, and share of the time above PEAK
REACHED = 0.97  # the limit is used up to this where nothing else limits
CODES = {"chip": CHIP, "power": POWER, "torque": TORQUE}
BOUNDS = {"chip": 0.03, "power": 900.0, "torque": 0.7}  # mm, W, Nm, in a slot of D10: 15 to 18 mm/s


def driven(plane, segments, diameter=10.0, cell=0.25, kind="chip", bound=None, **more):
    """(share of the limit in means over 10 ms, rows of Drive.seen)."""
    limits = Limits(**{kind: bound or BOUNDS[kind]})
    seen = Drive(plane, diameter, Z, limits, cell, **more).go(segments)
    allowed = {"chip": limits.chip, "power": limits.power / (2.0 * math.pi * limits.rps), "torque": limits.torque}[kind]
    return means(seen[:, 0 if kind == "chip" else 1]) / allowed, seen


@pytest.mark.parametrize(
    "kind, diameter, cell, share",
    [
        ("chip", 10.0, 0.25, 0.05),
        ("chip", 6.0, 0.25, 0.25),
        ("chip", 3.0, 0.125, 0.5),
        ("power", 10.0, 0.25, 0.05),
        ("power", 10.0, 0.25, 0.95),
        ("torque", 6.0, 0.25, 0.25),
    ],
)
def test_side_cut(kind, diameter, cell, share):
    """Held from above and used: the limit in force is said, and what the pins say is cut is cut."""
    bound = BOUNDS[kind] * (1.0 if kind == "chip" else 0.2 * diameter * share)  # so that the ceiling is above it
    load, seen = driven(*beside(diameter, share, 0.3), diameter, cell, kind, bound)
    steady = slice(len(seen) // 3, 2 * len(seen) // 3)
    assert load.max() < PEAK and load[steady].min() > REACHED, (load.max(), load[steady].min())
    assert set(seen[steady, 3]) == {CODES[kind]}
    told, true = (
        (seen[steady, 4], seen[steady, 0])
        if kind == "chip"
        else (seen[steady, 5] / (2.0 * math.pi * 200.0), seen[steady, 1])
    )
    assert np.median(told / true) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("kind", ["chip", "power"])
def test_the_oracle_sees_a_feed_without_limits(kind):
    load, _seen = driven(*beside(10.0, 0.95, 0.3), kind=kind, limited=False)
    assert load.max() > 1.5


@pytest.mark.parametrize("override", [0.6, 1.3])
def test_the_override_does_not_raise_the_chip(override):
    load, seen = driven(*beside(10.0, 0.25, 0.3), override=override)
    steady = slice(len(seen) // 3, 2 * len(seen) // 3)
    assert load.max() < PEAK and load[steady].min() > REACHED


@pytest.mark.parametrize("kind, side", [("chip", 0.0), ("power", 0.0), ("chip", 64.0), ("torque", 63.0)])
def test_entry(kind, side):
    """Into the stock at the ceiling: the chip is there at first contact. side: mm, of the path; the stock ends at
    60."""
    load, _seen = driven(Plane(), [core.line((-72.0, side, Z), (-48.0, side, Z))], kind=kind)
    assert load.max() < PEAK, load.max()


def read_along(plane, diameter, cell, begin, angle, places):
    """[(chip that limits, chip that is really met)] of a feed of 1 mm per tooth, at places (mm, 10 um apart) from begin
    (x, y) on, angle: of the path."""
    along = np.array([math.cos(angle), math.sin(angle)])
    drive = Drive(plane, diameter, Z, Limits(chip=1.0), cell)
    at, segment = (*begin, Z), core.line((*begin, Z), (*(begin + (places[-1] + 2.0) * along), Z))
    segment.accel = ACCEL
    look, cutter, seen = core.Lookahead(drive.stock, drive.tool), core.Cutter(drive.stock, drive.tool, at), []
    for s in places:
        look.path.follow(1, segment.length, s)
        if look.path.c.count == 0:
            look.path.append(1, segment)
        tip, _heading, _curvature = look.path.at(look.path.c.s)
        look.limit(1.0, 0.0, 0.25)
        look.step(at, tip, PERIOD, 20.0)
        cutter.to(tip)
        profile, at = look.profile(20.0), tip
        chip = max(
            (step.area for step in profile.tooth_step[: profile.tooth_steps] if step.distance <= 0.0), default=0.0
        )
        seen.append(
            (chip, chip_and_torque(plane.met(tip, angle, 0.5 * diameter, Z), 0.5 * diameter, 1.0, 1, 1.0, 0.0)[0])
        )
    return np.array(seen).T


@pytest.mark.parametrize("diameter, cell", [(3.0, 0.125), (6.0, 0.25), (6.0, 0.5), (10.0, 0.25)])
@pytest.mark.parametrize("angle, skew", [(0.0, 0.0), (0.3, 0.2), (0.7, 1.0)])
def test_the_chip_is_known_before_contact(diameter, cell, angle, skew):
    """A step of 10 um at a time to a wall: the chip limits from two cells before the exact contact on, never below what
    is really met, and not much sooner.  angle: of the path; skew: of the wall, rad."""
    wall = np.array([-math.sin(angle + skew), math.cos(angle + skew)])
    plane = Plane()
    plane.cut([-80.0 * wall, 80.0 * wall], 8.0, -4.0)
    contact, begin = (8.0 - 0.5 * diameter) / math.cos(skew), 5.0 * cell
    places = np.arange(contact - 2.0 * begin, contact + 1.0, 0.01)
    chip, true = read_along(plane, diameter, cell, np.zeros(2), angle, places)
    place = places - contact
    first = place[np.flatnonzero((chip == 0.0) & (place < 0.0))[-1] + 1]  # it limits all the way from there
    assert (
        true[place > 0.02].min() > 0.9 * math.cos(skew) and true[place < -0.02].max() == 0.0
    )  # the contact is where it is said to be
    assert -begin < first <= -2.0 * cell, first / cell
    assert (chip[place > 0.0] >= 0.98 * true[place > 0.0]).all()


@pytest.mark.parametrize(
    "diameter, cell, angle", [(3.0, 0.125, 0.7), (6.0, 0.25, 0.3), (6.0, 0.5, 0.0), (10.0, 0.25, 0.7)]
)
def test_the_chip_is_known_behind_contact(diameter, cell, angle):
    """Through a post of 1 mm, whose chip ends at once: it limits from before the exact contact to two cells behind its
    end (that of the map is known to a cell), and not much longer."""
    along, across, ditch = (
        np.array([math.cos(angle), math.sin(angle)]),
        np.array([-math.sin(angle), math.cos(angle)]),
        0.5 * diameter + 2.0,
    )
    plane = Plane()
    for line, side in ((along, across), (across, along)):
        for sign in (-1.0, 1.0):
            plane.cut(
                [sign * (0.5 + ditch) * side - 80.0 * line, sign * (0.5 + ditch) * side + 80.0 * line], ditch, -4.0
            )
    before = 0.5 + 0.5 * diameter + 1.0
    places = np.arange(0.0, before + 1.0 + 6.0 * cell, 0.01)
    chip, true = read_along(plane, diameter, cell, -before * along, angle, places)
    met = np.flatnonzero(true > 0.0)
    last = places[np.flatnonzero(chip > 0.0)[-1]] - places[met[-1]]
    assert true[met].min() > 0.9 and places[met[-1]] - places[met[0]] < 1.2  # it ends at once, and is a post
    assert (chip[met] >= 0.98 * true[met]).all()
    assert 2.0 * cell < last < 4.0 * cell, last / cell


@pytest.mark.parametrize(
    "kind, turn, share", [("power", 1.5, 1.0), ("power", -1.5, 0.2), ("chip", 1.5, 0.2), ("power", 1.5, 0.2)]
)
def test_arc(kind, turn, share):
    """A line into an arc and out of it, in full stock and beside an equal slot; turn: rad."""

    def track(radius):
        """The path, and the same so much farther from the centre of its arc."""
        sign = math.copysign(1.0, turn)
        first = core.line((-18.0, sign * (15.0 - radius), Z), (0.0, sign * (15.0 - radius), Z))
        bend = core.arc((0.0, sign * 15.0), (0.0, sign * (15.0 - radius), Z), turn)
        angle = abs(turn) - 0.5 * math.pi
        end = np.array([radius * math.cos(angle), sign * (15.0 + radius * math.sin(angle))])
        return first, bend, core.line((*end, Z), (*(end + 18.0 * np.array([math.cos(turn), math.sin(turn)])), Z))

    plane, path = Plane(), core.ProgrammedPath()
    if share < 1.0:
        for number, segment in enumerate(track(15.0)):
            path.append(number + 1, segment)
        slot = [path.at(s)[0][:2] for s in np.arange(0.0, path.c.end_s, 1.0)]
        plane.cut([(-90.0, slot[0][1]), *slot], 5.0, Z)
    load, _seen = driven(plane, list(track(15.0 + 10.0 * share if share < 1.0 else 15.0)), kind=kind)
    assert load.max() < PEAK, load.max()


@pytest.mark.parametrize("kind", ["chip", "power"])
@pytest.mark.parametrize("seed", range(2))
def test_steps_and_crossing_slots(kind, seed):
    """Slots of other depths and widths cross the pass: islands, shelves, walls."""
    rng = np.random.default_rng(seed)
    plane, segments = beside(10.0, rng.uniform(0.1, 1.2), 0.0, 40.0)
    for _ in range(3):
        angle, middle = rng.uniform(0.4, 2.7), rng.uniform(-12.0, 12.0)
        along = 70.0 * np.array([math.cos(angle), math.sin(angle)])
        plane.cut([(middle, 0.0) - along, (middle, 0.0) + along], rng.uniform(1.0, 4.0), rng.choice([-1.0, -2.0, -4.0]))
    load, _seen = driven(plane, segments, kind=kind)
    assert load.max() < ROUGH_PEAK and (load > PEAK).mean() <= ROUGH_OVER, (load.max(), (load > PEAK).mean())


def test_rate_and_chip_together():
    """The smaller one is in force: a slot by its rate, a thin pass by its chip."""
    for share, by in ((0.1, CHIP), (1.2, None)):
        load, seen = driven(*beside(10.0, share, 0.3), target=300.0)
        steady = seen[len(seen) // 3 : 2 * len(seen) // 3]
        assert load.max() < PEAK and (set(steady[:, 3]) == {by} if by else CHIP not in steady[:, 3])


def test_the_chip_alone():
    """No rate (M251 without Q): from air into the stock and out of it, held by the chip, at the ceiling in air, never
    at F because nothing is read yet."""
    load, seen = driven(Plane(), [core.line((-75.0, 64.0, Z), (-48.0, 64.0, Z))], target=0.0)
    assert load.max() < PEAK and np.median(load[len(load) // 2 :]) > REACHED and FALLBACK not in seen[:, 3]
