# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs in the style of a post processor, line by line, and what they have in common: work offset, stock, tools.
Called by foreign_flat.py and foreign_relief.py."""

import math
from dataclasses import dataclass, field

from support.judge import Blank

INCH = 25.4
CLEAR = 6.0  # mm above the blank: traverses


@dataclass
class Program:
    name: str
    text: str
    blank: Blank
    tools: dict  # number -> (Tool, length mm)
    notes: str = ""
    shapes: dict = field(default_factory=dict)


class Post:
    """Lines of a program in one post's style; takes mm, writes its own unit."""

    def __init__(self, rng, inch=False, numbers=0, spaced=True, decimals=3, modal=True, comment="({})"):
        self.rng, self.unit, self.numbers, self.spaced = rng, (INCH if inch else 1.0), numbers, spaced
        self.decimals, self.modal, self.comment = decimals + (1 if inch else 0), modal, comment
        self.lines, self.count, self.at, self.motion, self.feed = [], 0, {}, None, None

    def raw(self, *lines):
        for text in lines:
            self._raw(text)

    def _raw(self, text, number=True):
        self.count += 1
        head = f"N{self.count * self.numbers} " if self.numbers and number and not text.startswith(("(", "%")) else ""
        if not self.spaced and not text.startswith("("):
            head, text = head.replace(" ", ""), text.replace(" ", "")
        self.lines.append(head + text)

    def say(self, text):
        self._raw(self.comment.format(text.upper() if self.rng.random() < 0.3 else text), number=False)

    def value(self, number):
        text = f"{number / self.unit:.{self.decimals}f}"
        return (
            text if "." not in text else (text.rstrip("0") if text.rstrip("0")[-1] != "." else text.rstrip("0") + "0")
        )

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
        return Blank(
            x, y, self.size[0], self.size[1], self.offset[2] - self.size[2], self.offset[2], self.turn, self.round
        )

    def start(self, path="G64 P0.02"):
        """Preamble; the first tool has to be in already."""
        v = self.post.value
        turn = f" R{math.degrees(self.turn):.4f}" if self.turn else ""
        self.post.raw(f"G10 L2 P1 X{v(self.offset[0])} Y{v(self.offset[1])} Z{v(self.offset[2])}{turn}", path)

    def stock(self, rate_mm3_s, ceiling, mode=2):
        p = self.post
        v = p.value
        if self.round:
            p.lines.append(
                f"(WORKPIECE,CYLINDER,AXIS=Z,X={v(self.low[0] + 0.5 * self.size[0])},"
                f"Y={v(self.low[1] + 0.5 * self.size[1])},ZMIN={v(-self.size[2])},ZMAX=0,"
                f"DIAMETER={v(self.size[0])})"
            )
            p.lines.append("M250")
        else:
            p.lines.append(
                f"M250 P{v(self.low[0])} Q{v(self.low[1])} R{v(-self.size[2])} "
                f"I{v(self.size[0])} J{v(self.size[1])} K{v(self.size[2])}"
            )
        self.rate(rate_mm3_s, ceiling, mode)

    def rate(self, rate_mm3_s, ceiling, mode=2):
        p = self.post
        q = rate_mm3_s * 60.0 / p.unit**3 / (1000.0 if p.unit == 1.0 else 1.0)
        limit = f" E{ceiling / p.unit:.0f}" if mode == 2 else ""
        p.lines.append(f"M251 P{mode} Q{q:.4f}{limit}")

    def tool(self, number, tool, length):
        self.tools[number] = (tool, length)

    def finish(self, name, end="M30", notes=""):
        self.post.lines.append("M252")
        self.post.raw("M5")
        self.post.raw(end)
        return Program(name, "\n".join(self.post.lines) + "\n", self.blank(), self.tools, notes)
