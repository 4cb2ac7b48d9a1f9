# SPDX-License-Identifier: GPL-2.0-or-later
"""NaN, infinity and absurd numbers on every input pin and parameter of the components, in a HAL: finite outputs, the
overrides in 0..1, no crash; all is well again with sound inputs and a new stock.  The core with far more cases:
tests/core/test_fuzz.c."""

import json
import re

from support import ROOT, halrig
from support.random_cases import random_count, random_seed

PYTHON = "/usr/bin/python3"

BENCH = (
    """
loadrt threads name1=servo period1=1000000
"""
    + halrig.COUNT_PERIODS
    + """loadrt stock_tracker cell=0.25 size_x=60 size_y=40
loadrt volumetric_feed
loadrt chipwise_guard
loadrt chipwise_command
loadrt tracer
loadrt tracer_offset
loadrt tracer_slave
loadrt tracer_model
loadrt spindle_sim
addf chipwise-command.0 servo
addf stock-tracker.0 servo
addf volumetric-feed.0 servo
addf chipwise-guard.0 servo
addf tracer.0 servo
addf tracer-offset.0 servo
addf tracer-slave.0 servo
addf tracer-slave.0.pulse servo
addf tracer-model.0 servo
addf spindle-sim.0 servo
start
loadusr -w {python} {script} {seed} {steps}
getp stock-tracker.0.fault
"""
)


def inputs_of(component):
    """Names of a component's input pins as its source has them."""
    text = (ROOT / "components" / (component + ".comp")).read_text()
    found = []
    for name, size in re.findall(r"^pin in \w+ (\w+?)_?#?(\[\d+\])?(?= )", text, re.M):
        found += [f"{name}_{k}" for k in range(int(size[1:-1]))] if size else [name]
    return {name.replace("_", "-") for name in found}


def test_hostile_numbers_on_every_pin(tmp_path):
    steps = random_count(600)
    (tmp_path / "test.hal").write_text(
        BENCH.format(python=PYTHON, script=halrig.SUPPORT / "fuzz_pins.py", seed=random_seed(), steps=steps)
    )
    done = halrig.halrun(["-f", "test.hal"], tmp_path)
    assert done.returncode == 0 and {"TRUE", "FALSE"} & set(done.stdout.split()), done.stdout[-2000:]
    wrong, seen = (json.loads((tmp_path / (name + ".json")).read_text()) for name in ("wrong", "seen"))
    assert wrong == [], f"CHIPWISE_SEED={random_seed()} CHIPWISE_RANDOM_COUNT={steps}: {wrong[0]}"
    assert seen["steps"] == steps and seen["ready"] > 0.05 * steps
    for component in (
        "stock_tracker",
        "volumetric_feed",
        "chipwise_guard",
        "chipwise_command",
        "tracer",
        "tracer_offset",
        "tracer_slave",
        "tracer_model",
        "spindle_sim",
    ):
        prefix = component.replace("_", "-") + ".0."
        there = {name.removeprefix(prefix) for name in seen["inputs"] if name.startswith(prefix)}
        assert there == inputs_of(component), there ^ inputs_of(component)
