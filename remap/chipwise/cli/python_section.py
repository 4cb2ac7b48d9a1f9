# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether LinuxCNC's interpreter will find chipwise's codes: the [PYTHON] section of the INI file.

Called by load.py while LinuxCNC starts.  LinuxCNC looks up every code in the module `remap` that TOPLEVEL imports.  2.9
reads the first [PYTHON] section only; 2.10 takes all of them as one, with the first TOPLEVEL, so what chipwise.inc adds
to the path is behind the machine's own.  Without this check a machine with another module `remap` gets an error of the
interpreter that names neither.
"""

import glob
import os
import re

from chipwise.errors import CycleError, braceless
from chipwise.ini import first_section_of, values_of

CODES = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))  # the folder remap/
IMPORT = "from chipwise.codes import *"
LEFT = re.compile(r"\s*(#include\s+\S*chipwise\w*\.inc)\s*$", re.IGNORECASE)
UNREAD = re.compile(r"# handle_includes\(\):.* CANNOT READ (\S*chipwise\w*\.inc)\s*$")
OURS = re.compile(r".*\bpython\s*=\s*m250\b", re.IGNORECASE)


def check_includes(ini):
    """Raise CycleError for an Ini, as LinuxCNC reads it, in which a file of chipwise's is missing.

    LinuxCNC (handle_includes in linuxcnc, 2.9) leaves an #INCLUDE of an included file as it is, and goes on without a
    file that it cannot read: G-codes would be unknown without a reason."""
    for line in ini.lines:
        left, unread = LEFT.match(line), UNREAD.match(line)
        if left:
            raise CycleError(
                f'LinuxCNC has not expanded "{braceless(left[1])}": it expands only lines of the main INI file, in '
                f"capitals",
                "put it into the main INI file; one of an included section goes directly behind the #INCLUDE of that "
                "section",
            )
        if unread:
            raise CycleError(
                f"LinuxCNC cannot read {braceless(unread[1])}", "correct the #INCLUDE line, or run make install again"
            )


def check_codes(ini):
    """Raise CycleError for an Ini that remaps chipwise's codes and whose [PYTHON] section cannot find them."""
    if not any(OURS.match(text) for text in values_of(ini.lines, "RS274NGC", "REMAP")):
        return
    section = first_section_of(ini.lines, "PYTHON")
    if section is None:
        raise CycleError(
            "this INI file remaps chipwise's codes and has no [PYTHON] section",
            "add the third of README's lines, #INCLUDE .../chipwise.inc, at its end",
        )
    folder = os.path.dirname(os.path.abspath(ini.path))
    top = next((text for key, text in section if key == "TOPLEVEL"), "")
    top = os.path.join(folder, os.path.expanduser(top))
    if os.path.realpath(os.path.dirname(top)) == CODES:
        return
    places = [
        os.path.join(folder, os.path.expanduser(text))
        for key, text in section
        if key in ("PATH_PREPEND", "PATH_APPEND")
    ]
    if not (
        any(os.path.realpath(place) == CODES for place in places) and knows_the_codes([os.path.dirname(top), *places])
    ):
        other = next(
            (os.path.realpath(place) for place in [os.path.dirname(top), *places] if is_another_chipwise(place)), None
        )
        if other:
            raise CycleError(
                f"this INI file takes its codes from the chipwise in {braceless(other)}, and its components from the "
                f"one in "
                f"{braceless(CODES)}",
                "make a new configuration with chipwise new-config, or uninstall one of the two",
            )
        raise CycleError(
            "this INI file has a [PYTHON] section of its own that does not import chipwise's codes",
            f"add the line PATH_APPEND = {braceless(CODES)} to it, and the line `{IMPORT}` to its module "
            "remap (remap.py)",
        )


def is_another_chipwise(place):
    """Whether a folder is the remap/ of another copy of chipwise than this one."""
    return os.path.realpath(place) != CODES and os.path.isfile(os.path.join(place, "chipwise", "codes.py"))


def knows_the_codes(places):
    """Whether a Python file in one of the folders, beside chipwise's own, imports the codes."""
    for place in places:
        if os.path.realpath(place) == CODES:
            continue
        for name in glob.glob(os.path.join(glob.escape(place), "*.py")):
            try:
                with open(name, encoding="utf-8", errors="replace") as handle:
                    if re.search(r"^\s*(from|import)\s+chipwise\b", handle.read(), re.MULTILINE):
                        return True
            except OSError:
                continue
    return False
