# SPDX-License-Identifier: GPL-2.0-or-later
"""Comments that chipwise reads, and those that are remarks."""

import tracemalloc

import pytest

from chipwise.program import comments
from chipwise.turning import profile, request


@pytest.mark.parametrize(
    "text, found",
    [
        ("G24 D0.5 (SURFACE,FILE=a.stl)", ["FILE=a.stl"]),
        ("( surface , FILE=a.stl,X=1 ) (SURFACE,FILE=b.stl)", [" FILE=a.stl,X=1 ", "FILE=b.stl"]),
        ("; (SURFACE,FILE=a.stl)", []),
        ("(SURFACE,FILE=a.stl) ; before: (SURFACE,FILE=b.stl)", ["FILE=a.stl"]),
        ("(a ; within a comment) (SURFACE,FILE=a.stl)", ["FILE=a.stl"]),
        ("(was: SURFACE,FILE=a.stl)", []),
        ("(Surface of the part)", []),
        ("(SURFACES,FILE=a.stl)", []),
        ("(SURFACE,FILE=a.stl", []),
        ("; remark\n(SURFACE,FILE=a.stl)\n", ["FILE=a.stl"]),
        ("(not\nclosed) (SURFACE,FILE=a.stl)", ["FILE=a.stl"]),
    ],
)
def test_insides(text, found):
    assert comments.insides(text, "SURFACE") == found


def test_without_a_comma():
    assert comments.insides("(THREAD PITCH=1.5) (Thread) (THREADS,X) ; (THREAD,PITCH=2)", "THREAD", comma=False) == [
        " PITCH=1.5",
        "",
    ]


def test_a_turned_part_has_the_blank_and_the_tools_that_are_no_remarks():
    text = (
        "; (WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=80,ZMIN=-60,ZMAX=1)\n"
        "(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=1)\n"
        "(LATHE,ROUGH=1) ; (LATHE,ROUGH=7)\n"
    )
    assert profile.blank_of_comment(text, 1.0).outside[0].xr == pytest.approx(15.0)
    assert request.read_roles(text) == {"rough": (1,)}


LINES = [b"g1 X1.0\ty2 (a ; remark) z3\r\n", b"; (another)\n", b"\n", b"(not closed G84\n", b"x4 ) y5\n"]
BARE = [b"G1X1.0Y2Z3\n", b"\n", b"\n", b"(NOTCLOSEDG84\n", b"X4)Y5\n"]


@pytest.mark.parametrize("block", [1, 7, 30, 1 << 20])
def test_bare_is_the_same_in_blocks_of_any_size(monkeypatch, block):
    monkeypatch.setattr(comments, "BLOCK", block)
    for last in (b"", b"m2 ", b"m2 (end)"):
        assert comments.bare(b"".join(3 * LINES) + last) == b"".join(3 * BARE) + (b"M2" if last else b"")
    assert comments.bare(b"") == b""


def test_a_long_program_becomes_bare_in_a_small_multiple_of_its_size():
    """One substitution in the whole of it takes thirty times as much, so that the set-up of a million lines would take
    700 MB."""
    text = 100_000 * b"G1 X1.0 Y2.0 (a) Z3\n"
    tracemalloc.start()
    try:
        assert len(comments.bare(text)) == 100_000 * len(b"G1X1.0Y2.0Z3\n")
        assert tracemalloc.get_traced_memory()[1] < 5 * len(text)
    finally:
        tracemalloc.stop()
