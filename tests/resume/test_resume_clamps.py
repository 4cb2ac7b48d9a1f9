# SPDX-License-Identifier: GPL-2.0-or-later
"""M256 of the part that is done: it is in force again, and the approach keeps away from the clamps as they are when the program goes on."""
from support.resume_programs import SUBS
from support.resume_stop import Stop

WITH = SUBS.replace("T1 M6\n", "M256 P2\nT1 M6\n", 1)
FAR = "[set_up.2.clamp.jaw]\nbox = [-40.0, 0.0, -20.0, -20.0, 80.0, 5.0]\n"


def over(tip):
    """A clamp that has been moved to where the tool stopped."""
    return f"[set_up.2.clamp.jaw]\nbox = [{tip[0] - 2:.3f}, {tip[1] - 2:.3f}, -20.0, {tip[0] + 2:.3f}, {tip[1] + 2:.3f}, 5.0]\n"


def test_the_set_up_is_in_force_again_and_a_moved_clamp_is_refused(tmp_path):
    stop = Stop.__new__(Stop)
    (tmp_path / "mill").mkdir()
    clamps = tmp_path / "mill" / "clamps.toml"
    clamps.write_text(FAR)
    stop.__init__(tmp_path, WITH)
    made = stop.made()
    lines = made.data.decode().splitlines()
    head = lines[lines.index("M254 P9"):]
    assert head[1] == "M256 P2" and head[2].startswith("T1 M6") and lines.count("M256 P2") == 1, lines
    assert "M256 P2 puts the clamps of that set-up in force again." in made.said
    clamps.write_text(over(stop.run.points[stop.index]))
    before = sorted(stop.ini.parent.rglob("*"))
    status, said, errors = stop.resume("-o", str(tmp_path / "out.ngc"))
    assert status == 2 and not said and "would come nearer than 1 mm to clamp jaw of set-up 2; take the clamp away" in errors, errors
    assert sorted(stop.ini.parent.rglob("*")) == before and not (tmp_path / "out.ngc").exists()
    clamps.write_text(FAR.replace("set_up.2", "set_up.3"))
    status, said, errors = stop.resume("--plan")
    assert status == 2 and not said and "there is no set-up P2 of clamps" in errors, errors


def test_without_m256_nothing_is_put_in_force(tmp_path):
    assert b"M256" not in Stop(tmp_path).made().data
