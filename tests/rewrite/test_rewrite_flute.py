# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite --flute: CN105492980 on whole programs; judged by needles written apart."""

import re

import numpy as np
import pytest

from chipwise.program.reader import Machine
from chipwise.rewrite.program import read
from chipwise.rewrite.read_back import Different, same_stock
from chipwise.tool_data.geometry import load_tools
from support.random_cases import random_count, random_seed
from support.rewrite_rig import FLUTES, HEAD, check_status, deep_program, rewrite, verdict

STOCK = "M250 P0 Q0 R-40 I100 J60 K40\n"
WITHIN = 0.125  # mm, half a cell: what the height map's depth may be too low by on slopes and remains


def rewritten(tmp_path, machine, text, *options):
    """-> (what was said, path before, path after)."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(text)
    done = rewrite(before, after, machine, "--flute", *options)
    assert done.status == 0, done.errors
    return done.said, before, after


def test_long_enough_is_unchanged_byte_for_byte(tmp_path, machine):
    text = HEAD + STOCK + "T1 M6 ( six )\r\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-12\nN50 G1X110F400\nG0 Z5\nM2"
    said, before, after = rewritten(tmp_path, machine, text)
    assert "unchanged" in said and after.read_bytes() == before.read_bytes()


DEEP = {  # program, lowest added feed length: levels needed less one times the short segment
    "slot through the stock": ("T1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-30\nG1 X110 F400\nG0 Z5\n", 2 * 103.0),
    "a wall three flutes deep": ("T1 M6\nS8000 M3\nG0 X-10 Y-1 Z5\nG0 Z-36\nG1 X110 F400\nG0 Z5\n", 2 * 102.2),
    "closed, entered by a plunge": (
        "T1 M6\nS8000 M3\nG0 X20 Y20 Z5\nG1 Z-24 F100\nN9 X80 F400\nG3 X80 Y40 J10\nG1 X20\nY20\nG0 Z5\n",
        60 + 31.416 + 60 + 20,
    ),
    "a bracket with a recess": (  # [0086] to [0091]: round the outside, deep only where the recess comes
        "T3 M6\nS8000 M3\nG0 X-10 Y0 Z5\nG0 Z-11\nG1 X40 F900\nG0 Z5\nG0 X115 Y0\nG0 Z-11\nG1 X60\nG0 Z5\nG0 X-10 Y2\n"
        "Z-22\n"
        "G1 X38\nG0 Z5\nG0 X115 Y2\nZ-22\nG1 X62\nG0 Z5\nT1 M6\nG0 X-10 Y0\nG0 Z-22\nG1 X40 F400\nX60\nX110\nG0 Z5\n",
        15.0,
    ),
}


@pytest.mark.parametrize("name", DEEP)
def test_deep_walls(tmp_path, machine, name):
    body, least = DEEP[name]
    said, before, after = rewritten(tmp_path, machine, HEAD + STOCK + body + "M2\n")
    status, output = check_status(after, machine)
    assert status == 0, output
    over, more, left, rapid = verdict(before, after, machine)
    assert over <= 0.006 and rapid <= 0.006
    assert more <= 0.02 and left <= 0.05
    added = float(re.search(r"([\d.]+) mm of feed added", said).group(1))
    if name != "a bracket with a recess":
        assert least * 0.99 <= added <= 1.15 * least
    else:
        assert 0 < added < 60  # the segment of the recess, not the 120 mm of the path


def test_the_whole_path_again(tmp_path, machine):
    """[0082], S107: by choice the whole first path instead of the segments where material was left."""
    text = HEAD + STOCK + DEEP["a bracket with a recess"][0] + "M2\n"
    said, before, after = rewritten(tmp_path, machine, text, "--whole")
    assert float(re.search(r"([\d.]+) mm of feed added", said).group(1)) > 110
    assert verdict(before, after, machine)[0] <= 0.006


def test_a_corner_that_only_sweeps_too_deep_diagonally(tmp_path, machine):
    """[0057]: along the wall the flutes reach, in the corner they do not."""
    body = (
        "T3 M6\nS8000 M3\nG0 X-10 Y4 Z5\nZ-20\nG1 X60 F900\nG0 Z5\nG0 X105 Y20\n"
        "T1 M6\nG0 X-10 Y6\nZ-20\nG1 X62 F400\nY70\nG0 Z5\n"
    )
    said, before, after = rewritten(tmp_path, machine, HEAD + STOCK + body + "M2\n")
    text = after.read_text()
    assert "\nG1 X62 F400\n" in text or "G1 X62 F400" in text
    over, more, left, _rapid = verdict(before, after, machine)
    assert over <= 0.006 and more <= 0.02 and left <= 0.05
    assert check_status(after, machine)[0] == 0


def test_random_programs(tmp_path, machine):
    """Depth, holder, what is left and what is cut more, on seeded random programs (200 of them:
    bench/bench_rewrite.py)."""
    for case in range(random_count(4)):
        seed = random_seed() + case
        folder = tmp_path / str(seed)
        folder.mkdir()
        _said, before, after = rewritten(folder, machine, deep_program(seed))
        status, output = check_status(after, machine)
        assert status == 0 or "flute" not in output and "cuts" not in output, (seed, output)
        over, more, left, _ = verdict(before, after, machine)
        assert over <= WITHIN, (seed, over)
        assert left <= 0.25 and more <= 0.25, (seed, more, left)


@pytest.mark.parametrize("seed", [59, 134])
def test_what_the_first_path_has_cut_is_not_travelled_again(tmp_path, machine, seed):
    """Once the first path itself has been there, what the model's steps leave does not send the tool there again: it
    was 25 and 14 levels."""
    text = deep_program(seed)
    said, _before, _after = rewritten(tmp_path, machine, text)
    tool = int(re.findall(r"T(\d) M6", text)[-1])
    flute, corner = FLUTES[tool], {1: 0.0, 2: 3.0, 4: 1.0}[tool]
    step = (
        flute - (corner - np.sqrt(corner**2 - max(corner - 0.004, 0.0) ** 2)) - 0.2
    )  # the edge's round is left at the wall
    deepest = -min(float(z) for z in re.findall(r"Z(-[\d.]+)", text.split(f"T{tool} M6")[1]))
    levels = [int(n) for n in re.findall(r"in (\d+) levels", said)]
    assert levels and max(levels) <= 1 + np.ceil((deepest - flute) / step)


@pytest.mark.parametrize("seed", [75, 98])
def test_nothing_is_left(tmp_path, machine, seed):
    """98: beside a steep move, whose steps across the axis are a few micrometres, 16 mm of stock were left.  75: 0.084
    mm, too little to travel again and too much for the proof."""
    _said, before, after = rewritten(tmp_path, machine, deep_program(seed))
    over, more, left, rapid = verdict(before, after, machine)
    assert over <= WITHIN and left <= 0.25 and more <= 0.25 and rapid <= 0.006


def test_modes_are_kept(tmp_path, machine):
    """G91, inch, a turned coordinate system: what follows the shifted segment finds the modes as they were."""
    body = (
        "G10 L2 P1 X3 Y4 Z1 R20\nG54\nT1 M6\nS8000 M3\nG0 X0 Y10 Z5\nG1 Z-25 F100\nG91 X40 F400\nY8\nG2 X-10 Y10 I-10\n"
        "G90 G20 G1 X0.5 F12\nG21 G0 Z5\nX0 Y0\nM2\n"
    )
    _said, before, after = rewritten(tmp_path, machine, HEAD + STOCK + body)
    machine_ = Machine(str(machine))
    one, two = read(str(before), machine_), read(str(after), machine_)
    assert np.abs(one.end[-1] - two.end[-1]).max() < 1e-6
    over, more, left, _ = verdict(before, after, machine)
    assert over <= 0.006 and more <= 0.02 and left <= 0.05
    text = after.read_text()
    assert text.count("\nG90\n") == 3 and text.count("\nG91\n") == 4 and "\nG90 G20\n" in text


def test_arcs_of_several_planes_in_one_body(tmp_path, machine):
    """What is travelled again behind the last line has arcs of G18 and G19 in it; G17 and G19 are in force behind
    it."""
    body = (
        "T2 M6\nS8000 M3\nG0 X20 Y20 Z5\nG1 Z-12 F100\nG18 G3 X44 Z-12 I12 K8\nG19 G2 Y32 Z-12 J6 K0\n{}\nG0 Z5\nM2\n"
    )
    for name, last in (("a", "G17"), ("b", "G1 Y34 Z-14")):
        folder = tmp_path / name
        folder.mkdir()
        _said, before, after = rewritten(folder, machine, HEAD + STOCK + body.format(last))
        over, more, left, rapid = verdict(before, after, machine)
        assert over <= 0.006 and left <= 0.05 and more <= 0.02 and rapid <= 0.006
        assert {"G18", "G19"} <= set(
            after.read_text().partition("K0)")[2].split()
        )  # behind the last line that is shown


@pytest.mark.parametrize("retract", ["G0 Z35\nX-20", "G0 Z35", "o1 sub\nG0 Z35\no1 endsub\no1 call"])
def test_an_incremental_retract_goes_no_further_than_it_did(tmp_path, machine, retract):
    body = f"T1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG91\nG1 Z-35 F200\nX120 F400\n{retract}\nM2\n"
    _said, before, after = rewritten(tmp_path, machine, HEAD + STOCK + body)
    machine_ = Machine(str(machine))
    one, two = read(str(before), machine_), read(str(after), machine_)
    assert np.abs(one.end[-1] - two.end[-1]).max() < 1e-5 and two.end[:, 2].max() == 5.0
    two.end[-1, 2] += 35.0  # what it did before
    with pytest.raises(Different, match="ends at another place"):
        same_stock(one, two, load_tools(str(machine.parent / "tools.toml")), 0.25)


REFUSED = {
    "compensation": ("G0 X-20 Y30 Z5\nG0 Z-30\nG41.1 D6 G1 X-10 F400\nX110\nG40 G0 Z5\nM2\n", "cutter compensation"),
    "tool change on the line": ("G0 X-10 Y30 Z5\nG0 Z-30\nG1 X110 F400 M8\nG0 Z5\nM2\n", "M8 on the same line"),
    "block delete": ("G0 X-10 Y30 Z5\nG0 Z-30\n/G1 X110 F400\nG0 Z5\nM2\n", "block delete"),
    "an assignment": ("G0 X-10 Y30 Z5\nG0 Z-30\nG1 X110 F400 #5=3\nG0 Z5\nM2\n", "sets a parameter"),
    "G93": ("G0 X-10 Y30 Z5\nG0 Z-30\nG93 G1 X110 F4\nG0 Z5\nM2\n", "G93"),
    "probing": ("G0 X-10 Y30 Z5\nG38.2 Z-30 F100\nM2\n", "probes"),
    "no end": ("G0 X-10 Y30 Z5\nG0 Z-30\nG1 X110 F400\n", "M2"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(tmp_path, machine, name):
    """A clear line, status 2, and the file that is there stays."""
    before, after = tmp_path / "a.ngc", tmp_path / "b.ngc"
    before.write_text(HEAD + STOCK + "T1 M6\n" + REFUSED[name][0])
    after.write_text("precious")
    done = rewrite(before, after, machine, "--flute")
    assert done.status == 2 and REFUSED[name][1] in done.errors, done.errors
    assert after.read_text() == "precious" and len(done.errors.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.ngc", "b.ngc"]


def test_bad_files_and_options(tmp_path, machine):
    good, out = tmp_path / "a.ngc", tmp_path / "o.ngc"
    good.write_text(HEAD + STOCK + "T1 M6\nG0 X-10 Y30 Z5\nG0 Z-3\nG1 X110 F400\nM2\n")
    (tmp_path / "binary.ngc").write_bytes(b"\x7fELF\0\0\0")
    (tmp_path / "empty.ngc").write_bytes(b"")
    for program, options, said in (
        (tmp_path / "binary.ngc", ["--flute"], "not a text file"),
        (tmp_path / "empty.ngc", ["--flute"], "empty"),
        (tmp_path / "none.ngc", ["--flute"], "No such file"),
        (good, [], "required"),
        (good, ["--flute", "--feed", "3"], "not allowed"),
        (good, ["--feed", "-3"], "above 0"),
        (
            good,
            ["--feed", "30000"],
            "--feed 30000 cm3/min is above 10000 cm3/min, which no machine removes; give it in cm3/min, not in mm3/min",
        ),
        (good, ["--feed", "2e6", "--lower", "3"], "--feed 2e+06 cm3/min is above"),
        (good, ["--feed", "inf"], "above 0"),
        (good, ["--feed", "nan"], "above 0"),
        (good, ["--feed", "3", "--lower", "4"], "above --feed"),
        (good, ["--flute", "--split", "2"], "goes with --feed"),
        (good, ["--feed", "3", "--whole"], "goes with --flute"),
        (good, ["--feed", "3", "--split", "0.001"], "0.05"),
    ):
        done = rewrite(program, out, machine, *options)
        assert done.status == 2 and said in done.errors, (options, done.errors)
        assert not out.exists()
    for target in ("/dev/null", str(tmp_path / "no" / "o.ngc"), str(tmp_path)):
        assert rewrite(good, target, machine, "--flute").status == 2
