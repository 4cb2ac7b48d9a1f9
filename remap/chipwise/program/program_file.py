# SPDX-License-Identifier: GPL-2.0-or-later
"""A program as a file: whether it can be one, and the errors of one that cannot be checked.

Called by reader.py and filter/, for a name alone by monitor/, glue/, resume/, setup/job.py; imports nothing that takes
time.
"""

import codecs
import os
import re

from chipwise.errors import printable
from chipwise.host.files import NoRegularFile, TooLong, has_cr_alone, open_regular
from chipwise.host.temp_folder import writing

MAX_BYTES = 100_000_000  # of a program; 4 million moves
LOOKED_AT = 1 << 16  # bytes of a program; a NUL among them means that it is not text
_PART = 1 << 20
_ASCII = bytes(byte if byte < 128 else ord("?") for byte in range(256))

# What AXIS of LinuxCNC 2.10 calls a filter's output (axis.py: open_file_guts); its folder is one of tempfile.mkdtemp()
_FILTERED, _MADE_FOLDER = "filtered-", re.compile(r"tmp[a-z0-9_]{8}")
_SPLASH = "/share/axis/images/axis.ngc"  # of LinuxCNC's files, 2.9 and 2.10 (axis.py: initialfile)
TOOL, AXIS = "tool", "axis"  # what a machine may lack
_NO_TOOL, _NO_AXIS = (
    re.compile(r"Requested tool (\d{1,9}) not found"),
    re.compile(r"Bad character '([abc])' used"),
)  # LinuxCNC's words, 2.9
_SUB = re.compile(
    rb"^[ \t]*(?:N[ \t]*\d+[ \t]*)?O[ \t]*(<[^<>\n]{1,100}>|\d{1,9})[ \t]*sub\b", re.IGNORECASE | re.MULTILINE
)

# What is known of a program that cannot be checked (Unreadable.state)
UNCHECKED, UNUSABLE, UNFINISHED, UNSAFE = "unchecked", "unusable", "unfinished", "unsafe"


def opened_name(path):
    """The name of a program as the operator knows it: of the file that was opened, not of the copy that runs."""
    folder, name = os.path.split(path)
    if name.startswith(_FILTERED) and _MADE_FOLDER.fullmatch(os.path.basename(folder)):
        return name[len(_FILTERED) :]
    return name


def is_splash(path):
    """Whether it is the program that AXIS opens where the operator has opened none: AXIS's name in lines of G-code."""
    return os.path.abspath(path).endswith(_SPLASH)


class Unreadable(Exception):
    """A program that cannot be checked: str() is the message, line the line of the program (0: none)."""

    state = UNCHECKED

    def __init__(self, text, remedy, line=0):
        super().__init__(printable(f"{text}; {remedy}" if remedy else text))
        self.line = line


class Missing(Unreadable):
    """The program cuts without a stock or a tool; both can be assumed (assumed/)."""


class Unusable(Unreadable):
    """LinuxCNC cannot use the file either."""

    state = UNUSABLE


class Lacking(Unusable):
    """LinuxCNC refuses the program on a machine that lacks something.  kind: TOOL or AXIS; name: the tool's number, the
    axis' letter."""

    def __init__(self, text, remedy, line, kind, name):
        super().__init__(text, remedy, line)
        self.kind, self.name = kind, name


class Unfinished(Unreadable):
    """The program was not read to its end, and may have none."""

    state = UNFINISHED


class Unsafe(Unreadable):
    """LinuxCNC's interpreter would run Python or a shell (program/program_code.py)."""

    state = UNSAFE


def check_file(path, most_bytes=MAX_BYTES):
    """Raise Unreadable for a file that is not a G-code program, or has more than most_bytes."""
    try:
        with open_regular(path, most_bytes) as file:
            head = file.read(LOOKED_AT)
    except NoRegularFile as error:
        raise Unusable(error.strerror, "name a G-code program") from error
    except TooLong as error:
        raise Unusable(
            f"it has {error.found / 1e6:.0f} MB, more than {error.most / 1e6:.0f}", "check it in parts"
        ) from error
    except OSError as error:
        raise Unusable(error.strerror, "name a file that can be read") from error
    if not head.strip():
        raise Unusable("it is empty", "name a G-code program")
    if b"\0" in head or head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise Unusable("it is not a text file", "name a G-code program")
    if has_cr_alone(head):
        raise Unusable(
            "its lines end with CR alone, so LinuxCNC reads it as one line", "save it with LF or CR LF at the ends", 1
        )
    if head.startswith(codecs.BOM_UTF8):
        raise Unusable("it begins with a byte order mark, which LinuxCNC refuses", "save it as UTF-8 without one", 1)


def readable(path, folder):
    """The program itself if it and its name are UTF-8, else a link, or a copy with "?" for other bytes, in the folder:
    module gcode hands comments and names to Python as UTF-8 and fails at others (2.9).  Lines stay."""
    copy = os.path.join(folder, os.path.basename(path).encode("utf-8", "replace").decode())
    decoder = codecs.getincrementaldecoder("utf-8")()
    with open(path, "rb") as file:
        try:
            while part := file.read(_PART):
                decoder.decode(part)
            decoder.decode(b"", True)
            path.encode()
            return path
        except UnicodeDecodeError:
            file.seek(0)
        except UnicodeEncodeError:
            with writing():
                os.symlink(path, copy)
            return copy
        with writing(), open(copy, "wb") as other:
            while part := file.read(_PART):
                other.write(part.translate(_ASCII))
    return copy


def lacking(text, line):
    """The Lacking of an error of LinuxCNC's interpreter, None of any other."""
    if found := _NO_TOOL.search(text):
        return Lacking(
            f"tool {found.group(1)} is not in the tool table",
            f"add T{found.group(1)} to it, or name the machine with --ini",
            line,
            TOOL,
            int(found.group(1)),
        )
    if found := _NO_AXIS.search(text):
        letter = found.group(1).upper()
        return Lacking(
            f"the machine has no axis {letter}",
            f"leave {letter} out, or name the machine with --ini",
            line,
            AXIS,
            letter,
        )
    return None


def only_sub(path):
    """Name of the first sub that a program without moves defines; "" if it defines none."""
    try:
        with open_regular(path, MAX_BYTES) as file:
            found = _SUB.search(file.read(LOOKED_AT))
    except OSError:
        return ""
    return "o" + found.group(1).decode("utf-8", "replace") if found else ""
