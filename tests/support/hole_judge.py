# SPDX-License-Identifier: GPL-2.0-or-later
"""Random holes for G12 and G13, and the verdict on one: shared by test_hole.py and test_g12_g13*.py."""

import math

from chipwise.cycles import hole
from support import hole_oracle as oracle

TOLERANCE = 0.001  # mm, the target: no kerf further outside the hole


def request(**changes):
    """A hole of 20 mm, tool 2 mm, H 8."""
    values = dict(
        x=10.0,
        y=-5.0,
        bottom=-6.0,
        clearance=2.0,
        radius=10.0,
        ccw=True,
        tool_radius=1.0,
        feed=600.0,
        plunge_feed=300.0,
        start=(0.0, 0.0, 20.0),
        chop_size=8.0,
    )
    return hole.HoleRequest(**{**values, **changes})


def random_case(rng):
    """A hole with any mixture of diameter, tool and H: from hardly larger than the tool to 60 tools across."""
    tool = rng.choice([rng.uniform(0.4, 3), rng.uniform(2, 12)])
    d = tool * rng.uniform(1.02, rng.choice([2.5, 6, 30, 60]))
    return request(
        radius=d / 2,
        tool_radius=tool / 2,
        chop_size=rng.uniform(0.12, 1.3) * d,
        x=rng.uniform(-50, 50),
        y=rng.uniform(-50, 50),
        ccw=rng.random() < 0.5,
        depth_step=rng.choice([None, 1.1, 3.0]),
        start=(rng.uniform(-60, 60), rng.uniform(-60, 60), 5.0),
    )


def judge(r, elements, cell_share=1 / 220):
    """All the promises of one hole; returns (largest piece / H, mm outside, wall gap), raises AssertionError."""
    centre, radius = (r.x, r.y), hole.finished_radius(r)
    out = oracle.outside(elements, centre, radius, r.tool_radius)
    gap = oracle.wall_gap(elements, centre, radius, r.tool_radius, r.bottom)
    assert out <= TOLERANCE, f"kerf {out:.5f} mm outside the hole"
    assert gap <= TOLERANCE, f"wall missed by {gap:.5f} mm"
    assert not oracle.rapid_faults(elements, r.clearance), "rapid below the clearance plane"
    assert math.dist(elements[-1].b, (r.x, r.y, r.clearance)) < 1e-4, "does not end over the centre"
    share = 0.0
    if r.chop_size > 0 and r.finished is None:
        cell = 2 * radius * cell_share
        exact = oracle.grid_pieces(elements, centre, radius, r.tool_radius, r.bottom)
        seen = oracle.loose_pieces(elements, centre, radius, r.tool_radius, r.bottom, cell)
        largest = max(exact, default=0.0)
        if 2 * radius >= r.chop_size:
            assert largest < r.chop_size, f"piece of {largest:.4f} mm, H {r.chop_size:.4f}"
            assert max(seen, default=0.0) < r.chop_size, f"piece of {max(seen):.4f} mm seen, H {r.chop_size:.4f}"
        share = largest / r.chop_size
        # the lead-in may cut a piece further, never the other way round
        assert max(seen, default=0.0) <= largest + 1e-6, "the raster sees a larger piece than the exact cells"
    return share, out, gap
