# SPDX-License-Identifier: GPL-2.0-or-later
"""The largest chip and A_mc of a section (core/tooth.h) against closed forms, and the law of the limits
(core/tooth_law.h)."""

import math

import numpy as np
import pytest

from chipwise.clib import core, layout
from support.feed_cases import CHIP, FALLBACK, HERE, NOTHING, ODD, POWER, TORQUE, given, limited
from support.tooth_oracle import Limits, anywhere

MC, DEPTH = 0.25, 3.0
# largest mean error and standard deviation, shares of the truth: cells know 0.1 of their width
FLAT, CURVED, CHIP_CURVED = (0.01, 0.03), (0.035, 0.05), (0.10, 0.05)


def truth(tool, depth, inner):
    """(largest n . d, A_mc mm2) of stock that reaches from `inner` mm beside the path outwards: a sum over the tool's
    surface."""
    z = (np.arange(1500) + 0.5) / 1500 * depth
    r = np.array([tool.reach(v) for v in z])
    slope = np.array([tool.reach(v + 1e-6) - tool.reach(max(v - 1e-6, 1e-12)) for v in z]) / 2e-6
    lean = 1.0 / np.sqrt(1.0 + slope**2)
    phi = (np.arange(1500) + 0.5) / 1500 * math.pi - 0.5 * math.pi
    face = lean[:, None] * np.cos(phi) * (r[:, None] * np.sin(phi) >= inner)
    part = np.where(face > 0.0, face, 0.0) ** (1.0 - MC) * (face > 0.0)
    return float(face.max()), float(np.sum(part * (r / lean)[:, None])) * math.pi / 1500 * depth / 1500


def errors(shape, cell, share, depth, count):
    """Errors of chip and A_mc, shares of the truth, at places and directions of all kinds; a pass of `share` of the
    diameter."""
    rng, tool = np.random.default_rng(7), core.Tool(*shape).limit()
    inner = tool.radius * (1.0 - 2.0 * share)
    chip, power = truth(tool, depth, inner)
    found = []
    for _ in range(count):
        stock, place, along = anywhere(rng, cell, inner, depth)
        met = stock.tooth(tool, (*place, -depth), (*along, 0.0), core.UNCUT)
        found.append((met[0] / chip - 1.0, met[1] / power - 1.0))
    return np.array(found)


def within(values, bound):
    return abs(values.mean()) <= bound[0] and values.std() <= bound[1]


@pytest.mark.parametrize("diameter, cell", [(10, 0.25), (6, 0.25), (3, 0.125)])
@pytest.mark.parametrize("share", [0.05, 0.1, 0.25, 0.5, 0.75, 0.95])
def test_side_cut(diameter, cell, share):
    found = errors((diameter,), cell, share, DEPTH, 16)
    if share * diameter >= 2.0 * cell or diameter > 3:
        assert within(found[:, 0], FLAT) and within(found[:, 1], FLAT), (found.mean(0), found.std(0))
    assert np.abs(found[:, 0]).max() < 0.03  # the chip of one place


@pytest.mark.parametrize(
    "shape, depth, share",
    [
        ((6, 3, 0), 3.0, 0.25),
        ((6, 3, 0), 1.0, 0.5),
        ((6, 3, 0), 3.0, 1.0),
        ((10, 2, 0), 3.0, 0.1),
        ((10, 2, 0), 1.2, 0.25),
        ((10, 2, 0), 3.0, 1.0),
        ((8, 0, 90), 3.0, 0.5),
        ((8, 0, 90), 3.0, 1.0),
        ((6, 0.5, 20), 4.0, 0.75),
    ],
)
def test_curved(shape, depth, share):
    found = errors(shape, 0.25, share, depth, 10)
    assert within(found[:, 1], CURVED) and within(found[:, 0], CHIP_CURVED) and found[:, 0].mean() > -0.005, (
        found.mean(0),
        found.std(0),
    )


def test_slot_and_exponents():
    """A full slot: chip 1, A_mc = h R times the integral of cos^(1 - mc)."""
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    phi = (np.arange(200_000) + 0.5) / 200_000 * math.pi - 0.5 * math.pi
    for mc in (0.0, 0.14, 0.25, 0.4):
        chip, power = stock.tooth(core.Tool(10.0).limit(exponent=mc), (0.1, 0.2, -DEPTH), (1.0, 0.0, 0.0), core.UNCUT)
        assert chip == pytest.approx(1.0, abs=1e-9)
        assert power == pytest.approx(DEPTH * 5.0 * float(np.mean(np.cos(phi) ** (1.0 - mc))) * math.pi, rel=0.001)


@pytest.mark.parametrize("degrees", [2.0, 20.0, 60.0, 90.0])
def test_ramp_and_plunge(degrees):
    """A flat end that goes down: its end cuts as thick as it falls, its wall as much less as it goes level."""
    fall, level = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    chip, power = stock.tooth(core.Tool(10.0).limit(), (0.1, 0.2, -DEPTH), (level, 0.0, -fall), core.UNCUT)
    slot = 2.0 * 5.0 * DEPTH * 1.0898 * level ** (1.0 - MC) if degrees < 90 else 0.0
    assert chip == pytest.approx(max(level, fall), rel=0.001)
    assert power == pytest.approx(slot + math.pi * 25.0 * fall ** (1.0 - MC), rel=0.01)


@pytest.mark.parametrize("tip_angle", [60.0, 90.0, 118.0, 140.0])
@pytest.mark.parametrize("degrees", [10.0, 45.0, 90.0])
def test_ramp_and_plunge_of_a_cone(tip_angle, degrees):
    """A drill, a countersink, a vee: also at its point the chip is (n . d) thick, not as thick as it falls."""
    fall, level, half = math.sin(math.radians(degrees)), math.cos(math.radians(degrees)), math.radians(tip_angle / 2.0)
    stock, tool = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25), core.Tool(6.0, 0.0, tip_angle).limit()
    depth = 0.8 * 3.0 / math.tan(half)
    chip, power = stock.tooth(tool, (0.1, 0.2, -depth), (level, 0.0, -fall), core.UNCUT)
    phi = (np.arange(100_000) + 0.5) / 100_000 * 2.0 * math.pi
    face = np.clip(level * math.cos(half) * np.cos(phi) + fall * math.sin(half), 0.0, None)
    surface = math.pi * (0.8 * 3.0) ** 2 / math.sin(half)
    assert chip == pytest.approx(face.max(), rel=0.001)
    assert power == pytest.approx(surface * float(np.mean(face ** (1.0 - MC))), rel=0.035)


def two_walls(cuts, tip, exact_chip, tool):
    """The chip where the tool meets stock that was cut in several passes."""
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    for low, high, z in cuts:
        radius = 0.5 * (high - low)
        core.Cutter(stock, core.Tool(2.0 * radius), (-80.0, low + radius, z)).to((80.0, low + radius, z))
    chip, _power = stock.tooth(tool, tip, (1.0, 0.0, 0.0), core.UNCUT)
    assert chip == pytest.approx(exact_chip, rel=0.02)


def test_islands_and_stairs():
    """Stock on both sides, and a low shelf before a high wall: the mean over the width is wrong by 30 to 40 %."""

    def face(side):
        return math.sqrt(1.0 - (side / 5.0) ** 2)

    two_walls([(-4.5, 4.5, -4.0)], (0.0, 0.0, -DEPTH), face(4.5), core.Tool(10.0).limit())
    two_walls([(-20.0, 1.0, -4.0), (0.5, 4.5, -2.8)], (0.0, 0.0, -DEPTH), face(1.0), core.Tool(10.0).limit())
    two_walls([(-20.0, 4.0, -4.0)], (0.0, 0.0, -DEPTH), face(4.0), core.Tool(10.0).limit())


def test_a_thin_layer_between_high_walls():
    """On a floor that rises, in its own slot: a layer of 0.01 to 0.15 mm over the whole width has the chip of a slot,
    also if the tool touches the slot's walls beside it."""
    angle, tool = math.radians(15.1633), core.Tool(6.35).limit()
    c, s = math.cos(angle), math.sin(angle)

    def at(x, z):
        return (c * x + 0.193, s * x - 0.437, z)

    stock = core.Stock((-16.0, -16.0, -10.0), (40.0, 30.0, 0.0), 0.1)
    core.Cutter(stock, core.Tool(6.35), at(22.0, -1.17)).to(at(0.0, -2.17))
    found = [
        stock.tooth(tool, at(x, -2.17), (c, s, 0.0), core.UNCUT)
        for x in np.arange(0.3, 3.3, 0.1)  # 1 / 22 of that high
    ]
    assert min(chip for chip, _power in found) == 1.0


def test_without_limits_nothing_changes():
    """Bit for bit: the area does not depend on limits, and without them nothing is summed."""
    rng = np.random.default_rng(3)
    for shape in ((10, 0, 0), (6, 3, 0), (10, 2, 0), (8, 0, 90)):
        stock, plain, limited = (
            core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25),
            core.Tool(*shape),
            core.Tool(*shape).limit(),
        )
        cutter = core.Cutter(stock, core.Tool(7.0), (-20.0, -3.0, -2.5))
        cutter.to((20.0, 4.0, -2.5))
        for _ in range(40):
            turn, fall = rng.uniform(0.0, 7.0), rng.choice([0.0, 0.0, 0.3, -0.2])
            level = math.sqrt(1.0 - fall**2)
            where = (
                tuple(rng.uniform(-6.0, 6.0, 2)) + (-DEPTH,),
                (level * math.cos(turn), level * math.sin(turn), -fall),
                rng.choice([0.0, 1.0, core.UNCUT]),
            )
            assert stock.section(plain, *where) == stock.section(limited, *where)
            assert stock.tooth(plain, *where) == (0.0, 0.0) and stock.tooth(limited, *where)[1] > 0.0


# ---- the law ---------------------------------------------------------------------------------------------------------


def test_what_the_tracker_is_given():
    """A slot of 3 mm with D10, 3 edges, 12,000 1/min in 6061 at fz = 0.05 mm: torque and power by hand."""
    limits = Limits(chip=0.04, power=500.0)
    law = core.tooth_law(limited(limits, speed=30.0, chip_share_now=1.0, power_root_now=32.69 ** (1.0 / (1.0 - MC))))
    torque = 800.0 * 3 * 0.05**0.75 * 32.69 / (2000.0 * math.pi)
    assert (law.chip_mm, law.torque_nm, law.power_w) == pytest.approx((0.05, torque, torque * 2.0 * math.pi * 200.0))
    assert law.chip_weight_per_mm == pytest.approx(25.0)
    allowed = 500.0 / (2.0 * math.pi * 200.0)
    assert law.power_weight_per_mm == pytest.approx((800.0 * 3 / (2000.0 * math.pi * allowed)) ** (4.0 / 3.0))


@pytest.mark.parametrize(
    "limits, code",
    [
        (Limits(power=500.0), POWER),
        (Limits(torque=0.3), TORQUE),
        (Limits(power=500.0, torque=0.3), TORQUE),
        (Limits(power=300.0, torque=0.3), POWER),
        (Limits(chip=0.05, torque=0.3), TORQUE),
    ],
)
def test_which_limit(limits, code):
    out = core.feed(limited(limits, [(0.0, 40.0, layout.ToothLimit.POWER)]), 1.0)
    assert (out.scale, out.limit) == (pytest.approx(600.0 / 40.0 / 60.0), code)
    assert core.feed(limited(limits, [(0.0, 40.0, layout.ToothLimit.CHIP)]), 1.0).limit == CHIP


def test_the_override_raises_no_chip():
    """The rate follows the operator's override, the chip does not: at 120 % the commanded velocity is lower."""
    for knob in (0.5, 1.0, 1.2):
        out = core.feed(limited(Limits(chip=0.03), [(0.0, 100.0, 0)], knob=knob), 1.0)
        assert knob * out.scale * 60.0 == pytest.approx(6.0) and out.limit == CHIP


def test_it_is_braked_to():
    """v^2 <= (n z / tau)^2 + 2 a d, with half the acceleration where it is not known."""
    out = core.feed(limited(Limits(chip=0.03), [(3.0, 100.0, 0)]), 0.0)
    assert out.scale * 60.0 == pytest.approx(math.sqrt(6.0**2 + 2.0 * 250.0 * 3.0)) and out.limit == CHIP


@pytest.mark.parametrize(
    "limits",
    [Limits(chip=0.03, rps=0.0), Limits(chip=0.03, flutes=0), Limits(), Limits(chip=math.nan), Limits(chip=-1.0)],
)
def test_what_is_unknown_limits_nothing(limits):
    out = core.feed(limited(limits, [(0.0, 100.0, 0)]), 1.0)
    assert (out.scale, out.limit) == (1.0, layout.LimitedBy.CEILING)


@pytest.mark.parametrize(
    "limits",
    [
        Limits(power=500.0, kc11=0.0),
        Limits(power=500.0, flutes=0),
        Limits(torque=1.0, mc=0.9),
        Limits(power=500.0, rps=0.0),
        Limits(power=500.0, kc11=math.nan),
        Limits(torque=1.0, mc=math.nan),
    ],
)
def test_no_power_without_a_material(limits):
    assert core.tooth_law(limited(limits, speed=10.0, power_root_now=50.0)).power_weight_per_mm == 0.0


def test_hostile_numbers():
    """Never NaN, never above the ceiling; one that is not finite makes the feed fall back to F."""
    rng = np.random.default_rng(5)
    for _ in range(4000):
        values = limited(Limits(chip=0.03, power=400.0, torque=1.0), [(1.0, 50.0, 1), (3.0, 80.0, 0)])
        names = [
            name
            for name, _kind in layout.FeedIn._fields_
            if name.startswith(
                ("tooth_", "max_chip_mm", "max_p", "max_t", "spec", "force", "chip_s", "power_r", "flut", "spin")
            )
        ]
        for name in rng.choice(names, 3):
            odd = ODD[rng.integers(len(ODD))]
            if name == "tooth_limit":
                values.tooth_limit[1] = int(rng.integers(-5, 9))
            elif name.startswith("tooth_"):
                getattr(values, name)[int(rng.integers(8))] = odd
            else:
                setattr(values, name, odd)
        out, law = core.feed(values, 1.0), core.tooth_law(values)
        assert 0.0 <= out.scale <= 1.0 and 0 <= out.limit <= TORQUE
        assert all(
            math.isfinite(getattr(law, name)) and getattr(law, name) >= 0.0 for name, _kind in layout.ToothOut._fields_
        )
    values = limited(Limits(chip=0.03), [(0.0, math.nan, 0)])
    assert core.feed(values, 1.0).limit == FALLBACK


def test_weights_that_are_no_numbers():
    """The tables stay sound, and what cannot be a weight limits nothing."""
    stock, tool = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25), core.Tool(10.0)
    for odd in ODD:
        for given_weights in ((odd, 1.0, 0.25), (1.0, odd, 0.25), (1.0, 1.0, odd)):
            tool.limit(*given_weights)
            chip, power = stock.tooth(tool, (0.1, 0.2, -DEPTH), (1.0, 0.0, 0.0), core.UNCUT)
            assert 0.0 <= chip <= 1.0 and 0.0 <= power < 100.0


ALONE = {"mrr_target_mm3_s": 0.0, "section_area_mm2": 12.0, "programmed_vel_mm_s": 5.0}  # M251 without Q


@pytest.mark.parametrize("mode", [2, 3])
def test_limits_alone(mode):
    """Without a rate the chip is the only bound, up to the ceiling; with one of the tool the smaller of both."""

    def alone(**more):
        return core.feed(
            limited(Limits(chip=0.03), [(0.0, 100.0, 0)], feed_mode=mode, **ALONE | {"mrr_lower_mm3_s": 6000.0} | more),
            1.0,
        )

    out = alone()
    assert out.scale * 60.0 == pytest.approx(6.0) and out.limit == CHIP
    out = alone(tool_max_rate_mm3_s=36.0)
    assert out.scale * 60.0 == pytest.approx(3.0) and out.limit == HERE
    assert (
        core.feed(
            limited(
                Limits(chip=0.03), [], feed_mode=mode, **ALONE | {"section_area_mm2": 0.0, "mrr_lower_mm3_s": 6000.0}
            ),
            1.0,
        ).scale
        == 1.0
    )  # air: the ceiling


@pytest.mark.parametrize(
    "limits",
    [
        Limits(),
        Limits(chip=0.03, rps=0.0),
        Limits(chip=0.03, flutes=0),
        Limits(power=500.0, kc11=0.0),
        Limits(chip=math.nan),
        Limits(torque=1.0, mc=0.9),
    ],
)
def test_without_a_rate_and_a_limit_the_feed_is_f(limits):
    for mode in (2, 3):
        out = core.feed(limited(limits, [(0.0, 100.0, 0)], feed_mode=mode, **ALONE), 1.0)
        assert out.limit == FALLBACK and out.scale == pytest.approx(5.0 / 60.0)


def test_limits_alone_that_are_not_read_yet():
    """The tracker meets stock and gives no tooth load, as in the first period after a tool change: F, not the
    ceiling."""
    out = core.feed(limited(Limits(chip=0.03), [], **ALONE), 1.0)
    assert out.limit == FALLBACK and out.scale == pytest.approx(5.0 / 60.0)
    values = limited(Limits(chip=0.03), [], **ALONE | {"section_area_mm2": 0.0})
    values.load_area_mm2[5] = 12.0
    assert core.feed(values, 1.0).limit == FALLBACK


def test_a_measured_load_has_the_power_predicted_and_limits_nothing():
    """Without a limit the power is 0 until the spindle's load is measured (spindle_load.h); the feed is the same, and
    so it is with a limit."""
    known = dict(speed=30.0, chip_share_now=1.0, power_root_now=40.0)
    for limits in (Limits(), Limits(chip=0.03), Limits(power=500.0)):
        plain, measured = (limited(limits, [(2.0, 1e-12 * 40.0, 1)], is_load_measured=seen, **known) for seen in (0, 1))
        law = core.tooth_law(measured)
        assert law.power_w > 10.0 and law.power_weight_per_mm > 0.0
        assert core.feed(measured, 1.0).scale == core.feed(plain, 1.0).scale
        assert (law.power_weight_per_mm < 1e-9) == (limits.power == 0.0)
    plain = core.tooth_law(limited(Limits(), [], **known))
    assert plain.power_w == plain.power_weight_per_mm == 0.0


@pytest.mark.parametrize("rate", [math.nan, math.inf, -1.0])
def test_a_rate_that_is_no_number_is_not_none(rate):
    assert (
        core.feed(limited(Limits(chip=0.03), [(0.0, 100.0, 0)], **ALONE | {"mrr_target_mm3_s": rate}), 1.0).limit
        == FALLBACK
    )


def test_mode_1_needs_a_rate():
    assert core.feed(limited(Limits(chip=0.03), [(0.0, 100.0, 0)], feed_mode=1, **ALONE), 1.0).limit == FALLBACK


def test_no_limit_no_code():
    out = core.feed(given(kind=1, area=3.0), 1.0)
    assert out.limit in (HERE, NOTHING)
