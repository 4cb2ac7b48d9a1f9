# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs as other people's CAM writes them for pockets, holes, slots, bosses and faces.  Called by foreign.py."""

import math

from support.foreign_post import INCH, CLEAR, Post, number, Job
from support.judge import Tool


def fusion_adaptive(rng):
    """Adaptive clearing as loops of arcs, lifted 0.2 mm on the way back; helical entry; D8 flat, G43, mm, R-less
    arcs."""
    p = Post(rng, numbers=5)
    job = Job(rng, p, (number(rng, 70, 80), number(rng, 44, 52), number(rng, 12, 16)))
    job.tool(3, Tool(8.0), number(rng, 40, 60))
    p.say("1001")
    p.say("T3  D=8. CR=0. - ZMIN=-6 - flat end mill")
    p.raw("G90 G94 G17 G91.1", "G21")
    job.start()
    p.say("2D Adaptive1")
    p.raw("T3 M6", "S9000 M3", "G54", "G0 G43 Z15. H3")
    p.at["z"], p.motion = 15.0, 0
    job.stock(rng.uniform(110, 150), 4500)
    depth, load, radius = -number(rng, 4, 6), number(rng, 1.0, 1.6), 6.0
    x, y = 14.3, 0.5 * job.size[1] + 0.77
    p.rapid(x=x + 2.5, y=y)
    p.rapid(z=2.0)
    p.line(z=1.0, feed=400)
    z = 1.0
    while z > depth:  # the helix, pitch 1.2 mm
        for side in (-1, 1):
            z = max(z - 0.6, depth)
            p.arc(False, x + side * 2.5, y, x, y, z=z, feed=900)
    p.arc(False, x - 2.5, y, x, y)
    p.arc(False, x + 2.5, y, x, y)
    while x < job.size[0] - 16.0:  # one loop a step
        p.line(x=x + load, y=y - radius, z=depth, feed=1500)
        x += load
        p.arc(False, x, y + radius, x, y)
        p.arc(False, x - 1.0, y + radius - 1.0, x - 0.0, y + radius - 1.0)
        p.line(z=depth + 0.2, x=x - 1.2, y=y + radius - 1.6, feed=3000)
        p.line(x=x - 1.2, y=y - radius + 1.6)
        p.line(x=x - 0.6, y=y - radius + 0.4, z=depth, feed=1500)
    p.rapid(z=15.0)
    return job.finish("fusion_adaptive")


def drill(p, cycle, holes):
    """A canned cycle at the first hole, where the tool is, and at the others; then up for the next tool."""
    p.raw(cycle)
    for x, y in holes[1:]:
        p.raw(f"X{p.value(x)} Y{p.value(y)}")
    p.raw("G80", "M5", "G53 G0 Z4.5")


def mastercam_inch(rng):
    """Inch, three tools with lengths of 1.25, 3.4 and 5.6 in: spot G81, peck G83, a slot and a stepped contour; N,
    %."""
    p = Post(rng, inch=True, numbers=2, decimals=3)
    job = Job(rng, p, (number(rng, 76, 88), number(rng, 48, 58), number(rng, 15, 19)))
    job.tool(11, Tool(9.525, 0.0, 90.0), 31.75 + rng.random())
    job.tool(12, Tool(6.35, 0.0, 118.0), 86.36 + rng.random())
    job.tool(14, Tool(12.7), 142.24 + rng.random())
    p.raw("%")
    p.say("PROGRAM NAME - T")
    p.raw("G20", "G0 G17 G40 G49 G80 G90")
    job.start("G64 P0.001")
    holes = [(9.7 + 11.3 * k, 9.1) for k in range(5)] + [(9.7 + 11.3 * k, job.size[1] - 8.3) for k in range(5)]
    p.say("3/8 SPOT DRILL")
    p.raw("T11 M6", f"G0 G90 G54 X{p.value(holes[0][0])} Y{p.value(holes[0][1])} S3500 M3", "G43 H11 Z1.")
    job.stock(60, 2600)
    drill(p, f"G99 G81 Z{p.value(-2.6)} R{p.value(2.5)} F12.", holes)
    p.say("1/4 DRILL")
    p.raw("T12 M6", f"G0 G90 G54 X{p.value(holes[0][0])} Y{p.value(holes[0][1])} S2800 M3", "G43 H12 Z1.")
    job.rate(75, 2600)
    drill(p, f"G98 G83 Z{p.value(-12.7)} R{p.value(2.5)} Q{p.value(4.1)} F9.", holes)
    p.say("1/2 FLAT ENDMILL")
    p.raw("T14 M6")
    y, depth = 0.5 * job.size[1] + 0.4, -5.08
    p.raw(f"G0 G90 G54 X{p.value(-10.2)} Y{p.value(y)} S5200 M3", "G43 H14 Z1.")
    job.rate(rng.uniform(260, 330), 3600)
    p.at.update(x=-10.2, y=y, z=INCH)
    p.motion = 0
    for z in (0.5 * depth, depth):
        p.rapid(z=z)
        p.line(x=job.size[0] + 10.2, feed=700)
        p.rapid(z=INCH)
        p.rapid(x=-10.2)
    p.rapid(x=-9.0, y=-4.1)
    p.rapid(z=-3.175)
    r = 7.62
    p.line(x=job.size[0] - r, y=1.2, feed=700)
    p.arc(False, job.size[0] - 1.2, r + 1.2, job.size[0] - r - 0.0, r + 1.2) if False else p.line(
        x=job.size[0] - 1.2, y=r
    )
    p.line(y=job.size[1] + 9.0)
    p.rapid(z=INCH)
    return job.finish("mastercam_inch")


def freecad_pocket(rng):
    """Zigzag pocket in three depths with ramp entries, D6.35 flat, comments on every operation, one word group a
    line."""
    p = Post(rng, decimals=4, modal=False)
    job = Job(
        rng, p, (number(rng, 58, 70), number(rng, 40, 50), number(rng, 10, 13)), turn=math.radians(rng.uniform(8, 35))
    )
    job.offset = (job.offset[0] + 35.0, job.offset[1], job.offset[2])
    job.tool(5, Tool(6.35), number(rng, 25, 35))
    p.say("Exported by FreeCAD")
    p.say("Post Processor: linuxcnc_post")
    p.say("begin preamble")
    p.raw("G17 G54 G40 G49 G80 G90", "G21")
    job.start("G64 P0.05")
    p.say("begin operation: TC: 6.35mm_Endmill")
    p.raw("M5", "M6 T5", "G43 H5", "M3 S12000")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(70, 95), 3600)
    p.say("begin operation: Pocket_Shape")
    x0, x1, y0, y1 = 7.4, job.size[0] - 8.1, 6.9, job.size[1] - 7.7
    step, level = number(rng, 2.4, 3.0), -2.17
    for n in range(1, 4):
        z = n * level
        p.rapid(x=x0, y=y0)
        p.rapid(z=max(0.4, (n - 1) * level + 0.4) if n == 1 else 0.6)
        p.line(x=x0, y=y0, z=(n - 1) * level + (0.4 if n == 1 else 0.0), feed=300)
        p.line(x=x0 + 22.0, y=y0, z=z + 1.0, feed=500)
        p.line(x=x0, y=y0, z=z, feed=500)
        y, forth = y0, True
        while True:
            p.line(x=x1 if forth else x0, y=y, z=z, feed=900)
            forth = not forth
            if y >= y1 - 1e-9:
                break
            y = min(y + step, y1)
            p.line(x=p.at["x"], y=y, z=z)
        p.line(x=x1, y=y1, z=z)
        p.line(x=x1, y=y0, z=z)
        p.line(x=x0, y=y0, z=z)
        p.line(x=x0, y=y1, z=z)
        p.rapid(z=CLEAR)
    p.say("finish operation: Pocket_Shape")
    return job.finish("freecad_pocket", end="M2")


def hsm_bull_boss(rng):
    """A boss by levels with helical links, arcs with IJ, bull nose D10 R2; G61 in the original."""
    p = Post(rng, numbers=10)
    job = Job(rng, p, (number(rng, 52, 58), number(rng, 52, 58), number(rng, 12, 14)), origin="centre")
    job.offset = (job.offset[0] + 30.0, job.offset[1] + 30.0, job.offset[2])
    job.tool(9, Tool(10.0, 2.0), number(rng, 110, 125))
    p.say("HSMWorks boss")
    p.raw("G90 G94 G17 G91.1 G21")
    job.start("G61")
    p.raw("T9 M6", "G54", "G0 G43 H9 Z20.", "S7000 M3")
    p.at["z"], p.motion = 20.0, 0
    job.stock(rng.uniform(200, 260), 4200)
    outer = 0.5 * job.size[0] + 5.5
    p.rapid(x=outer + 2.0, y=0.0)
    p.rapid(z=1.0)
    z, boss = 0.0, number(rng, 13, 15)
    for _level in range(3):
        z -= 1.63
        r = outer - 4.4
        p.line(x=outer + 2.0, y=0.0, z=z, feed=2000)
        p.line(x=r, y=0.0, feed=1200)
        while True:
            p.arc(True, -r, 0.0, 0.0, 0.0)
            p.arc(True, r, 0.0, 0.0, 0.0)
            if r <= boss + 5.0 + 1e-9:
                break
            new = max(r - 4.7, boss + 5.0)
            p.line(x=new, y=0.0)
            r = new
        p.line(x=r + 0.7, y=0.7)
        p.rapid(z=4.0)
        p.rapid(x=outer + 2.0, y=0.0)
    p.line(x=boss + 5.4, y=-6.0, z=4.0, feed=2000)  # finishing helix round the boss
    p.line(x=boss + 4.85, y=0.0, z=0.0)
    z = 0.0
    while z > -4.6:
        for side in (-1, 1):
            z -= 0.41
            p.arc(True, side * (boss + 4.85), 0.0, 0.0, 0.0, z=z)
    p.rapid(z=20.0)
    return job.finish("hsm_bull_boss")


def facing_rim(rng):
    """A box whose size is not a multiple of any cell, turned in G54: faced with D12.7, then cut along its rim,
    deeper."""
    p = Post(rng, decimals=3)
    job = Job(rng, p, (number(rng, 60, 68, 0.117), number(rng, 36, 44, 0.083), number(rng, 11, 14)))
    job.offset = (job.offset[0] + 0.119, job.offset[1] + 0.071, job.offset[2])
    job.tool(30, Tool(12.7), number(rng, 70, 90))
    job.tool(31, Tool(8.0), number(rng, 12, 20))
    p.say("Face and profile")
    p.raw("G21 G90 G17 G94 G40")
    job.start("G64")
    p.raw("T30 M6", "G43 H30", "M3 S6000")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(240, 300), 4800)
    y, forth = 3.1, True
    p.rapid(x=-9.0, y=y)
    p.rapid(z=-1.37)
    while y < job.size[1] + 4.0:
        p.line(x=job.size[0] + 9.0 if forth else -9.0, feed=1500)
        y += 8.3
        forth = not forth
        p.line(y=y)
    p.rapid(z=CLEAR)
    p.raw("G53 G0 Z115.", "G49", "T31 M6", "G43 H31", "M3 S8000")
    p.motion, p.at = None, {}
    job.rate(rng.uniform(90, 120), 4200)
    for z, engaged in ((-5.2, 1.1), (-8.9, 1.1), (-8.9, 1.5)):
        d = 4.0 - engaged
        p.rapid(x=-d, y=-9.0)
        p.rapid(z=CLEAR)
        p.rapid(z=z)
        p.line(y=job.size[1] + d - 3.0, feed=1100)
        p.arc(True, 3.0 - d, job.size[1] + d, 3.0 - d, job.size[1] + d - 3.0)
        p.line(x=job.size[0] + d)
        p.line(y=-d)
        p.line(x=-9.0)
        p.rapid(z=CLEAR)
    return job.finish("facing_rim", end="M2")


def slots_three_depths(rng):
    """Slots of the tool's own width in three depths, crossed and left into each other; D4.7625, inch words; G61.1."""
    p = Post(rng, inch=True, numbers=10)
    job = Job(rng, p, (number(rng, 56, 62), number(rng, 38, 44), number(rng, 11, 13)))
    job.tool(18, Tool(4.7625), number(rng, 14, 18))
    p.say("keyways")
    p.raw("G20 G17 G40 G80 G90 G94")
    job.start("G61.1")
    p.raw("T18 M6", "G43 H18", "M3 S15000")
    p.rapid(z=CLEAR)
    job.stock(rng.uniform(50, 70), 3000)
    tilt = math.tan(rng.uniform(0.1, 0.25))
    for z in (-2.03, -4.06, -6.1):
        p.rapid(x=-4.0, y=8.3)
        p.rapid(z=z)
        p.line(x=job.size[0] + 4.0, y=8.3 + tilt * (job.size[0] + 8.0), feed=700)
        p.rapid(z=CLEAR)
    for z in (-3.3, -5.5):
        p.rapid(x=12.1, y=job.size[1] + 4.0)
        p.rapid(z=z)
        p.line(y=16.0, feed=700)
        p.line(x=40.3)
        p.line(y=job.size[1] + 4.0)
        p.rapid(z=CLEAR)
    p.rapid(x=20.7, y=2.0)
    p.rapid(z=0.5)
    p.line(z=-2.54, feed=250)
    p.line(x=33.0, y=30.3, feed=700)
    p.rapid(z=CLEAR)
    return job.finish("slots_three_depths")
