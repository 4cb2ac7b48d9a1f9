# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten programs in CAM styles that foreign.py has not: outlines, trochoids, holes, plunges and chains of short lines.
Called by foreign_styles.py."""

import math

from support.foreign_post import CLEAR, Post, number, Job
from support.judge import Tool


def begin(rng, post, size, tools, path="G64 P0.02", feed=1200, **job_words):
    """(Post, Job) with the first of the tools {number: Tool} in and the tool CLEAR above the blank; `post`: words of
    Post."""
    p = Post(rng, **post)
    job = Job(rng, p, size, **job_words)
    job.offset = (job.offset[0] + 25.0, job.offset[1] + 25.0, job.offset[2])
    for n, tool in tools.items():
        job.tool(n, tool, number(rng, 20, 60))
    p.raw("G20" if p.unit != 1.0 else "G21", "G17 G40 G49 G80 G90 G94")
    job.start(path)
    first = min(tools)
    p.raw(f"T{first} M6", f"G43 H{first}", "S9000 M3")
    p.rapid(z=CLEAR)
    p.raw(f"F{feed / p.unit:.1f}")
    return p, job


def change(p, number_of, rate, job):
    """Another tool."""
    p.rapid(z=CLEAR)
    p.raw("M5", "G53 G0 Z4.5" if p.unit != 1.0 else "G53 G0 Z115.", f"T{number_of} M6", f"G43 H{number_of}", "S9000 M3")
    p.motion, p.at, p.feed = None, {}, None
    job.rate(rate, 3600)
    p.rapid(z=CLEAR)


def down(p, x, y, z, feed=300):
    """To a place, and straight down by feed."""
    p.rapid(x=x, y=y)
    p.rapid(z=1.0)
    p.line(z=z, feed=feed)


def trochoid_slot(rng):
    """A slot by full circles that step forward on straight lines, as trochoidal cycles are posted."""
    p, job = begin(rng, {"numbers": 4}, (number(rng, 36, 42), number(rng, 22, 26), 9.4), {2: Tool(6.0)})
    job.stock(rng.uniform(50, 80), 4200)
    y, radius, step = 0.5 * job.size[1] + 0.31, number(rng, 2, 3), rng.uniform(0.6, 1.1)
    p.rapid(x=-4.0, y=y)
    p.rapid(z=-4.3)
    x = -4.0 - radius
    while x < job.size[0] - 14.0:
        for side in (-1, 1):
            p.arc(False, x + side * radius, y, x, y, feed=1500)
        x += step
        p.line(x=x + radius, y=y)
    p.rapid(z=CLEAR)
    return job.finish("trochoid_slot")


def ramp_contour(rng):
    """An outside contour cut in one long ramp, corners as arcs with I J, led in and out by quarter circles."""
    p, job = begin(rng, {"numbers": 10}, (number(rng, 40, 44), number(rng, 30, 34), 10.3), {3: Tool(8.0)}, "G64 P0.05")
    job.stock(rng.uniform(70, 110), 3900)
    r, low, high = 5.0, -2.3, (job.size[0] + 2.3, job.size[1] + 2.3)
    p.rapid(x=low - 4.0, y=low - 7.0)
    p.rapid(z=1.0)
    p.line(x=low - 4.0, y=low + r - 1.0, z=0.2, feed=900)
    p.line(x=low, y=low + r)
    z = 0.2
    for _turn in range(3):
        for x, y, cx, cy, to_x, to_y in (
            (low, high[1] - r, low + r, high[1] - r, low + r, high[1]),
            (high[0] - r, high[1], high[0] - r, high[1] - r, high[0], high[1] - r),
            (high[0], low + r, high[0] - r, low + r, high[0] - r, low),
            (low + r, low, low + r, low + r, low, low + r),
        ):
            z -= 0.35
            p.line(x=x, y=y, z=z)
            z -= 0.08
            p.arc(True, to_x, to_y, cx, cy, z=z)
    p.arc(False, low - 4.0, low + r + 4.0, low - 4.0, low + r)
    p.rapid(z=CLEAR)
    return job.finish("ramp_contour")


def r_word_profile(rng):
    """Inch: a rounded plate in three levels, arcs with R words, no spaces."""
    p, job = begin(
        rng, {"inch": True, "spaced": False}, (number(rng, 34, 40), number(rng, 26, 30), 9.9), {6: Tool(6.35)}, "G61"
    )
    job.stock(rng.uniform(60, 90), 3600)
    r, v = 6.0, p.value
    x1, y1 = job.size[0] - 1.5, job.size[1] - 1.9
    for z in (-2.1, -4.0, -5.5):
        p.rapid(x=-6.0, y=r)
        p.rapid(z=z)
        p.line(x=1.2, y=r, feed=900)
        p.line(y=y1 - r)
        for x, y, to_x, to_y in (
            (1.2 + r, y1, x1 - r, y1),
            (x1, y1 - r, x1, 1.7 + r),
            (x1 - r, 1.7, 1.2 + r, 1.7),
            (1.2, 1.7 + r, -6.0, r + 1.7),
        ):
            p.raw(f"G2 X{v(x)} Y{v(y)} R{v(r)}", f"G1 X{v(to_x)} Y{v(to_y)}")
        p.motion, p.at = None, {"z": z}
        p.rapid(z=CLEAR)
    return job.finish("r_word_profile", end="M2")


def incremental_steps(rng):
    """Everything between approach and retract in G91: a staircase of short lines, then back beside it."""
    p, job = begin(rng, {}, (number(rng, 38, 44), number(rng, 28, 32), 8.7), {4: Tool(5.0)}, "G64 P0.03")
    job.stock(rng.uniform(35, 55), 3600)
    down(p, 4.3, 4.1, -2.9)
    p.raw("G91")
    count = 7
    for _ in range(count):
        p.raw(f"G1 X{rng.uniform(3.2, 4.1):.3f}", f"Y{rng.uniform(1.4, 2.4):.3f}")
    p.raw("X0.6 Y2.1")
    for _ in range(count):
        p.raw(f"X{-rng.uniform(2.8, 3.6):.3f} Y{-rng.uniform(0.1, 0.5):.3f}", f"Y{-rng.uniform(0.9, 1.5):.3f}")
    p.raw("G90")
    p.motion, p.at = None, {}
    p.rapid(z=CLEAR)
    return job.finish("incremental_steps", end="M2")


def polyline_rings(rng):
    """Rings as polygons of 0.3 mm lines, from the outside to the inside, in two levels, linked by lines."""
    p, job = begin(
        rng,
        {"decimals": 4},
        (number(rng, 34, 38), number(rng, 34, 38), 9.1),
        {1: Tool(6.0)},
        "G64 P0.01 Q0.005",
        origin="centre",
    )
    job.stock(rng.uniform(50, 70), 3000)
    for level in (-1.9, -3.7):
        down(p, 11.3, 0.0, level)
        for radius in (11.3, 8.6, 5.4, 2.2):
            p.line(x=radius, y=0.0, feed=1100)
            sides = max(12, int(2 * math.pi * radius / 0.3))
            for k in range(1, sides + 1):
                p.line(x=radius * math.cos(2 * math.pi * k / sides), y=radius * math.sin(2 * math.pi * k / sides))
        p.rapid(z=CLEAR)
    return job.finish("polyline_rings")


def plunge_roughing(rng):
    """Plunges beside each other, each raised a little and away from the wall before the next."""
    p, job = begin(rng, {"numbers": 1}, (number(rng, 34, 38), number(rng, 22, 26), 12.1), {7: Tool(8.0)}, "G61")
    job.stock(rng.uniform(45, 70), 1800)
    for row in range(2):
        y = 1.3 + 4.7 * row
        x = 3.4
        while x < job.size[0]:
            p.rapid(x=x, y=y)
            p.rapid(z=1.0)
            p.line(z=-7.2 + 0.4 * row, feed=350)
            p.line(x=x - 0.3, y=y - 0.3, z=-6.0)
            p.rapid(z=CLEAR)
            x += 3.1
    return job.finish("plunge_roughing")


def bored_holes(rng):
    """Holes of four sizes by helices of full turns (one G2 a turn), a round at the bottom, out over the centre."""
    p, job = begin(rng, {"numbers": 5}, (number(rng, 60, 66), number(rng, 20, 24), 9.7), {5: Tool(6.0)})
    job.stock(rng.uniform(55, 85), 3600)
    x = 8.4
    for k in range(4):
        radius = 1.4 + 0.8 * k
        y = 0.5 * job.size[1] + rng.uniform(-1.0, 1.0)
        p.rapid(x=x + radius, y=y)
        p.rapid(z=0.5)
        z = 0.5
        while z > -5.5:
            z = max(z - 0.9, -5.6)
            p.arc(True, x + radius, y, x, y, z=z, feed=700)
        p.arc(True, x + radius, y, x, y)
        p.line(x=x, y=y)
        p.rapid(z=CLEAR)
        x += 11.3 + 1.3 * k
    return job.finish("bored_holes")


def offset_polygons(rng):
    """A pocket of five corners by offsets from the inside to the outside, lines only, each ring begun where the last
    one ends."""
    p, job = begin(
        rng,
        {"decimals": 4, "modal": False},
        (number(rng, 40, 46), number(rng, 40, 46), 9.5),
        {2: Tool(4.0)},
        "G64 P0.05",
        origin="centre",
    )
    job.stock(rng.uniform(28, 44), 3300)
    turn, corners = rng.uniform(0, 1), 5
    points = [(turn + 2 * math.pi * k / corners, rng.uniform(0.8, 1.1)) for k in range(corners)]
    down(p, 0.0, 0.0, -2.7, feed=200)
    for radius in (1.4, 2.9, 4.6, 6.6, 8.4, 10.5, 12.4):
        for angle, share in points + points[:1]:
            p.line(x=radius * share * math.cos(angle), y=radius * share * math.sin(angle), z=-2.7, feed=900)
    p.rapid(z=CLEAR)
    return job.finish("offset_polygons")


def small_bends(rng):
    """A chain of 1 to 3 mm lines that bend by a few degrees, out and back with half the tool's width, G64 P0.1."""
    p, job = begin(
        rng, {"numbers": 2, "decimals": 4}, (number(rng, 58, 64), number(rng, 34, 38), 9.2), {9: Tool(6.0)}, "G64 P0.1"
    )
    job.stock(rng.uniform(48, 72), 4200)
    points, angle, x, y = [], 0.0, -6.0, 0.5 * job.size[1]
    while x < job.size[0] - 8.0:
        points.append((x, y))
        angle = 0.8 * angle + math.radians(rng.uniform(-9, 9)) - 0.02 * (y - 0.5 * job.size[1])
        length = rng.uniform(1.0, 3.0)
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
    p.rapid(x=points[0][0], y=points[0][1])
    p.rapid(z=-3.1)
    for x, y in points[1:]:
        p.line(x=x, y=y, feed=1600)
    for x, y in reversed(points[:-1]):
        p.line(x=x + 0.4, y=y + 3.1)
    p.rapid(z=CLEAR)
    return job.finish("small_bends")


def slot_over_holes(rng):
    """Holes pecked by G83, then slots across them and beside them: stock that comes and goes."""
    p, job = begin(
        rng,
        {"numbers": 10},
        (number(rng, 52, 56), number(rng, 24, 28), 11.2),
        {11: Tool(7.0, 0.0, 118.0), 12: Tool(6.0)},
        "G64 P0.02",
    )
    job.stock(rng.uniform(45, 65), 1800)
    y = 0.5 * job.size[1] + 0.23
    xs = [6.2 + rng.uniform(8.3, 9.1) * k for k in range(5)]
    p.rapid(x=xs[0], y=y)
    p.raw(f"G98 G83 X{p.value(xs[0])} Y{p.value(y)} Z-7.5 R1 Q2.4 F260")
    for x in xs[1:]:
        p.raw(f"X{p.value(x)}")
    p.raw("G80")
    change(p, 12, rng.uniform(55, 80), job)
    for z, aside in ((-2.4, 0.0), (-4.9, 0.0), (-3.3, 3.7)):
        p.rapid(x=-5.0, y=y + aside)
        p.rapid(z=z)
        p.line(x=job.size[0] + 5.0, feed=1000)
        p.rapid(z=CLEAR)
    return job.finish("slot_over_holes")


BUILDERS = (
    trochoid_slot,
    ramp_contour,
    r_word_profile,
    incremental_steps,
    polyline_rings,
    plunge_roughing,
    bored_holes,
    offset_polygons,
    small_bends,
    slot_over_holes,
)
