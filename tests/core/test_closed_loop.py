# SPDX-License-Identifier: GPL-2.0-or-later
"""Tracker and feed law drive a simulated planner through random cuts: the true removal rate never rises above its
target.

A failure prints the seed; `CHIPWISE_SEED=<seed> CHIPWISE_RANDOM_COUNT=1 tools/test tests/core/test_closed_loop.py`
repeats it.
"""

import subprocess

import pytest

from support import ROOT, closed_loop, random_cases, unchanged

PEAK = 1.02 + 0.003  # in 10 ms; the grain of the needles
VOLUME = 0.003  # of the volume


def inputs():
    return [*unchanged.c_files(), *ROOT.glob("tests/support/*.[ch]")]


def high(scenes):
    return [scene for scene in scenes if scene.peak > PEAK]


def test_no_peak(tmp_path):
    scenes = closed_loop.run(closed_loop.build(tmp_path), random_cases.random_seed(), random_cases.random_count(2))
    assert not high(scenes), high(scenes)
    assert not [scene for scene in scenes if abs(scene.volume - 1.0) > VOLUME], scenes
    assert max(scene.peak for scene in scenes) > 0.9  # not all of it was air


@pytest.mark.inputs(lambda **_of_a_test: inputs())
def test_loads_out_of_date_are_seen(tmp_path):
    """The checker of closed_loop.c that compares what the look-ahead keeps with what it would compute."""
    with pytest.raises(subprocess.CalledProcessError) as found:
        closed_loop.run(closed_loop.build(tmp_path, "INTERVALS_KEPT"), 1, 1)
    assert "is out of date" in found.value.stderr


@pytest.mark.inputs(lambda **_of_a_test: inputs())
@pytest.mark.parametrize("fault", ["TOO_FAST", "SAMPLES_LATE", "LOOKAHEAD_OFF"])
def test_a_fault_is_seen(fault, tmp_path):
    assert high(closed_loop.run(closed_loop.build(tmp_path, fault), 1, 2)), fault
