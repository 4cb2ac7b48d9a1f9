# SPDX-License-Identifier: GPL-2.0-or-later
"""Comments that chipwise reads, and those that are remarks."""
import pytest

from chipwise import comments
from chipwise.turning import profile, request


@pytest.mark.parametrize("text, found", [
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
    ("(not\nclosed) (SURFACE,FILE=a.stl)", ["FILE=a.stl"])])
def test_insides(text, found):
    assert comments.insides(text, "SURFACE") == found


def test_without_a_comma():
    assert comments.insides("(THREAD PITCH=1.5) (Thread) (THREADS,X) ; (THREAD,PITCH=2)", "THREAD", comma=False) == [" PITCH=1.5", ""]


def test_a_turned_part_has_the_blank_and_the_tools_that_are_no_remarks():
    text = ("; (WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=80,ZMIN=-60,ZMAX=1)\n(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=1)\n"
            "(LATHE,ROUGH=1) ; (LATHE,ROUGH=7)\n")
    assert profile.blank_of_comment(text, 1.0).outside[0].xr == pytest.approx(15.0)
    assert request.read_roles(text) == {"rough": (1,)}
