# SPDX-License-Identifier: GPL-2.0-or-later
"""The program that LinuxCNC has loaded, and what its path depends on.  Called by panel/machine.py, panel/look_ahead.py,
monitor/shadow.py and monitor/set_up.py."""

import os

MODAL = (70, 80, 170, 180, 190, 200, 210, 900, 910, 901, 911)  # of stat.gcodes: codes that say how coordinates are read


def identity(program, follow_links=True):
    """What tells a file, or a link itself, from what it was before; None for one that is not there."""
    try:
        found = os.stat(program, follow_symlinks=follow_links)
        return found.st_mtime_ns, found.st_size, found.st_ino
    except (OSError, ValueError):
        return None


class MainProgram:
    """Path of the program that is open.  LinuxCNC's status has the file of a sub instead, and that of the body of a
    remapped code, while the interpreter is in it.  While a program runs, LinuxCNC 2.10 has the file of the move that is
    under way (emctask.cc: emcTaskUpdate), which is the program before until the first move begins."""

    def __init__(self):
        self.path = ""
        self.before = None  # the program before, until the status has had `path` while it ran

    def of(self, status, idle):
        """From a linuxcnc.stat; idle: whether the interpreter is."""
        in_sub = self.path and getattr(status, "call_level", 0)
        if idle:
            if status.file != self.path:
                self.path, self.before = status.file, self.path
        elif status.file == self.path:
            self.before = None
        elif status.file != self.before and not in_sub:
            self.path, self.before = status.file, None
        return self.path


def scene(status):
    """Of a linuxcnc.stat: {"index" of the work offset, its "offset", "g92", "turn" (machine units, degrees), "tool",
    "codes" in force, "block_delete"}."""
    return {
        "index": max(1, status.g5x_index),  # 0: LinuxCNC has not said it yet
        "offset": [round(v, 9) for v in status.g5x_offset[:3]],
        "g92": [round(v, 9) for v in status.g92_offset[:3]],
        "turn": round(status.rotation_xy, 9),
        "tool": max(0, status.tool_in_spindle),
        "block_delete": bool(status.block_delete),
        "codes": " ".join(f"G{code / 10:g}" for code in status.gcodes if code in MODAL),
    }


def place(scene):
    """The work offset of a scene(): what says where on the machine a program cuts."""
    return [scene[name] for name in ("index", "offset", "g92", "turn")]
