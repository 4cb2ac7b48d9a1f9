# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL file of docs/user/tracer.md as it is printed there: it traces the ball to its last line."""

import re
import subprocess

import numpy as np
import pytest

from chipwise.stock import store
from support import ROOT, halrig

LAST_LINE, DONE = 11, 9  # 5 mm in pick feeds of 0.5 mm; the state


def numbers(done):
    """What getp has printed."""
    return [int(line) for line in done.stdout.splitlines() if line.isdigit()]


@pytest.mark.xdist_group("hal_tracer_demo")
def test_the_example_of_the_manual(tmp_path):
    text = (ROOT / "docs/user/tracer.md").read_text()
    blocks = re.findall(r"(?ms)^```\n(.*?)^```", text)
    (tmp_path / "copy.hal").write_text(
        blocks[0] + f"loadusr -w sh {halrig.SUPPORT}/wait_pin tracer.0.done TRUE\n"
        "getp tracer.0.state\ngetp tracer.0.lines\n"
    )
    done = halrig.halrun(["-f", "copy.hal"], tmp_path)
    assert done.returncode == 0 and numbers(done) == [DONE, LAST_LINE], done.stdout


def test_the_slave_of_the_manual(tmp_path):
    """Added to the first, before `start`: it follows."""
    text = (ROOT / "docs/user/tracer.md").read_text()
    first, *_, second = re.findall(r"(?ms)^```\n(.*?)^```", text)
    (tmp_path / "copy.hal").write_text(
        first.replace("start\n", second + "start\n") + f"loadusr -w sh {halrig.SUPPORT}/wait_pin tracer.0.state 2\n"
        "getp tracer-slave.0.state\n"
    )
    done = halrig.halrun(["-f", "copy.hal"], tmp_path)
    assert done.returncode == 0 and numbers(done) == [2], done.stdout


def test_a_recorded_trace_is_digitised(tmp_path):
    """The sampler of the manual, 4 s of it: the ball of 10 mm radius comes out."""
    text = (ROOT / "docs/user/tracer.md").read_text()
    first, sampler, *_ = re.findall(r"(?ms)^```\n(.*?)^```", text)
    (tmp_path / "copy.hal").write_text(
        first.replace("start\n", sampler + "start\n") + "loadusr -w halsampler -c 0 -n 4000 trace.log\n"
    )
    done = halrig.halrun(["-f", "copy.hal"], tmp_path)
    assert done.returncode == 0, done.stdout
    done = subprocess.run(
        [
            str(ROOT / "bin/chipwise"),
            "digitise",
            str(tmp_path / "trace.log"),
            "-o",
            str(tmp_path / "a.stock"),
            "--ball",
            "1",
            "--cell",
            "0.1",
        ],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 0, done.stdout
    head, cells = store.read(str(tmp_path / "a.stock"))
    along = cells["top"][1]  # the cells whose middles are 0.05 mm from the first line
    x = head.low[0] + (np.arange(-1, head.nx + 1) + 0.5) * 0.1
    inside = (x > 0.0) & (x < 4.5)  # the first line begins where the head is, at 0
    assert along[inside] == pytest.approx(np.sqrt(100.0 - x[inside] ** 2 - 0.05**2) - 15.0, abs=0.01)
