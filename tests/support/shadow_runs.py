# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs on the real LinuxCNC with SHADOW = yes or no, and what differs between two runs, servo period by servo
period.

Called by bench/bench_shadow.py and tests/machine/test_shadow_manners.py.
"""

import subprocess

import numpy as np

from support import ROOT
from support.headless_rig import WITH_LOG, own_ini
from support.operate import operate

MACHINES = {"metric": "mill.ini", "inch": "mill_inch.ini", "gmoccapy": "mill_gmoccapy.ini"}
SPEED = 4.0
SWITCH = WITH_LOG + "\ns/^KEEP_STOCK = .*/KEEP_STOCK = no\\nSHADOW = {}/"
PINS = ["pins", "stock-tracker.0.stock-defined", "stock-tracker.0.certain", "stock-tracker.0.removed-volume"]
TIMEOUT_S = 1500.0


def steps_of(paths, shadow):
    """For operate(): each program on a place of its own."""
    found = []
    for at, path in enumerate(paths):
        found += [
            ["mdi", f"G21 G10 L2 P1 X{30 + 0.37 * at:.2f} Y{25 + 0.23 * at:.2f} Z-25"],
            ["mdi", "G64 P0.01"],
            ["mdi", "T0 M6"],
            ["mdi", "G53 G0 Z60"],
            ["mdi", "G53 G0 X5 Y5"],
            ["open", str(path)],
            ["messages", f"{path.name}: "] if shadow else ["sleep", 0.1],
            ["log together", str(path)],
            PINS,
        ]
    return found


def moves(path):
    """(n, 5) rows of a log in which something moves: position, tool offset, adaptive feed; None if it lacks servo
    periods.  How long the machine rests between depends on the task's timing."""
    log = np.load(path)
    if (np.diff(log["sample"]) != 1).any():
        return None
    rows = np.column_stack([log[name] for name in ("x", "y", "z", "tool_offset_z", "adaptive_feed")])
    return rows[np.append(False, np.abs(np.diff(rows[:, :3], axis=0)).max(axis=1) > 0)]


def run(folder, texts, machine, shadow):
    """{name: (operator errors, moves() or None, what was said of the stock, pins at the end)}."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.ngc" for name in texts]
    for path in paths:
        path.write_text(texts[path.stem])
    answers = operate(
        folder,
        steps_of(paths, shadow),
        ini=MACHINES[machine],
        edit=SWITCH.format("yes" if shadow else "no"),
        speed=SPEED,
        timeout=TIMEOUT_S,
    )
    found = {}
    for at, path in enumerate(paths):
        said, (errors, log), pins = answers[9 * at + 6 : 9 * at + 9]
        found[path.stem] = errors, moves(log), said or [], pins
    return found


def strange(ours, theirs):
    """Number of rows that are not those of the other run, to the last digit; all of them if it has another number of
    rows."""
    return len(ours) if ours.shape != theirs.shape else int((ours != theirs).any(axis=1).sum())


def canonical(folder, text, machine, shadow):
    """What rs274 prints of a program."""
    source = ROOT / "configs" / MACHINES[machine]
    copy = own_ini(folder, source, CHIPWISE=f"KEEP_STOCK = no\nSHADOW = {shadow}")
    (folder / "canonical.ngc").write_text(text)
    return subprocess.run(
        ["rs274", "-g", "-i", copy, str(folder / "canonical.ngc")],
        cwd=source.parent,
        env={"PATH": "/usr/bin:/bin", "HOME": str(folder), "LANG": "C.UTF-8"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
    ).stdout
