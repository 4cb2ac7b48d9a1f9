# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten more programs in CAM styles that foreign.py has not: faces, terraces, slopes, chamfers, rest of corners.  Called
by foreign_styles.py."""

import math

from support.foreign_post import CLEAR, number
from support.judge import Tool, ball
from support.styles_outline import begin, change, down


def diagonal_relief(rng):
    """A ball over a wavy face in rows at 45 degrees, lines as long as the chord allows, lifted to the next row."""
    p, job = begin(rng, {"decimals": 4}, (number(rng, 22, 25), number(rng, 22, 25), 9.4), {4: ball(6.0)}, "G64 P0.01")
    job.stock(rng.uniform(40, 60), 2700)
    phase = rng.uniform(0, 6)

    def height(x, y):
        return -1.6 + 0.8 * math.sin(0.42 * x + phase) + 0.5 * math.cos(0.37 * y - phase)

    for row in range(-9, 10, 3):
        x, y = max(-3.0, -3.0 + row), max(-3.0, -3.0 - row)
        end = job.size[0] + 3.0
        p.rapid(x=x, y=y)
        p.rapid(z=1.0)
        p.line(z=height(x, y), feed=600)
        while max(x, y) < end:
            step = rng.uniform(0.2, 0.8)
            x, y = x + step, y + step
            p.line(x=x, y=y, z=height(x, y), feed=1300)
        p.rapid(z=CLEAR)
    return job.finish("diagonal_relief")


def waterlines(rng):
    """A hill cut level by level, each outline a closed polygon of 0.8 mm lines, the step-in to the next level a slanted
    line."""
    p, job = begin(
        rng,
        {"numbers": 10},
        (number(rng, 36, 40), number(rng, 36, 40), 10.6),
        {3: Tool(8.0)},
        "G64 P0.02",
        origin="centre",
    )
    job.stock(rng.uniform(70, 100), 3600)
    phase = rng.uniform(0, 6)
    p.rapid(x=0.5 * job.size[0] + 6.0, y=0.0)
    p.rapid(z=1.0)
    for level in range(4):
        z, base = -1.3 * (level + 1), 19.0 + 0.9 * level
        for k in range(151):
            angle = 2 * math.pi * k / 150
            radius = base + 1.7 * math.sin(3 * angle + phase)
            p.line(x=radius * math.cos(angle), y=radius * math.sin(angle), z=z, feed=1400)
    p.line(x=0.5 * job.size[0] + 8.0, y=0.0)
    p.rapid(z=CLEAR)
    return job.finish("waterlines")


def smooth_lace(rng):
    """Facing with a bull nose: rows joined by half circles outside and inside of the stock."""
    p, job = begin(
        rng, {"numbers": 5}, (number(rng, 42, 48), number(rng, 36, 40), 10.2), {8: Tool(12.0, 1.5)}, "G64 P0.05"
    )
    job.stock(rng.uniform(150, 210), 4500)
    y, apart, forth = 2.3, 7.9, True
    p.rapid(x=-10.0, y=y)
    p.rapid(z=-1.7)
    while True:
        x = job.size[0] - 3.0 if forth else 3.0
        p.line(x=x, y=y, feed=1800)
        if y + apart > job.size[1] + 2.0:
            break
        p.arc(not forth, x, y + apart, x, y + 0.5 * apart)
        y, forth = y + apart, not forth
    p.line(x=job.size[0] + 10.0 if forth else -10.0, y=y)
    p.rapid(z=CLEAR)
    return job.finish("smooth_lace")


def chamfered_plate(rng):
    """A plate faced along two sides, then chamfered by a vee along these edges and round a corner."""
    p, job = begin(
        rng,
        {"decimals": 3},
        (number(rng, 40, 44), number(rng, 30, 34), 9.8),
        {2: Tool(8.0), 6: Tool(8.0, 0.0, 90.0)},
        "G64 P0.02",
    )
    job.stock(rng.uniform(60, 90), 3600)
    p.rapid(x=-2.9, y=-7.0)
    p.rapid(z=-4.4)
    p.line(y=job.size[1] + 2.9, feed=1100)
    p.line(x=job.size[0] + 7.0)
    change(p, 6, rng.uniform(8, 13), job)
    p.rapid(x=-0.2, y=-7.0)
    p.rapid(z=-2.2)
    p.line(y=job.size[1] - 2.0, feed=900)
    p.arc(True, 2.0, job.size[1] + 0.2, 2.0, job.size[1] - 2.0)
    p.line(x=job.size[0] + 7.0)
    p.rapid(z=CLEAR)
    return job.finish("chamfered_plate", end="M2")


def thread_mill(rng):
    """A bore milled by a helix, then a second, finer helix upward 0.3 mm wider, led in and out by half circles."""
    p, job = begin(
        rng,
        {"numbers": 10},
        (number(rng, 28, 32), number(rng, 28, 32), 10.9),
        {3: Tool(8.0), 5: Tool(6.0)},
        "G61.1",
        origin="centre",
    )
    job.stock(rng.uniform(60, 90), 3000)
    p.rapid(x=3.1, y=0.0)
    p.rapid(z=0.6)
    z = 0.6
    while z > -7.0:
        z -= 0.55
        for side in (-1, 1):
            p.arc(False, side * 3.1, 0.0, 0.0, 0.0, z=z + (0.0 if side > 0 else 0.275), feed=700)
    for side in (-1, 1):
        p.arc(False, side * 3.1, 0.0, 0.0, 0.0)
    p.line(x=0.0, y=0.0)
    change(p, 5, rng.uniform(12, 20), job)
    p.rapid(x=0.0, y=0.0)
    p.rapid(z=-6.5)
    radius, z = 4.45, -6.5
    p.arc(False, radius, 0.0, 0.5 * radius, 0.0, feed=900)
    for _turn in range(5):
        for side in (-1, 1):
            z += 0.5
            p.arc(False, side * radius, 0.0, 0.0, 0.0, z=z)
    p.arc(False, 0.0, 0.0, 0.5 * radius, 0.0)
    p.rapid(z=CLEAR)
    return job.finish("thread_mill")


def terraces(rng):
    """Lines along X whose height jumps from step to step as a push cutter writes them: vertical moves up and down in
    the cut."""
    p, job = begin(rng, {"modal": False}, (number(rng, 40, 44), number(rng, 18, 21), 9.9), {1: Tool(6.0)}, "G61")
    job.stock(rng.uniform(45, 70), 3000)
    edges = sorted(rng.uniform(2, 38) for _ in range(5))
    depths = [-rng.uniform(1.0, 4.0) for _ in range(6)]
    for k in range(4):
        y = 1.1 + 4.3 * k
        p.rapid(x=-4.5, y=y)
        p.rapid(z=depths[0])
        for edge, z, after in zip(edges, depths, depths[1:]):
            p.line(x=edge, y=y, z=z, feed=1100)
            p.line(x=edge, y=y, z=after, feed=500)
        p.line(x=job.size[0] + 4.5, y=y, z=depths[-1], feed=1100)
        p.rapid(z=CLEAR)
    return job.finish("terraces")


def corner_rest(rng):
    """A pocket by 10 mm, then its corners by 4 mm: arcs into each corner, wider from one to the next."""
    p, job = begin(
        rng,
        {"numbers": 2},
        (number(rng, 44, 48), number(rng, 36, 40), 9.3),
        {10: Tool(10.0), 14: Tool(4.0)},
        "G64 P0.03",
    )
    job.stock(rng.uniform(90, 130), 3600)
    x0, y0, x1, y1 = 10.2, 10.4, job.size[0] - 10.1, job.size[1] - 10.3
    down(p, x0, y0, -2.6, feed=250)
    for x, y in (
        (x1, y0),
        (x1, y1),
        (x0, y1),
        (x0, y0),
        (x0 + 6, y0 + 6),
        (x1 - 6, y0 + 6),
        (x1 - 6, y1 - 6),
        (x0 + 6, y1 - 6),
    ):
        p.line(x=x, y=y, feed=1300)
    change(p, 14, rng.uniform(14, 22), job)
    for x, y, turn in ((x0, y0, 180), (x1, y0, 270), (x1, y1, 0), (x0, y1, 90)):
        a, b = math.radians(turn), math.radians(turn + 90)
        p.rapid(x=x + 0.5 * (math.cos(a) + math.cos(b)), y=y + 0.5 * (math.sin(a) + math.sin(b)))
        p.rapid(z=1.0)
        p.line(z=-2.6, feed=400)
        for out in (1.1, 1.6, 2.1, 2.6, 3.0):
            p.line(
                x=x + out * math.cos(a) + 3.0 * math.cos(b) - out * math.cos(b),
                y=y + out * math.sin(a) + (3.0 - out) * math.sin(b),
                feed=900,
            )
            p.line(x=x + out * (math.cos(a) + math.cos(b)), y=y + out * (math.sin(a) + math.sin(b)))
            p.line(x=x + out * math.cos(b), y=y + out * math.sin(b))
            p.line(x=x + 0.5 * (math.cos(a) + math.cos(b)), y=y + 0.5 * (math.sin(a) + math.sin(b)))
        p.rapid(z=CLEAR)
    return job.finish("corner_rest")


def biarc_logo(rng):
    """A band of arcs of ever another radius that turn left and right, tangent to each other, in two depths."""
    p, job = begin(
        rng,
        {"decimals": 5, "modal": False},
        (number(rng, 56, 62), number(rng, 36, 40), 8.9),
        {1: Tool(3.0)},
        "G64 P0.01",
    )
    job.stock(rng.uniform(18, 28), 3000)
    arcs = [(rng.uniform(2.5, 9.0), math.radians(rng.uniform(50, 100))) for _ in range(6)]
    for z in (-1.1, -2.3):
        down(p, 6.3, 0.5 * job.size[1], z, feed=200)
        x, y, heading = 6.3, 0.5 * job.size[1], math.radians(-35)
        for k, (radius, sweep) in enumerate(arcs):
            side = 1 if k % 2 == 0 else -1
            cx, cy = x - side * radius * math.sin(heading), y + side * radius * math.cos(heading)
            heading += side * sweep
            x, y = cx + side * radius * math.sin(heading), cy - side * radius * math.cos(heading)
            p.arc(side < 0, x, y, cx, cy, feed=800)
        p.rapid(z=CLEAR)
    return job.finish("biarc_logo")


def peel_arcs(rng):
    """Peeling: arcs of changing radius sweep off a side, the width of cut swells and fades along each, back in the air
    at full feed."""
    p, job = begin(rng, {"numbers": 5}, (number(rng, 40, 46), number(rng, 38, 42), 11.1), {7: Tool(10.0)}, "G64 P0.02")
    job.stock(rng.uniform(90, 130), 4800)
    middle = 0.5 * job.size[1]
    p.rapid(x=-8.0, y=middle - 14.0)
    p.rapid(z=-6.2)
    for k in range(9):
        bulge = -4.6 + 1.15 * k
        half = 14.0 + 0.4 * k
        depth = bulge + 8.0  # of the arc over its chord at X-8
        radius = (half * half + depth * depth) / (2 * depth)
        p.line(x=-8.0, y=middle - half, feed=4000)
        p.arc(False, -8.0, middle + half, -8.0 + depth - radius, middle, feed=1700)
        p.line(x=-14.0, y=middle, feed=4000)
    p.rapid(z=CLEAR)
    return job.finish("peel_arcs")


def slope_zigzag(rng):
    """A flat tool zigzags down a slope in full slots that cross their own turns, the feed word on every line."""
    p, job = begin(
        rng,
        {"decimals": 3, "modal": False},
        (number(rng, 46, 50), number(rng, 26, 30), 10.4),
        {5: Tool(6.0)},
        "G64 P0.02",
        turn=math.radians(rng.uniform(-25, 25)),
    )
    job.stock(rng.uniform(45, 70), 3300)
    x, z, side = 5.1, -0.4, True
    down(p, x, 5.2, z, feed=300)
    while x < job.size[0] - 6.0:
        p.line(x=x, y=job.size[1] - 5.3 if side else 5.2, z=z - 0.35, feed=1000)
        x, z, side = x + rng.uniform(3.4, 6.9), z - 0.6, not side
        p.line(x=x, y=p.at["y"], z=z, feed=1000)
    p.rapid(z=CLEAR)
    return job.finish("slope_zigzag")


BUILDERS = (
    diagonal_relief,
    waterlines,
    smooth_lace,
    chamfered_plate,
    thread_mill,
    terraces,
    corner_rest,
    biarc_logo,
    peel_arcs,
    slope_zigzag,
)
