# SPDX-License-Identifier: GPL-2.0-or-later
"""Traverses that bin/chipwise rewrite --flute adds keep a clearance from stock at their side; judged by needles written
apart."""

import random
from types import SimpleNamespace

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.program.records import FEED, RAPID
from chipwise.clib.height_map import HeightMap, Shape
from chipwise.rewrite import depth_proof
from chipwise.rewrite.edits import Edits
from chipwise.rewrite.fed import feed_traverses
from chipwise.rewrite.links import Links
from chipwise.rewrite.program import read
from support import clearance_oracle as oracle
from support.depth_cases import geometry_of, program_of
from support.random_cases import random_count, random_seed
from support.rewrite_rig import FLUTES, HEAD, deep_program, rewrite, verdict

TOOLS = {1: (6.0, 0.0), 2: (6.0, 3.0), 3: (10.0, 0.0), 4: (8.0, 1.0)}  # diameter, corner radius of rewrite_rig.TOOLS
CLEARANCE = 0.2
STOCK = "M250 P0 Q0 R-50 I80 J60 K50\n"
BACK = HEAD + STOCK + "T1 M6\nF600\nG0 X-5 Y30\nG0 Z-36\nG1 X85\nG0 Z20\nM2\n"
SLIVER = HEAD + STOCK + "T1 M6\nF600\nG0 X-6 Y-2.5\nG0 Z-32\nG1 X40\nG1 X60 Y20\nG1 X40 Y62.5\nG1 X-6\nG0 Z20\nM2\n"


def rewritten(folder, machine, text):
    """-> the new text.  It cuts no deeper, no more and leaves no more than the first, by check_oracle.py's needles."""
    folder.mkdir(exist_ok=True)
    before, after = folder / "a.ngc", folder / "b.ngc"
    before.write_text(text)
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 0, done.errors
    return after.read_text()


def test_not_back_through_the_slot_just_cut(tmp_path, machine):
    after = rewritten(tmp_path, machine, BACK)
    assert oracle.violations(after, TOOLS, CLEARANCE) == [] and "shifted" in after
    over, more, left, rapid = verdict(tmp_path / "a.ngc", tmp_path / "b.ngc", machine)
    assert over <= 0.006 and more <= 0.02 and left <= 0.05 and rapid == 0.0


def test_the_last_level_leaves_no_sliver_for_a_traverse(tmp_path, machine):
    after = rewritten(tmp_path, machine, SLIVER)
    assert oracle.violations(after, TOOLS, CLEARANCE) == [] and "shifted" in after
    box, moves = oracle.read(after)
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(0.0, 1.0, 201), np.linspace(59.51, 59.99, 49)))
    assert oracle.heights(box, moves, TOOLS, x, y).max() == -32.0  # the corner where the last level ends


def test_the_oracle_sees_both(tmp_path):
    """What was written before: G0 through the slot, and through a sliver 0.04 mm thick."""
    slot = BACK.replace(
        "G0 Z-36\nG1 X85\n", "G0 Z-36\nG1 X-5 Z-20\nG1 X85\nG0 X-3.5\nG0 Z-35\nG1 Z-36\nG1 X80\nG0 X85\n"
    )
    found = oracle.violations(slot, TOOLS, CLEARANCE)
    assert [line for line, _, _ in found] == [9, 13] and all(
        side == pytest.approx(0.0, abs=0.01) for _, _, side in found
    )
    sliver = SLIVER.replace("G1 X-6\n", "G1 X0.5\nG0 X-6\n")
    assert [line for line, _, _ in oracle.violations(sliver, TOOLS, CLEARANCE)] == [11]


def low_program(seed):
    """Slots, some into the stock and some through it, between which the program travels beside the stock at the depth
    that it cuts."""
    r = random.Random(f"low {seed}")
    size = r.uniform(45, 70), r.uniform(40, 60), r.uniform(25, 40)
    tool = r.choice([1, 2, 4])
    lines = [
        HEAD.strip(),
        f"M250 P0 Q0 R{-size[2]:.3f} I{size[0]:.3f} J{size[1]:.3f} K{size[2]:.3f}",
        f"T{tool} M6",
        "S9000 M3",
    ]
    lines += [f"G0 X{r.uniform(-14, -6):.3f} Y{r.uniform(5, size[1] - 5):.3f}"]
    for _ in range(r.randint(1, 3)):
        lines.append(f"G0 Z{-r.uniform(1.2 * FLUTES[tool], min(size[2] - 1, 3 * FLUTES[tool])):.3f}")
        x, y = r.choice([size[0] + 8, r.uniform(10, size[0])]), r.uniform(-2, size[1] + 2)
        lines.append(f"G1 X{x:.3f} Y{y:.3f} F{r.choice([300, 600])}")
        if x > size[0]:
            lines += [f"G0 X{x:.3f} Y{r.choice([-12.0, size[1] + 12]):.3f}"] * r.randint(0, 1)
        elif r.random() < 0.5:
            lines.append(f"G1 X{x + r.uniform(5, 20):.3f} Y{r.uniform(0, size[1]):.3f}")
        lines += ["G0 Z5", f"G0 X{r.uniform(-14, -8):.3f} Y{r.uniform(-5, size[1] + 5):.3f}"]
    return "\n".join([*lines, "M2"]) + "\n"


@pytest.mark.parametrize("program", [deep_program, low_program])
def test_no_new_traverse_is_nearer_than_the_clearance(tmp_path, machine, program):
    """CHIPWISE_RANDOM_COUNT=50 makes a hundred."""
    seen = 0
    for case in range(random_count(2)):
        seed = 40_000 + random_seed() + case
        before = program(seed)
        after = rewritten(tmp_path / str(seed), machine, before)
        found = oracle.new_violations(before, after, TOOLS, CLEARANCE, seed)
        assert not found, (seed, found)
        seen += "shifted" in after
    assert seen


def test_traverses_of_the_program_itself_stay(tmp_path, machine):
    """It goes back through its own slot by G0: that is what it said."""
    text = HEAD + STOCK + "T1 M6\nF600\nG0 X-5 Y30 Z5\nG1 Z-20\nG1 X85\nG0 X-5\nG1 X-6 Y10\nG0 Z5\nM2\n"
    after = rewritten(tmp_path, machine, text)
    assert "shifted" in after and "\nG0 X-5\n" in after
    assert oracle.violations(after, TOOLS, CLEARANCE) and not oracle.new_violations(text, after, TOOLS, CLEARANCE)


def test_a_link_is_for_the_stock_before_the_segment_is_cut():
    """What the segment takes away beside its own beginning is still there when the tool comes down."""
    links = Links(SimpleNamespace(known_from=0, feed=np.array([600.0]), kind=np.array([FEED])), CLEARANCE)
    stock, tool = HeightMap((0, 0, -20), (60, 60, 0), 0.25), Shape(6.0)
    links.stock, links.tool, links.travel = stock, SimpleNamespace(shape=tool), 5.0
    part, body = SimpleNamespace(points=np.array([[-3.1, 30.0, -9.0]])), SimpleNamespace(lead=[], move=np.array([0]))
    link = links.to_segment((50.0, 30.0, -5.0), part, body)
    stock.cut(tool, (-3.1, 30.0, -9.0), np.array([[70.0, 30.0, -9.0]]))
    assert [(m.kind, m.end[2]) for m in link(-9.0)] == [
        (RAPID, 5.0),
        (RAPID, 5.0),
        (RAPID, 1.0),
        (FEED, -8.0),
        (FEED, -9.0),
    ]


def test_a_traverse_of_the_program_itself_that_is_too_near_by_then(tmp_path, machine):
    """It becomes a feed move where it is written; others stay."""
    path = tmp_path / "a.ngc"
    path.write_text(HEAD + STOCK + "T1 M6\nG0 X-5 Y30\nG0 Z-4\nG1 X85 F600\nG0 Z-3\nG0 X90\nM2\n")
    program, edits = read(str(path), Machine(str(machine)), None), Edits()
    feed_traverses(program, edits, [(85.0, 30.0, -3.0)])
    steps, _, table = edits.instead.merged()
    assert [int(program.line[program.first[step]]) for step in steps] == [
        path.read_text().split("\n").index("G0 Z-3") + 1
    ]
    assert [tuple(move) for move in table] == [(FEED, (85.0, 30.0, -3.0), 600.0, None)]


@pytest.mark.parametrize("setting", ["0", "3"])
def test_the_setting(tmp_path, machine, setting):
    own = machine.with_name(f"clear{setting}.ini")
    own.write_text(machine.read_text().replace("\n[CHIPWISE]\n", f"\n[CHIPWISE]\nTRAVERSE_CLEARANCE = {setting}\n"))
    after = rewritten(tmp_path, own, SLIVER)
    assert not oracle.new_violations(SLIVER, after, TOOLS, float(setting))


FLAT, BALL, CONE = (6.0, 0.0, 0.0), (6.0, 3.0, 0.0), (6.0, 0.0, 90.0)
# tool (diameter, corner, tip), begin and end beside the stock's edge at Y0, whether it is nearer than 0.2 mm
TRAVERSES = {
    "beside a wall, 0.19 mm": (FLAT, (-4, -3.19, -4), (18, -3.19, -4), True),
    "beside a wall, 0.21 mm": (FLAT, (-4, -3.21, -4), (18, -3.21, -4), False),
    "straight up beside a wall": (FLAT, (7, -3.0, -4), (7, -3.0, 3), False),
    "straight down beside a wall": (FLAT, (7, -3.1, 3), (7, -3.1, -1), True),
    "straight down, 0.21 mm": (FLAT, (7, -3.21, 3), (7, -3.21, -4), False),
    "over the stock": (FLAT, (-4, 3.0, 0.0), (18, 3.0, 0.0), False),
    "a ball beside the edge": (
        BALL,
        (-4, -2.426, -1),
        (18, -2.426, -1),
        True,
    ),  # it is 2.236 mm wide at the top of the stock
    "a ball, 0.21 mm": (BALL, (-4, -2.446, -1), (18, -2.446, -1), False),
    "a cone beside the edge": (CONE, (-4, -1.19, -1), (18, -1.19, -1), True),
    "a cone, 0.21 mm": (CONE, (-4, -1.21, -1), (18, -1.21, -1), False),
    "down a slope": (FLAT, (-9, -3.1, 9), (8, -3.1, -1), True),
    "down a slope, over it": (FLAT, (-9, -3.1, 9), (8, -3.1, 0), False),
    "up a slope to a wall": (BALL, (7, -9, -8), (7, -2, -1.1), True),
}


@pytest.mark.parametrize("name", TRAVERSES)
def test_the_proof_of_a_traverse(name):
    tool, start, end, expected = TRAVERSES[name]
    program = program_of([(-20, -20, 5), start, end], tool, kinds=[FEED, RAPID])
    found = depth_proof.too_deep(program, geometry_of(tool, None), 0.25, 0.0, CLEARANCE)
    assert bool(found) == expected, found
    assert all(w.line == 4 and w.traverse == pytest.approx((*start, *end)) for w in found)


@pytest.mark.parametrize("name", TRAVERSES)
def test_the_map_of_what_is_written_is_no_less_strict(name):
    """A cell more than the clearance, as links.py asks: nothing that the proof finds is in the clear."""
    tool, start, end, expected = TRAVERSES[name]
    stock = HeightMap((0, 0, -12), (14, 12, 0), 0.25)
    assert not (expected and stock.is_clear(Shape(*tool), CLEARANCE + stock.cell, start, end))
    assert stock.is_clear(Shape(*tool), CLEARANCE, start, end) or expected
