# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise.headless.runner: the command that starts LinuxCNC, with a LinuxCNC that only shows the INI file."""

import os
import subprocess

import pytest

from chipwise.headless import runner

INI = "[EMCMOT]\nCOMM_TIMEOUT = 30\n\n[CHIPWISE]\nCELL = 1\n"


@pytest.fixture
def shown(tmp_path):
    """shown(settings, speed): {(section, key): value} that LinuxCNC reads, of two equal keys the first."""
    program, ini = tmp_path / "linuxcnc", tmp_path / "own.ini"
    program.write_text('#!/bin/sh\n[ "$1" = -r ] && cat "$2"\n')
    program.chmod(0o755)
    ini.write_text(INI)

    def show(settings, speed):
        done = subprocess.run(
            runner.start_command(str(ini), settings, speed),
            env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
            text=True,
            capture_output=True,
            check=True,
        )
        found, section = {}, ""
        for line in done.stdout.splitlines():
            section = line.strip("[]") if line.startswith("[") else section
            if "=" in line:
                found.setdefault((section, line.split(" = ")[0]), line.split(" = ")[1])
        return found

    return show


@pytest.mark.parametrize("settings, cell", [({}, "1"), ({"CELL": "0.5", "SHADOW": "no"}, "0.5")])
@pytest.mark.parametrize("speed, timeout", [(1.0, "30"), (5.0, "300"), (2.5, "150")])
def test_motion_has_as_much_real_time_however_fast_the_clock_is(shown, settings, cell, speed, timeout):
    found = shown(settings, speed)
    assert found["EMCMOT", "COMM_TIMEOUT"] == timeout and found["CHIPWISE", "CELL"] == cell
    assert (("CHIPWISE", "SHADOW") in found) == bool(settings)
