# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check on programs of a test, and a mill with tools for it.  Called by tests/check/test_check.py and
test_check_unusable.py."""

import json
import os

from support import ROOT, forked
from support.forked import CHIPWISE

HEAD = "G21 G90 G17 G40 G49 G80 G94\n"
STOCK = "M250 P0 Q0 R-20 I100 J60 K20\n"
SLOT = HEAD + STOCK + "T1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\nG1 X110 F400\nG0 Z5\nM2\n"  # D6, flutes 20
TOOLS = (
    "[tool.1]\nshape = 'flat'\nflute_length = 10\n[tool.2]\nshape = 'flat'\n[tool.5]\nflute_length = 50\n"
    "stick_out = 15\n"
    "holder_diameter = 30\n[tool.6]\nflute_length = 30\nmax_rate = 5\n"
)
TABLE = "T1 P1 D6 Z30\nT2 P2 D6\nT3 P3 D6\nT4 P4\nT5 P5 D6\nT6 P6 D10\n"


def chipwise_check(tmp_path, programs, *options, machine=None, environment=None):
    """-> (exit status, stdout, stderr, JSON)."""
    paths = []
    for name, text in programs.items():
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        paths.append(str(path))
    ini = ["--ini", str(machine)] if machine else []
    done = forked.run(
        [CHIPWISE, "check", *paths, "--json", str(tmp_path / "out.json"), *ini, *options],
        timeout=300,
        env={**os.environ, **(environment or {})},
    )
    assert "Traceback" not in done.stdout + done.stderr
    found = tmp_path / "out.json"
    return done.returncode, done.stdout, done.stderr, json.loads(found.read_text()) if found.exists() else None


def mill_with_tools(tmp_path):
    """INI of a mill with the tools above."""
    folder = tmp_path / "machine"
    folder.mkdir()
    (folder / "tools.toml").write_text(TOOLS)
    (folder / "mill.tbl").write_text(TABLE)
    (folder / "subs").mkdir()
    with open(os.path.join(ROOT, "configs", "mill.ini"), encoding="utf-8") as file:
        text = file.read()
    remap = os.path.join(ROOT, "remap")
    text = (
        text.replace("TOPLEVEL = remap/toplevel.py", f"TOPLEVEL = {remap}/toplevel.py")
        .replace("PATH_PREPEND = remap", f"PATH_PREPEND = {remap}")
        .replace("SUBROUTINE_PATH = nc_files:../nc_files", "SUBROUTINE_PATH = subs")
    )
    (folder / "mill.ini").write_text(text)
    return folder / "mill.ini"
