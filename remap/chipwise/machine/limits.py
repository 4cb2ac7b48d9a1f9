# SPDX-License-Identifier: GPL-2.0-or-later
"""Soft limits of the axes, from the INI file, mm.  Called by glue/soft_limits.py.

LinuxCNC refuses a move whose end is beyond [AXIS_L] or beyond [JOINT_n] (command.c: inRange, 2.9 and 2.10).  With
trivial kinematics a joint is an axis, so the tighter of both counts; with other kinematics a joint's limit says nothing
of an axis.
"""

import math
import re
from functools import lru_cache

from chipwise.ini import read_lines, section_of, unit_mm

LETTERS = "XYZABCUVW"  # joints of trivkins in their order, without coordinates=


def axis_limits(path):
    """((name, low, high), ..) of X, Y and Z in mm, machine coordinates; infinite where the INI file has none.  Raises
    OSError."""
    return _limits(path, tuple(read_lines(path)))


@lru_cache(maxsize=4)
def _limits(_path, lines):
    scale = unit_mm(section_of(lines, "TRAJ").get("LINEAR_UNITS", "mm"))
    found = {letter: [f"axis {letter}", -math.inf, math.inf] for letter in "XYZ"}
    for letter in "XYZ":
        _tighten(found[letter], section_of(lines, f"AXIS_{letter}"), scale)
    for joint, letter in enumerate(trivial_joints(lines)):
        if letter in found:
            _tighten(found[letter], section_of(lines, f"JOINT_{joint}"), scale)
    return tuple((name, low, high) for name, low, high in found.values())


def rotary_limits(path):
    """((name, low, high), ..) of A, B and C in degrees; as axis_limits()."""
    lines = tuple(read_lines(path))
    found = {letter: [f"axis {letter}", -math.inf, math.inf] for letter in "ABC"}
    for letter in "ABC":
        _tighten(found[letter], section_of(lines, f"AXIS_{letter}"), 1.0)
    for joint, letter in enumerate(trivial_joints(lines)):
        if letter in found:
            _tighten(found[letter], section_of(lines, f"JOINT_{joint}"), 1.0)
    return tuple(map(tuple, found.values()))


def machine_axes(lines):
    """Letters of the axes X Y Z A B C that the machine has, in this order; all that LinuxCNC assumes without
    [TRAJ]COORDINATES."""
    named = section_of(lines, "TRAJ").get("COORDINATES", "XYZ").upper()
    return "".join(letter for letter in "XYZABC" if letter in named)


def joint_limits(lines):
    """((lowest, highest, speed per s), ..) of the joints, as the kinematics have them: machine units, degrees."""
    found = []
    for joint in range(int(section_of(lines, "KINS").get("JOINTS", "0"))):
        section = section_of(lines, f"JOINT_{joint}")
        low, high, speed = (_number(section.get(key, "")) for key in ("MIN_LIMIT", "MAX_LIMIT", "MAX_VELOCITY"))
        found.append(
            (
                -math.inf if low is None else low,
                math.inf if high is None else high,
                math.inf if speed is None else speed,
            )
        )
    return tuple(found)


def traverse_speeds(lines):
    """(mm/s, degrees/s) of a traverse: those of the slowest axis."""
    scale = unit_mm(section_of(lines, "TRAJ").get("LINEAR_UNITS", "mm"))
    speeds = [
        [_number(section_of(lines, f"AXIS_{letter}").get("MAX_VELOCITY", "")) or math.inf for letter in letters]
        for letters in ("XYZ", "ABC")
    ]
    return min(speeds[0]) * scale, min(speeds[1])


def trivial_joints(lines):
    """Letters of the axes that are joints 0, 1, ..; "" unless the kinematics are trivkins."""
    text = section_of(lines, "KINS").get("KINEMATICS", "")
    if text.split()[:1] != ["trivkins"]:
        return ""
    named = re.search(r"coordinates\s*=\s*\"?([A-Za-z]+)", text)
    return named[1].upper() if named else LETTERS


def _tighten(limit, section, scale):
    """Take the limits of a section where they are tighter."""
    low, high = (_number(section.get(key, "")) for key in ("MIN_LIMIT", "MAX_LIMIT"))
    limit[1] = limit[1] if low is None else max(limit[1], low * scale)
    limit[2] = limit[2] if high is None else min(limit[2], high * scale)


def _number(text):
    """A finite number; None of anything else: LinuxCNC then uses its default, no limit."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
