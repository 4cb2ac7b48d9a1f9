# SPDX-License-Identifier: GPL-2.0-or-later
"""What a servo period of tracker and feed law costs has not risen: instructions over a fixed path, the same in every
run.

bench/bench_cost.py measures times; those of a busy computer say nothing.  A change that is worth more instructions
raises LIMITS, and measures the times of docs/proof/benchmarks.md again.
"""

import json
import os
import shutil
import subprocess
import sys

import pytest

from chipwise.headless import runner
from support import unchanged

PERIODS = 3000
# mean instructions of a period, 3 % above what gcc 12 makes of it (Debian 12, amd64)
LIMITS = {
    "D10 flat, 0.25 mm cells, 100 mm/s": 64900,
    "D10 bull R2, 0.25 mm cells, 100 mm/s": 73000,
    "D6 ball, 0.25 mm cells, 100 mm/s": 54100,
    "D8 vee 90, 0.25 mm cells, 100 mm/s": 53800,
    "D25 flat, 0.1 mm cells, 500 mm/s": 194100,
    "D10 flat, 12 clamps, 0.25 mm cells, 100 mm/s": 70500,
    "D10 flat, 100 clamps, 0.25 mm cells, 100 mm/s": 85800,
}


def measured(name):
    command = [sys.executable, os.path.join(runner.ROOT, "bench", "bench_cost.py"), "--count", str(PERIODS), name]
    return json.loads(subprocess.run(command, text=True, capture_output=True, check=True).stdout)["value"]


def other_compiler():
    return [
        subprocess.run(["gcc", option], text=True, capture_output=True, check=False).stdout.strip()
        for option in ("-dumpmachine", "-dumpversion")
    ] != ["x86_64-linux-gnu", "12"]


@pytest.mark.skipif(not shutil.which("valgrind"), reason="no valgrind")
@pytest.mark.skipif(other_compiler(), reason="the limits are those of gcc 12 on amd64")
@pytest.mark.inputs(lambda name: [*unchanged.c_files(), "bench/bench_cost.py", "bench/lib/cost.c"])
@pytest.mark.parametrize("name", LIMITS)
def test_instructions_of_a_period(name):
    assert 0.8 * LIMITS[name] < measured(name) < LIMITS[name]


def test_no_division_of_integers():
    """An integer division takes as long as twenty other instructions: places in the rings of the look-ahead need
    none."""
    objects = [
        os.path.join(runner.ROOT, "build", "core", f"{name}.o")
        for name in (
            "load_bound",
            "load_profile",
            "lookahead",
            "path",
            "sweep_curved",
            "sweep_level",
            "sweep_lowest",
            "sweep_row",
        )
    ]
    found = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", *objects], text=True, capture_output=True, check=True
    ).stdout
    assert "<chip_load_complete>" in found
    assert not [
        line
        for line in found.splitlines()
        if "\tidiv" in line or "\tdiv " in line or "\tdivl" in line or "\tdivq" in line
    ]
