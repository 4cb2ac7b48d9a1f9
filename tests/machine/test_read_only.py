# SPDX-License-Identifier: GPL-2.0-or-later
"""A sample machine that is started where nothing can be written: said before anything else, with the remedy; LinuxCNC
itself says nothing."""

import os
import subprocess

import pytest

from chipwise.headless import runner

pytestmark = pytest.mark.machine

WORDS = (
    "cannot be written, so work offsets, tools and stock are forgotten at the end; make a folder of your own with "
    "chipwise new-config"
)


@pytest.mark.parametrize("ini", ["mill_headless.ini", "lathe_headless.ini", "robot_headless.ini"])
def test_it_is_the_first_sentence(ini):
    """Without a program the display ends at once."""
    environment = {name: value for name, value in os.environ.items() if name not in ("CHIPWISE_PROGRAM", "DISPLAY")}
    done = subprocess.run(
        [runner.SANDBOX, "--timeout", "600", "--", "sh", "-c", f"cd configs && chmod a-w . && linuxcnc -r {ini}"],
        cwd=runner.ROOT,
        env=environment,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    ours = [line for line in done.stdout.splitlines() if "chipwise: " in line or "chipwise-headless: " in line]
    assert ours and ours[0] == f"chipwise: {runner.ROOT}/configs {WORDS}", done.stdout
    assert len([line for line in ours if WORDS in line]) == 1 and "CHIPWISE_PROGRAM" in done.stdout, done.stdout
