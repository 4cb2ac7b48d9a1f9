# SPDX-License-Identifier: GPL-2.0-or-later
"""The program that is open, while LinuxCNC's status has the file of a sub (loaded.MainProgram)."""

import types

from chipwise.program.loaded import MainProgram


def test_a_sub_in_a_file_of_its_own_is_not_another_program():
    """While the interpreter is in it, and in the body of a remapped M6; once it is back, or at rest, the status has the
    program."""
    main, seen = MainProgram(), []
    for idle, file, level in (
        (True, "one.ngc", 0),
        (False, "sub.ngc", 1),
        (False, "deeper.ngc", 2),
        (False, "one.ngc", 0),
        (False, "sub.ngc", 1),
        (False, "two.ngc", 0),
        (True, "three.ngc", 1),
        (True, "", 0),
        (False, "sub.ngc", 1),
    ):
        seen.append(main.of(types.SimpleNamespace(file=file, call_level=level), idle))
    assert seen == ["one.ngc"] * 5 + ["two.ngc", "three.ngc", "", "sub.ngc"]
    assert MainProgram().of(types.SimpleNamespace(file="one.ngc"), False) == "one.ngc"


def test_the_file_of_the_move_before_is_not_the_program():
    """LinuxCNC 2.10 has it until the first move of a program begins; the same program may be opened again."""
    main, seen = MainProgram(), []
    for idle, file, level in (
        (True, "", 0),
        (True, "one.ngc", 0),
        (False, "", 0),
        (False, "one.ngc", 0),
        (True, "two.ngc", 0),
        (False, "one.ngc", 0),
        (False, "one.ngc", 1),
        (False, "two.ngc", 1),
        (False, "sub.ngc", 1),
        (False, "one.ngc", 0),  # opened and begun between two looks
        (True, "one.ngc", 0),
    ):
        seen.append(main.of(types.SimpleNamespace(file=file, call_level=level), idle))
    assert seen == ["", *["one.ngc"] * 3, *["two.ngc"] * 5, "one.ngc", "one.ngc"]
