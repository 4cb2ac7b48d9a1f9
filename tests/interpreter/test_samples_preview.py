# SPDX-License-Identifier: GPL-2.0-or-later
"""Every program of nc_files previews without an error on the machines it is for.

All screens preview with LinuxCNC's module gcode (AXIS by rs274.interpret, gmoccapy, QtVCP and touchy by gremlin), which
runs the whole program at once: no input is read, and #5399 stays 0.  An error there is a dialog at each start, for
LinuxCNC opens [DISPLAY]OPEN_FILE.  rs274 is the second interpreter.
"""

import functools
import json
import os
import subprocess

import pytest

from chipwise.ini import section_of, unit_mm
from chipwise.program import rs274
from chipwise.machine.sample_folder import sample_files
from support import ROOT

PYTHON = "/usr/bin/python3"
MASK = {"lathe": 0b101, "robot": 0b111111}
MACHINES = {
    "turning_shaft": ("lathe", "lathe_inch"),
    "turning_": ("lathe",),
    "slots": ("mill", "mill_inch"),
    "stations": ("robot",),
    "tracer/follow": ("tracer_slave",),
    "tracer/back": ("tracer", "tracer_slave"),
    "tracer/trace": ("tracer",),
    "": ("mill",),
}


@functools.lru_cache(maxsize=None)
def files():
    return sample_files(str(ROOT), str(ROOT))


def programs():
    for name in sorted(files()):
        if name.endswith(".ngc") and "/patterns/" not in name:  # there are subs: pattern.ngc runs them
            short = name.removeprefix("nc_files/").removesuffix(".ngc")
            for machine in next(found for start, found in MACHINES.items() if short.startswith(start)):
                yield short, machine


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder as `chipwise new-config` makes it."""
    where = tmp_path_factory.mktemp("machine")
    for name, content in files().items():
        (where / name).parent.mkdir(exist_ok=True)
        (where / name).write_bytes(content)
    return where


def previewed(program, ini, home):
    """-> (error, number of moves) of LinuxCNC's preview."""
    lines = ini.read_text().splitlines()
    (home / "preview.var").write_text("5161 0\n")
    done = subprocess.run(
        [
            PYTHON,
            ROOT / "tests" / "support" / "preview_probe.py",
            program,
            repr(1 / unit_mm(section_of(lines, "TRAJ")["LINEAR_UNITS"])),
            section_of(lines, "EMCIO")["TOOL_TABLE"],
            home / "preview.var",
        ],
        cwd=ini.parent,
        text=True,
        check=True,
        capture_output=True,
        env={
            **os.environ,
            "HOME": str(home),
            "INI_FILE_NAME": str(ini),
            "AXIS_MASK": str(MASK.get(ini.stem.partition("_")[0], 0b111)),
        },
    )
    result = json.loads(done.stdout.splitlines()[-1])
    kinds = [call[0] for call in result["calls"]]
    return result["error"], sum(kind in ("rapid", "feed", "arc") for kind in kinds)


@pytest.mark.parametrize("program, machine", programs())
def test_it_previews_clean(program, machine, folder, tmp_path):
    path, ini = folder / "nc_files" / (program + ".ngc"), folder / (machine + ".ini")
    error, moves = previewed(path, ini, tmp_path)
    assert error == ""
    assert moves or program in ("tracer/back", "tracer/follow"), "nothing moves"
    if not machine.endswith("_inch"):
        done = rs274.run(path, ini, capture_output=True)
        assert done.returncode == 0, done.stdout[-500:] + done.stderr


def test_an_abort_without_a_guard_is_seen(folder, tmp_path):
    """As the tracer's programs were: the input is not read in a preview."""
    path = tmp_path / "abort.ngc"
    path.write_text("M66 P2 L0\no100 if [#5399 EQ 0]\n  (ABORT, never)\no100 endif\nM2\n")
    assert "never" in previewed(path, folder / "tracer.ini", tmp_path)[0]
