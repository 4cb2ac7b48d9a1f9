# SPDX-License-Identifier: GPL-2.0-or-later
"""planner/program_clamps.py: where the clamps of comments are, before LinuxCNC's interpreter, which reads the same
program (program/reader.py)."""

import math
import random

import pytest

from chipwise.clamps.clamp import Clamp
from chipwise.monitor import comment_process
from chipwise.order import ClampsAsked
from chipwise.planner import program_clamps
from support.check_runs import mill_with_tools
from support.scenes import SCENE

SYSTEMS = ["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"]


class Program:
    """A random program with clamps; its systems and what is in force at its end."""

    def __init__(self, rng):
        self.random, self.units, self.system = rng, "mm", 0
        self.systems = [
            (
                math.radians(rng.choice([0, 0, 90, 33.3])),
                tuple(rng.uniform(-50, 50) for _ in range(3)),
                (3.0, -2.0, 1.0),
            )
            for _ in SYSTEMS
        ]
        self.lines = ["G90 G17 G21 G54 F100"]
        for number, (turn, offset, _g92) in enumerate(self.systems, 1):
            self.lines.append(
                f"G10 L2 P{number} X{offset[0]:.9f} Y{offset[1]:.9f} Z{offset[2]:.9f} R{math.degrees(turn):.9f}"
            )
        x, y, z = (offset + shift for offset, shift in zip((0, 0, 0), (3.0, -2.0, 1.0)))
        self.lines += [
            "G53 G0 X0 Y0 Z0",
            "G92.1",
            f"#5211={x} #5212={y} #5213={z}",
            "G92.3",
            "o1 sub",
            "G0 X#1",
            "o1 endsub",
        ]
        for _ in range(60):
            self.lines.append(self.line())
        self.lines += ["G0 X1", "M2"]

    def line(self):
        kind = self.random.choice(["units", "system", "clamp", "clamp", "move", "loop", "call", "text"])
        if kind == "units":
            self.units = self.random.choice(["mm", "in"])
            return "g 20" if self.units == "in" else "G21"
        if kind == "system":
            self.system = self.random.randrange(9)
            return SYSTEMS[self.system] + self.random.choice(["", " G0 Y2"])
        if kind == "clamp":
            corner = [self.random.uniform(-3, 3) for _ in range(3)]
            return (
                "(CLAMP,BOX,"
                + ",".join(
                    f"{name}={value:.6f}"
                    for name, value in zip(
                        ("XMIN", "YMIN", "ZMIN", "XMAX", "YMAX", "ZMAX"), (*corner, *(v + 1 for v in corner))
                    )
                )
                + ")"
            )
        loop = f"o{len(self.lines) + 100}"
        return {
            "move": "G1 X2 Y1",
            "loop": f"{loop} repeat [2]\nG0 Z1\n{loop} endrepeat\nG0 Z2",
            "call": "o1 call [2]\nG0 Z3",
            "text": "(G20 G55) M5",
        }[kind]

    def asked(self, path, line):
        return ClampsAsked(
            0,
            "",
            str(path),
            line,
            0,
            "",
            "",
            (self.units, self.system + 1, self.systems[self.system]),
            tuple(self.systems),
            1.0,
            6.0,
            ("", 1),
        )


@pytest.fixture(name="mill", scope="module")
def make_mill(tmp_path_factory):
    return mill_with_tools(tmp_path_factory.mktemp("mill"))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_programs_before_the_interpreter(mill, tmp_path, seed):
    program, path = Program(random.Random(seed)), tmp_path / "part.ngc"
    text = "\n".join(program.lines) + "\n"
    path.write_text(text)
    read = comment_process.answer({"ini": str(mill), "program": str(path), "scene": SCENE}, str(tmp_path))["clamps"]
    found, notes = [], []
    program_clamps._add_of_program(program.asked(path, text.count("\n") - 1), found, notes)
    assert len(found) == len(read) >= 8 and not notes, (seed, notes)
    for (_after, *row), clamp in zip(
        sorted(read, key=lambda row: row[-1]), sorted(found, key=lambda clamp: clamp.name)
    ):
        other = Clamp.of_row(row)
        assert clamp.name == other.name and clamp.is_where(other), (seed, clamp, other)
