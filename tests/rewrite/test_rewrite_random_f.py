# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise rewrite --feed on programs with F in all kinds of places: every move has the F that was meant
(proof.same_feeds)."""

import random

import pytest

from chipwise.program.reader import Machine
from chipwise.rewrite import feed, run
from support.random_cases import random_count, random_seed
from support.rewrite_rig import HEAD, make_machine

INCH = 25.4


class Lines:
    """A random program in a block of stock, line by line."""

    def __init__(self, seed):
        self.random, self.inch, self.relative = random.Random(f"F {seed}"), False, False
        self.lines = [HEAD.strip(), "M250 P0 Q0 R-40 I100 J60 K40", "T3 M6", "S8000 M3", "G0 X-10 Y30 Z5", "F300"]
        for _ in range(self.random.randint(6, 30)):
            self.random.choice(
                [self.straight] * 8
                + [
                    self.arc,
                    self.arc,
                    self.traverse,
                    self.down,
                    self.alone,
                    self.remark,
                    self.units,
                    self.distance,
                    self.reference,
                    self.cycle,
                    self.loop,
                ]
            )()
        self.lines += ["G90", f"G0 Z{self.mm(5)}", "M2"]

    def mm(self, value):
        return f"{value / INCH if self.inch else value:.4f}"

    def f(self, share=1.0):
        value = self.mm(self.random.choice([80, 150.5, 333.333, 400, 800, 1234.56]))
        return self.random.choice(["F", "f "]) + value if self.random.random() < share else ""

    def place(self):
        x, y = ((-15, 15), (-10, 10)) if self.relative else ((-10, 110), (-5, 65))
        return f"X{self.mm(self.random.uniform(*x))} Y{self.mm(self.random.uniform(*y))}"

    def straight(self):
        self.lines.append(f"G1 {self.place()} {self.f(0.25)}")
        if self.random.random() < 0.5:
            self.lines.append(f"{self.place()} {self.f(0.25)}")

    def arc(self):
        width = self.mm(self.random.uniform(2, 15))
        self.lines += [
            "G91",
            f"G{self.random.choice([2, 3])} X{width} Y0 R{width} {self.f(0.25)}",
            "G91" if self.relative else "G90",
        ]

    def traverse(self):
        self.lines.append(f"G0 {self.place()} {self.f(0.4)}")

    def down(self):
        if not self.relative:
            self.lines.append(f"G1 Z{self.mm(self.random.choice([-1, -2, -3]))} {self.f(0.25)}")

    def alone(self):
        self.lines.append(self.random.choice(["", "S7000 ", "M8 ", "G61 ", "(F99) "]) + self.f())

    def remark(self):
        self.lines.append("; F 1")

    def units(self):
        self.inch = not self.inch
        self.lines.append(f"G2{0 if self.inch else 1} {self.f()}")

    def distance(self):
        self.relative = not self.relative
        self.lines.append("G91" if self.relative else "G90")

    def reference(self):
        if not self.relative:
            self.lines += [f"G0 Z{self.mm(5)}", f"G28 Z{self.mm(6)} {self.f(0.5)}", f"G0 Z{self.mm(4)}"]

    def cycle(self):
        if not self.relative:
            self.lines += [f"G81 X{self.mm(20)} Y{self.mm(20)} Z{self.mm(-2)} R{self.mm(2)} {self.f(0.5)}", "G80"]

    def loop(self):
        number = 100 + len(self.lines)
        self.lines += [
            f"o{number} repeat [2]",
            f"G1 {self.place()} {self.f(0.25)}",
            self.f(0.5),
            f"o{number} endrepeat",
        ]


@pytest.mark.parametrize("case", range(random_count(10)))
def test_every_move_has_the_f_that_was_meant(tmp_path, case):
    seed = random_seed() + case
    ini, path = make_machine(tmp_path / "mill"), tmp_path / f"{seed}.ngc"
    path.write_text("\n".join(Lines(seed).lines) + "\n")
    rates = feed.Rates([3, 9, 25][seed % 3] * 1000.0, [0.0, 2000.0][seed % 2])
    data, said = run.rewritten(str(path), run.Order(rates), lambda share: None, Machine(str(ini)))
    assert data and said, f"seed {seed}, {path}"
