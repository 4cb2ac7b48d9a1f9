# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs in G93, G94 and G95 through LinuxCNC's interpreter, with and without REMAP = F (docs/user/codes.md)."""

import re

import pytest

from support.canon import run_preview, run_rs274, write_ini

MOVES = [(2.0 * (n % 2), 0.5 * n, 60 + n) for n in range(60)]
INVERSE = "\n".join(
    ["G21 G90 G17 G61", "S600 M3", "G0 X0 Y-1 Z5", "G93"]
    + [f"G1 X{x} Y{y} F{f}" for x, y, f in MOVES]
    + ["G94 F600", "G1 X10", "G95 F0.5", "G1 X20", "M2", ""]
)
FIRST = 5  # line of the first of MOVES


def without_f(tmp_path):
    """The INI file as docs/user/codes.md has the user change it."""
    ini = write_ini(tmp_path)
    text, count = re.subn(r"(?m)^REMAP = F ", "#REMAP = F ", ini.read_text())
    assert count == 1
    ini.write_text(text)
    return ini


def test_g93_without_f_remapped(tmp_path):
    """60 moves: all made, each under its own line, each F as written (inverse minutes times the length)."""
    trace = run_preview(INVERSE, ini=without_f(tmp_path))
    assert trace.error == ""
    assert trace.lines[-62:] == [*range(FIRST, FIRST + 60), FIRST + 61, FIRST + 63]
    at = (0.0, -1.0)
    for feed, (x, y, f) in zip(trace.feeds[-62:-2], MOVES):
        assert feed == pytest.approx(f * ((x - at[0]) ** 2 + (y - at[1]) ** 2) ** 0.5, rel=1e-4)
        at = (x, y)
    assert trace.feeds[-2] == pytest.approx(600)
    assert run_rs274(INVERSE, ini=without_f(tmp_path)).error == ""


def test_linuxcnc_still_loses_a_level():
    """Why the line has to go.  Where this passes no longer (skips), LinuxCNC is mended and the docs can say so."""
    error = run_rs274(INVERSE).error
    if not error:
        pytest.skip("this LinuxCNC takes F under G93 with F remapped")
    assert error == "maximum nesting of remapped blocks exceeded"


def test_no_ceiling_without_f_remapped(tmp_path):
    """M251 with E is refused; without E, P1 and P3, it is not."""
    ini = without_f(tmp_path)
    box, tool = "T1 M6\nM250 P0 Q0 R-10 I60 J40 K10\n", {1: 6.0}
    for line in ("M251 Q6 P2 E3000", "M251 Q6 P3 R3 E3000"):
        mode = line[8:10]
        assert run_preview("G21\n" + box + line + "\nM2\n", tools=tool, ini=ini).error == (
            f"chipwise: M251: mode {mode} with a ceiling E replaces F, and F is not remapped; add REMAP = F argspec=N "
            f"python=feed "
            "to [RS274NGC] (not for programs with G93), or use P1"
        ), line
        assert run_preview("G21\n" + box + line + "\nM2\n", tools=tool).error == ""
    for line in ("M251 Q6", "M251 Q6 P3 R3"):
        assert run_preview("G21\n" + box + line + "\nM2\n", tools=tool, ini=ini).error == ""


def test_no_volumetric_feed_under_a_jerk_limit(tmp_path):
    """LinuxCNC 2.10's planner leaves the path when the feed changes in a blend (docs/design/feed_law.md); M252 and the
    cycles stay."""
    ini = write_ini(tmp_path)
    machine = ini.read_text()
    assert machine.count("[TRAJ]\n") == 1
    box, tool = "G21\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\n", {1: 6.0}
    for kind, refused in (("1", True), ("0", False)):
        ini.write_text(machine.replace("[TRAJ]\n", f"[TRAJ]\nPLANNER_TYPE = {kind}\n"))
        for line in ("M251 Q6", "M251 Q6 P2 E3000"):
            found = run_preview(box + line + "\nM2\n", tools=tool, ini=ini).error
            assert (
                found.startswith("chipwise: M251: LinuxCNC's planner of [TRAJ]PLANNER_TYPE = 1 leaves the path")
                == refused
                and bool(found) == refused
            ), found
        assert run_preview(box + "M252\nM2\n", tools=tool, ini=ini).error == ""
