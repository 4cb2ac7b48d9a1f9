# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's stand-alone interpreter `rs274`, which prints what a program would move without a machine.

Called by `chipwise try`, by tests/support/canon.py and by the benchmarks.  Properties of rs274, measured on
2.9.0~pre1 (Debian 12) and 2.9.4 (Debian 13):

1. Its machine unit, the one of the tool table: 2.9.0~pre1 is an inch machine whatever the INI file says, 2.9.4 follows
   [TRAJ]LINEAR_UNITS.  It is measured here, because the version does not determine it.
2. It expands no #INCLUDE; `linuxcnc` does that.
3. Relative paths of the INI file count from the current directory; `linuxcnc` changes to the INI file's.
4. It empties ~/.tool.mmap, the tool table of a running LinuxCNC: it needs a HOME of its own.
5. It writes its parameter file.
"""

import functools
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path

from chipwise.program import program_code
from chipwise.errors import with_line
from chipwise.ini import section_of, unit_mm, usable
from chipwise.host.temp_folder import OwnFolder, check_room, put
from chipwise.settings import SECTION, parse_settings

PATIENCE_S = 60.0
PROBE = "G21\nT1 M6\nG43\nM2\n"  # prints the length of a tool of 1 machine unit in mm
LENGTHS = re.compile(r"(?<![A-Za-z])([DXYZUVW])\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+))", re.IGNORECASE)
PATH_KEYS = ("TOOL_GEOMETRY", "MATERIALS", "STOCK_DIR", "STATIONS", "CLAMPS", "TURNING_STEPS")
TABLE = re.compile(r"(?m)^(\s*TOOL_TABLE\s*=\s*)([^\s#;].*?)(?=\s*$| #)")


class Rs274Error(Exception):
    """rs274 cannot be used; str() has reason and remedy."""


def units_in_mm(linear_units):
    """[TRAJ]LINEAR_UNITS as mm per machine unit."""
    try:
        return unit_mm(linear_units)
    except ValueError:
        raise Rs274Error(f"[TRAJ]LINEAR_UNITS = {linear_units} is not a unit; use mm or inch") from None


@functools.lru_cache(maxsize=None)
def tool_table_unit(linear_units="mm"):
    """mm per unit of rs274's tool table under an INI file with these LINEAR_UNITS."""
    with OwnFolder("rs274") as folder:
        files = {
            "probe.ini": f"[TRAJ]\nLINEAR_UNITS = {linear_units}\n",
            "probe.tbl": "T1 P1 Z1 D1\n",
            "probe.var": "5161 0\n",
            "probe.ngc": PROBE,
        }
        for name, text in files.items():
            put(folder, name, text)
        done = start(
            ["-i", "probe.ini", "-t", "probe.tbl", "-v", "probe.var", "probe.ngc"],
            folder,
            folder,
            capture_output=True,
            timeout=PATIENCE_S,
        )
        check_room(folder, done.returncode)
    length = re.search(r"USE_TOOL_LENGTH_OFFSET\(\S+ \S+ ([\d.]+)", done.stdout)
    if not length:
        raise Rs274Error("rs274 did not report its unit; see what `rs274 -g` prints")
    return float(length[1])


def start(arguments, home, directory, call=subprocess.run, **options):
    """rs274 -g ARGUMENTS -> CompletedProcess, or what `call` gives."""
    environment = {**os.environ, "HOME": str(home), "LC_ALL": "C"}
    try:
        return call(
            ["rs274", "-g", *arguments],
            cwd=directory,
            env=environment,
            text=True,
            errors="replace",
            stdin=subprocess.DEVNULL,
            **options,
        )
    except FileNotFoundError:
        raise Rs274Error("LinuxCNC's rs274 is not on the PATH; install linuxcnc-uspace") from None


def deaf():
    """In the child: Ctrl-C reaches all processes of a terminal, and the Python in rs274 would print a traceback; the
    command ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def relayed(arguments, home, directory, to):
    """As start(), with the standard output written to the stream `to`: rs274 itself does not see that its output cannot
    be written.

    Raises OSError.  -> Popen that has ended"""
    options = {"call": subprocess.Popen, "stdout": subprocess.PIPE, "preexec_fn": deaf}
    with start(arguments, home, directory, **options) as process:
        try:
            shutil.copyfileobj(process.stdout, to)
            to.flush()
        except (OSError, KeyboardInterrupt):
            process.kill()
            raise
    return process


def run(program, ini, to=None, **options):
    """A program on the machine of an INI file, tool table included; work offsets are 0.  -> CompletedProcess or Popen,
    with its returncode

    to: stream that gets the standard output; else options of subprocess.run()."""
    ini = os.path.abspath(ini)
    directory = os.path.dirname(ini)
    text = _ini_text(ini)
    _refuse_code(program, text, directory)
    with OwnFolder("rs274") as folder:
        files = {"machine.ini": usable_elsewhere(text, directory), "machine.var": "5161 0\n"}
        arguments = ["-i", f"{folder}/machine.ini", "-v", f"{folder}/machine.var"]
        table = section_of(text.splitlines(), "EMCIO").get("TOOL_TABLE")
        if table:
            path = os.path.join(directory, os.path.expanduser(table))
            linear_units = section_of(text.splitlines(), "TRAJ").get("LINEAR_UNITS", "mm")
            tools = _read(
                path, lambda name: Path(name).read_text(encoding="utf-8", errors="surrogateescape"), "[EMCIO]TOOL_TABLE"
            )
            files["machine.tbl"] = scaled_table(tools, units_in_mm(linear_units) / tool_table_unit(linear_units))
            arguments += ["-t", f"{folder}/machine.tbl"]
        for name, content in files.items():
            put(folder, name, content)
        arguments.append(os.path.abspath(program))
        done = (
            start(arguments, folder, directory, **options) if to is None else relayed(arguments, folder, directory, to)
        )
        check_room(folder, done.returncode)
        return done


def _refuse_code(program, text, directory):
    """Raise Rs274Error for a program that runs Python or a shell; text: of the INI file."""
    lines = text.splitlines()
    allowed = parse_settings(section_of(lines, SECTION), directory)["PROGRAM_PYTHON"]
    code = program_code.first_code([program], program_code.Places.of(lines, directory), not allowed)
    if code:
        fact, line = code.sentence(program)
        raise Rs274Error(with_line(f"{os.path.basename(program)}: {fact}; {code.remedy}", line))


def _ini_text(ini):
    """The text of an INI file, with what it includes.  Raises Rs274Error."""
    try:
        return usable(ini)
    except OSError as error:
        if error.filename not in (None, ini):
            raise Rs274Error(
                f"#INCLUDE {error.filename} cannot be read: {error.strerror}; correct the INI file"
            ) from None
        raise Rs274Error(f"INI file {ini}: {error.strerror}; name the machine's INI file with --ini") from None


def _read(path, call, key):
    """call(path), a file of the machine that `key` of its INI file names.  Raises Rs274Error."""
    try:
        return call(path)
    except OSError as error:
        raise Rs274Error(
            f"{key} {error.filename or path} cannot be read: {error.strerror}; correct the INI file"
        ) from None


def usable_elsewhere(text, directory):
    """An INI text whose [CHIPWISE] paths, tool table and ~ mean the same in a file elsewhere and with another HOME."""
    settings = parse_settings(section_of(text.splitlines(), SECTION), directory)
    paths = "".join(f"{key} = {settings.path(key)}\n" for key in PATH_KEYS if settings[key])
    home = os.path.expanduser("~")
    text = TABLE.sub(lambda match: match[1] + os.path.join(directory, os.path.expanduser(match[2])), text)
    # of two equal keys the first counts
    return "[CHIPWISE]\n" + paths + re.sub(r"(?m)(?<=[=:\s])~(?=/|:|$)", lambda match: home, text)


def scaled_table(text, factor):
    """A tool table with every length multiplied; angles, numbers and remarks stay."""
    if factor == 1.0:
        return text
    lines = []
    for line in text.splitlines():
        words, remark, rest = line.partition(";")
        lines.append(LENGTHS.sub(lambda word: f"{word[1]}{float(word[2]) * factor:.9f}", words) + remark + rest)
    return "\n".join(lines) + "\n"
