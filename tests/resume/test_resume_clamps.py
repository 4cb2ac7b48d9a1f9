# SPDX-License-Identifier: GPL-2.0-or-later
"""M256 of the part that is done: it is in force again, and the approach keeps away from the clamps as they are when the
program goes on.  CLAMP comments of that part are where they were."""

import pytest

from chipwise.clamps.clamp import Clamp
from chipwise.monitor import comment_process
from support.resume_programs import SUBS
from support.resume_stop import Stop
from support.scenes import SCENE

pytestmark = pytest.mark.usefixtures("forked_readers")

WITH = SUBS.replace("T1 M6\n", "M256 P2\nT1 M6\n", 1)
FAR = "[set_up.2.clamp.jaw]\nbox = [-40.0, 0.0, -20.0, -20.0, 80.0, 5.0]\n"


def over(tip):
    """A clamp that has been moved to where the tool stopped."""
    return (
        f"[set_up.2.clamp.jaw]\nbox = [{tip[0] - 2:.3f}, {tip[1] - 2:.3f}, -20.0, {tip[0] + 2:.3f}, "
        f"{tip[1] + 2:.3f}, 5.0]\n"
    )


def test_the_set_up_is_in_force_again_and_a_moved_clamp_is_refused(tmp_path):
    stop = Stop.__new__(Stop)
    (tmp_path / "mill").mkdir()
    clamps = tmp_path / "mill" / "clamps.toml"
    clamps.write_text(FAR)
    stop.__init__(tmp_path, WITH)
    made = stop.made()
    lines = made.data.decode().splitlines()
    head = lines[lines.index("M254 P9") :]
    assert head[1] == "M256 P2" and head[2].startswith("T1 M6") and lines.count("M256 P2") == 1, lines
    assert "M256 P2 puts the clamps of that set-up in force again." in made.said
    clamps.write_text(over(stop.run.points[stop.index]))
    before = sorted(stop.ini.parent.rglob("*"))
    status, said, errors = stop.resume("-o", str(tmp_path / "out.ngc"))
    assert (
        status == 2
        and not said
        and "would come nearer than 1 mm to clamp jaw of set-up 2; take the clamp away" in errors
    ), errors
    assert sorted(stop.ini.parent.rglob("*")) == before and not (tmp_path / "out.ngc").exists()
    clamps.write_text(FAR.replace("set_up.2", "set_up.3"))
    status, said, errors = stop.resume("--plan")
    assert status == 2 and not said and "there is no set-up P2 of clamps" in errors, errors


def test_without_m256_nothing_is_put_in_force(tmp_path):
    assert b"M256" not in Stop(tmp_path).made().data


BOX = "(CLAMP,BOX,XMIN=-3,YMIN=-2.5,ZMIN=-1,XMAX=-2,YMAX=3,ZMAX=0.25)\n"
POST = "(CLAMP,CYLINDER,X=-50,Y=75,ZMIN=-20,ZMAX=8,DIAMETER=10)\n"
HEAD = "G21 G90 G17 G40 G49 G54 G80 G94\n"
COMMENTS = {
    BOX + HEAD: 1,  # in the head of the program, in mm
    HEAD + "G20\n" + BOX + "G0 Z5\nG21\n" + POST: 2,  # in inches, behind other units
    HEAD + "G55\n" + BOX + "G0 Z5\nG54\n" + POST: 2,  # in another coordinate system
    HEAD + BOX + "G0 Z5\nM256 P0\n" + POST: 1,  # M256 takes the place of the first
}


def in_force(stop, path):
    """Clamps of the comments of a program once it has come to an end."""
    rows = comment_process.answer({"ini": str(stop.ini), "program": str(path), "scene": SCENE}, str(path.parent))[
        "clamps"
    ]
    last = path.read_text().count("M256")
    return [Clamp.of_row(row) for after, *row in rows if after == last]


@pytest.mark.parametrize("head", COMMENTS)
def test_comments_of_the_part_that_is_done(tmp_path, head):
    """As LinuxCNC's interpreter places them: in the new program as in the one before."""
    stop = Stop.__new__(Stop)
    (tmp_path / "mill").mkdir()
    (tmp_path / "mill" / "mill.var").write_text("5161 0\n5241 -30\n5242 12\n5243 3\n")
    stop.__init__(tmp_path, SUBS.replace(HEAD, head, 1))
    out = tmp_path / "out.ngc"
    out.write_bytes(stop.made().data)
    before, now = in_force(stop, stop.program), in_force(stop, out)
    assert len(before) == len(now) == COMMENTS[head] and all(
        any(one.is_where(other) for other in now) for one in before
    ), (before, now, out.read_text())


def test_a_comment_that_cannot_be_placed_is_named(tmp_path):
    made = Stop(tmp_path, SUBS.replace(HEAD, HEAD + POST + "G0 Z5\nG10 L2 P2 X5\n", 1)).made()
    assert (
        "The clamp of line 13 is not kept: line 15 changes the work offset." in made.said and b"CLAMP" not in made.data
    )
