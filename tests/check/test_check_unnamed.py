# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check of programs whose first moves leave an axis unnamed: where they go is known on the machine
only."""

import math

import pytest

from support.check_runs import HEAD, STOCK, chipwise_check, mill_with_tools

START = HEAD + STOCK + "T1 M6\nS8000 M3\nF400\n"  # 5 lines; 100 x 60 x 20 mm, 6 mm flat, top Z0
SLOT = "G0 Z5\nG0 X-10 Y30\nG0 Z-4\nG1 X110\nG0 Z5\n"
SLOT_MM3 = 100 * 6 * 4
HOLE_MM3 = math.pi * 3**2 * 4
CASES = {  # program, mm3 removed, (line, named, in line, from line) or None
    "Y and Z are named behind a feed": ("G1 X50\nG1 X0 Z-4\nG1 X90\n" + SLOT, SLOT_MM3, (10, "Y is", 6)),
    "X is named in a feed at depth": (
        "G0 Z-4\nG1 X50 Y20\nG0 Z5\nG0 X-10 Y30\n" + SLOT,
        SLOT_MM3 + HOLE_MM3,
        (7, "X and Y are", 6),
    ),
    "a traverse to the first place, in stock": (
        "G0 Z-2\nG0 X-5 Y10\n" + SLOT,
        SLOT_MM3 + 22,
        None,
    ),  # judged, from X0 Y0
    "never": ("G0 Z-4\nG1 X90\nG0 Z5\n", 0, (6, "Y is", None)),
    "Z is named last, straight down": (
        "G0 X-10 Y30\nG1 X50\nG1 Z-4\nG1 X110\nG0 Z5\n",
        53 * 6 * 4 + math.pi * 3**2 * 2 - 12 * 6,
        (8, "Z is", 7),
    ),
    "Z is named last, down a slope": ("G0 X-10 Y30\nG1 X20\nG1 X-10 Z-4\nG1 X110\nG0 Z5\n", SLOT_MM3, (8, "Z is", 7)),
    "Z is named in the first cut": ("G0 X50 Y30\nG1 Z-4\nG0 Z5\n", HOLE_MM3, None),
    "an arc comes to the first place": (
        "G0 Z-4\nG1 X0\nG3 X20 Y0 R10\nG0 Z5\n" + SLOT,
        SLOT_MM3 + HOLE_MM3 / 2,
        (8, "Y is", 6),
    ),
    "relative words": ("G91 G0 X50 Y30 Z-4\nG1 X40\nG90 G0 Z5\n" + SLOT, SLOT_MM3, (10, "X and Y are", 7)),
    "relative words alone": ("G91 G1 X50 Y30 Z-4\nG1 X40\n", 0, (6, "X, Y and Z are", None)),
    "relative words of a drilling cycle": ("G91 G81 X10 Y10 Z-6 R2\nG80 G90 G0 Z5\n", 0, (6, "X and Y are", None)),
    "to the reference, under G91": ("G91 G28 X0 Y0 Z0\nG90\n" + SLOT, SLOT_MM3, None),
    "machine coordinates": ("G53 G0 X0 Y0 Z0\n" + SLOT, SLOT_MM3, None),
    "a hole round the current place": ("G12 Z-2 I10 J2\nG0 Z5\n", 0, (6, "X and Y are", None)),
    "a hole round a relative place": ("G91 G12 X50 Y30 Z-2 I10 J2\nG90 G0 Z5\n", 0, (6, "X and Y are", None)),
    "a full circle names nothing": ("G0 Z-4\nG2 I5\n" + SLOT, SLOT_MM3, (9, "X and Y are", 6)),
    "one after the other, above": ("G0 Z20\nG0 X0\nG0 Y0\n" + SLOT, SLOT_MM3, None),
    "named as 0": ("G0 X0 Y0 Z0\nG0 Z5\n" + SLOT, SLOT_MM3, None),
    "by a touch-off": ("G92 X-20 Y30 Z-4\n" + STOCK + "G1 X-10\nX110\nG0 Z5\n", SLOT_MM3, None),
    "by G10 L20": ("G10 L20 P1 X-20 Y30 Z-4\n" + STOCK + "G1 X-10\nX110\nG0 Z5\n", SLOT_MM3, None),
    "by G28": ("G28\n" + SLOT, SLOT_MM3, None),
    "by a sub": ("o100 sub\nG0 Z5\nG0 X-10 Y30\no100 endsub\no100 call\nG0 Z-4\nG1 X110\nG0 Z5\n", SLOT_MM3, None),
    "by a drilling cycle": ("G81 X-20 Y30 Z-4 R2\nG80\n" + SLOT, SLOT_MM3, None),
    "by a pocket of chipwise": ("G12 X50 Y30 Z-2 I10 J2\n", None, None),
    "in a polar place": ("G0 Z5\nG0 @10 ^180\nG0 Y30\n" + SLOT, SLOT_MM3, None),
    "under cutter compensation": ("G0 Z5\nG41 D1 G1 X-20 Y33\nG1 X-10\nG0 Z-4\nG1 X120\nG40 G0 Z5\n", None, None),
}


@pytest.fixture(name="mill", scope="module")
def make_mill(tmp_path_factory):
    return mill_with_tools(tmp_path_factory.mktemp("mill"))


def test_moves_of_an_unknown_place_are_not_judged(tmp_path, mill):
    names = {f"{number}.ngc": name for number, name in enumerate(CASES)}
    _, said, _, found = chipwise_check(
        tmp_path, {file: START + CASES[name][0] + "M2\n" for file, name in names.items()}, machine=mill
    )
    for file, one in zip(names, found["programs"]):
        _, volume, note = CASES[names[file]]
        assert one["error"] is None, (names[file], one["error"])
        notes = [[line, text] for line, text in one["notes"] if "named" in text]
        if note is None:
            assert not notes, (names[file], notes)
        else:
            line, axes, since = note
            rest = (
                "never named in the program: "
                if since is None
                else f"named first in line {line}: what is moved before is not judged, from line {since} on"
            )
            assert [line for line, _ in notes] == [line] and notes[0][1].startswith(f"{axes} {rest}"), (
                names[file],
                notes,
            )
        removed = sum(tool["volume_mm3"] for tool in one["tools"])
        if volume is not None:
            assert removed == pytest.approx(volume, rel=0.01, abs=0.1), (names[file], removed)
        else:
            assert removed > 100, names[file]
    assert "is named first in line 10" in said


ENDS = {  # program, (rule, line, mm) of its finding or None: the end of a move that begins anywhere is judged
    "G0 X50 Y30 Z-4\nG0 Z5\n": ("rapid", 6, 4.0),
    "G0 X50 Y30\nG0 Z-4\nG0 Z5\n": ("rapid", 7, 4.0),
    "G0 X50 Y30\nG1 X60\nG0 Z-4\nG0 Z5\n": ("rapid", 8, 4.0),
    "G1 X50\nG1 X60 Y30 Z-14\nG0 Z5\n": ("flute", 7, 14.0),
    "G0 X-3.1 Y30\nG0 Z-4\nG0 Z5\n": ("clearance", 7, 0.1),
    "G0 X-3.3 Y30\nG0 Z-4\nG0 Z5\n": None,
    "G0 X50 Y30\nG1 Z-4\nG0 Z5\n": None,
    "G0 X-10 Y30 Z-4\nG1 X110\nG0 Z5\n": None,
}


def test_the_end_of_a_move_from_an_unknown_place_is_judged(tmp_path, mill):
    _, _, _, found = chipwise_check(
        tmp_path, {f"{k}.ngc": START + text + "M2\n" for k, text in enumerate(ENDS)}, machine=mill
    )
    for (text, wanted), one in zip(ENDS.items(), found["programs"]):
        findings = [(f["rule"], f["line"], f["value"]) for f in one["findings"]]
        if wanted is None:
            assert not findings, (text, findings)
        else:
            assert [f[:2] for f in findings] == [wanted[:2]] and findings[0][2] == pytest.approx(wanted[2], abs=0.05), (
                text,
                findings,
            )


def test_a_stock_is_not_assumed_from_them(tmp_path, mill):
    """Two feeds before Y is known would make the assumed stock reach from Y0."""
    rest = "G0 Z5\nG0 X20 Y30\nG1 Z-4\nG1 X80 Y40\nG0 Z5\nM2\n"
    texts = {
        "a.ngc": HEAD + "T1 M6\nS8000 M3\nF400\nG1 X-50\nG1 X0 Z-9\n" + rest,
        "b.ngc": HEAD + "T1 M6\nS8000 M3\nF400\n" + rest,
        "c.ngc": HEAD + "T1 M6\nS8000 M3\nF400\nG0 Z5\nG1 Z-4\nG1 X90\nG0 Z5\nM2\n",
    }
    _, _, said, found = chipwise_check(tmp_path, texts, machine=mill)
    a, b, c = found["programs"]
    assert a["error"] is None and a["stock"] == b["stock"] and a["stock"]["source"] == "assumed", (
        a["stock"],
        b["stock"],
    )
    assert "internal" not in said and c["error"], c
