# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs of the simulated lathe through the preview's interpreter, with a tool table of the test.  Called by
tests/turning."""

import json
import math
import os
import re
import subprocess
from typing import NamedTuple

from support import ROOT, forked
from support.canon import split_line

HOME = (100.0, 100.0)  # z, x: where the preview is put before the program, mm


class Seen(NamedTuple):
    """moves: [(kind, line, (z, x) mm work coordinates of the tip, x a radius, feed mm, arc's (z, x, turn) or None)];
    marks: {comment: number of moves before}; modes: {comment: modes}; messages; tools: offsets (z, x) mm in their
    order; error; error_line."""

    moves: list
    marks: dict
    modes: dict
    messages: list
    tools: list
    error: str
    error_line: int

    def between(self, first, second):
        """Moves between two comments that go anywhere."""
        moves, at = [], self.moves[self.marks[first] - 1][2] if self.marks[first] else (0.0, 0.0)
        for move in self.moves[self.marks[first] : self.marks[second]]:
            if math.dist(move[2], at) > 1e-7 or move[4]:
                moves.append(move)
            at = move[2]
        return moves


def machine(folder, table="", ini="lathe.ini", geometry="", edit=None):
    """Path of an INI file in a folder, with its tool table and tool geometry."""
    for name in (ini, "lathe_tools.toml", "lathe.tbl", "lathe_inch.tbl"):
        path = os.path.join(ROOT, "configs", name)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                (folder / name).write_text(file.read())
    text = (
        (folder / ini)
        .read_text()
        .replace("PATH_PREPEND = remap", f"PATH_PREPEND = {ROOT / 'remap'}")
        .replace("TOPLEVEL = remap/", f"TOPLEVEL = {ROOT / 'remap'}/")
    )
    (folder / ini).write_text(edit(text) if edit else text)
    if table:
        (folder / re.search(r"TOOL_TABLE = (\S+)", text)[1]).write_text(table)
    if geometry:
        (folder / "lathe_tools.toml").write_text(geometry)
    return folder / ini


def canon_calls(folder, ini):
    """The finished rs274 that has read part.ngc of a machine's folder, remapped codes included: its stdout has the
    canonical calls."""
    (folder / "test.var").write_text("5161 0\n")
    files = ["-i", ini, "-t", folder / "lathe.tbl", "-v", folder / "test.var", folder / "part.ngc"]
    return subprocess.run(
        ["rs274", "-g", *map(str, files)],
        env={**os.environ, "HOME": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def preview(folder, ini, program):
    """Seen of a program's text."""
    text = ini.read_text()
    unit = 25.4 if re.search(r"LINEAR_UNITS = in", text) else 1.0
    path = folder / "program.ngc"
    path.write_text(program)
    (folder / "test.var").write_text("5161 0\n")
    table = folder / re.search(r"TOOL_TABLE = (\S+)", text)[1]
    run = forked.preview(
        [str(path), repr(1 / unit), str(table), str(folder / "test.var")],
        cwd=ROOT,
        timeout=300,
        env={**os.environ, "HOME": str(folder), "INI_FILE_NAME": str(ini), "AXIS_MASK": "5"},
    )
    if run.returncode != 0:
        raise RuntimeError(f"preview: exit {run.returncode}\n{run.stderr}")
    result = json.loads(run.stdout.splitlines()[-1])
    return _seen(result)


def _seen(result):
    moves, marks, modes, messages, tools, feed = [], {}, {}, [], [], 0.0
    for kind, line, *n in result["calls"]:
        if kind in ("rapid", "feed"):
            moves.append((kind, line, (n[2], n[0]), feed if kind == "feed" else None, None))
        elif kind == "arc":  # in G18 the first coordinates are Z and X
            moves.append(("arc", line, (n[0], n[1]), feed, (n[3], n[4], n[5])))
        elif kind == "F":
            feed = n[0]
        elif kind == "comment":
            marks[n[0]], modes[n[0]] = len(moves), n[1]
        elif kind == "message":
            messages.append(n[0])
        elif kind == "tool offset":
            tools.append((n[2], n[0]))
    error, line = split_line(result["error"])
    return Seen(moves, marks, modes, messages, tools, error, line)
