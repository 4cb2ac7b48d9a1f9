# SPDX-License-Identifier: GPL-2.0-or-later
"""The tool's orientation in a station, and what of the robot, or of a tilting table, G75 has to know.  Called by
glue/pattern.py.

[CHIPWISE]TOOL_POSE says that A, B and C are roll, pitch and yaw of the tool, or the angles of a table that
stations.pose knows, and what they are in a level station.
"""

from __future__ import annotations

import os
import subprocess
from typing import TYPE_CHECKING

from chipwise import ini
from chipwise.host.clock import patience
from chipwise.errors import CycleError, braceless
from chipwise.glue.soft_limits import tool_offset
from chipwise.machine import limits

if TYPE_CHECKING:
    from chipwise.glue.state import State
    from chipwise.pattern.isometry import Isometry

PATIENCE_S = 5.0
_AXES = ("AA", "BB", "CC")


def of(state: State, station: Isometry | None, travel: dict[str, tuple] | None) -> dict[str, object]:
    """{"pose": .., "reach": ..} of a PatternRequest, {} on a machine whose tool keeps its axis.

    station: Isometry from its coordinates to work coordinates, None without one; travel: fields of a Travel, None in
    the preview.
    """
    pose = state.settings["TOOL_POSE"]
    if not pose:
        return {}
    lines = tuple(ini.read_lines(ini.file_name()))
    letters = ini.section_of(lines, "TRAJ").get("COORDINATES", "").upper()
    module, *arguments = ini.section_of(lines, "KINS").get("KINEMATICS", "").split() or [""]
    import numpy as np  # here, so that a machine without TOOL_POSE does not load it

    from chipwise.stations import pose as poses

    table = poses.TABLES.get(module)
    if not set(table or "ABC") <= set(letters):
        needed = " and ".join(table) if table else "A, B and C"
        raise CycleError(
            f"[CHIPWISE]TOOL_POSE is set, and the machine has no axes {needed}", "take TOOL_POSE out of the INI file"
        )
    now = tuple(float(getattr(state.interp, f"{axis}_current")) for axis in _AXES)
    if table:
        _check_switch(module, arguments, travel)
    reach = _reach(lines, now, module, tool_offset(state)[2] if table else None) if travel else None
    if station is None:
        return {"reach": reach}
    _check_offsets(state, table)
    angle = np.radians(state.interp.rotation_xy)
    turned = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    matrix = turned @ np.array(station.matrix)
    if table:
        ranges = [(low, high) for _name, low, high in limits.rotary_limits(ini.file_name())]
        return {"pose": poses.table_in_station(table, matrix, pose, now, ranges), "reach": reach}
    return {"pose": poses.in_station(matrix, pose, now), "reach": reach}


def _check_switch(module: str, arguments: list[str], travel: dict[str, tuple] | None) -> None:
    """Raise CycleError for a table whose coordinates are not those of the part."""
    odd = [word for word in arguments if word.lower() != "coordinates=xyz" + module[3:5]]
    if odd:
        raise CycleError(
            f"[KINS]KINEMATICS of the table has {braceless(odd[0])}: G75 with P knows its usual joints only",
            "leave it out, or leave TOOL_POSE out",
        )
    if travel and _pins("motion.switchkins-type").get("motion.switchkins-type"):
        raise CycleError(
            "the kinematics are switched (motion.switchkins-type is not 0): X Y Z are not those of the part",
            "switch them back",
        )


def _check_offsets(state: State, table: str | None) -> None:
    """Raise CycleError for offsets that would turn or shift the tool in another direction than the station's."""
    interp = state.interp
    for axis in _AXES:
        if getattr(interp, f"{axis}_origin_offset") or getattr(interp, f"{axis}_axis_offset"):
            raise CycleError(
                f"the work offset of {axis[0]} is not 0: the tool would not be square to the station",
                f"set it to 0, as with G10 L2 P1 {axis[0]}0",
            )
    if table and any(tool_offset(state)[:2]):
        raise CycleError(
            "the tool has an offset in X or Y, which the table's kinematics do not know",
            "set it to 0 in the tool table",
        )
    if not table and any(tool_offset(state)):
        raise CycleError(
            "a tool length is on (G43): it acts along Z of the machine, and not along the tool",
            "program G49, and put the length into the kinematics",
        )


def _reach(lines: tuple[str, ...], now: tuple[float, ...], module: str, length: float | None) -> dict[str, object]:
    """What a cycles.reach.Reach is made of; length: mm of the tool (G43), of a table, whose pin tool-offset has it when
    the machine gets there."""
    joints = limits.joint_limits(lines)
    pins = _pins(f"{module}.*", "joint.*.pos-cmd")
    named = [f"joint.{k}.pos-cmd" for k in range(len(joints))]
    per_mm = 1.0 / ini.unit_mm(ini.section_of(lines, "TRAJ").get("LINEAR_UNITS", "mm"))
    if length is not None:
        pins[f"{module}.tool-offset"] = length * per_mm
    if not set(named) <= set(pins):
        raise CycleError(
            "the robot's joints cannot be read: HAL has no pins joint.N.pos-cmd", "see what `halcmd show pin` says"
        )
    return dict(
        module=module,
        pins=tuple((name, value) for name, value in pins.items() if name.startswith(module + ".")),
        joints=tuple(pins[name] for name in named),
        limits=joints,
        abc=now,
        per_mm=per_mm,
        speeds=limits.traverse_speeds(lines),
    )


def _pins(*patterns: str) -> dict[str, float]:
    """{name: value} of the HAL pins that are numbers."""
    found = {}
    try:
        for pattern in patterns:
            said = subprocess.run(
                ["halcmd", "-s", "show", "pin", pattern],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=patience(PATIENCE_S),
                check=True,
                env={**os.environ, "LC_ALL": "C"},
            ).stdout
            for line in said.splitlines():
                words = line.split()
                if len(words) >= 5 and words[1] in ("float", "real"):
                    found[words[4]] = float(words[3])
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        raise CycleError(
            f"the robot's joints cannot be read: {braceless(str(error))}", "see what `halcmd show pin` says"
        ) from error
    return found
