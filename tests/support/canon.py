# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs programs through LinuxCNC's interpreter, without a machine, and reads back what it would have moved.

Two ways, each with a HOME of its own per run (rs274 empties ~/.tool.mmap, and parallel runs share it):
  run_rs274    the program rs274, as a user would call it.  4 decimals; the unit of its tool table differs between
               versions of LinuxCNC (chipwise.program.rs274), so tools are given in mm and written as it takes them.
  run_preview  the interpreter of AXIS's preview (preview_probe.py): any machine unit, full doubles, modes, line
               numbers.
Both give a Trace in machine coordinates (offsets, rotation and G92 applied), mm.
"""

import cmath
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from chipwise.program import rs274
from chipwise.ini import section_of
from support import ROOT, forked
from support.hole_oracle import Element

PYTHON = "/usr/bin/python3"
UNIT_MM = {"mm": 1.0, "in": 25.4}
UPRIGHT_STEP = 0.002  # rad
MODES = (  # that a cycle has to leave as they are
    "G90 G91.1 G21 G64 P0.01 G94 G98 G0 X1",
    "G91 G91.1 G21 G61 G94 G99 G1 X1 F100",
    "G90 G90.1 G20 G61.1 G94 G98 G80",
    "G91 G90.1 G20 G64 G94 G98 G1 X1 F100",
    "S500 M3 G90 G91.1 G21 G64 G95 G98 G1 X1 F1",
)


@dataclass
class Trace:
    """What a program did: elements, feed of each element (mm/min), its line, the comments' modes, the error."""

    elements: list = field(default_factory=list)
    feeds: list = field(default_factory=list)
    lines: list = field(default_factory=list)
    comments: list = field(default_factory=list)  # (text, number of elements so far, modes)
    error: str = ""  # without its line
    error_line: int = None  # the line it names
    output: str = ""

    def after(self, text):
        """The elements after a comment of the program."""
        return self.elements[next(n for t, n, _ in self.comments if t == text) :]

    def between(self, first, second):
        """The elements between two comments."""
        places = {t: n for t, n, _ in self.comments}
        return self.elements[places[first] : places[second]]

    def modes(self, text):
        """(active G-codes without line and block, feed) at a comment; preview only."""
        mode = next(m for t, _, m in self.comments if t == text)
        return mode["gcodes"][1:2] + mode["gcodes"][3:], mode["feed"]


_LINE = re.compile(r" \(line (\d+)(?: of [^()]*)?\)$")


def split_line(message):
    """A message of the package -> (text, the line it names at its end; None without one)."""
    match = _LINE.search(message)
    return (message[: match.start()], int(match.group(1))) if match else (message, None)


class _World:
    """Follows offsets and turns program coordinates (mm) into machine coordinates."""

    def __init__(self, trace):
        self.trace, self.g5x, self.g92, self.rotation = trace, (0, 0, 0), (0, 0, 0), 0.0
        self.here, self.feed, self.plane, self.program_here = (0.0, 0.0, 0.0), 0.0, "XY", (0.0, 0.0, 0.0)

    def machine(self, x, y, z=0.0):
        x, y = x + self.g92[0], y + self.g92[1]
        t = math.radians(self.rotation)
        return (
            x * math.cos(t) - y * math.sin(t) + self.g5x[0],
            x * math.sin(t) + y * math.cos(t) + self.g5x[1],
            z + self.g92[2] + self.g5x[2],
        )

    def move(self, kind, line, x, y, z, centre=None, turn=1, inside=False):
        """inside: a chord of an arc, not its last one."""
        there, self.program_here = self.machine(x, y, z), (x, y, z)
        extra = {"ccw": not inside} if centre is None else {"centre": self.machine(*centre)[:2], "ccw": turn > 0}
        self.trace.elements.append(Element(kind, self.here, there, **extra))
        self.trace.feeds.append(None if kind == "rapid" else self.feed)
        self.trace.lines.append(line)
        self.here = there


def _upright_arc(world, line, mm, turn):
    """An arc of ARC_FEED in G18 (Z, X, then Y) or G19 (Y, Z, then X) as short straight moves, whose ccw is False but
    for the last one.  mm: in program coordinates: the two ends, the centre, the turns, the third end."""
    order = (2, 0, 1) if world.plane == "XZ" else (1, 2, 0)
    here = [world.program_here[k] for k in order]
    start, centre, end = complex(here[0], here[1]), complex(mm[2], mm[3]), complex(mm[0], mm[1])
    sweep = cmath.phase((end - centre) / (start - centre)) % (2 * math.pi)
    sweep -= 2 * math.pi * (turn < 0)
    count = max(1, math.ceil(abs(sweep) / UPRIGHT_STEP))
    for k in range(1, count + 1):
        at = (
            end
            if k == count
            else centre
            + (start - centre)
            * cmath.exp(1j * sweep * k / count)
            * (1 + (abs((end - centre) / (start - centre)) - 1) * k / count)
        )
        place = dict(zip(order, (at.real, at.imag, here[2] + (mm[5] - here[2]) * k / count)))
        world.move("feed", line, place[0], place[1], place[2], inside=k < count)


def ends_of(elements):
    """Elements with a length, of an arc in G18 or G19 only the last chord."""
    return [e for e in elements if math.dist(e.a, e.b) > 1e-6 and (e.ccw or e.kind == "arc")]


def write_ini(folder, machine="mm", **settings):
    """The repository's INI file of a machine, with [CHIPWISE] settings replaced; returns its path."""
    text = (ROOT / "configs" / ("mill.ini" if machine == "mm" else "mill_inch.ini")).read_text()
    settings.setdefault("TOOL_GEOMETRY", str(ROOT / "configs" / "tools.toml"))
    for key, value in settings.items():
        text, count = re.subn(rf"(?m)^{key} =.*$", lambda m: f"{key} = {value}", text)
        assert count == 1, key
    text = text.replace("PATH_PREPEND = remap", f"PATH_PREPEND = {ROOT / 'remap'}")
    text = text.replace("TOPLEVEL = remap/", f"TOPLEVEL = {ROOT / 'remap'}/")
    path = Path(folder) / "test.ini"
    path.write_text(text)
    return path


def write_tools(folder, tools, unit_mm):
    """A tool table from {number: diameter in mm}, in a unit of so many mm."""
    path = Path(folder) / "tool.tbl"
    path.write_text("".join(f"T{n} P{n} D{d / unit_mm:.15f}\n" for n, d in tools.items()))
    return path


def _prepare(folder, program):
    path = Path(folder) / "program.ngc"
    path.write_text(program)
    (Path(folder) / "test.var").write_text("5161 0\n")
    return path, {**os.environ, "HOME": str(folder)}


def run_rs274(program, tools=None, machine="mm", ini=None, started=False, **settings):
    """A program through rs274, its tools given in mm; started: as a user starts it, without support/forked.py."""
    run = _rs274(program, tools, machine, ini, settings, (), started)
    trace = parse_rs274(run.stdout)
    messages = [line for line in run.stderr.splitlines() if line and line != "executing"]
    if run.returncode != 0:
        trace.error, trace.error_line = split_line(messages[0] if messages else f"exit {run.returncode}")
    trace.output = run.stdout + run.stderr
    return trace


def run_rs274_on(program, tools=None, machine="mm", ini=None, **settings):
    """As run_rs274, going on after errors: (Trace, [messages of the package without their lines], [the lines])."""
    run = _rs274(program, tools, machine, ini, settings, ("-n", "0"))
    said = [split_line(line) for line in run.stderr.splitlines() if line.startswith("chipwise: ")]
    return parse_rs274(run.stdout), [text for text, _ in said], [line for _, line in said]


def _rs274(program, tools, machine, ini, settings, options, started=False):
    """The finished process."""
    with tempfile.TemporaryDirectory() as folder:
        path, environment = _prepare(folder, program)
        ini = ini or write_ini(folder, machine, **settings)
        unit = section_of(Path(ini).read_text().splitlines(), "TRAJ").get("LINEAR_UNITS", "mm")
        table = write_tools(folder, tools or {1: 2.0}, rs274.tool_table_unit(unit))
        arguments = ["-g", *options, "-i", str(ini), "-t", str(table), "-v", f"{folder}/test.var", str(path)]
        if started:
            return subprocess.run(
                ["rs274", *arguments],
                cwd=ROOT,
                env=environment,
                capture_output=True,
                text=True,
                timeout=300,
                check=False,
            )
        return forked.rs274(arguments, cwd=ROOT, env=environment, timeout=300)


_CALL = re.compile(r"^\s*\d+ N\S*\s+([A-Z0-9_]+)\((.*)\)\s*$")


def parse_rs274(text):
    """Canonical calls as rs274 prints them -> Trace."""
    trace = Trace()
    world, unit = _World(trace), 1.0
    for line in text.splitlines():
        match = _CALL.match(line)
        if not match:
            continue
        name, arguments = match.groups()
        if name == "USE_LENGTH_UNITS":
            unit = 1.0 if "MM" in arguments else 25.4
        elif name == "SELECT_PLANE":
            world.plane = arguments[-2:]
        elif name == "COMMENT":
            trace.comments.append((arguments.strip('"'), len(trace.elements), None))
        elif name == "SET_FEED_RATE":
            world.feed = float(arguments) * unit
        elif name in (
            "SET_G5X_OFFSET",
            "SET_G92_OFFSET",
            "SET_XY_ROTATION",
            "STRAIGHT_TRAVERSE",
            "STRAIGHT_FEED",
            "ARC_FEED",
        ):
            n = [float(a) for a in arguments.split(",")]
            mm = [v * unit for v in n]
            if name == "SET_G5X_OFFSET":
                world.g5x = tuple(mm[1:4])
            elif name == "SET_G92_OFFSET":
                world.g92 = tuple(mm[:3])
            elif name == "SET_XY_ROTATION":
                world.rotation = n[0]
            elif name == "ARC_FEED" and world.plane != "XY":
                _upright_arc(world, 0, mm, n[4])
            elif name == "ARC_FEED":
                world.move("arc", 0, mm[0], mm[1], mm[5], mm[2:4], n[4])
            else:
                world.move("rapid" if name == "STRAIGHT_TRAVERSE" else "feed", 0, *mm[:3])
    return trace


def run_preview(program, tools=None, machine="mm", ini=None, timeout=300, **settings):
    """A program through the preview's interpreter on a mm or inch machine, tools in mm; timeout: s."""
    with tempfile.TemporaryDirectory() as folder:
        path, environment = _prepare(folder, program)
        environment["INI_FILE_NAME"] = str(ini or write_ini(folder, machine, **settings))
        table = write_tools(folder, tools or {1: 2.0}, UNIT_MM[machine])
        run = forked.preview(
            [str(path), repr(1 / UNIT_MM[machine]), str(table), f"{folder}/test.var"],
            cwd=ROOT,
            env=environment,
            timeout=timeout,
        )
    trace = Trace(output=run.stdout + run.stderr)
    if run.returncode != 0:
        raise RuntimeError(f"preview: exit {run.returncode}\n{run.stderr}")
    result = json.loads(run.stdout.splitlines()[-1])
    trace.error, trace.error_line = split_line(result["error"])
    world = _World(trace)
    for kind, line, *n in result["calls"]:
        if kind in ("rapid", "feed"):
            world.move(kind, line, *n)
        elif kind == "plane":
            world.plane = {1: "XY", 2: "YZ", 3: "XZ"}[n[0]]
        elif kind == "arc" and world.plane != "XY":
            _upright_arc(world, line, [n[0], n[1], n[3], n[4], 0.0, n[2]], n[5])
        elif kind == "arc":
            world.move("arc", line, *n[:3], n[3:5], n[5])
        elif kind == "F":
            world.feed = n[0]
        elif kind == "comment":
            trace.comments.append((n[0], len(trace.elements), n[1]))
        elif kind in ("g5x", "g92"):
            setattr(world, kind, tuple(n))
        elif kind == "rotation":
            world.rotation = n[0]
    return trace


def same_path(first, second, tolerance):
    """Raise AssertionError unless two lists of elements are the same motion within a tolerance (mm)."""
    assert [e.kind for e in first] == [e.kind for e in second]
    for n, (e, f) in enumerate(zip(first, second)):
        assert math.dist(e.b, f.b) <= tolerance, f"element {n} ends at {e.b}, not {f.b}"
        if e.kind == "arc":
            assert e.ccw == f.ccw, f"arc {n} turns the other way"
            assert math.dist(e.centre, f.centre) <= tolerance, f"arc {n} about {e.centre}, not {f.centre}"


if __name__ == "__main__":
    shown = run_rs274(Path(sys.argv[1]).read_text(), {1: 6.0, 2: 3.0})
    print(shown.output)
