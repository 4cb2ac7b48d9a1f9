# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether the feed of a program may rise above F: not with a tap, which goes at its pitch without an override, nor with
M52, which may switch off what holds the ceiling.  Called by job_process.py and time_process.py.

The program is searched, and the files of the subs that it calls: LinuxCNC's O-words and M98, and bodies of remapped
codes (ngc=) that it uses.  It is a search of text, so a code that is never reached counts, too.
"""

import os
import re

from chipwise import ini as ini_files
from chipwise.program.comments import bare
from chipwise.program.find_sub import sub_folders
from chipwise.errors import printable
from chipwise.host.files import open_regular

MOST_FILES = 200
_KEEPS_F = re.compile(rb"G0*(?:74|84)(?![0-9.])|M0*52(?![0-9.])")
FEEDS_OUT = re.compile(rb"G0*8[59](?![0-9.])")  # a bore or a reamer comes out at F
_CALLS = re.compile(rb"^/?(?:N[0-9.]+)?O(\d+|<[^>\n]*>|\[|#)[^\n]*?CALL|M0*98P(\d+|\[|#)", re.MULTILINE)
_BODY = re.compile(r"(\S+)\s.*?\bngc=(\S+)", re.IGNORECASE)
COMPUTED = "call of a sub whose name is computed"


def code_of(program, ini, most_bytes, codes=_KEEPS_F):
    """The first one of the codes, with the name of its file if that is another one; "": none.  ini: path of the INI
    file.  Raises OSError for the program itself."""
    folders = [os.path.join(os.path.dirname(ini), folder) for folder in sub_folders(ini)]
    bodies = list(_bodies(ini))
    waiting, seen = [program], {program}
    while waiting:
        path = waiting.pop()
        try:
            with open_regular(path, most_bytes) as file:
                text = bare(file.read())
        except OSError:
            if path == program:
                raise
            continue  # LinuxCNC cannot read it either
        found = codes.search(text)
        if found:
            return found.group().decode() + ("" if path == program else f" in {printable(os.path.basename(path))}")
        names = {(call.group(1) or call.group(2)).decode("utf-8", "replace") for call in _CALLS.finditer(text)}
        if any(name[0] in "[#" for name in names):
            return COMPUTED
        names.update(name for code, name in bodies if code.search(text))
        files = {os.path.join(folder, _file_name(name)) for name in names for folder in folders}
        waiting += [file for file in sorted(files - seen) if os.path.isfile(file)]
        seen |= files
        if len(waiting) > MOST_FILES:
            return f"calls of more than {MOST_FILES} subs"
    return ""


def _file_name(name):
    """Of a sub; LinuxCNC reads names in small letters."""
    name = name.strip("<>").lower()
    return (str(int(name)) if name.isdigit() else name) + ".ngc"


def _bodies(ini):
    """(pattern of a code, name of the sub that is its body) of the INI file."""
    try:
        lines = ini_files.expanded(ini).splitlines()
    except OSError:
        return
    for text in ini_files.values_of(lines, "RS274NGC", "REMAP"):
        found = _BODY.match(text)
        if not found:
            continue
        letter, number = found.group(1)[:1].upper(), found.group(1)[1:]
        end = rb"0*" + re.escape(number.encode()) + rb"(?![0-9.])" if number else rb"[-0-9.\[#]"
        yield re.compile(re.escape(letter.encode()) + end), found.group(2)
