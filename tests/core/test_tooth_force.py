# SPDX-License-Identifier: GPL-2.0-or-later
"""The side force of a section (core/tooth_force.c) against closed forms, and its limit in the law
(core/tooth_law.c)."""

import math

import numpy as np
import pytest

from chipwise.clib import core, layout
from chipwise.tool_data.bending import stiffness
from support.feed_cases import FALLBACK, FORCE, ODD, limited
from support.tooth_oracle import Limits, anywhere

MC, DEPTH = 0.25, 3.0
FLAT, CURVED = (0.01, 0.03), (0.04, 0.05)  # mean error and standard deviation of the sums, shares of the truth
PEAK, PEAK_CURVED = (
    (-0.02, 0.03),
    (-0.06, 0.05),
)  # mean error of the largest force: 5 degrees between two edges, bands of a round end
PEAK_RIM = 0.15  # the same where the rim of a round end meets all of the stock: never too low


def truth(tool, depth, inner, edges, count=720):
    """(largest vector sum of a turn, its mean) mm, of stock that reaches from `inner` mm beside the path outwards: a
    sum over the tool's edges."""
    z = (np.arange(600) + 0.5) / 600 * depth
    r = np.array([tool.reach(v) for v in z])
    slope = np.array([tool.reach(v + 1e-6) - tool.reach(max(v - 1e-6, 1e-12)) for v in z]) / 2e-6
    lean = 1.0 / np.sqrt(1.0 + slope**2)
    count = edges * (count // edges)
    phi = (np.arange(2 * count) + 0.5) * math.pi / count - 0.5 * math.pi
    face = lean[:, None] * np.cos(phi) * (r[:, None] * np.sin(phi) >= inner)
    one = (
        np.sum(np.where(face > 0.0, face, 0.0) ** (1.0 - MC) * (face > 0.0) / lean[:, None], axis=0)
        * depth
        / 600
        * np.exp(1j * phi)
    )
    together = one.reshape(edges, -1).sum(axis=0)
    return float(np.abs(together).max()), float(np.abs(together.mean()))


def errors(shape, cell, share, depth, count, edges):
    """Errors of both, shares of the truth, at places and directions of all kinds; a pass of `share` of the diameter."""
    rng, tool = np.random.default_rng(7), core.Tool(*shape).limit(force_weight=1.0, edges=edges)
    inner = tool.radius * (1.0 - 2.0 * share)
    exact, found = np.array(truth(tool, depth, inner, edges)), []
    for _ in range(count):
        stock, place, along = anywhere(rng, cell, inner, depth)
        found.append(np.array(stock.side_force(tool, (*place, -depth), (*along, 0.0), core.UNCUT)) / exact - 1.0)
    return np.array(found)


@pytest.mark.parametrize("diameter, cell", [(10, 0.25), (6, 0.25), (3, 0.125)])
@pytest.mark.parametrize("share", [0.05, 0.1, 0.25, 0.5, 0.75, 0.95])
def test_side_cut(diameter, cell, share):
    for edges in range(1, 6):
        found = errors((diameter,), cell, share, DEPTH, 8, edges)
        assert abs(found[:, 1].mean()) <= FLAT[0] and found[:, 1].std() <= FLAT[1], (
            edges,
            found[:, 1].mean(),
            found[:, 1].std(),
        )
        assert PEAK[0] <= found[:, 0].mean() <= PEAK[1] and found[:, 0].std() <= FLAT[1], (
            edges,
            found[:, 0].mean(),
            found[:, 0].std(),
        )


@pytest.mark.parametrize(
    "shape, depth, share",
    [
        ((6, 3, 0), 3.0, 0.1),
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
    for edges in (2, 4):
        found = errors(shape, 0.25, share, depth, 6, edges)
        assert abs(found[:, 1].mean()) <= CURVED[0] and found[:, 1].std() <= CURVED[1], (
            edges,
            found[:, 1].mean(),
            found[:, 1].std(),
        )
        assert (
            PEAK_CURVED[0] <= found[:, 0].mean() <= (PEAK_RIM if share <= 0.1 else PEAK_CURVED[1])
            and found[:, 0].std() <= CURVED[1]
        ), (edges, found[:, 0].mean(), found[:, 0].std())


@pytest.mark.parametrize("degrees, edges", [(0.0, 3), (5.0, 2), (30.0, 3), (60.0, 4)])
def test_ramp(degrees, edges):
    """A flat end that goes down a slot: its wall pushes as much less as it goes level; the forces on its end cancel
    each other."""
    fall, level = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    stock, tool = (
        core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25),
        core.Tool(10.0).limit(force_weight=1.0, edges=edges),
    )
    found = stock.side_force(tool, (0.1, 0.2, -DEPTH), (level, 0.0, -fall), core.UNCUT)
    exact = np.array(truth(tool, DEPTH, -5.0, edges)) * level ** (1.0 - MC)
    assert found == pytest.approx(exact, rel=0.03)


def test_a_plunge_pushes_one_edge_aside():
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    one, three = (
        stock.side_force(
            core.Tool(10.0).limit(force_weight=1.0, edges=edges), (0.1, 0.2, -DEPTH), (0.0, 0.0, -1.0), core.UNCUT
        )
        for edges in (1, 3)
    )
    assert one[0] == pytest.approx(5.0, rel=0.03) and three[0] < 0.3 and one[1] < 0.1


def test_a_brink_in_the_heading():
    """Islands on both sides, and a rib: the largest of all is found."""
    stock, tool = (
        core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25),
        core.Tool(10.0).limit(force_weight=1.0, edges=2),
    )
    core.Cutter(stock, core.Tool(7.0), (-80.0, 0.0, -4.0)).to((80.0, 0.0, -4.0))
    assert stock.side_force(tool, (0.0, 0.0, -DEPTH), (1.0, 0.0, 0.0), core.UNCUT)[0] == pytest.approx(
        DEPTH * math.sqrt(1.0 - 0.7**2) ** 0.75, rel=0.02
    )
    stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
    for y in (-11.0, 11.0):
        core.Cutter(stock, core.Tool(20.0), (-80.0, y, -4.0)).to((80.0, y, -4.0))
    assert stock.side_force(tool, (0.0, 0.0, -DEPTH), (1.0, 0.0, 0.0), core.UNCUT)[0] == pytest.approx(DEPTH, rel=0.02)


def test_without_a_limit_nothing_changes():
    """Bit for bit: area, chip and A_mc do not depend on the force, and without its limit it is not summed up."""
    rng = np.random.default_rng(3)
    for shape in ((10, 0, 0), (6, 3, 0), (10, 2, 0), (8, 0, 90)):
        stock = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25)
        core.Cutter(stock, core.Tool(7.0), (-20.0, -3.0, -2.5)).to((20.0, 4.0, -2.5))
        plain, limited, forced = core.Tool(*shape), core.Tool(*shape).limit(), core.Tool(*shape).limit(force_weight=1.0)
        for _ in range(40):
            turn, fall = rng.uniform(0.0, 7.0), rng.choice([0.0, 0.0, 0.3, -0.2])
            level = math.sqrt(1.0 - fall**2)
            where = (
                tuple(rng.uniform(-6.0, 6.0, 2)) + (-DEPTH,),
                (level * math.cos(turn), level * math.sin(turn), -fall),
                rng.choice([0.0, 1.0, core.UNCUT]),
            )
            assert stock.section(plain, *where) == stock.section(forced, *where) and stock.tooth(
                limited, *where
            ) == stock.tooth(forced, *where)
            assert stock.side_force(plain, *where) == stock.side_force(limited, *where) == (0.0, 0.0)
            most, mean = stock.side_force(forced, *where)
            assert 0.0 <= mean <= most * 1.05 + 1e-6 and most < 3.0 * 20.0


# ---- the law ---------------------------------------------------------------------------------------------------------


def test_what_the_tracker_is_given():
    """3 mm of edge across a slot at fz = 0.05 mm in 6061: 1.044 x 800 x 3 x 0.05^0.75 N, and the bending of a beam."""
    stiff = stiffness(6.0, 30.0, "carbide")
    assert stiff == pytest.approx(3.0 * 580e3 * math.pi * 6.0**4 / 64.0 / 30.0**3)
    values = limited(
        Limits(force=200.0), speed=30.0, force_root_now=3.0 ** (1.0 / (1.0 - MC)), force_mean_share_now=0.5
    )
    values.tool_stiffness_n_mm = stiff
    law = core.tooth_law(values)
    force = 1.044 * 800.0 * 3.0 * 0.05**0.75
    assert (law.side_force_n, law.mean_force_n, law.deflection_mm) == pytest.approx((force, 0.5 * force, force / stiff))
    assert law.force_weight_per_mm == pytest.approx((1.044 * 800.0 / 200.0) ** (4.0 / 3.0))


def test_its_code_and_its_braking():
    out = core.feed(limited(Limits(force=200.0), [(0.0, 40.0, layout.ToothLimit.FORCE)]), 1.0)
    assert (out.scale, out.limit) == (pytest.approx(600.0 / 40.0 / 60.0), FORCE)
    out = core.feed(limited(Limits(force=200.0), [(3.0, 100.0, layout.ToothLimit.FORCE)]), 0.0)
    assert out.scale * 60.0 == pytest.approx(math.sqrt(6.0**2 + 2.0 * 250.0 * 3.0)) and out.limit == FORCE


@pytest.mark.parametrize(
    "limits",
    [
        Limits(force=200.0, kc11=0.0),
        Limits(force=200.0, mc=0.9),
        Limits(force=200.0, flutes=0),
        Limits(force=math.nan),
        Limits(force=-1.0),
    ],
)
def test_what_is_unknown_limits_nothing(limits):
    law = core.tooth_law(limited(limits, speed=30.0, force_root_now=4.0))
    assert law.force_weight_per_mm == law.side_force_n == law.deflection_mm == 0.0


def test_the_force_alone_can_do_without_a_rate():
    more = {"mrr_target_mm3_s": 0.0, "section_area_mm2": 12.0, "programmed_vel_mm_s": 5.0}
    assert core.feed(limited(Limits(force=200.0), [(0.0, 100.0, 2)], **more), 1.0).scale * 60.0 == pytest.approx(6.0)
    assert core.feed(limited(Limits(force=200.0, kc11=0.0), [(0.0, 100.0, 2)], **more), 1.0).limit == FALLBACK


def test_weights_that_are_no_numbers():
    stock, tool = core.Stock((-16.0, -16.0, -10.0), (16.0, 16.0, 0.0), 0.25), core.Tool(10.0)
    for odd in ODD:
        for weights in (
            {"force_weight": odd},
            {"force_weight": 1.0, "edges": odd},
            {"force_weight": 1.0, "exponent": odd},
        ):
            tool.limit(**weights)
            most, mean = stock.side_force(tool, (0.1, 0.2, -DEPTH), (1.0, 0.0, 0.0), core.UNCUT)
            assert 0.0 <= most < 100.0 and 0.0 <= mean < 100.0
    rng = np.random.default_rng(5)
    for _ in range(2000):
        values = limited(Limits(force=200.0), [(1.0, 50.0, 2)], speed=30.0)
        for name in rng.choice(
            [
                "max_force_n",
                "tool_stiffness_n_mm",
                "force_root_now",
                "force_mean_share_now",
                "flutes",
                "spindle_speed_rps",
                "specific_force_n_mm2",
            ],
            3,
        ):
            setattr(values, name, ODD[rng.integers(len(ODD))])
        out, law = core.feed(values, 1.0), core.tooth_law(values)
        assert 0.0 <= out.scale <= 1.0
        assert all(
            math.isfinite(getattr(law, name)) and getattr(law, name) >= 0.0 for name, _kind in layout.ToothOut._fields_
        )
