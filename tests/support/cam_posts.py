# SPDX-License-Identifier: GPL-2.0-or-later
"""The post-processors of docs/user/cam.md, run with stand-ins for FreeCAD and Fusion.  Called by test_cam_posts.py and
test_cam_posts_run.py."""

import json
import subprocess
import sys
import types
from unittest import mock

from support import ROOT

BOX = {
    "XMin": -1.0,
    "YMin": -1.0,
    "ZMin": -1.0,
    "XMax": 61.0,
    "YMax": 41.0,
    "ZMax": 11.0,
}  # the block of freecad_profile.ngc and 1 mm around it
PROFILE = (
    ROOT / "tests/support/freecad_profile.ngc"
)  # written by FreeCAD 0.20.2's own post: a profile around a block 60 x 40 x 10 mm
CUT_MM3 = (62 * 42 - 60 * 40) * 12  # all of the stock around the block goes


def block(language):
    """The code block of the page."""
    return (ROOT / "docs/user/cam.md").read_text().split(f"```{language}\n")[1].split("```")[0]


def freecad(path, text, arguments=""):
    """-> what the post for FreeCAD writes into a file, of a program that FreeCAD's own post has written."""
    job = types.SimpleNamespace(
        Stock=types.SimpleNamespace(Shape=types.SimpleNamespace(BoundBox=types.SimpleNamespace(**BOX)))
    )
    own = mock.Mock(return_value=text)
    modules = {
        "PathScripts": types.SimpleNamespace(
            PathUtils=types.SimpleNamespace(findParentJob=lambda one: job if one == "profile" else None)
        ),
        "PathScripts.post": types.SimpleNamespace(linuxcnc_post=types.SimpleNamespace(export=own)),
    }
    with mock.patch.dict(sys.modules, modules):
        post = {}
        exec(compile(block("python"), "chipwise_post.py", "exec"), post)  # noqa: S102
        found = post["export"](["fixture", "profile"], str(path), arguments)
    own.assert_called_once_with(["fixture", "profile"], "-", arguments)
    return found


STAND_INS = """
var lines = [];
function getWorkpiece() { return {lower:{x:BOX[0], y:BOX[1], z:BOX[2]}, upper:{x:BOX[3], y:BOX[4], z:BOX[5]}}; }
function createFormat(how) { return {format:function (value) { return String(Number(value.toFixed(how.decimals))); }}; }
function writeln(line) { lines.push(line); }
function writeBlock() { lines.push(Array.prototype.slice.call(arguments).join(" ")); }
"""


def fusion(node, box):
    """-> lines of chipwiseBegin(), lines of chipwiseEnd(); box: as getWorkpiece() has it, in units of the program."""
    script = (
        f"var BOX = {json.dumps(box)};\n{STAND_INS}\n{block('javascript')}\n"
        f"chipwiseBegin(); lines.push('|'); chipwiseEnd(); "
        "console.log(JSON.stringify(lines));"
    )
    lines = json.loads(subprocess.run([node, "-e", script], check=True, text=True, capture_output=True).stdout)
    at = lines.index("|")
    return lines[:at], lines[at + 1 :]
