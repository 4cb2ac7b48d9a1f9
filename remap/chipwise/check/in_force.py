# SPDX-License-Identifier: GPL-2.0-or-later
"""A Machine with the work offsets and the tool that are in force.  Called by the processes that read the loaded
program: panel/look_ahead_process.py, panel/set_up.py, monitor/shadow_process.py, setup/job_process.py and
setup/time_process.py; resume/running.py takes the work offsets alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from chipwise.program.reader import Machine
from chipwise.host.temp_folder import put

G92, SYSTEM, OFFSETS, TURN, EACH = 5210, 5220, 5221, 9, 20  # parameters of LinuxCNC, numbers of LinuxCNC's manual


def parameters(text: str, scene: Mapping[str, Any]) -> str:
    """The text of a parameter file with the work offsets that are in force, machine units."""
    values = {}
    for row in text.splitlines():
        words = row.split()
        if len(words) >= 2 and words[0].isdigit():
            values[int(words[0])] = words[1]
    first = OFFSETS + EACH * (scene["index"] - 1)
    known = {
        SYSTEM: scene["index"],
        first + TURN: scene["turn"],
        G92: float(any(scene["g92"])),
        **dict(zip(range(first, first + 3), scene["offset"])),
        **dict(zip(range(G92 + 1, G92 + 4), scene["g92"])),
    }
    values.update((number, f"{value:.9f}") for number, value in known.items())
    return "".join(f"{number} {value}\n" for number, value in sorted(values.items()))


def machine_in_force(ini: str, scene: Mapping[str, Any], folder: str) -> Machine:
    """The check.reader.Machine of an INI file; scene: loaded.scene()."""
    machine = with_offsets(Machine(ini), scene, folder)
    machine.tool, machine.block_delete = scene["tool"], scene["block_delete"]
    machine.codes = ["G20" if machine.unit_mm > 10 else "G21", scene["codes"]]
    return machine


def with_offsets(machine: Machine, scene: Mapping[str, Any], folder: str) -> Machine:
    """A check.reader.Machine with the work offsets that are in force; else it begins as the INI file says."""
    try:
        with open(machine.parameters, encoding="utf-8", errors="replace") as file:
            text = file.read(1 << 20)
    except OSError:
        text = ""
    machine.parameters = put(folder, "now.var", parameters(text, scene))
    return machine
