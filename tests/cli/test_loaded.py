# SPDX-License-Identifier: GPL-2.0-or-later
"""The messages about G93 and M73 when a program is opened."""

import os

import pytest

from chipwise.monitor.loaded_program import LoadedProgram, lines_of
from support.computing import least_s


@pytest.mark.parametrize(
    "line, found",
    [
        ("G93", True),
        ("g 9 3 G1 X1 F2", True),
        ("N5G1G093X1F3", True),
        ("(G93)", False),
        ("; G93", False),
        ("G92 X3", False),
        ("G93.1", False),
        ("G930", False),
        ("G1 X93", False),
        ("(a) G93 (b)", True),
        ("M93", False),
        ("G9 X3", False),
    ],
)
def test_lines(tmp_path, line, found):
    path = tmp_path / "a.ngc"
    path.write_text(f"G21\n{line}\nM2\n")
    assert lines_of(str(path)) == ({"G93": 2} if found else {})


@pytest.mark.parametrize(
    "line, found",
    [
        ("M73", True),
        ("m 7 3", True),
        ("N5M073(a)", True),
        ("(M73)", False),
        ("; M73", False),
        ("M72", False),
        ("M730", False),
        ("G73 X1", False),
        ("G1 X73", False),
    ],
)
def test_lines_with_m73(tmp_path, line, found):
    path = tmp_path / "a.ngc"
    path.write_text(f"G21\n{line}\nM2\n")
    assert lines_of(str(path)) == ({"M73": 2} if found else {})


def test_both_are_said(tmp_path):
    path = tmp_path / "a.ngc"
    path.write_text("M73\nG93\nM73\n")
    said = []
    LoadedProgram(said.append, True).follow(str(path))
    assert [text.partition(",")[0] for text in said] == ["a.ngc uses G93 (line 2)", "a.ngc uses M73 (line 1)"]


def test_said_once_for_each_program(tmp_path):
    said = []
    program = LoadedProgram(said.append, True)
    path = tmp_path / "a.ngc"
    path.write_text("G93\n")
    for _ in range(3):
        program.follow(str(path))
    assert len(said) == 1 and "a.ngc uses G93 (line 1)" in said[0] and "REMAP = F" in said[0]
    path.write_text("G21\nG93\n")
    os.utime(path, ns=(1, 1))
    program.follow(str(path))
    program.follow("")
    program.follow(str(path))
    assert [text.count("line 2") for text in said] == [0, 1, 1]
    other = LoadedProgram(said.append, False)
    other.follow(str(path))
    assert len(said) == 3


def test_hostile_files(tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    large = tmp_path / "large.ngc"
    large.write_bytes(b"G1 X93.5 Y9 Z73\n" * 1_000_000)
    binary = tmp_path / "binary"
    binary.write_bytes(os.urandom(100_000).replace(b"3", b"x"))

    def find():
        for path in (fifo, "/dev/zero", large, binary, tmp_path, tmp_path / "none", "/dev/null", "a\0b"):
            assert lines_of(str(path)) == {}

    assert least_s(find, 2.0)[1] < 2.0
