# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check, rule `clearance`: traverses beside stock.  What is found, and what a program may do."""

import re

import numpy as np
import pytest

from chipwise.check import rules
from chipwise.program import records
from chipwise.clib.height_map import HeightMap, Shape
from support.check_runs import HEAD, STOCK, TABLE, chipwise_check, mill_with_tools

START = HEAD + STOCK + "T1 M6\nS8000 M3\nF400\n"  # 100 x 60 x 20 mm, 6 mm flat
CASES = {  # program, {first line: mm beside stock}
    # found
    "back through its own slot": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110\nG0 X-10\nG0 Z5\n", {9: 0.0}),
    "back through its own slot, rising a little": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110\nG0 X-10 Z3\n", {9: 0.0}),
    "along the side, 0.1 mm": ("G0 X-10 Y-3.1 Z5\nG0 Z-4\nG0 X110\nG0 Z5\n", {8: 0.1}),
    "down beside the stock": ("G0 X50 Y-3 Z5\nG0 Z-4\nG1 X110\nG0 Z5\n", {7: 0.0}),
    "down into its own slot": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110\nG0 Z5\nX50\nG0 Z-3.5\nG1 Z-8\nG0 Z5\n", {11: 0.0}),
    "down a slope into its own slot": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110\nG0 Z5\nX20\nG0 X50 Z-3.5\nG0 Z5\n", {11: 0.0}),
    "up to a wall that is not near at first": ("G0 X-10 Y30 Z5\nG0 Z-9\nG0 X-3.1 Z-1\nG0 Z5\n", {8: 0.1}),
    "one after the other are one finding": (
        "G0 X-10 Y30 Z5\nG0 Z-4\nG1 X110\nG0 X-10\nG1 Y40\nX110\nG0 X-10\nG0 Z5\n",
        {9: 0.0},
    ),
    # allowed
    "straight up out of a slot": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X50\nG0 Z5\n", {}),
    "up along a wall": ("G0 X-10 Y-3 Z5\nG0 Z-4\nG1 X40\nG0 X50 Z7\n", {}),
    "up along a slot": ("G0 X-10 Y30 Z5\nG0 Z-4\nG1 X40\nG0 X30 Z7\n", {}),
    "away from a wall": ("G0 X-10 Y-3 Z5\nG0 Z-4\nG1 X40\nG0 Y-20\nG0 Z5\n", {}),
    "away from a wall at 30 degrees": ("G0 X-10 Y-3 Z5\nG0 Z-4\nG1 X40\nG0 X60 Y-14.55\nG0 Z5\n", {}),
    "along the side, 0.25 mm": ("G0 X-10 Y-3.25 Z5\nG0 Z-4\nG0 X110\nG0 Z5\n", {}),
    "over the stock": ("G0 X-10 Y30 Z5\nG0 Z0\nG0 X110\nG0 Z5\n", {}),
    "over the floor that it has cut": (
        "G0 X-10 Y0 Z5\nG0 Z-4\nG1 X110\nG0 Y-12\nG0 X-10\nG0 Y4\nG1 X110\nG0 Y-0.5\nG0 X-10\nG0 Z5\n",
        {},
    ),
    "pecks": ("G0 X50 Y30 Z5\nG83 Z-12 R2 Q2\nX70\nG80\nG0 Z5\n", {}),
    "pecks by hand": ("G0 X50 Y30 Z5\nG1 Z-3\nG0 Z2\nG0 Z-2.9\nG1 Z-6\nG0 Z2\nG0 Z-5.9\nG1 Z-9\nG0 Z5\n", {}),
}


@pytest.fixture(name="mill", scope="module")
def make_mill(tmp_path_factory):
    return mill_with_tools(tmp_path_factory.mktemp("mill"))


def test_what_is_found_and_what_is_not(tmp_path, mill):
    names = {f"{number}.ngc": name for number, name in enumerate(CASES)}
    _, _, _, found = chipwise_check(
        tmp_path, {file: START + CASES[name][0] + "M2\n" for file, name in names.items()}, machine=mill
    )
    for file, one in zip(names, found["programs"]):
        near = {f["line"]: f for f in one["findings"] if f["rule"] == "clearance"}
        expected = CASES[names[file]][1]
        assert one["error"] is None and not [f for f in one["findings"] if f["rule"] == "rapid"], names[file]
        assert set(near) == set(expected), (names[file], one["findings"])
        for line, side in expected.items():
            assert (
                near[line]["value"] == pytest.approx(side, abs=0.13)
                and near[line]["value"] >= side - 0.003
                and near[line]["limit"] == 0.2
            ), near


def test_the_text_counts_the_traverses_of_a_tool(tmp_path, mill):
    text = START + CASES["one after the other are one finding"][0] + "M2\n"
    status, said, _, _ = chipwise_check(tmp_path, {"a.ngc": text}, machine=mill)
    assert status == 1 and re.search(
        r"line 9 to 12, tool 1: traverses beside stock: 2, the nearest 0\.00\d mm from it at X", said
    ), said
    assert "TRAVERSE_CLEARANCE is 0.2 mm; retract higher, or use G1" in said


@pytest.mark.parametrize("setting, count", [("0", 0), ("0.05", 0), ("0.2", 1), ("1", 1)])
def test_the_setting(tmp_path, mill, setting, count):
    own = mill.with_name(f"clear{setting}.ini")
    own.write_text(mill.read_text().replace("\n[CHIPWISE]\n", f"\n[CHIPWISE]\nTRAVERSE_CLEARANCE = {setting}\n"))
    (tmp_path / "mill.tbl").write_text(TABLE)
    _, _, _, found = chipwise_check(
        tmp_path, {"a.ngc": START + CASES["along the side, 0.1 mm"][0] + "M2\n"}, machine=own
    )
    assert len(found["programs"][0]["findings"]) == count


def test_a_block_of_moves_may_end_anywhere():
    """rules.near_stock() of all moves, and of them cut in two: the same traverses."""
    rng = np.random.default_rng(11)
    places = np.repeat(rng.uniform(0, 50, (200, 2)), rng.integers(1, 7, 200), axis=0)
    positions = np.column_stack((places, rng.uniform(-9, 3, len(places))))
    kinds, start = rng.choice([records.RAPID, records.FEED], len(places)), np.zeros(3)
    whole, last = rules.near_stock(start, positions, kinds, 0.0, np.inf)
    assert 0 < whole.sum() < (kinds == records.RAPID).sum()
    for cut in rng.integers(1, len(places) - 1, 20):
        first, been = rules.near_stock(start, positions[:cut], kinds[:cut], 0.0, np.inf)
        second, end = rules.near_stock(positions[cut - 1], positions[cut:], kinds[cut:], 0.0, been)
        assert np.array_equal(np.concatenate((first, second)), whole) and end == pytest.approx(last, abs=1e-4)


def test_needles_count_too():
    """What rewrite has found between the map's own needles."""
    stock = HeightMap((0, 0, -9), (1, 20, 0), 0.5)
    for y in (10.12 + 15, 10.1 - 15):  # a strip 0.02 mm wide stays
        stock.cut(Shape(30.0), (-20, y, -9), np.array([[40.0, y, -9]]))
    ends = (-9.0, 7.0, -5.0), (30.0, 7.0, -5.0)
    assert stock.is_clear(Shape(6.0), 0.2, *ends)
    stock.add_needles(np.array([(0.7, 10.11)]))  # as high as the stock was, so that nothing has cut it
    assert not stock.is_clear(Shape(6.0), 0.2, *ends)
