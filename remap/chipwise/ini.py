# SPDX-License-Identifier: GPL-2.0-or-later
"""Read LinuxCNC's INI file: the one reader of the whole package.

Called by settings.py, by the glue, by bin/chipwise and by the display program of the headless machine.  LinuxCNC names
the file in the environment variable INI_FILE_NAME; linuxcnc, AXIS and `rs274 -i` all set it.  The module `linuxcnc` is
not importable everywhere a remap runs, and configparser refuses repeated keys (REMAP).  As in LinuxCNC, the first of
several equal keys counts.
"""

import ctypes
import errno
import math
import os
import re
from typing import Iterable, Iterator, Optional, Sequence

from chipwise.errors import MM_PER_INCH, CycleError, braceless
from chipwise.host.files import has_cr_alone, read_bytes

MAX_BYTES = 1 << 22  # of an INI file
INCLUDE = re.compile(r"#INCLUDE[ \t]+(\S.*?)\s*$")
MAX_INCLUDES = 16  # files within each other, as in LinuxCNC
UNITS_MM = {
    "mm": 1.0,
    "metric": 1.0,
    "in": MM_PER_INCH,
    "inch": MM_PER_INCH,
    "imperial": MM_PER_INCH,
}  # [TRAJ]LINEAR_UNITS


def unit_mm(linear_units: str) -> float:
    """[TRAJ]LINEAR_UNITS as mm per machine unit.  Raises ValueError for text that is neither a name nor a number above
    0."""
    known = UNITS_MM.get(linear_units.lower())
    number = known or float(linear_units)
    if not 0 < number < math.inf:
        raise ValueError(linear_units)
    return known or 1.0 / number


def file_name() -> str:
    """INI_FILE_NAME of the process, "" if it is not set.

    rs274 sets it by setenv() after the embedded Python has started; os.environ is a copy made before that.
    """
    getenv = ctypes.CDLL(None).getenv
    getenv.restype = ctypes.c_char_p
    return os.fsdecode(getenv(b"INI_FILE_NAME") or b"")


def read_lines(path: str) -> list[str]:
    """Lines of an INI file.  Raises OSError.

    2.9 writes INI.expanded, with the files of #INCLUDE lines in it, and names that; what is left in it no longer
    counts.  2.10 names the INI file itself, and its processes read what is included (emc/ini/inifile.cc).  A file that
    cannot be read leaves its line here."""
    lines = read_bytes(path, MAX_BYTES).decode("utf-8", "replace").split("\n")
    return lines if path.endswith(".expanded") else list(_with_included(lines, path, MAX_INCLUDES))


def _with_included(lines: Iterable[str], path: str, depth: int) -> Iterator[str]:
    """Lines of the file at path, with those of the files they include."""
    for line in lines:
        named = INCLUDE.match(line)
        try:
            if not named or not depth:
                raise OSError
            place = os.path.join(os.path.dirname(path), os.path.expanduser(named[1]))
            included = read_bytes(place, MAX_BYTES).decode("utf-8", "replace").split("\n")
        except OSError:
            yield line
        else:
            yield from _with_included(included, place, depth - 1)


def expanded(path: str) -> str:
    """The text of an INI file with its #INCLUDE lines replaced, as `linuxcnc` does it.  Raises OSError."""
    lines = []
    for line in _whole(path).splitlines(keepends=True):
        words = line.split(None, 1)
        if words[:1] == ["#INCLUDE"] and len(words) == 2:
            name = os.path.expanduser(os.path.expandvars(words[1].strip()))
            lines.append(_whole(os.path.join(os.path.dirname(path), name)) + "\n")
        else:
            lines.append(line)
    return "".join(lines)


def usable(path: str) -> str:
    """expanded() of a file that LinuxCNC can read.  Raises OSError."""
    data = read_bytes(path, MAX_BYTES)
    if b"\0" in data:
        raise OSError(errno.EINVAL, "it is not a text file", path)
    if has_cr_alone(data):
        raise OSError(errno.EINVAL, "its lines end with CR alone, so LinuxCNC reads it as one line", path)
    text = expanded(path)
    if not re.search(r"(?m)^\s*\[", text):
        raise OSError(errno.EINVAL, "it has no section", path)
    return text


def _whole(path: str) -> str:
    """The text of a file, whatever its bytes and line ends.  Raises OSError."""
    return read_bytes(path, MAX_BYTES).decode("utf-8", "surrogateescape").replace("\r\n", "\n").replace("\r", "\n")


def _entries(lines: Iterable[str]) -> Iterator[tuple[int, str, str, str]]:
    """Yield (number of the section header, SECTION, KEY, text) of every entry; before the first header: 0 and ""."""
    header, section = 0, ""
    for line in lines:
        line = line.strip()
        if line.startswith("["):
            header, section = header + 1, line[1:].partition("]")[0].strip().upper()
        elif line and line[0] not in "#;":
            key, equals, text = line.partition("=")
            if equals:
                # a trailing comment starts with " #", as in LinuxCNC's own INI files
                yield header, section, key.strip().upper(), text.partition(" #")[0].strip()


def section_of(lines: Iterable[str], name: str) -> dict[str, str]:
    """INI lines -> {KEY: text} of all sections of that name; the first of several equal keys counts."""
    found: dict[str, str] = {}
    for _header, section, key, text in _entries(lines):
        if section == name:
            found.setdefault(key, text)
    return found


def first_section_of(lines: Sequence[str], name: str) -> Optional[list[tuple[str, str]]]:
    """INI lines -> [(KEY, text)] of the first section of that name, repeated keys included; None without one."""
    header = 0
    for line in lines:
        line = line.strip()
        if line.startswith("["):
            header += 1
            if line[1:].partition("]")[0].strip().upper() == name:
                return [(key, text) for number, _section, key, text in _entries(lines) if number == header]
    return None


def values_of(lines: Iterable[str], section: str, key: str) -> list[str]:
    """Every text of a key that may be repeated, in their order."""
    return [text for _header, name, found, text in _entries(lines) if (name, found) == (section, key)]


def limits_jerk(lines: Iterable[str]) -> bool:
    """Whether the planner limits the jerk: [TRAJ]PLANNER_TYPE is 1 (LinuxCNC 2.10)."""
    return section_of(lines, "TRAJ").get("PLANNER_TYPE", "").strip() == "1"


class Ini:
    """The INI file LinuxCNC runs with, or the one at `path`.  Raises CycleError if it cannot be read."""

    def __init__(self, path: Optional[str] = None):
        self.path = path or file_name()
        if not self.path:
            raise CycleError(
                "no INI file: this is called by chipwise.hal while LinuxCNC starts",
                "put HALFILE = chipwise.hal into the [HAL] section of your INI file",
            )
        try:
            self.lines = read_lines(self.path)
        except OSError as error:
            raise CycleError(
                f"INI file {braceless(self.path)}: {error.strerror}", "correct --ini, or INI_FILE_NAME"
            ) from error

    def section(self, name: str) -> dict[str, str]:
        """{KEY: text}, {} without such a section."""
        return section_of(self.lines, name)

    def text(self, section: str, key: str, default: str = "") -> str:
        return self.section(section).get(key, default)

    def number(self, section: str, key: str, default: Optional[float] = None) -> Optional[float]:
        """A number above 0, `default` if the key is missing.  Raises CycleError."""
        text = self.text(section, key)
        if not text:
            return default
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not 0 < number < math.inf:
            raise CycleError(f"[{section}]{key} = {braceless(text)} is not a number above 0", "correct the INI file")
        return number

    def tool_table(self) -> str:
        """Path of [EMCIO]TOOL_TABLE; "" without one."""
        name = self.text("EMCIO", "TOOL_TABLE")
        return os.path.join(os.path.dirname(os.path.abspath(self.path)), os.path.expanduser(name)) if name else ""

    def units_per_mm(self) -> float:
        """[TRAJ]LINEAR_UNITS as machine units per mm."""
        text = self.text("TRAJ", "LINEAR_UNITS", "mm")
        try:
            return 1.0 / unit_mm(text)
        except ValueError as error:
            raise CycleError(f"[TRAJ]LINEAR_UNITS = {braceless(text)} is not a unit", "use mm or inch") from error

    def startup_codes(self) -> str:
        """Codes in force when LinuxCNC has started: its unit, and [RS274NGC]RS274NGC_STARTUP_CODE."""
        return ("G20 " if self.units_per_mm() < 0.1 else "G21 ") + self.text(
            "RS274NGC", "RS274NGC_STARTUP_CODE"
        ).upper()

    def servo_period_s(self) -> float:
        """[EMCMOT]SERVO_PERIOD in s."""
        return (self.number("EMCMOT", "SERVO_PERIOD") or 1e6) * 1e-9
