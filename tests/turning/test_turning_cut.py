# SPDX-License-Identifier: GPL-2.0-or-later
"""The judges of feed in the air and of LinuxCNC's G71, on paths whose answer is known."""

import math
import random
import subprocess

import pytest

from support import turning_g71
from support.turning_cut import lengths
from support.turning_oracle import Insert
from support.turning_random import random_case

C80, BORING, DRILL = Insert(0.8, 85, 5, 2), Insert(0.4, 275, 328, 3), Insert(12, 0, 0, 7, point=118)
BLANK = (15.0, -40.0, 0.0)


def measured(*lines, tool=C80):
    found = lengths("\n".join(["T1", "G0 X30 Z20", *lines]), 1.0, BLANK, {1: tool})
    return [found[name] for name in ("feed", "air", "rapid")]


def test_a_pass_in_stock_cuts_and_the_same_once_more_does_not():
    first = ["G0 X14 Z2", "G1 X14 Z-20", "G0 X16 Z-19", "G0 X16 Z2"]
    assert measured(*first) == pytest.approx([22, 2, 0], abs=0.15)
    assert measured(*first, "G0 X14 Z2", "G1 X14 Z-20") == pytest.approx([44, 24, 0], abs=0.3)
    slope = ["G0 X12 Z2", "G1 X12 Z0", "G1 X14 Z-20", "G0 X16 Z-19", "G0 X16 Z2"]
    assert measured(*slope, *slope) == pytest.approx([2 * (2 + math.hypot(2, 20)), 4 + math.hypot(2, 20), 0], abs=0.6)


def test_a_face_is_cut_on_all_of_its_length():
    """A step of 3 mm with 0.3 mm on its face: the tool that climbs it cuts, although at its foot it has passed below
    all of that."""
    assert (
        measured(
            "G0 X12 Z2", "G1 X12 Z-9.7", "G1 X15.5 Z-9.7", "G0 X16 Z2", "G0 X12 Z-9.5", "G1 X12 Z-10", "G1 X15 Z-10"
        )[1]
        < 2 + 3.5 + 0.6
    )
    assert measured("G0 X12 Z2", "G1 X12 Z-10", "G1 X12 Z-9.5", "G1 X12 Z-10", "G1 X12 Z-9.5")[1] == pytest.approx(
        2 + 1.5, abs=0.1
    )


def test_rapids_that_cut_are_seen():
    assert measured("G0 X14 Z2", "G0 X14 Z-10")[2] == pytest.approx(10, abs=0.1)
    assert measured("G0 X15.1 Z2", "G0 X15.1 Z-10")[2] == 0.0


def test_drill_and_boring_bar():
    drilled = lengths(
        "T1\nG0 X0 Z5\nG1 X0 Z-20\nG0 X0 Z5\nT2\nG0 X6.5 Z2\nG1 X6.5 Z-10\nG1 X6.5 Z-8\n",
        1.0,
        BLANK,
        {1: DRILL, 2: BORING},
    )
    assert [drilled[name] for name in ("feed", "air", "rapid")] == pytest.approx([25 + 12 + 2, 5 + 2 + 2, 0], abs=0.2)
    assert [drilled[2, name] for name in ("feed", "air")] == pytest.approx([12 + 2, 2 + 2], abs=0.2)


def without_bore(seed):
    rng = random.Random(seed)
    return next(case for case in iter(lambda: random_case(rng, "C80", 0.0), None) if not case.bore)


def test_g71_is_judged(tmp_path, monkeypatch):
    """A part that G71 can turn has no gouge; a path 0.01 mm lower has; errors and endless loops are named."""
    found = [turning_g71.judged(without_bore(k), C80, 1.0, tmp_path) for k in range(4)]
    clean = next(k for k in range(4) if not found[k]["error"] and found[k]["gouge"] < 0.001)
    case, plain = without_bore(clean), turning_g71.run
    text, _ = plain(case, 1.0, tmp_path)
    assert "G1 " in text
    lower = [line if not line.startswith(("G1", "G2", "G3")) else f"{line} " for line in text.splitlines()]
    lowered = "\n".join(
        " ".join(f"X{float(w[1:]) - 0.01:.6f}" if w.startswith("X") else w for w in line.split())
        if line.endswith(" ")
        else line
        for line in lower
        if not line.startswith(("G2", "G3"))
    )
    monkeypatch.setattr(turning_g71, "run", lambda *_: (lowered, ""))
    assert turning_g71.judged(case, C80, 1.0, tmp_path)["gouge"] > 0.003
    monkeypatch.setattr(turning_g71, "run", plain)
    monkeypatch.setattr(turning_g71, "program", lambda *_: "G71 Q100\nM2\n")
    assert turning_g71.judged(case, C80, 1.0, tmp_path)["error"]

    def hangs(*_args, **_words):
        raise subprocess.TimeoutExpired("rs274", 1)

    monkeypatch.setattr(turning_g71.subprocess, "run", hangs)
    assert turning_g71.judged(case, C80, 1.0, tmp_path) == {"error": "endless"}
