# SPDX-License-Identifier: GPL-2.0-or-later
"""Puts hostile numbers on the input pins and parameters of our components, and looks at every output pin.

Called by test_fuzz_pins.py inside HAL: fuzz_pins.py SEED STEPS; what is wrong goes to wrong.json, what was seen to
seen.json.  Each component stands alone: its inputs are ours, so that it meets numbers no component of ours would give
it.
"""

import json
import math
import random
import sys
import time
from pathlib import Path

import hal

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "remap"))

from chipwise.host.halcmd import halcmd  # noqa: E402

SETTLE = 4  # servo periods until an input has been read and answered
FILL_S = 300.0  # until the map is filled again, on a busy computer
PREFIXES = (
    "stock-tracker.0.",
    "volumetric-feed.0.",
    "chipwise-guard.0.",
    "chipwise-command.0.",
    "tracer.0.",
    "tracer-offset.0.",
    "tracer-slave.0.",
    "tracer-model.0.",
    "spindle-sim.0.",
)
KINDS = {"float": hal.HAL_FLOAT, "s32": hal.HAL_S32, "bit": hal.HAL_BIT, "u32": hal.HAL_U32}
HOSTILE = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    5e-324,
    1e-300,
    1e-12,
    1e-6,
    0.3,
    90.0,
    180.0,
    1e5,
    1e6,
    -1e6,
    1.1e6,
    1e9,
    1e18,
    1e150,
    -1e150,
    1.7e308,
    -1.7e308,
    math.inf,
    -math.inf,
    math.nan,
]
HOSTILE_WHOLE = [0, 1, 2, 3, 4, 5, 7, 8, 17, 27, -1, 255, 2**31 - 1, -(2**31)]
SOUND = {
    "stock-tracker.0.tool-diameter": 6.0,
    "stock-tracker.0.enable": 1,
    "stock-tracker.0.motion-type": 2,
    "stock-tracker.0.min-z": -10.0,
    "stock-tracker.0.max-x": 60.0,
    "stock-tracker.0.max-y": 40.0,
    "stock-tracker.0.pos-x": 5.0,
    "stock-tracker.0.pos-y": 5.0,
    "stock-tracker.0.pos-z": -2.0,
    "volumetric-feed.0.mode": 2,
    "volumetric-feed.0.mrr-target": 1800.0,
    "volumetric-feed.0.programmed-vel": 20.0,
    "volumetric-feed.0.requested-vel": 50.0,
    "volumetric-feed.0.motion-type": 2,
    "volumetric-feed.0.acceleration": 500.0,
    "volumetric-feed.0.section-area": 2.0,
    "volumetric-feed.0.ready": 1,
    "tracer.0.enable": 1,
    "tracer.0.mode": 2,
    "tracer.0.direction": 1,
    "tracer.0.feed": 10.0,
    "tracer.0.feed-override": 1.0,
    "tracer.0.deflection-target": 0.3,
    "tracer.0.deflection-z": 0.3,
    "tracer.0.window-max-x": 50.0,
    "tracer-slave.0.enable": 1,
}
# Registers carry what the program says; the tracker and the law judge it.
PASSED_ON = {
    "chipwise-command.0." + name
    for name in ("min-x", "min-y", "min-z", "max-x", "max-y", "max-z", "mrr-target", "mrr-lower", "turn")
}


def shown(what):
    """Rows of halcmd for our components: lists of words."""
    for line in halcmd("show", what).splitlines():
        words = line.split()
        name = words[4] if len(words) > 4 else ""
        if name.startswith(PREFIXES):
            yield words, name


class Bench:
    def __init__(self):
        self.own = hal.component("fuzz")
        self.inputs, self.outputs, self.params = {}, {}, {}
        self.own.newpin("periods", hal.HAL_FLOAT, hal.HAL_IN)
        for number, (words, name) in enumerate(shown("pin")):
            kind, direction = words[1], words[2]
            ours = f"p{number}"
            if name.endswith(".time") or kind not in KINDS:
                continue
            if direction == "IN":
                self.own.newpin(ours, KINDS[kind], hal.HAL_OUT)
                self.inputs[name] = (ours, kind)
            elif direction == "OUT":
                self.own.newpin(ours, KINDS[kind], hal.HAL_IN)
                self.outputs[name] = (ours, kind)
        for words, name in shown("param"):
            if words[2] == "RW" and not name.endswith((".tmax", ".tmax-increased")):
                self.params[name] = (words[1], words[3])
        self.own.ready()
        for name, (ours, _kind) in [*self.inputs.items(), *self.outputs.items()]:
            halcmd("net", "s" + ours, "fuzz." + ours, name)
        halcmd("net", "periods", "fuzz.periods", "integ.0.out")

    def settle(self):
        """Waits until the servo thread has run SETTLE times: how long that takes depends on what else this machine
        does."""
        end = self.own["periods"] + SETTLE
        while self.own["periods"] < end:
            time.sleep(0.001)

    def put(self, name, value):
        self.own[self.inputs[name][0]] = value

    def sound(self):
        """All inputs and parameters as on a machine, and the stock defined anew; -> whether the tracker is ready
        then."""
        for name in self.inputs:
            self.put(name, SOUND.get(name, 0))
        for name, (_kind, value) in self.params.items():
            hal.set_p(name, value)
        self.settle()
        self.put("stock-tracker.0.define", 1)
        self.settle()  # until then it is ready with the stock before
        end = time.monotonic() + FILL_S
        while time.monotonic() < end and not (
            self.read("stock-tracker.0.ready") and not self.read("stock-tracker.0.fault")
        ):
            time.sleep(0.004)
        self.put("stock-tracker.0.define", 0)
        return bool(self.read("stock-tracker.0.ready")) and not self.read("stock-tracker.0.fault")

    def read(self, name):
        return self.own[self.outputs[name][0]]


def hostile(kind, chance):
    """A number for a pin or parameter of this kind."""
    value = chance.choice(HOSTILE if kind == "float" else [0, 1] if kind == "bit" else HOSTILE_WHOLE)
    return value % 2**32 if kind == "u32" else value


def spoil(bench, chance):
    """Some inputs or parameters hostile; -> what was done."""
    done = {}
    for _ in range(chance.randrange(1, 5)):
        if chance.random() < 0.2:
            name = chance.choice(sorted(bench.params))
            kind = bench.params[name][0]
            value = hostile(kind, chance)
            hal.set_p(name, repr(value))
        else:
            name = chance.choice(sorted(bench.inputs))
            kind = bench.inputs[name][1]
            value = hostile(kind, chance)
            bench.put(name, value)
        done[name] = repr(value)
    return done


def wrong(bench):
    """What no output may be: (pin, value)."""
    found = []
    for name, (_ours, kind) in bench.outputs.items():
        value = bench.read(name)
        if kind == "float" and name not in PASSED_ON and not math.isfinite(value):
            found.append((name, repr(value)))
    for name in ("volumetric-feed.0.adaptive-feed", "volumetric-feed.0.override"):
        if not 0.0 <= bench.read(name) <= 1.0:
            found.append((name, repr(bench.read(name))))
    for name in (
        "section-area",
        "depth",
        "mrr",
        "removed-volume",
        "rapid-distance",
        *(f"load-step-{what}-{k}" for what in ("distance", "area", "accel") for k in range(8)),
    ):
        if not bench.read("stock-tracker.0." + name) >= 0.0:
            found.append(("stock-tracker.0." + name, repr(bench.read("stock-tracker.0." + name))))
    if not 0 <= bench.read("volumetric-feed.0.limited-by") <= 8:
        found.append(("limited-by", bench.read("volumetric-feed.0.limited-by")))
    return found


def main(seed, steps):
    chance, bench = random.Random(seed), Bench()
    bad, ready, since = [], 0, []
    for step in range(steps):
        if step % 12 == 0:
            since = []
            if not bench.sound():
                bad.append(
                    (step, "not ready with sound inputs and a new stock", bench.read("stock-tracker.0.fault-code"))
                )
        since.append(spoil(bench, chance))
        bench.settle()
        bad += [(step, *what, since[-12:]) for what in wrong(bench)]
        ready += bool(bench.read("stock-tracker.0.ready"))
        if len(bad) > 10:
            break
    with open("wrong.json", "w") as handle:
        json.dump(bad, handle, indent=1)
    with open("seen.json", "w") as handle:
        json.dump(
            {
                "steps": step + 1,
                "ready": ready,
                "inputs": sorted(bench.inputs),
                "outputs": sorted(bench.outputs),
                "params": sorted(bench.params),
            },
            handle,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
