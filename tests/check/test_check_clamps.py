# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check, rule `clamp`: traverses and feeds of tool, shank and holder near the clamps of CLAMP comments."""

import math
import random

import numpy as np
import pytest

from chipwise.check.answer import check
from chipwise.program.reader import Machine
from chipwise.clamps import comment as clamp_comment
from support import clamp_oracle
from support.check_runs import HEAD, STOCK, chipwise_check, mill_with_tools

TOOLS = {
    1: {"shape": "flat", "diameter": 6.0, "flute_length": 10.0, "stick_out": 18.0, "holder_diameter": 20.0},
    2: {"shape": "ball", "diameter": 8.0, "flute_length": 12.0},
    3: {"shape": "bull", "diameter": 10.0, "corner_radius": 2.0, "stick_out": 15.0, "holder_diameter": 30.0},
    4: {"shape": "vee", "diameter": 12.0, "tip_angle": 60.0},
    5: {"shape": "tapered-ball", "diameter": 9.0, "corner_radius": 1.5, "tip_angle": 30.0},
}
CLEARANCE = 1.0  # mm, the default
MOVES = 90  # of a program
SAMPLED = (
    0.05  # mm, of the oracle's distances: half a step along the path and in height, and 0.002 of the chords of arcs
)
LEFT = "(CLAMP,BOX,XMIN=40,YMIN=-12,ZMIN=-20,XMAX=60,YMAX=-2,ZMAX=8)\n"
POST = "(CLAMP, CYLINDER, X=80, Y=75, ZMIN=-20, ZMAX=8, DIAMETER=10)\n"


@pytest.fixture(name="mill", scope="module")
def make_mill(tmp_path_factory):
    mill = mill_with_tools(tmp_path_factory.mktemp("mill"))
    text = ""
    for number, tool in TOOLS.items():
        text += f"[tool.{number}]\n" + "".join(
            f"{key} = {value!r}\n" for key, value in tool.items() if key != "diameter"
        )
    (mill.parent / "tools.toml").write_text(text)
    (mill.parent / "mill.tbl").write_text(
        "".join(f"T{n} P{n} D{tool['diameter']} Z{30 + n}\n" for n, tool in TOOLS.items())
    )
    return mill


class Program:
    """Random moves among random clamps, as text and as what the oracle judges."""

    def __init__(self, seed, tool):
        self.random, self.tool, self.clamps, self.paths, self.middles = random.Random(seed), tool, {}, {}, []
        self.inch = self.random.random() < 0.5
        self.unit = 25.4 if self.inch else 1.0
        self.offset, self.turn = (
            [self.random.uniform(-50, 50) for _ in range(3)],
            math.radians(self.random.choice([0, 0, 90, 33.3])),
        )
        self.lines = []
        self.comments_first = self.random.random() < 0.5
        if self.comments_first:
            self.add_clamps()
        self.put("G20" if self.inch else "G21")
        self.put("G90 G17 G40 G49 G80 G94 G64 G54")
        self.put("G10 L2 P1 " + self.words(self.offset) + f" R{math.degrees(self.turn):.6f}")
        self.put(
            f"M250 P{100 / self.unit:.6f} Q{100 / self.unit:.6f} R{-20 / self.unit:.6f} I{20 / self.unit:.6f} "
            f"J{20 / self.unit:.6f} K{5 / self.unit:.6f}"
        )
        self.put(f"T{tool} M6")
        self.put(f"G43 H{tool}")
        self.put("S8000 M3")
        if not self.comments_first:
            self.add_clamps()
        self.place = self.rounded([0.0, 0.0, 60.0])
        self.put(f"F{600 / self.unit:.4f} G0 " + self.words(self.place))
        for _ in range(MOVES):
            self.move()
        self.put("M2")

    def put(self, text):
        self.lines.append(text)

    def rounded(self, place):
        return [round(value / self.unit, 5) * self.unit for value in place]

    def words(self, place, letters="XYZ"):
        return " ".join(f"{letter}{value / self.unit:.5f}" for letter, value in zip(letters, place))

    def machine(self, places):
        places = np.asarray(places, float)
        c, s = math.cos(self.turn), math.sin(self.turn)
        x, y = places[..., 0], places[..., 1]
        return np.stack((x * c - y * s, x * s + y * c, places[..., 2]), axis=-1) + self.rounded(self.offset)

    def add_clamps(self):
        for _ in range(3):
            x, y, top = (self.random.uniform(-30, 30) for _ in range(3))
            u = self.unit
            self.middles.append((x, y, top))
            if self.random.random() < 0.5:
                wide, deep = self.random.uniform(3, 25), self.random.uniform(3, 25)
                self.put(
                    f"(CLAMP,BOX,XMIN={x / u!r},YMIN={y / u!r},ZMIN={(top - 4) / u!r},XMAX={(x + wide) / u!r},"
                    f"YMAX={(y + deep) / u!r},ZMAX={top / u!r})"
                )
                corners = [(x, y, 0), (x + wide, y, 0), (x + wide, y + deep, 0), (x, y + deep, 0)]
                clamp = {"corners": [tuple(p[:2]) for p in self.machine(corners)]}
            else:
                diameter = self.random.uniform(3, 25)
                self.put(
                    f"(clamp, Cylinder,X={x / u!r}, "
                    f"Y={y / u!r},ZMIN={(top - 4) / u!r},ZMAX={top / u!r},DIAMETER={diameter / u!r})"
                )
                clamp = {"middle": tuple(self.machine((x, y, 0))[:2]), "diameter": diameter}
            self.clamps[len(self.lines)] = {
                **clamp,
                "top": float(self.machine((x, y, top))[2]),
                "bottom": float(self.machine((x, y, top - 4))[2]),
            }

    def move(self):
        """One move, to somewhere near a clamp more often than not."""
        middle = self.random.choice(self.middles)
        target = [value + self.random.uniform(-18, 18) for value in middle]
        kind = self.random.choice(["G0", "G0", "G1", "G1", "G0 down", "G2", "G3"])
        if kind == "G0 down":
            target[:2] = self.place[:2]
        if self.random.random() < 0.2:
            target[2] = self.place[2]
        target = self.rounded(target)
        start = self.place
        if kind in ("G2", "G3"):
            centre = self.rounded([start[0] + self.random.uniform(-15, 15), start[1] + self.random.uniform(-15, 15), 0])
            radius, sweep = math.dist(start[:2], centre[:2]), self.random.uniform(0.3, 6) * (1 if kind == "G3" else -1)
            angle = math.atan2(start[1] - centre[1], start[0] - centre[0])
            target[:2] = self.rounded(
                [centre[0] + radius * math.cos(angle + sweep), centre[1] + radius * math.sin(angle + sweep)]
            )
            share = np.linspace(0, 1, max(2, math.ceil(abs(sweep) * radius / clamp_oracle.STEP)))
            path = np.stack(
                (
                    centre[0] + radius * np.cos(angle + sweep * share),
                    centre[1] + radius * np.sin(angle + sweep * share),
                    start[2] + (target[2] - start[2]) * share,
                ),
                axis=-1,
            )
            self.put(
                f"{kind} " + self.words(target) + " " + self.words([centre[0] - start[0], centre[1] - start[1]], "IJ")
            )
        else:
            path = clamp_oracle.line(start, target)
            self.put(f"{kind[:2]} " + self.words(target))
        self.paths[len(self.lines)] = self.machine(path)
        self.place = target

    def expected(self):
        """{(line, line of the clamp, part): mm}; FAR ones too."""
        tool = TOOLS[self.tool]
        parts = ["tool"] + ["holder"] * ("holder_diameter" in tool)
        return {
            (number, line, part): clamp_oracle.nearest(tool, part, clamp, path)
            for number, path in self.paths.items()
            for line, clamp in self.clamps.items()
            for part in parts
        }


def found_by(result):
    """{(line, line of the clamp, part): Finding}."""
    found = {}
    for finding in result.findings.kept:
        if finding.rule == "clamp":
            part = "holder" if finding.subject.endswith("holder") else "tool"
            for line in range(finding.line, finding.last_line + 1):
                found[line, int(finding.clamp.split()[-1]), part] = finding
    return found


@pytest.mark.parametrize("tool", TOOLS)
def test_random_moves_against_a_sampled_sweep(tmp_path, mill, tool):
    near = unsure = 0
    for seed in (tool, tool + 100):
        program = Program(seed, tool)
        path = tmp_path / f"{seed}.ngc"
        path.write_text("\n".join(program.lines) + "\n")
        result = check(str(path), Machine(str(mill)))
        assert result.error is None, result.error
        found, expected = found_by(result), program.expected()
        for key, distance in expected.items():
            if abs(distance - CLEARANCE) <= SAMPLED:
                unsure += 1
                continue
            assert (key in found) == (distance < CLEARANCE), (
                seed,
                key,
                distance,
                program.lines[key[0] - 1],
                program.lines[key[1] - 1],
            )
            if key in found:
                near += 1
                one = found[key]
                lines = range(one.line, one.last_line + 1)
                least = min(expected[(line, *key[1:])] for line in lines)
                assert max(one.value, 0.0) == pytest.approx(max(least, 0.0), abs=SAMPLED), (seed, key, one)
                assert one.subject.startswith("a traverse" if program.lines[key[0] - 1].startswith("G0") else "a feed")
        assert set(found) <= set(expected)
    assert near > 80 and unsure < 20, (near, unsure)


START = HEAD + LEFT + POST + "(CLAMP, REMOVE IT WHEN DONE)\n" + STOCK + "T1 M6\nS8000 M3\nF400\nG0 X-10 Y30 Z40\n"
MEETS, NEAR = "meets the clamp of line 2", "comes within 0.5 mm of the clamp of line 2"
CASES = {  # program, what is said of it
    "into": (
        "G0 Z5\nG0 X50\nG0 Y-5\nG0 Z40\n",
        [f"line 12 to 13, tool 1: a traverse of the tool {MEETS} at X50 Y-2 Z5; go over it, or round it"],
    ),
    "near": (
        "G0 Z5\nG0 X50\nG1 Y1.5\nG0 Z40\n",
        [
            f"line 12, tool 1: a feed of the tool {NEAR} at X50 Y1.5 Z5, CLAMP_CLEARANCE is 1 mm; go over it, or round "
            f"it",
            f"line 13, tool 1: a traverse of the tool {NEAR} at X50 Y1.5 Z5, CLAMP_CLEARANCE is 1 mm; go over it, or "
            f"round it",
        ],
    ),
    "shank": (
        "G0 X20 Z-35\nG0 Y-7\nG1 X36.5\nG0 X-10 Z40\n",
        [
            f"line 12, tool 1: a feed of the shank {NEAR} at X36.5 Y-7 Z-35, CLAMP_CLEARANCE is 1 mm; go over it, or "
            f"round it",
            f"line 12, tool 1: a feed of the holder {MEETS} at X36.5 Y-7 Z-35; go over it, or round it",
            f"line 13, tool 1: a traverse of the shank {NEAR} at X36.5 Y-7 Z-35, CLAMP_CLEARANCE is 1 mm; go over it, "
            f"or round it",
            f"line 13, tool 1: a traverse of the holder {MEETS} at X36.5 Y-7 Z-35; go over it, or round it",
        ],
    ),
    "over": ("G0 X50 Y-7\nG0 Z9.001\nG0 Z40\n", []),
    "round": ("G0 X34 Y30 Z20\nG0 X35.999 Z5\nG1 Y-16.001\nG0 X65\nG0 Z40\n", []),
    "a longer tool": ("G0 X50 Y-7 Z10\nG43.1 Z-25\nG0 X51 Z35\n", []),  # the axis stays, the tip is at Z35
}


def test_what_is_said_and_what_is_not(tmp_path, mill):
    names = {f"{number}.ngc": name for number, name in enumerate(CASES)}
    _, said, _, report = chipwise_check(
        tmp_path, {file: START + CASES[name][0] + "M2\n" for file, name in names.items()}, machine=mill
    )
    for file, one in zip(names, report["programs"]):
        found = sorted(f["text"] for f in one["findings"] if f["rule"] == "clamp")
        assert one["error"] is None and found == sorted(CASES[names[file]][1]), names[file]
        assert len(found) > 2 or all(text in said for text in found)


def test_the_clearance_is_a_setting_and_moves_at_unknown_places_are_not_judged(tmp_path, mill):
    own = mill.parent / "own.ini"
    own.write_text(mill.read_text().replace("\n[CHIPWISE]\n", "\n[CHIPWISE]\nCLAMP_CLEARANCE = 0.4\n"))
    near = START + CASES["near"][0] + "M2\n"
    unknown = START.replace("G0 X-10 Y30 Z40\n", "G1 Z5\nG1 X50\nG1 Y1.5\n") + "G0 Z40\nM2\n"
    _, _, _, report = chipwise_check(tmp_path, {"near.ngc": near}, machine=own)
    assert [f for f in report["programs"][0]["findings"] if f["rule"] == "clamp"] == []
    _, _, _, report = chipwise_check(tmp_path, {"unknown.ngc": unknown}, machine=mill)
    assert [f["line"] for f in report["programs"][0]["findings"] if f["rule"] == "clamp"] == [11, 12]


WRONG = {
    "(CLAMP,BOX,XMIN=40,YMIN=-12,ZMIN=-20,XMAX=60,YMAX=-2)": "CLAMP comment: BOX lacks ZMAX; BOX needs XMIN, YMIN, "
    "ZMIN, XMAX, YMAX, ZMAX (line 3)",
    "(CLAMP,BOX,XMIN=60,YMIN=-12,ZMIN=-20,XMAX=40,YMAX=-2,ZMAX=8)": "CLAMP comment: the clamp has no extent in X (60 "
    "to 40); give a maximum above the minimum (line 3)",
    "(CLAMP,CYLINDER,X=1,Y=1,ZMIN=-20,ZMAX=8,DIAMETER=nan)": "CLAMP comment: DIAMETER=nan is not KEY=number; correct "
    "the comment (line 3)",
    "(CLAMP,BOKS,XMIN=1)": "CLAMP comment: shape BOKS is unknown; use BOX or CYLINDER (line 3)",
    "(CLAMP,CYLINDER,X=1e9,Y=1,ZMIN=-20,ZMAX=8,DIAMETER=5)": "CLAMP comment: a corner is at 1000000002.5 mm, more than "
    "1000000 mm from zero; correct the comment (line 3)",
    LEFT.strip()
    + " ; the left one": "another comment is behind the CLAMP comment, and LinuxCNC executes only the last of a line; "
    "give it a line of its own (line 3)",
    LEFT.strip()
    + POST.strip(): "another comment is behind the CLAMP comment, and LinuxCNC executes only the last of a line; give "
    "it a line of its own (line 3)",
    "o1 if [1 EQ 1] "
    + LEFT
    + "o1 endif": "the CLAMP comment is on an O line, where LinuxCNC executes none; give it a line of its own (line 3)",
}


def test_a_wrong_comment_is_refused_in_a_sentence(tmp_path, mill):
    programs = {
        f"{number}.ngc": START.replace(LEFT, "G40\n" + text + "\n") + "M2\n" for number, text in enumerate(WRONG)
    }
    programs["many.ngc"] = START.replace(LEFT, LEFT * 101) + "M2\n"
    status, _, _, report = chipwise_check(tmp_path, programs, machine=mill)
    said = [f"{one['error']} (line {one['error_line']})" for one in report["programs"]]
    assert status == 2 and said == [*WRONG.values(), "the program has more than 100 clamps; leave some out (line 102)"]


def test_a_remark_of_a_person_is_no_clamp():
    assert (
        clamp_comment.inside("CLAMP, THEN PRESS START") is None and clamp_comment.inside("CLAMPED,BOX,XMIN=1") is None
    )
    assert clamp_comment.inside(" clamp ,box") == "box"
    text = b"(CLAMP, HERE) ; remark\n; (CLAMP,BOX,XMIN=1) ; twice\nG1 (x (CLAMP,BOX,A=1) ; more\n"
    assert clamp_comment.lost(text) is None
    assert clamp_comment.lost(text + b"n10 O<a> sub (CLAMP,BOX,A=1)")[0] == 4


SET_UP = "[set_up.2.clamp.jaw]\nbox = [40, -12, -20, 60, -2, 8]\n[set_up.3]\nname = 'bare table'\n"
M256 = {  # lines before the moves, lines of findings and their clamps, or the error
    "M256 P2": [("line 11 to 12", "clamp jaw of set-up 2")],
    "M256 P3": [],
    "M256 P2\nM256 P0": [],
    LEFT + "M256 P2": [
        ("line 12 to 13", "clamp jaw of set-up 2")
    ],  # it takes the place of the comment, which no move has followed
    "M256 P2\n" + LEFT: [("line 12 to 13", "clamp jaw of set-up 2"), ("line 12 to 13", "the clamp of line 9")],
    "M256 P4": "M256: there is no set-up P4 of clamps; there are 2, 3; add it with `chipwise clamps add`, or use P0 "
    "for none (line 8)",
    "M256": "M256: word P (set-up of clamps) is missing; add P, or P0 for none (line 8)",
    "M256 P1000": "M256: set-up P1000 is not from 0 to 999; use P0 for none (line 8)",
    "M256 P0.5": "M256: set-up P0.5 is not from 0 to 999; use P0 for none (line 8)",
}


def test_the_set_up_of_m256(tmp_path, mill):
    """A set-up has machine coordinates: the work offset of the program does not move it."""
    (mill.parent / "clamps.toml").write_text(SET_UP)
    head = HEAD + STOCK + "T1 M6\nS8000 M3\nF400\nG10 L2 P1 X5 Y0 Z0\nG0 X-10 Y30 Z40\n"
    moves = "G0 X50 Z5\nG0 Y-5\nG0 Z40\nM2\n"
    programs = {f"{number}.ngc": head + text.rstrip("\n") + "\nG0 X0\n" + moves for number, text in enumerate(M256)}
    _, _, _, report = chipwise_check(tmp_path, programs, machine=mill)
    for (text, expected), one in zip(M256.items(), report["programs"]):
        if isinstance(expected, str):
            assert one["error"] == expected
            continue
        found = [f["text"] for f in one["findings"] if f["rule"] == "clamp"]
        assert one["error"] is None and len(found) == len(expected), (text, found, one["error"])
        for words, (lines, clamp) in zip(sorted(found), expected):
            assert words.startswith(lines) and f"meets {clamp} at" in words, (text, words)
