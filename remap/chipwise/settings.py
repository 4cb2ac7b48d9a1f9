# SPDX-License-Identifier: GPL-2.0-or-later
"""Every [CHIPWISE] key of the INI file: name, default, unit and check, in one table.

Called by the glue (remaps), by bin/chipwise and by the wiring scripts.  ini.py reads the file.
"""

import ipaddress
import math
import os
import re
from dataclasses import dataclass
from typing import Any, Callable, Optional

from chipwise import ini
from chipwise.errors import CycleError, braceless
from chipwise.rates import MAX_RATE, MM3_PER_CM3

SECTION = "CHIPWISE"

# Minimum angle of a ramp or an approach, degrees; 10 mm of depth are 5.7 m of travel then
MIN_ANGLE = 0.1
_ANGLE_RULE = f"an angle from {MIN_ANGLE:g} to 90 degrees"

# Maximum length that a finished wall is run on over its start, mm
MAX_SEAM_OVERLAP = 100.0

# What an alarm of the spindle's load does, in the order of chip_load_action
LOAD_ACTIONS = ("say", "hold", "slow")

# Minimum chop size, mm; far below what any kerf leaves
MIN_CHOP_SIZE = 0.1


def _number(text: str) -> float:
    """Text -> finite float."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def _whole(text: str) -> int:
    """Text -> int; 3.0 is not one."""
    return int(text, 10)


def _switch(text: str) -> bool:
    """yes/no, true/false, on/off, 1/0 -> bool."""
    known = {"yes": True, "true": True, "on": True, "1": True, "no": False, "false": False, "off": False, "0": False}
    if text.lower() not in known:
        raise ValueError
    return known[text.lower()]


def _pair(text: str) -> tuple[float, float]:
    """ "300 200" -> (300.0, 200.0)."""
    first, second = text.replace(",", " ").split()
    return _number(first), _number(second)


def _angles(text: str) -> tuple:
    """ "180 0 0" -> (180.0, 0.0, 0.0); nothing -> ()."""
    values = tuple(_number(word) for word in text.replace(",", " ").split())
    if len(values) not in (0, 3):
        raise ValueError
    return values


def _powers(text: str) -> tuple:
    """ "800" -> ((0.0, 800.0),); "6000:400 24000:800" -> ((6000.0, 400.0), (24000.0, 800.0)), 1/min and W; nothing ->
    ()."""
    points = tuple(
        (_number(speed), _number(power)) if colon else (0.0, _number(speed))
        for speed, colon, power in (word.partition(":") for word in text.replace(",", " ").split())
    )
    if (
        len(points) > 8
        or any(b[0] <= a[0] for a, b in zip(points, points[1:]))
        or any(speed < 0 or power <= 0 for speed, power in points)
    ):
        raise ValueError
    return points


def power_at(points: tuple, speed: float) -> float:
    """W at a speed, 1/min: on the line between two points, beyond the ends that of the last one, below the first one in
    proportion; 0: no limit."""
    if not points or speed <= 0.0:
        return 0.0
    if speed < points[0][0]:
        return points[0][1] * speed / points[0][0]
    for (low, a), (high, b) in zip(points, points[1:]):
        if speed <= high:
            return a + (b - a) * (speed - low) / (high - low)
    return points[-1][1]


def edge_power(settings: "Settings", speed: float) -> float:
    """W at the edges at a speed, 1/min: what SPINDLE_POWER leaves of SPINDLE_EFFICIENCY; 0: no limit."""
    return settings["SPINDLE_EFFICIENCY"] * power_at(settings["SPINDLE_POWER"], speed)


def spindle_limit(settings: "Settings", speed: float) -> float:
    """W at a speed, 1/min: what SPINDLE_POWER and SPINDLE_TORQUE leave; 0: no limit."""
    torque = settings["SPINDLE_TORQUE"] * 2.0 * math.pi * speed / 60.0 if speed > 0.0 else 0.0
    limits = [one for one in (edge_power(settings, speed), torque) if one > 0.0]
    return min(limits, default=0.0)


def _address(text: str) -> str:
    """The text of an IP address -> its usual form."""
    return str(ipaddress.ip_address(text))


@dataclass(frozen=True)
class Setting:
    """One key: default, unit, parser, check and the text of its rule."""

    default: Any
    unit: str
    parse: Callable[[str], Any]
    allowed: Callable[[Any], bool]
    rule: str


SETTINGS = {
    "CELL": Setting(0.25, "mm", _number, lambda v: 0.01 <= v <= 10, "a length from 0.01 to 10 mm"),
    "FINEST_CELL": Setting(0.1, "mm", _number, lambda v: 0.01 <= v <= 10, "a length from 0.01 to 10 mm"),
    "MAP_SIZE": Setting((300.0, 200.0), "mm", _pair, lambda v: min(v) > 0, "two lengths above 0 mm, X and Y"),
    "CHOP_SIZE": Setting(
        0.0,
        "mm",
        _number,
        lambda v: v == 0 or v >= MIN_CHOP_SIZE,
        f"0 (never chop) or a length of {MIN_CHOP_SIZE:g} mm or more",
    ),
    "CHORD": Setting(0.002, "mm", _number, lambda v: 1e-4 <= v <= 1, "a length from 0.0001 to 1 mm"),
    "CLOSE_GAP": Setting(0.01, "mm", _number, lambda v: 0 <= v <= 0.5, "a length from 0 to 0.5 mm"),
    "TOOL_GEOMETRY": Setting("", "path", str, lambda v: True, "the path of a TOML file"),
    "BARRIER_CLEARANCE": Setting(1.0, "mm", _number, lambda v: 0 <= v <= 100, "a length from 0 to 100 mm"),
    "CLAMP_CLEARANCE": Setting(1.0, "mm", _number, lambda v: 0 <= v <= 100, "a length from 0 to 100 mm"),
    "TURNING_STOCK": Setting("turning.stock", "path", str, lambda v: True, "the path of a file, or nothing"),
    "TURNING_STEPS": Setting("", "path", str, lambda v: True, "the path of a TOML file"),
    "ANALOG_OUT": Setting(0, "", _whole, lambda v: 0 <= v <= 61, "a whole number from 0 to 61 (three pins are used)"),
    "ANALOG_IN": Setting(0, "", _whole, lambda v: 0 <= v <= 63, "a whole number from 0 to 63"),
    "READ_PATH": Setting(True, "", _switch, lambda v: True, "yes or no"),
    "WORK": Setting(
        0,
        "%",
        _whole,
        lambda v: v == 0 or 10 <= v <= 100,
        "a whole number from 10 to 100, or 0 (measured at the start)",
    ),
    "MIN_FEED": Setting(0.0, "mm/min", _number, lambda v: v >= 0, "a feed of 0 mm/min (none) or more"),
    "MAX_FEED": Setting(0.0, "mm/min", _number, lambda v: v >= 0, "a feed of 0 mm/min (none) or more"),
    "MIN_FEED_SHARE": Setting(0.0, "", _number, lambda v: 0 <= v <= 1, "a share of F from 0 (none) to 1"),
    "MAX_FEED_SHARE": Setting(0.0, "", _number, lambda v: v >= 0, "a share of F of 0 (none) or more"),
    "AIR_FEED": Setting(0.0, "mm/min", _number, lambda v: v >= 0, "a feed of 0 mm/min (as the mode says) or more"),
    "PLUNGE_FEED": Setting(0.0, "mm/min", _number, lambda v: v >= 0, "a feed of 0 mm/min (none) or more"),
    "MAX_CHIP": Setting(0.0, "mm", _number, lambda v: v >= 0, "a thickness of 0 mm (none) or more"),
    "MATERIAL": Setting("", "", str, lambda v: True, "the name of a material, or nothing"),
    "MATERIALS": Setting("", "path", str, lambda v: True, "the path of a TOML file, or nothing"),
    "DEFAULT_CHIP": Setting(True, "", _switch, lambda v: True, "yes or no"),
    "SPINDLE_POWER": Setting(
        (), "W", _powers, lambda v: True, "a power above 0, or up to 8 points 1/min:W with rising speeds"
    ),
    "SPINDLE_EFFICIENCY": Setting(1.0, "", _number, lambda v: 0 < v <= 1, "a share above 0, 1 at most"),
    "SPINDLE_TORQUE": Setting(0.0, "Nm", _number, lambda v: 0 <= v <= 1e4, "a torque from 0 (none) to 10000 Nm"),
    "SPINDLE_LOAD_SCALE": Setting(
        1.0, "W", _number, lambda v: 0 <= v <= 1e6, "a power from 0 (not measured) to 1000000 W"
    ),
    "SPINDLE_LOAD_ACTION": Setting("say", "", str.lower, lambda v: v in LOAD_ACTIONS, "say, hold or slow"),
    "SPINDLE_LOADS": Setting("spindle_loads.toml", "path", str, lambda v: v != "", "the path of a TOML file"),
    "RECOVERY": Setting(0.0, "mm/s2", _number, lambda v: v >= 0, "an acceleration of 0 mm/s2 (at once) or more"),
    "DEADBAND": Setting(0.0, "", _number, lambda v: 0 <= v <= 1, "a share from 0 to 1"),
    "APPROACH_ANGLE": Setting(30.0, "deg", _number, lambda v: MIN_ANGLE <= v <= 90, _ANGLE_RULE),
    "RAMP_ANGLE": Setting(3.0, "deg", _number, lambda v: MIN_ANGLE <= v <= 90, _ANGLE_RULE),
    "SEAM_OVERLAP": Setting(
        0.3, "mm", _number, lambda v: 0 <= v <= MAX_SEAM_OVERLAP, f"a length from 0 to {MAX_SEAM_OVERLAP:g} mm"
    ),
    "ALLOWANCE": Setting(0.0, "mm", _number, lambda v: 0 <= v <= 100, "a length from 0 to 100 mm"),
    "SURFACE_TOLERANCE": Setting(0.01, "mm", _number, lambda v: 0.001 <= v <= 1, "a length from 0.001 to 1 mm"),
    "STOCK_DIR": Setting("stock", "path", str, lambda v: v != "", "the path of a folder"),
    "STATIONS": Setting("stations.toml", "path", str, lambda v: v != "", "the path of a TOML file"),
    "CLAMPS": Setting("clamps.toml", "path", str, lambda v: v != "", "the path of a TOML file"),
    "KEEP_STOCK": Setting(False, "", _switch, lambda v: True, "yes or no"),
    "SHADOW": Setting(True, "", _switch, lambda v: True, "yes or no"),
    "PATTERNS": Setting("patterns", "path", str, lambda v: v != "", "one or more paths of folders"),
    "ENTRY": Setting("", "path", str, lambda v: True, "the path of a TOML file"),
    "COLOURS": Setting("", "path", str, lambda v: True, "the path of a TOML file"),
    "TOOL_POSE": Setting((), "deg", _angles, lambda v: True, "three angles A B C, or nothing"),
    "KEEP_CLIMB": Setting(False, "", _switch, lambda v: True, "yes or no"),
    "TO_AND_FRO": Setting(False, "", _switch, lambda v: True, "yes or no"),
    "GUARD_RAPID": Setting(True, "", _switch, lambda v: True, "yes or no"),
    "PLAN_TIME": Setting(10, "s", _whole, lambda v: 1 <= v <= 600, "a whole number of seconds from 1 to 600"),
    "PLAN_MOVES": Setting(
        500_000, "", _whole, lambda v: 1000 <= v <= 10_000_000, "a whole number from 1000 to 10000000"
    ),
    "PLAN_MEMORY": Setting(1024, "MB", _whole, lambda v: 64 <= v <= 65_536, "a whole number of MB from 64 to 65536"),
    "FILTER_TIME": Setting(30.0, "s", _number, lambda v: 1 <= v <= 3600, "a time from 1 to 3600 s"),
    "FILTER_REFUSE": Setting(
        "unusable",
        "",
        str.lower,
        lambda v: v in ("unusable", "findings", "unchecked"),
        "unusable, findings or unchecked",
    ),
    "FILTER_REWRITE": Setting("no", "", str.lower, lambda v: v in ("no", "flute", "feed"), "no, flute or feed"),
    "FILTER_RATE": Setting(
        0.0,
        "cm3/min",
        _number,
        lambda v: 0 <= v <= MAX_RATE / MM3_PER_CM3,
        f"a removal rate from 0 (none) to {MAX_RATE / MM3_PER_CM3:g} cm3/min",
    ),
    "FILTER_CEILING": Setting(0.0, "mm/min", _number, lambda v: 0 <= v < 1e6, "a feed of 0 (that of the axes) or more"),
    "JOBS": Setting("", "path", str, lambda v: True, "the path of a folder, or nothing"),
    "SETUP_CEILING": Setting(2.0, "", _number, lambda v: 1 <= v <= 10, "a share of F from 1 to 10"),
    "SETUP_AIR": Setting(False, "", _switch, lambda v: True, "yes or no"),
    "AIR_CLEARANCE": Setting(0.5, "mm", _number, lambda v: 0.1 <= v <= 100, "a length from 0.1 to 100 mm"),
    "PROGRAM_PYTHON": Setting(False, "", _switch, lambda v: True, "yes or no"),
    "PANEL": Setting(True, "", _switch, lambda v: True, "yes or no"),
    "PANEL_ADDRESS": Setting(
        "127.0.0.1", "", _address, lambda v: True, "an IP address of this machine, or 0.0.0.0 for all of them"
    ),
    "PANEL_PORT": Setting(8250, "", _whole, lambda v: 1024 <= v <= 65_535, "a whole number from 1024 to 65535"),
    "PANEL_LOG": Setting("", "path", str, lambda v: True, "the path of a CSV file, or nothing"),
    "PANEL_TOKEN": Setting(
        "",
        "",
        str,
        lambda v: v == "" or re.fullmatch(r"[!-~]{8,200}", v) is not None,
        "nothing (read-only), or 8 to 200 letters, digits and signs without blanks",
    ),
    "TRAVERSE_CLEARANCE": Setting(0.2, "mm", _number, lambda v: 0 <= v <= 10, "a length from 0 to 10 mm"),
    "GUARD_FLUTE": Setting(True, "", _switch, lambda v: True, "yes or no"),
}


@dataclass(frozen=True)
class Settings:
    """Values by key, and the folder that relative paths are relative to."""

    values: tuple
    folder: str

    def __getitem__(self, key: str) -> Any:
        return dict(self.values)[key]

    def path(self, key: str) -> str:
        """A path setting as a usable path, "" if it is not set; relative means relative to the INI file."""
        value = self[key]
        return os.path.join(self.folder, os.path.expanduser(value)) if value else ""


def parse_settings(found: dict[str, str], folder: str = "") -> Settings:
    """{KEY: text} -> Settings.  Raises CycleError for an unknown key, an unreadable or a forbidden value."""
    for key in found:
        if key not in SETTINGS:
            raise CycleError(f"[{SECTION}]{key} is not a setting", "use one of " + ", ".join(sorted(SETTINGS)))
    values = []
    for key, setting in SETTINGS.items():
        value = setting.default
        if key in found:
            try:
                value = setting.parse(found[key])
                good = setting.allowed(value)
            except (ValueError, KeyError):
                good = False
            if not good:
                raise CycleError(
                    f"[{SECTION}]{key} = {braceless(found[key])} is not {setting.rule}", "correct the INI file"
                )
        values.append((key, value))
    return Settings(tuple(values), folder)


_cache: dict = {}


def load_settings(ini_path: Optional[str] = None) -> Settings:
    """The settings of an INI file (default: INI_FILE_NAME; without any: the defaults).

    Cached by path and time of change.  Raises CycleError if the file or a value cannot be used.
    """
    path = ini_path or ini.file_name()
    if not path:
        return parse_settings({})
    try:
        stamp = (os.path.abspath(path), os.stat(path).st_mtime_ns)
        if stamp not in _cache:
            lines = ini.read_lines(path)
            _cache.clear()
            _cache[stamp] = parse_settings(ini.section_of(lines, SECTION), os.path.dirname(stamp[0]))
    except (OSError, ValueError) as error:
        raise CycleError(
            f"INI file {braceless(path)}: {getattr(error, 'strerror', None) or error}",
            "correct --ini, or INI_FILE_NAME",
        ) from error
    return _cache[stamp]


def _machine_lines(ini_path: Optional[str]) -> Optional[list[str]]:
    """The lines of an INI file (default: INI_FILE_NAME), None if there is none to read."""
    path = ini_path or ini.file_name()
    try:
        return ini.read_lines(path) if path else None
    except OSError:
        return None


def feed_is_remapped(ini_path: Optional[str] = None) -> bool:
    """Whether [RS274NGC] has REMAP = F; True if there is no INI file to read."""
    lines = _machine_lines(ini_path)
    return lines is None or any(
        re.match(r"F(\s|$)", text, re.IGNORECASE) for text in ini.values_of(lines, "RS274NGC", "REMAP")
    )


def planner_limits_jerk(ini_path: Optional[str] = None) -> bool:
    """Whether the planner of LinuxCNC limits the jerk; False if there is no INI file to read."""
    return ini.limits_jerk(_machine_lines(ini_path) or [])
