# SPDX-License-Identifier: GPL-2.0-or-later
"""Named parameters: the program's own beside our cycles, names of ours that do not exist."""

import pytest

from support.canon import run_preview, run_rs274

TOOLS = {1: 6.0}
SUB = "o100 sub\nG0 X0 Y0\nG1 X40\nG1 Y30\nG1 X0\nG1 Y0\no100 endsub\n"
HEAD = "G21 G90 G17 G40\nT1 M6\nG0 Z20\nF600\n"
CYCLES = {
    "G12": "G12 X20 Y20 I10 Z-3 R1",
    "G13": "G13 X20 Y20 I10 Z-3 R1",
    "G77": "G77 Q100 P42 I0.3 L2 D5 Z-3 R1",
    "G78": "G78 Q100 P41 Z-3 R1",
    "G79": "G79 Q100 Z-3 R1",
}


def program(line, before="", inside=""):
    return SUB.replace("G1 X40", f"{inside}G1 X40") + HEAD + before + line + "\nM2\n"


@pytest.mark.parametrize("code", CYCLES)
@pytest.mark.parametrize(
    "before",
    [
        "#<depth> = 4\n",
        "#<a> = 1\n#<Depth of it> = 2\n#<_global> = 3\n",
        "#<x> = 0\n#1 = 5\n#40 = 6\n",
        "#<_huge> = [10 ** 300]\n#<_tiny> = [1 / 10 ** 30]\n#<_less> = -0.000001\n#<_big> = -123456789012345678\n",
    ],
)
def test_parameters_of_the_main_program(code, before):
    """Local and global ones of any size, in the main program: the cycle is what it is without them."""
    plain = run_preview(program(CYCLES[code], inside="#9 = 1\n"), tools=TOOLS)  # it may read them, so it gets them
    found = run_preview(program(CYCLES[code], before, "#9 = 1\n"), tools=TOOLS)
    assert plain.error == found.error == ""
    assert len(plain.elements) > 4
    assert [(e.kind, e.a, e.b) for e in found.elements] == [(e.kind, e.a, e.b) for e in plain.elements]


@pytest.mark.parametrize("code", CYCLES)
def test_parameters_of_a_calling_sub(code):
    """The same in a sub that calls the cycle, with locals of its own and of the main program."""
    text = program(
        "o1 call [2] [3]", "#<depth> = 4\no1 sub\n#<depth> = 3\n#<width> = #1\n" + CYCLES[code] + "\no1 endsub\n"
    )
    found = run_preview(text, tools=TOOLS)
    assert found.error == ""
    assert [(e.kind, e.a, e.b) for e in found.elements] == [
        (e.kind, e.a, e.b) for e in run_preview(program(CYCLES[code]), tools=TOOLS).elements
    ]


def test_a_contour_sub_sees_globals_to_their_last_digits():
    """What a sub reads is what the program has set, to 15 digits; locals of the main program are not visible, as in any
    call."""
    before = "#<_tiny> = 0.00012345678901\n#<_big> = [2 ** 70]\n#<depth> = 4\n"
    text = program("G78 Q100 P42 Z-3 R1", before, "#1 = [#<_tiny> * 100000 + #<_big> / 2 ** 70]\nG1 X[#1]\n")
    assert run_preview(text, tools=TOOLS).error == ""
    error = run_preview(program("G78 Q100 P42 Z-3 R1", before, "G1 X[#<depth>]\n"), tools=TOOLS).error
    assert "depth" in error and "line 3" in error and "internal" not in error


@pytest.mark.parametrize("run", [run_rs274, run_preview])
@pytest.mark.parametrize("line", [*CYCLES.values(), "M250 P0 Q0 R-10 I60 J40 K10", "M251 Q6"])
def test_an_unknown_name_is_named(run, line):
    tools = TOOLS
    found = run(program(line, "#<_chipwise_chopsize> = 12\n"), tools=tools)
    code = line.split()[0]
    assert found.error == (
        f"chipwise: {code}: #<_chipwise_chopsize> is not known; known after #<_chipwise_ are allowance, "
        "approach_angle, chop_size, keep_climb, ramp_angle, seam_overlap, surface_depth, surface_rest, "
        "surface_scallop, to_and_fro"
    )
    assert not [e for e in found.elements if e.kind != "rapid"]


def test_known_names_in_any_spelling():
    chopped = run_preview(program(CYCLES["G13"], "#< _Chipwise_Chop_Size > = 5\n"), tools=TOOLS)
    assert chopped.error == ""
    assert len(chopped.elements) > len(run_preview(program(CYCLES["G13"]), tools=TOOLS).elements)
