# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs as other people's CAM writes them for reliefs, engraving and spirals, of many short moves.  Called by
foreign.py."""

import math

from support.foreign_post import CLEAR, Post, number, Job
from support.judge import Tool, ball


def relief(x, y, rng_phase):
    """A smooth relief, 0 down to about -6 mm."""
    a, b, c = rng_phase
    return (
        -3.1
        + 1.3 * math.sin(0.31 * x + a) * math.cos(0.23 * y + b)
        + 1.2 * math.sin(0.11 * x - 0.17 * y + c)
        + 0.4 * math.sin(0.9 * x + 0.4 * y)
    )


def relief_rows(job, rows, beyond, step, phase, feed):
    """Zigzag rows, (first y, below which, how far apart), over a relief and so far beyond its ends.  step: () -> mm of
    the next move."""
    (y, last, apart), p, forth = rows, job.post, True
    while y < last:
        x, end = (-beyond, job.size[0] + beyond) if forth else (job.size[0] + beyond, -beyond)
        p.line(x=x, y=y, z=relief(x, y, phase), feed=feed)
        while abs(end - x) > 1e-9:
            x = min(x + step(), end) if forth else max(x - step(), end)
            p.line(x=x, y=y, z=relief(x, y, phase))
        y, forth = y + apart, not forth


def estlcam_relief(rng):
    """One D3.175 ball, zigzag raster of a relief straight from the solid: 0.5 mm rows, moves of 0.05 to 0.5 mm."""
    p = Post(rng, numbers=10, decimals=4)
    job = Job(rng, p, (number(rng, 24, 28), number(rng, 7, 9), number(rng, 9, 11)))
    job.tool(1, ball(3.175), number(rng, 20, 30))
    p.say("Project relief")
    p.raw("G21", "G90 G17 G94")
    job.start("G64 P0.01")
    p.raw("T1 M6", "G43 H1", "M3 S24000")
    p.rapid(z=5.0)
    job.stock(rng.uniform(28, 36), 2400)
    phase = [rng.uniform(0, 6) for _ in range(3)]
    y = 1.3
    p.rapid(x=-2.1, y=y)
    p.rapid(z=1.0)
    relief_rows(job, (y, job.size[1] - 1.0, 0.5), 2.1, lambda: rng.choice((0.05, 0.1, 0.17, 0.25, 0.5)), phase, 1200)
    p.rapid(z=5.0)
    return job.finish("estlcam_relief")


def vectric_vcarve(rng):
    """V-carving, inch, no spaces: strokes of a 60 degree vee whose depth swells and fades, corners lifted out."""
    p = Post(rng, inch=True, numbers=10, spaced=False)
    job = Job(
        rng, p, (number(rng, 66, 74), number(rng, 40, 46), number(rng, 9, 12)), turn=math.radians(rng.uniform(-14, -4))
    )
    job.offset = (job.offset[0], job.offset[1] + 22.0, job.offset[2])
    job.tool(7, Tool(12.7, 0.0, 60.0), number(rng, 60, 75))
    p.say("v-carve sign")
    p.raw("G20", "G17G40G49G80G90G94")
    job.start("G64 P0.0005")
    p.raw("T7M6", "G43H7", "S16000M3")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(40, 55), 2400)
    for k in range(9):
        x, y = 8.0 + 6.1 * k, number(rng, 8.0, 12.0)
        length, deepest, turn = rng.uniform(16, 24), rng.uniform(2.2, 4.4), rng.uniform(-0.5, 0.5)
        p.rapid(x=x, y=y)
        p.rapid(z=1.0)
        p.line(z=-0.05, feed=500)
        steps = rng.randint(18, 60)
        for n in range(1, steps + 1):
            t = n / steps
            bend = turn + 0.8 * math.sin(3.0 * t)
            p.line(
                x=x + length * t * math.sin(bend),
                y=y + length * t * math.cos(bend),
                z=-0.05 - deepest * math.sin(math.pi * min(t, 0.999)) ** 0.8,
                feed=1400,
            )
        p.rapid(z=CLEAR)
    return job.finish("vectric_vcarve")


def taper_two_tools(rng):
    """Roughing by a D6 flat in levels, then a D6 tapered ball (R0.5, 20 degrees) in 0.4 mm rows; lengths 28 and 96
    mm."""
    p = Post(rng, numbers=1, decimals=3)
    job = Job(rng, p, (number(rng, 30, 34), number(rng, 14, 17), number(rng, 10, 12)))
    job.tool(21, Tool(6.0), 28.0 + rng.random())
    job.tool(22, Tool(6.0, 0.5, 20.0), 96.0 + rng.random())
    p.say("Aspire 3D rough + finish")
    p.raw("G21", "G17 G90 G40 G94")
    job.start("G64 P0.01")
    p.raw("T21 M6", "G43 H21", "S14000 M3")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(60, 80), 3000)
    phase = [rng.uniform(0, 6) for _ in range(3)]
    y = 2.2
    while y < 11.0:
        p.rapid(x=-4.3, y=y)
        p.rapid(z=-1.2)
        p.line(x=job.size[0] + 4.3, feed=900)
        p.rapid(z=CLEAR)
        y += 4.4
    p.raw("M5", "G53 G0 Z115.", "T22 M6")
    p.raw(f"G43.1 Z{p.value(job.tools[22][1])}")  # the length is in the program, as the post of a presetter has it
    p.raw("S18000 M3")
    job.rate(rng.uniform(22, 30), 2400)
    y = 2.9
    p.motion, p.at = None, {}
    p.rapid(x=-1.0, y=y)
    p.rapid(z=CLEAR)
    p.rapid(z=1.0)
    relief_rows(job, (y, 7.5, 0.4), 1.0, lambda: 0.3, phase, 1300)
    p.rapid(z=CLEAR)
    return job.finish("taper_two_tools")


def spiral_round(rng):
    """A round blank: a spiral of 0.3 mm moves over its face, a helical bore, a ring groove; D12 ball, D10 flat."""
    p = Post(rng, numbers=5, decimals=3)
    size = number(rng, 48, 56)
    job = Job(rng, p, (size, size, number(rng, 14, 17)), round_=True, origin="centre")
    job.offset = (job.offset[0] + 40.0, job.offset[1] + 40.0, job.offset[2])
    job.tool(15, ball(12.0), number(rng, 100, 120))
    job.tool(16, Tool(10.0), number(rng, 45, 55))
    p.say("spiral")
    p.raw("G21 G17 G90 G94 G91.1")
    job.start("G64 P0.03 Q0.01")
    p.raw("T15 M6", "G43 H15", "M3 S8000")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(150, 190), 3900)
    radius, angle = 0.5 * size + 6.0, 0.0
    p.rapid(x=radius, y=0.0)
    p.rapid(z=-1.9)
    while radius > 8.0:
        angle += 0.3 / radius
        radius = 0.5 * size + 6.0 - 3.7 * angle / (2.0 * math.pi)
        p.line(x=radius * math.cos(angle), y=radius * math.sin(angle), feed=1500)
    p.rapid(z=CLEAR)
    p.raw("G53 G0 Z115.", "T16 M6", "G43 H16", "M3 S7000")
    p.motion, p.at = None, {}
    job.rate(rng.uniform(130, 170), 3900)
    p.rapid(x=4.2, y=0.0)
    p.rapid(z=CLEAR)
    p.rapid(z=1.0)
    z = 1.0
    while z > -9.0:
        z -= 1.1
        p.arc(False, -4.2, 0.0, 0.0, 0.0, z=z + 0.55, feed=700)
        p.arc(False, 4.2, 0.0, 0.0, 0.0, z=z)
    p.arc(False, -4.2, 0.0, 0.0, 0.0)
    p.arc(False, 4.2, 0.0, 0.0, 0.0)
    p.line(x=2.0, y=0.5)
    p.rapid(z=CLEAR)
    return job.finish("spiral_round")
