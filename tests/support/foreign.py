# SPDX-License-Identifier: GPL-2.0-or-later
"""Ten programs as other people's CAM writes them, with M250 and M251 put in as a user of chipwise would.

Called by bench/bench_claims.py and tests/machine/test_foreign.py; by hand `python3 -m support.foreign FOLDER [--seed N]` in tests/ writes
them.  Nothing is copied from any post processor: the style (line numbers, comments, spacing, words, units) is what
matters, and sizes, offsets, angles and rates come from the seed.  No size is a multiple of a cell.

A Program is what the machine runs and what the judge has to know: blank in machine coordinates, tools with their
lengths.  The work offset is set by G10 L2, because nobody touches off in a simulation.
"""
import argparse
import math
import random
from dataclasses import dataclass, field
from pathlib import Path

from support.judge import Blank, Tool, ball

INCH = 25.4
CLEAR = 6.0                 # mm above the blank: traverses


@dataclass
class Program:
    name: str
    text: str
    blank: Blank
    tools: dict             # number -> (Tool, length mm)
    notes: str = ""
    shapes: dict = field(default_factory=dict)


class Post:
    """Lines of a program in one post's style; takes mm, writes its own unit."""

    def __init__(self, rng, inch=False, numbers=0, spaced=True, decimals=3, modal=True, comment="({})"):
        self.rng, self.unit, self.numbers, self.spaced = rng, (INCH if inch else 1.0), numbers, spaced
        self.decimals, self.modal, self.comment = decimals + (1 if inch else 0), modal, comment
        self.lines, self.count, self.at, self.motion, self.feed = [], 0, {}, None, None

    def raw(self, text, number=True):
        self.count += 1
        head = f"N{self.count * self.numbers} " if self.numbers and number and not text.startswith(("(", "%")) else ""
        if not self.spaced and not text.startswith("("):
            head, text = head.replace(" ", ""), text.replace(" ", "")
        self.lines.append(head + text)

    def say(self, text):
        self.raw(self.comment.format(text.upper() if self.rng.random() < 0.3 else text), number=False)

    def value(self, number):
        text = f"{number / self.unit:.{self.decimals}f}"
        return text if "." not in text else (text.rstrip("0") if text.rstrip("0")[-1] != "." else text.rstrip("0") + "0")

    def move(self, code, i=None, j=None, feed=None, **axes):
        words = [] if self.modal and code == self.motion and code in (0, 1) else [f"G{code}"]
        for axis in "xyz":
            value = axes.get(axis)
            if value is None:
                continue
            if self.modal and code in (0, 1) and self.at.get(axis) is not None and abs(self.at[axis] - value) < 1e-9:
                continue
            words.append(f"{axis.upper()}{self.value(value)}")
            self.at[axis] = value
        if i is not None:
            words += [f"I{self.value(i)}", f"J{self.value(j)}"]
        if feed and feed != self.feed:
            words.append(f"F{feed / self.unit:.{0 if self.unit == 1 else 1}f}")
            self.feed = feed
        if len(words) > (0 if words and words[0][0] != "G" else 1) or i is not None:
            self.motion = code
            self.raw(" ".join(words))

    def rapid(self, **axes):
        self.move(0, **axes)

    def line(self, feed=None, **axes):
        self.move(1, feed=feed, **axes)

    def arc(self, clockwise, x, y, cx, cy, z=None, feed=None):
        """From where it is to x y about cx cy."""
        start = self.at["x"], self.at["y"]
        self.at["x"] = self.at["y"] = None
        # the words are rounded: the centre is written from the rounded start
        self.move(2 if clockwise else 3, i=cx - start[0], j=cy - start[1], feed=feed, x=x, y=y, z=z)


def number(rng, low, high, step=0.013):
    """A size that is not a multiple of a cell."""
    return round(low + rng.random() * (high - low), 2) + step


class Job:
    """What the programs have in common: work offset, wrapper, tools."""

    def __init__(self, rng, post, size, turn=0.0, round_=False, origin="corner"):
        self.rng, self.post, self.size, self.turn = rng, post, size, turn
        self.offset = (number(rng, 18, 60), number(rng, 14, 48), -number(rng, 60, 75))
        self.round, self.origin, self.tools = round_, origin, {}
        self.low = (0.0, 0.0) if origin == "corner" else (-0.5 * size[0], -0.5 * size[1])

    def blank(self):
        centre = self.low[0] + 0.5 * self.size[0], self.low[1] + 0.5 * self.size[1]
        c, s = math.cos(self.turn), math.sin(self.turn)
        x, y = self.offset[0] + c * centre[0] - s * centre[1], self.offset[1] + s * centre[0] + c * centre[1]
        return Blank(x, y, self.size[0], self.size[1], self.offset[2] - self.size[2], self.offset[2], self.turn, self.round)

    def start(self, rate_mm3_s, ceiling, mode=2, feed=None, path="G64 P0.02"):
        """Preamble; the first tool has to be in already."""
        p = self.post
        v = p.value
        turn = f" R{math.degrees(self.turn):.4f}" if self.turn else ""
        p.raw(f"G10 L2 P1 X{v(self.offset[0])} Y{v(self.offset[1])} Z{v(self.offset[2])}{turn}")
        p.raw(path)

    def stock(self, rate_mm3_s, ceiling, mode=2):
        p = self.post
        v = p.value
        if self.round:
            p.lines.append(f"(WORKPIECE,CYLINDER,AXIS=Z,X={v(self.low[0] + 0.5 * self.size[0])},"
                           f"Y={v(self.low[1] + 0.5 * self.size[1])},ZMIN={v(-self.size[2])},ZMAX=0,"
                           f"DIAMETER={v(self.size[0])})")
            p.lines.append("M250")
        else:
            p.lines.append(f"M250 P{v(self.low[0])} Q{v(self.low[1])} R{v(-self.size[2])} "
                           f"I{v(self.size[0])} J{v(self.size[1])} K{v(self.size[2])}")
        self.rate(rate_mm3_s, ceiling, mode)

    def rate(self, rate_mm3_s, ceiling, mode=2):
        p = self.post
        q = rate_mm3_s * 60.0 / p.unit ** 3 / (1000.0 if p.unit == 1.0 else 1.0)
        limit = f" E{ceiling / p.unit:.0f}" if mode == 2 else ""
        p.lines.append(f"M251 P{mode} Q{q:.4f}{limit}")

    def tool(self, number, tool, length):
        self.tools[number] = (tool, length)

    def finish(self, name, end="M30", notes=""):
        self.post.lines.append("M252")
        self.post.raw("M5")
        self.post.raw(end)
        return Program(name, "\n".join(self.post.lines) + "\n", self.blank(), self.tools, notes)


# --- the ten ----------------------------------------------------------------------------------

def fusion_adaptive(rng):
    """Adaptive clearing as loops of arcs, lifted 0.2 mm on the way back; helical entry; D8 flat, G43, mm, R-less arcs."""
    p = Post(rng, numbers=5)
    job = Job(rng, p, (number(rng, 70, 80), number(rng, 44, 52), number(rng, 12, 16)))
    job.tool(3, Tool(8.0), number(rng, 40, 60))
    p.say("1001")
    p.say("T3  D=8. CR=0. - ZMIN=-6 - flat end mill")
    for code in ("G90 G94 G17 G91.1", "G21"):
        p.raw(code)
    job.start(0, 0)
    p.say("2D Adaptive1")
    p.raw("T3 M6")
    p.raw("S9000 M3")
    p.raw("G54")
    p.raw("G0 G43 Z15. H3")
    p.at["z"], p.motion = 15.0, 0
    job.stock(rng.uniform(110, 150), 4500)
    depth, load, radius = -number(rng, 4, 6), number(rng, 1.0, 1.6), 6.0
    x, y = 14.3, 0.5 * job.size[1] + 0.77
    p.rapid(x=x + 2.5, y=y)
    p.rapid(z=2.0)
    p.line(z=1.0, feed=400)
    z = 1.0
    while z > depth:                                    # the helix, pitch 1.2 mm
        for side in (-1, 1):
            z = max(z - 0.6, depth)
            p.arc(False, x + side * 2.5, y, x, y, z=z, feed=900)
    p.arc(False, x - 2.5, y, x, y)
    p.arc(False, x + 2.5, y, x, y)
    while x < job.size[0] - 16.0:                       # one loop a step
        p.line(x=x + load, y=y - radius, z=depth, feed=1500)
        x += load
        p.arc(False, x, y + radius, x, y)
        p.arc(False, x - 1.0, y + radius - 1.0, x - 0.0, y + radius - 1.0)
        p.line(z=depth + 0.2, x=x - 1.2, y=y + radius - 1.6, feed=3000)
        p.line(x=x - 1.2, y=y - radius + 1.6)
        p.line(x=x - 0.6, y=y - radius + 0.4, z=depth, feed=1500)
    p.rapid(z=15.0)
    return job.finish("fusion_adaptive")


def mastercam_inch(rng):
    """Inch, three tools with lengths of 1.25, 3.4 and 5.6 in: spot G81, peck G83, a slot and a stepped contour; N, %."""
    p = Post(rng, inch=True, numbers=2, decimals=3)
    job = Job(rng, p, (number(rng, 76, 88), number(rng, 48, 58), number(rng, 15, 19)))
    job.tool(11, Tool(9.525, 0.0, 90.0), 31.75 + rng.random())
    job.tool(12, Tool(6.35, 0.0, 118.0), 86.36 + rng.random())
    job.tool(14, Tool(12.7), 142.24 + rng.random())
    p.raw("%")
    p.say("PROGRAM NAME - T")
    p.raw("G20")
    p.raw("G0 G17 G40 G49 G80 G90")
    job.start(0, 0, path="G64 P0.001")
    holes = [(9.7 + 11.3 * k, 9.1) for k in range(5)] + [(9.7 + 11.3 * k, job.size[1] - 8.3) for k in range(5)]
    p.say("3/8 SPOT DRILL")
    p.raw("T11 M6")
    p.raw(f"G0 G90 G54 X{p.value(holes[0][0])} Y{p.value(holes[0][1])} S3500 M3")
    p.raw("G43 H11 Z1.")
    job.stock(60, 2600)
    p.raw(f"G99 G81 Z{p.value(-2.6)} R{p.value(2.5)} F12.")
    for x, y in holes[1:]:
        p.raw(f"X{p.value(x)} Y{p.value(y)}")
    p.raw("G80")
    p.raw("M5")
    p.raw("G53 G0 Z4.5")
    p.say("1/4 DRILL")
    p.raw("T12 M6")
    p.raw(f"G0 G90 G54 X{p.value(holes[0][0])} Y{p.value(holes[0][1])} S2800 M3")
    p.raw("G43 H12 Z1.")
    job.rate(75, 2600)
    p.raw(f"G98 G83 Z{p.value(-12.7)} R{p.value(2.5)} Q{p.value(4.1)} F9.")
    for x, y in holes[1:]:
        p.raw(f"X{p.value(x)} Y{p.value(y)}")
    p.raw("G80")
    p.raw("M5")
    p.raw("G53 G0 Z4.5")
    p.say("1/2 FLAT ENDMILL")
    p.raw("T14 M6")
    y, depth = 0.5 * job.size[1] + 0.4, -5.08
    p.raw(f"G0 G90 G54 X{p.value(-10.2)} Y{p.value(y)} S5200 M3")
    p.raw("G43 H14 Z1.")
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
    p.arc(False, job.size[0] - 1.2, r + 1.2, job.size[0] - r - 0.0, r + 1.2) if False else p.line(x=job.size[0] - 1.2, y=r)
    p.line(y=job.size[1] + 9.0)
    p.rapid(z=INCH)
    return job.finish("mastercam_inch")


def freecad_pocket(rng):
    """Zigzag pocket in three depths with ramp entries, D6.35 flat, comments on every operation, one word group a line."""
    p = Post(rng, decimals=4, modal=False)
    job = Job(rng, p, (number(rng, 58, 70), number(rng, 40, 50), number(rng, 10, 13)), turn=math.radians(rng.uniform(8, 35)))
    job.offset = (job.offset[0] + 35.0, job.offset[1], job.offset[2])
    job.tool(5, Tool(6.35), number(rng, 25, 35))
    p.say("Exported by FreeCAD")
    p.say("Post Processor: linuxcnc_post")
    p.say("begin preamble")
    p.raw("G17 G54 G40 G49 G80 G90")
    p.raw("G21")
    job.start(0, 0, path="G64 P0.05")
    p.say("begin operation: TC: 6.35mm_Endmill")
    p.raw("M5")
    p.raw("M6 T5")
    p.raw("G43 H5")
    p.raw("M3 S12000")
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


def relief(x, y, rng_phase):
    """A smooth relief, 0 down to about -6 mm."""
    a, b, c = rng_phase
    return -3.1 + 1.3 * math.sin(0.31 * x + a) * math.cos(0.23 * y + b) + 1.2 * math.sin(0.11 * x - 0.17 * y + c) \
        + 0.4 * math.sin(0.9 * x + 0.4 * y)


def estlcam_relief(rng):
    """One D3.175 ball, zigzag raster of a relief straight from the solid: 0.5 mm rows, moves of 0.05 to 0.5 mm."""
    p = Post(rng, numbers=10, decimals=4)
    job = Job(rng, p, (number(rng, 24, 28), number(rng, 7, 9), number(rng, 9, 11)))
    job.tool(1, ball(3.175), number(rng, 20, 30))
    p.say("Project relief")
    for code in ("G21", "G90 G17 G94"):
        p.raw(code)
    job.start(0, 0, path="G64 P0.01")
    p.raw("T1 M6")
    p.raw("G43 H1")
    p.raw("M3 S24000")
    p.rapid(z=5.0)
    job.stock(rng.uniform(28, 36), 2400)
    phase = [rng.uniform(0, 6) for _ in range(3)]
    y, forth = 1.3, True
    p.rapid(x=-2.1, y=y)
    p.rapid(z=1.0)
    while y < job.size[1] - 1.0:
        x, end = (-2.1, job.size[0] + 2.1) if forth else (job.size[0] + 2.1, -2.1)
        p.line(x=x, y=y, z=relief(x, y, phase), feed=1200)
        while abs(end - x) > 1e-9:
            step = rng.choice((0.05, 0.1, 0.17, 0.25, 0.5))
            x = min(x + step, end) if forth else max(x - step, end)
            p.line(x=x, y=y, z=relief(x, y, phase))
        y, forth = y + 0.5, not forth
    p.rapid(z=5.0)
    return job.finish("estlcam_relief")


def vectric_vcarve(rng):
    """V-carving, inch, no spaces: strokes of a 60 degree vee whose depth swells and fades, corners lifted out."""
    p = Post(rng, inch=True, numbers=10, spaced=False)
    job = Job(rng, p, (number(rng, 66, 74), number(rng, 40, 46), number(rng, 9, 12)), turn=math.radians(rng.uniform(-14, -4)))
    job.offset = (job.offset[0], job.offset[1] + 22.0, job.offset[2])
    job.tool(7, Tool(12.7, 0.0, 60.0), number(rng, 60, 75))
    p.say("v-carve sign")
    p.raw("G20")
    p.raw("G17G40G49G80G90G94")
    job.start(0, 0, path="G64 P0.0005")
    p.raw("T7M6")
    p.raw("G43H7")
    p.raw("S16000M3")
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
            p.line(x=x + length * t * math.sin(bend), y=y + length * t * math.cos(bend),
                   z=-0.05 - deepest * math.sin(math.pi * min(t, 0.999)) ** 0.8, feed=1400)
        p.rapid(z=CLEAR)
    return job.finish("vectric_vcarve")


def taper_two_tools(rng):
    """Roughing by a D6 flat in levels, then a D6 tapered ball (R0.5, 20 degrees) in 0.4 mm rows; lengths 28 and 96 mm."""
    p = Post(rng, numbers=1, decimals=3)
    job = Job(rng, p, (number(rng, 30, 34), number(rng, 14, 17), number(rng, 10, 12)))
    job.tool(21, Tool(6.0), 28.0 + rng.random())
    job.tool(22, Tool(6.0, 0.5, 20.0), 96.0 + rng.random())
    p.say("Aspire 3D rough + finish")
    for code in ("G21", "G17 G90 G40 G94"):
        p.raw(code)
    job.start(0, 0, path="G64 P0.01")
    p.raw("T21 M6")
    p.raw("G43 H21")
    p.raw("S14000 M3")
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
    p.raw("M5")
    p.raw("G53 G0 Z115.")
    p.raw("T22 M6")
    p.raw(f"G43.1 Z{p.value(job.tools[22][1])}")            # the length told by the program, as a presetter's post does
    p.raw("S18000 M3")
    job.rate(rng.uniform(22, 30), 2400)
    y, forth = 2.9, True
    p.motion, p.at = None, {}
    p.rapid(x=-1.0, y=y)
    p.rapid(z=CLEAR)
    p.rapid(z=1.0)
    while y < 7.5:
        x, end = (-1.0, job.size[0] + 1.0) if forth else (job.size[0] + 1.0, -1.0)
        p.line(x=x, y=y, z=relief(x, y, phase), feed=1300)
        while abs(end - x) > 1e-9:
            x = min(x + 0.3, end) if forth else max(x - 0.3, end)
            p.line(x=x, y=y, z=relief(x, y, phase))
        y, forth = y + 0.4, not forth
    p.rapid(z=CLEAR)
    return job.finish("taper_two_tools")


def hsm_bull_boss(rng):
    """A boss by levels with helical links, arcs with IJ, bull nose D10 R2; G61 in the original."""
    p = Post(rng, numbers=10)
    job = Job(rng, p, (number(rng, 52, 58), number(rng, 52, 58), number(rng, 12, 14)), origin="centre")
    job.offset = (job.offset[0] + 30.0, job.offset[1] + 30.0, job.offset[2])
    job.tool(9, Tool(10.0, 2.0), number(rng, 110, 125))
    p.say("HSMWorks boss")
    p.raw("G90 G94 G17 G91.1 G21")
    job.start(0, 0, path="G61")
    p.raw("T9 M6")
    p.raw("G54")
    p.raw("G0 G43 H9 Z20.")
    p.raw("S7000 M3")
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
    p.line(x=boss + 5.4, y=-6.0, z=4.0, feed=2000)              # finishing helix round the boss
    p.line(x=boss + 4.85, y=0.0, z=0.0)
    z = 0.0
    while z > -4.6:
        for side in (-1, 1):
            z -= 0.41
            p.arc(True, side * (boss + 4.85), 0.0, 0.0, 0.0, z=z)
    p.rapid(z=20.0)
    return job.finish("hsm_bull_boss")


def facing_rim(rng):
    """A box whose size is not a multiple of any cell, turned in G54: faced with D12.7, then cut along its rim, deeper."""
    p = Post(rng, decimals=3)
    job = Job(rng, p, (number(rng, 60, 68, 0.117), number(rng, 36, 44, 0.083), number(rng, 11, 14)))
    job.offset = (job.offset[0] + 0.119, job.offset[1] + 0.071, job.offset[2])
    job.tool(30, Tool(12.7), number(rng, 70, 90))
    job.tool(31, Tool(8.0), number(rng, 12, 20))
    p.say("Face and profile")
    p.raw("G21 G90 G17 G94 G40")
    job.start(0, 0, path="G64")
    p.raw("T30 M6")
    p.raw("G43 H30")
    p.raw("M3 S6000")
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
    p.raw("G53 G0 Z115.")
    p.raw("G49")
    p.raw("T31 M6")
    p.raw("G43 H31")
    p.raw("M3 S8000")
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
    job.start(0, 0, path="G64 P0.03 Q0.01")
    p.raw("T15 M6")
    p.raw("G43 H15")
    p.raw("M3 S8000")
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
    p.raw("G53 G0 Z115.")
    p.raw("T16 M6")
    p.raw("G43 H16")
    p.raw("M3 S7000")
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


def slots_three_depths(rng):
    """Slots of the tool's own width in three depths, crossed and left into each other; D4.7625, inch words; G61.1."""
    p = Post(rng, inch=True, numbers=10)
    job = Job(rng, p, (number(rng, 56, 62), number(rng, 38, 44), number(rng, 11, 13)))
    job.tool(18, Tool(4.7625), number(rng, 14, 18))
    p.say("keyways")
    p.raw("G20 G17 G40 G80 G90 G94")
    job.start(0, 0, path="G61.1")
    p.raw("T18 M6")
    p.raw("G43 H18")
    p.raw("M3 S15000")
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


BUILDERS = (fusion_adaptive, mastercam_inch, freecad_pocket, estlcam_relief, vectric_vcarve, taper_two_tools,
            hsm_bull_boss, facing_rim, spiral_round, slots_three_depths)


def programs(seed=1):
    """{name: Program} of a seed; each has a generator of its own, so that one can change alone."""
    return {build.__name__: build(random.Random(f"{seed} {build.__name__}")) for build in BUILDERS}


def tool_table(tools, unit=1.0):
    """Text of a tool table; unit: mm per machine unit."""
    return "".join(f"T{n} P{n} Z{length / unit:.6f} D{tool.diameter / unit:.6f}\n" for n, (tool, length) in sorted(tools.items()))


def geometry_file(tools):
    """Text of a tool geometry file."""
    lines = []
    for n, (tool, _length) in sorted(tools.items()):
        lines.append(f"[tool.{n}]")
        if tool.corner and tool.angle:
            lines += ['shape = "tapered-ball"', f"corner_radius = {tool.corner:g}", f"tip_angle = {tool.angle:g}"]
        elif tool.angle:
            lines += ['shape = "vee"', f"tip_angle = {tool.angle:g}"]
        elif tool.corner >= 0.5 * tool.diameter:
            lines += ['shape = "ball"']
        elif tool.corner:
            lines += ['shape = "bull"', f"corner_radius = {tool.corner:g}"]
        else:
            lines += ['shape = "flat"']
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--seed", default="1")
    options = parser.parse_args()
    folder = Path(options.folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, made in programs(options.seed).items():
        (folder / f"{name}.ngc").write_text(made.text)
        (folder / f"{name}.tbl").write_text(tool_table(made.tools))
        (folder / f"{name}.toml").write_text(geometry_file(made.tools))
        print(f"{name}: {len(made.text.splitlines())} lines")


if __name__ == "__main__":
    main()
