# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check against the machine: tools and axes that it lacks, the limits of its axes, and what a file without
moves is."""

import pytest

from support.check_runs import HEAD, SLOT, STOCK, chipwise_check, mill_with_tools

CAM = (
    HEAD + "(T12 D=8. CR=0. - ZMIN=-3. - flat end mill)\nT12 M6\nS9000 M3\nG43 H12\nG0 X10 Y10\nG0 Z5\nG1 Z-3 F300\n"
    "G1 X60 F900\nG0 Z5\nM2\n"
)


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def checked(tmp_path, text, *options, machine):
    """-> (stdout, the program's JSON)."""
    _status, out, _err, report = chipwise_check(tmp_path, {"part.ngc": text}, *options, machine=machine)
    return out, report["programs"][0]


def rules(program, *names):
    return [(one["rule"], one["line"]) for one in program["findings"] if one["rule"] in names]


def test_a_tool_that_is_not_in_the_table_is_judged_and_is_a_finding(tmp_path, machine):
    out, program = checked(tmp_path, CAM, machine=machine)
    assert "tool 12 is not in the tool table and is taken as 8 mm, from a comment" in out
    assert (
        rules(program, "machine") == [("machine", 3)]
        and "add T12 to it" in out
        and program["tools"][0]["diameter_mm"] == 8.0
    )
    assert not program["findings"][0]["assumed"] and program["tools"][0]["volume_mm3"] == pytest.approx(
        50 * 8 * 3 + 3.1416 * 16 * 3, rel=0.01
    )


def test_of_tools_that_nobody_describes_both_are_named(tmp_path, machine):
    text = CAM.replace("(T12 D=8. CR=0. - ZMIN=-3. - flat end mill)\n", "").replace("M2\n", "T77 M6\nG1 Y20\nM2\n")
    out, program = checked(tmp_path, text, machine=machine)
    assert (
        program["status"] == 2
        and "tool 12 is not in the tool table" in out
        and "add it there with its D" in out
        and "tool 77" in out
    )
    assert program["extents_mm"]["min"] == pytest.approx([10, 10, -3])
    out, program = checked(tmp_path, text, "--tool-diameter", "8", machine=machine)
    assert rules(program, "machine") == [("machine", 2), ("machine", 10)]


def test_an_axis_that_the_machine_lacks(tmp_path, machine):
    """A post for four axes begins with A0; the machine has three."""
    out, program = checked(tmp_path, SLOT.replace("T1 M6", "T1 M6\nG0 A0"), machine=machine)
    _, whole = checked(tmp_path, SLOT, machine=machine)
    assert rules(program, "machine") == [("machine", 4)] and "line 4: the machine has no axis A" in out
    assert program["tools"][0]["volume_mm3"] == whole["tools"][0]["volume_mm3"]
    out, program = checked(tmp_path, SLOT.replace("G0 Z5\nM2", "G0 Z5\nG0 A90\nG1 Z-15\nM2"), machine=machine)
    assert (
        rules(program, "machine", "rapid") == [("machine", 9)]
        and "line 9: a rotary axis moves: it is judged up to here" in out
    )


@pytest.mark.parametrize("end", ["", "M2\n"])
def test_a_file_with_a_sub_alone(tmp_path, machine, end):
    out, program = checked(tmp_path, f"o<drill_row> sub\nG0 X1\no<drill_row> endsub\n{end}", machine=machine)
    assert program["status"] == 2 and "it defines the sub o<drill_row> only; name a program that calls it" in out


# ---- limits: X -50 to 350, Y -50 to 250, Z -60 to 90 mm --------------------------------------------------------------

FAR = SLOT.replace("G0 Z5\nM2", "G0 Z5\nG0 Y-60\nM2")


def test_no_limits_are_judged_unless_the_machine_is_named(tmp_path):
    out, program = checked(tmp_path, FAR, machine=None)
    assert program["status"] != 2 and not rules(program, "limit") and "its limits are" not in out


def test_a_place_beyond_a_limit(tmp_path, machine):
    """Where a work offset is set; the tool's length counts with G43 only."""
    out, program = checked(tmp_path, FAR.replace("T1 M6", "G10 L2 P1 X20 Z30\nT1 M6\nG43 H1"), machine=machine)
    limits = [one for one in program["findings"] if one["rule"] == "limit"]
    assert [(one["line"], one["value"], one["limit"]) for one in limits] == [
        (11, pytest.approx(-60), -50)
    ] and "Y goes to -60 mm" in out
    out, program = checked(
        tmp_path, SLOT.replace("T1 M6", "G10 L2 P1 Z56\nT1 M6\nG43 H1"), machine=machine
    )  # 56 + 5 + 30 of T1
    assert [(one["line"], one["value"]) for one in program["findings"] if one["rule"] == "limit"] == [
        (7, pytest.approx(91))
    ]
    assert not any(one["assumed"] for one in program["findings"])
    assert not rules(checked(tmp_path, SLOT.replace("T1 M6", "G10 L2 P1 Z56\nT1 M6"), machine=machine)[1], "limit")


def test_before_a_work_offset_is_set_it_is_a_note(tmp_path, machine):
    out, program = checked(tmp_path, FAR, machine=machine)
    assert not rules(program, "limit")
    assert (
        "line 9: Y goes from -60 mm to 30 mm in machine coordinates, its limits are -50 mm and 250 mm, and no work "
        "offset is set: touch off" in out
    )
    _out, program = checked(tmp_path, FAR.replace("G0 Y-60", "G0 X-60\nG0 X360"), machine=machine)  # no offset can help
    assert [line for _rule, line in rules(program, "limit")] == [9, 10]


def test_extents_of_a_program_that_is_judged(tmp_path, machine):
    out, program = checked(tmp_path, SLOT, machine=machine)
    assert (
        program["extents_mm"] == {"min": pytest.approx([-10, 30, -4]), "max": pytest.approx([110, 30, -4])}
        and "it feeds from X-10 Y30 Z-4 to X110 Y30 Z-4" in out
    )


def test_a_comment_that_describes_another_tool_is_said_of_a_program_with_a_stock_too(tmp_path, machine):
    out, program = checked(
        tmp_path, SLOT.replace(STOCK, STOCK + "(T1 D=8. CR=0. - ZMIN=-4. - flat end mill)\n"), machine=machine
    )
    assert (
        "tool 1 has 6 mm in the tool table and 8 mm in a comment; the tool table counts" in out
        and program["tools"][0]["diameter_mm"] == 6.0
    )
