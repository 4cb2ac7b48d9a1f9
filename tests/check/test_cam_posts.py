# SPDX-License-Identifier: GPL-2.0-or-later
"""The post-processors of docs/user/cam.md: chipwise check understands what they write.
tests/machine/test_cam_posts_run.py runs it."""

import shutil
import subprocess

import pytest

from support import cam_posts
from support.check_runs import chipwise_check

NODE, FREECAD = shutil.which("node"), shutil.which("freecadcmd")
TEXT = cam_posts.PROFILE.read_text()
ADDED = ["M250", "M251 P1 Q12", "M252"]


def in_inches(text):
    """The profile in inches, as FreeCAD writes it with --inches."""
    return (
        "\n".join(
            " ".join(
                f"{word[0]}{float(word[1:]) / 25.4:.4f}" if word[:1] in "XYZIJF" else word for word in line.split()
            )
            for line in text.replace("G21", "G20").splitlines()
        )
        + "\n"
    )


def judged(tmp_path, program):
    """chipwise check has no findings, and the tool cuts the stock around the block and no more."""
    status, said, _, found = chipwise_check(tmp_path, {"a.ngc": program})
    assert status == 0 and "no findings" in said, said
    (tool,) = found["programs"][0]["tools"]
    assert tool["volume_mm3"] == pytest.approx(
        cam_posts.CUT_MM3, rel=0.01
    )  # of 12 mm height and 1/10000 inch in the words
    assert tool["peak_rate_mm3_min"] < 12000  # Q12 does not slow it down


@pytest.mark.parametrize("unit", ["mm", "inch"])
def test_freecad(tmp_path, unit):
    text, arguments = (TEXT, "--no-header") if unit == "mm" else (in_inches(TEXT), "--inches")
    program = cam_posts.freecad(tmp_path / "posted.ngc", text, arguments)
    assert (tmp_path / "posted.ngc").read_text() == program
    assert [line for line in program.splitlines() if line not in text.splitlines()][1:] == ADDED
    judged(tmp_path, program)


def test_freecad_nothing_to_write(tmp_path):
    assert cam_posts.freecad(tmp_path / "posted.ngc", None) is None
    assert not (tmp_path / "posted.ngc").exists()


@pytest.mark.skipif(not NODE, reason="node is not installed")
@pytest.mark.parametrize("per_unit", [1.0, 25.4])
def test_fusion(tmp_path, per_unit):
    """The lines, between those of a program for the same block."""
    begin, end = cam_posts.fusion(NODE, [value / per_unit for value in (-1, -1, -1, 61, 41, 11)])
    assert begin[1:] + end == ADDED
    units, text = ("G21\n", TEXT) if per_unit == 1.0 else ("G20\n", in_inches(TEXT))
    head, rest = text.split(units)
    body, tail = rest.split("M05\n")
    judged(tmp_path, "\n".join([head + units.strip(), *begin, body.strip(), *end, "M05", tail]))


JOB = """
import sys
sys.path.insert(0, {folder!r})
import FreeCAD, Part
import PathScripts.PathJob as PathJob, PathScripts.PathProfile as PathProfile
import chipwise_post
document = FreeCAD.newDocument('t')
box = document.addObject('Part::Box', 'Box')
box.Length, box.Width, box.Height = 60, 40, 10
document.recompute()
job = PathJob.Create('Job', [box], None)
controller = job.Tools.Group[0]
controller.ToolNumber, controller.SpindleSpeed = 1, 8000
controller.HorizFeed, controller.VertFeed = '600 mm/min', '300 mm/min'
controller.Tool.Diameter = 6
PathProfile.Create('Profile').StepDown = 5
document.recompute()
chipwise_post.export([controller] + list(job.Operations.Group), {folder!r} + '/posted.ngc', '--no-comments --no-header')
"""


@pytest.mark.skipif(not FREECAD, reason="FreeCAD is not installed")
def test_freecad_itself(tmp_path):
    """What FreeCAD writes today: Debian 12 has 0.20."""
    (tmp_path / "chipwise_post.py").write_text(cam_posts.block("python"))
    (tmp_path / "job.py").write_text(JOB.format(folder=str(tmp_path)))
    done = subprocess.run(
        [FREECAD, tmp_path / "job.py"],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
        env={"HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen", "PATH": "/usr/bin:/bin"},
    )
    assert (tmp_path / "posted.ngc").exists(), done.stdout[-2000:] + done.stderr[-2000:]
    program = (tmp_path / "posted.ngc").read_text()
    assert [
        line.rstrip() for line in program.splitlines() if "WORKPIECE" not in line and line not in ADDED
    ] == TEXT.splitlines()
    judged(tmp_path, program)
