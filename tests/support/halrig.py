# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a folder of tests/components in a HAL of its own and gives back what was sampled.

A folder holds
  test.hal      plain HAL: a streamer plays the stimulus, one row per servo period, samplers record.
                $(PERIODS) is the number of rows, $(DEPTH) a fifo depth that holds them all,
                $(TESTS) the path of tests/components, $(SUPPORT) that of tests/support
  stimulus.py   stimulus() -> Stimulus
  check.py      check(trace) -> None or AssertionError; SABOTAGE = {what: trace -> worse trace},
                every one of which check() must refuse
Columns are called like the signals: `net pos-x streamer.0.pin.0 => ...` names the column pos-x of
the stimulus, `net section-area ... => sampler.0.pin.9` that of the trace.  Streamer, components
and samplers share one thread, so row k of the trace is what row k of the stimulus led to.
"""

import importlib.util
import os
import re
import subprocess
from pathlib import Path

import numpy as np

from support import ROOT

SCENES = ROOT / "tests/components"
SUPPORT = ROOT / "tests/support"
SANDBOX = ROOT / "bin/chipwise-sandbox"
PERIOD_S = 0.001
TIMEOUT_S = 600
COUNT_PERIODS = "loadrt integ\nsetp integ.0.in 1000\naddf integ.0 servo\n"  # of the thread servo, for wait_periods


class Stimulus:
    """Columns of numbers, one row per period; phases name ranges of rows."""

    def __init__(self, columns=None):
        self.columns = {name: list(values) for name, values in (columns or {}).items()}
        self.phases = {}

    def __len__(self):
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def add(self, row):
        """One period; a column the row does not name keeps its value."""
        for name, column in self.columns.items():
            column.append(row.get(name, column[-1] if column else 0.0))

    def phase(self, name):
        """The rows from here to the next phase are called `name`."""
        self._close()
        self.phases[name] = slice(len(self), None)

    def _close(self):
        for name, rows in self.phases.items():
            if rows.stop is None:
                self.phases[name] = slice(rows.start, len(self))

    def closed_phases(self):
        self._close()
        return dict(self.phases)


class ToolPath(Stimulus):
    """A tool on its way: positions in mm, `scale` machine units per mm at the pins."""

    LENGTHS = (
        "pos-x",
        "pos-y",
        "pos-z",
        "tool-offset-x",
        "tool-offset-y",
        "tool-offset-z",
        "tool-diameter",
        "tool-corner-radius",
        "tool-flute-length",
        "min-x",
        "min-y",
        "min-z",
        "max-x",
        "max-y",
        "max-z",
    )
    OTHERS = ("tool-tip-angle", "motion-type", "enable", "define")

    def __init__(self, at, scale=1.0, **state):
        super().__init__({name: [] for name in self.LENGTHS + self.OTHERS})
        self.at, self.scale = np.array(at, float), scale
        self.state = dict.fromkeys(self.columns, 0)
        self.set(**state)

    def set(self, **state):
        """Pins from the next row on; underscores become hyphens."""
        for name, value in state.items():
            name = name.replace("_", "-")
            assert name in self.state, name
            self.state[name] = value
        return self

    def box(self, low, high):
        for axis, a, b in zip("xyz", low, high):
            self.set(**{"min_" + axis: a, "max_" + axis: b})
        return self

    def offset(self, x, y, z):
        return self.set(tool_offset_x=x, tool_offset_y=y, tool_offset_z=z)

    def stay(self, periods):
        for _ in range(periods):
            row = dict(self.state)
            for axis, value in zip("xyz", self.at):
                row["pos-" + axis] = value + row["tool-offset-" + axis]
            for name in self.LENGTHS:
                row[name] *= self.scale
            self.add(row)
        return self

    def jump(self, to):
        """The tip (mm) is elsewhere in the next period."""
        self.at = np.array(to, float)
        return self.stay(1)

    def line(self, to, speed):
        """A straight path of the tip to `to` (mm) at about `speed` mm/s, in whole periods."""
        start, to = self.at, np.array(to, float)
        steps = int(np.ceil(np.linalg.norm(to - start) / (speed * PERIOD_S) - 1e-9))
        for i in range(1, steps + 1):
            self.jump(start + (to - start) * i / steps)
        return self

    def move(self, to, speed, accel):
        """As the planner does: speed up, cruise, brake to a stand (mm/s, mm/s2)."""
        start, to = self.at.copy(), np.array(to, float)
        length = np.linalg.norm(to - start)
        speed = min(speed, np.sqrt(accel * length))
        ramp = speed / accel
        total = length / speed + ramp
        for i in range(1, int(np.ceil(total / PERIOD_S)) + 1):
            t = min(i * PERIOD_S, total)
            if t < ramp:
                s = 0.5 * accel * t * t
            elif t < total - ramp:
                s = speed * (t - 0.5 * ramp)
            else:
                s = length - 0.5 * accel * (total - t) ** 2
            self.jump(start + (to - start) * s / length)
        return self

    def define(self, periods=12):
        """A pulse on `define`, and time to fill the map."""
        self.set(define=1).stay(1).set(define=0)
        return self.stay(periods)


class Trace:
    """What the samplers saw: columns (n,), rows = periods; `t` in s."""

    def __init__(self, columns, phases):
        self.columns, self.phases = columns, phases

    def __getitem__(self, name):
        return self.columns[name]

    @property
    def t(self):
        return np.arange(len(next(iter(self.columns.values())))) * PERIOD_S

    def only(self, phase):
        """The rows of one phase, as a trace."""
        rows = self.phases[phase]
        part = Trace({name: values[rows] for name, values in self.columns.items()}, {})
        part.start = rows.start
        return part

    start = 0

    def but(self, **columns):
        """A copy with columns replaced by functions of the old ones (for sabotage)."""
        changed = dict(self.columns)
        for name, function in columns.items():
            name = name.replace("_", "-")
            changed[name] = np.asarray(function(changed[name].copy()))
        return Trace(changed, self.phases)

    def put(self, name, phase, value, at=None):
        """A copy with `value` in one column in a phase (`at`: one row of it)."""
        rows = self.phases[phase]
        chosen = rows if at is None else range(*rows.indices(10**9))[at]

        def change(values):
            values[chosen] = value
            return values

        return self.but(**{name: change})


def load_module(path):
    """A Python file of a test folder, under a name of its own."""
    spec = importlib.util.spec_from_file_location(f"hal_{path.parent.name}_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def hal_text(path):
    """A HAL file with the files it sources."""
    lines = []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["source"]:
            lines += hal_text(Path(words[1].replace("$(TESTS)", str(SCENES)))).splitlines()
        else:
            lines.append(line)
    return "\n".join(lines)


def pins_of(text, component):
    """-> {channel: [signal name by pin number]} of streamer or sampler."""
    found = {}
    for line in text.splitlines():
        words = line.split()
        if words[:1] != ["net"]:
            continue
        for channel, pin in re.findall(component + r"\.(\d+)\.pin\.(\d+)", line):
            found.setdefault(int(channel), {})[int(pin)] = words[1]
    return {c: [names[i] for i in range(len(names))] for c, names in found.items()}


def write_stimulus(stimulus, text, path):
    """The file halstreamer reads; whole numbers where the pin is one."""
    order = pins_of(text, "streamer")[0]
    kinds = re.search(r"loadrt streamer .*cfg=(\w+)", text)[1]
    columns = [
        [str(int(v)) for v in stimulus.columns[name]]
        if kind in "bsu"
        else [repr(float(v)) for v in stimulus.columns[name]]
        for name, kind in zip(order, kinds)
    ]
    assert len(kinds) == len(order) and set(order) == set(stimulus.columns), order
    path.write_text("".join(" ".join(row) + "\n" for row in zip(*columns)))


def halrun(arguments, where, env=None, shell=None):
    """halrun (or a shell command) in a sandbox; -> CompletedProcess, output in one."""
    command = ["sh", "-c", shell] if shell else ["halrun", *map(str, arguments)]
    return subprocess.run(
        [str(SANDBOX), "--timeout", str(TIMEOUT_S), "--", *command],
        cwd=where,
        env=dict(os.environ, TESTS=str(SCENES), SUPPORT=str(SUPPORT), **(env or {})),
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def run(folder, where):
    """Runs tests/components/<folder>; `where` is a scratch directory. -> Trace"""
    script = SCENES / folder / "test.hal"
    text = hal_text(script)
    stimulus = load_module(SCENES / folder / "stimulus.py").stimulus()
    write_stimulus(stimulus, text, where / "stimulus.txt")
    count = len(stimulus)
    done = halrun(["-f", script], where, {"PERIODS": str(count), "DEPTH": str(count + 100)})
    assert done.returncode == 0, f"{folder}: halrun left with {done.returncode}\n{done.stdout}"
    columns = {}
    for channel, names in pins_of(text, "sampler").items():
        lines = (where / f"trace{channel}.txt").read_text().splitlines()
        assert len(lines) == count and "overrun" not in lines, (
            f"{folder}: sampler {channel} gave {len(lines)} of {count} rows\n{done.stdout}"
        )
        table = np.array([[float(word) for word in line.split()] for line in lines])
        columns.update(zip(names, table.T))
    return Trace(columns, stimulus.closed_phases())


# --- what checkers say ------------------------------------------------------------------------


def require(trace, name, good, unit, bound, values=None):
    """Every row good, or an AssertionError with time, value, unit, bound of the first bad one."""
    values = trace[name] if values is None else values
    good = np.broadcast_to(good, np.shape(values))
    if np.all(good):
        return
    k = int(np.argmin(good))
    raise AssertionError(
        f"{name}: {values[k]:.6g} {unit} at {(trace.start + k) * PERIOD_S:.3f} s "
        f"({np.sum(~good)} of {len(good)} rows), allowed: {bound}"
    )


def within(trace, name, low, high, unit, values=None):
    """Every row in low..high (numbers or arrays); NaN is outside."""
    values = trace[name] if values is None else values
    good = (values >= low) & (values <= high)
    k = int(np.argmin(np.broadcast_to(good, np.shape(values))))
    low, high = np.broadcast_to(low, np.shape(values)), np.broadcast_to(high, np.shape(values))
    require(trace, name, good, unit, f"{low[k]:.6g} .. {high[k]:.6g} {unit}" if len(values) else "", values)


def always(trace, name, value):
    """Every row of a bit or whole number is `value`."""
    require(trace, name, trace[name] == value, "(pin)", f"only {value}")


def near(what, value, wanted, share, unit, at_s):
    """One number within a share of the wanted one."""
    assert abs(value - wanted) <= share * abs(wanted), (
        f"{what}: {value:.6g} {unit} at {at_s:.3f} s, allowed: {wanted:.6g} {unit} +- {100 * share:g} %"
    )
