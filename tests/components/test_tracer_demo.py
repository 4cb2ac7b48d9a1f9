# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL file of docs/user/tracer.md as it is printed there: it traces the ball to its last line."""
import re

import pytest

from support import ROOT, halrig

LAST_LINE, DONE = 11, 9         # 5 mm in pick feeds of 0.5 mm; the state


def numbers(done):
    """What getp has printed."""
    return [int(line) for line in done.stdout.splitlines() if line.isdigit()]


@pytest.mark.xdist_group("hal_tracer_demo")
def test_the_example_of_the_manual(tmp_path):
    text = (ROOT / "docs/user/tracer.md").read_text()
    blocks = re.findall(r"(?ms)^```\n(.*?)^```", text)
    (tmp_path / "copy.hal").write_text(blocks[0] + f"loadusr -w sh {halrig.SUPPORT}/wait_pin tracer.0.done TRUE\n"
                                       "getp tracer.0.state\ngetp tracer.0.lines\n")
    done = halrig.halrun(["-f", "copy.hal"], tmp_path)
    assert done.returncode == 0 and numbers(done) == [DONE, LAST_LINE], done.stdout


def test_the_slave_of_the_manual(tmp_path):
    """Added to the first, before `start`: it follows."""
    text = (ROOT / "docs/user/tracer.md").read_text()
    first, second = re.findall(r"(?ms)^```\n(.*?)^```", text)[:2]
    (tmp_path / "copy.hal").write_text(first.replace("start\n", second + "start\n") + f"loadusr -w sh {halrig.SUPPORT}/wait_pin tracer.0.state 2\n"
                                       "getp tracer-slave.0.state\n")
    done = halrig.halrun(["-f", "copy.hal"], tmp_path)
    assert done.returncode == 0 and numbers(done) == [2], done.stdout
