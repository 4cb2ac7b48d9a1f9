# SPDX-License-Identifier: GPL-2.0-or-later
"""Where a contour sub is: in the program, in its callers, or in a file of its own.

Called by contour_sub/read.py, and by glue/program_run.py for the folders.
"""

import os
import re
from dataclasses import dataclass
from functools import lru_cache

from chipwise.errors import MM_PER_INCH, CycleError, braceless
from chipwise.host.files import NoRegularFile, TooLong, read_bytes
from chipwise.ini import section_of

MAX_BYTES = 1 << 28  # of a program or a file of subs


@dataclass(frozen=True)
class Found:
    """A file that holds the sub: path, its lines, first and last line number of the definition."""

    path: str
    lines: tuple
    first: int
    last: int

    @property
    def body(self):
        """[(line number, text)] between sub and endsub."""
        return [(n, self.lines[n - 1]) for n in range(self.first + 1, self.last)]

    def fault(self, line, text, remedy, before=None):
        """CycleError about a line of the sub; before: a line that was executed before it."""
        where = f"sub O{sub_name(self)}, line {line}" + (
            f" (after line {before})" if before not in (None, line) else ""
        )
        return CycleError(f"{where} of {quoted(self.path)}: {braceless(text)}", braceless(remedy))


_O_LINE = re.compile(r"^/?(?:n\d+(?:\.\d+)?)?o(\d+|<[^>]*>)(sub|endsub|while|do|repeat|call|\w+)?", re.IGNORECASE)


def plain_text(text):
    """A line without comments and blanks, lower case."""
    return re.sub(r"\([^)]*\)?|;.*|\s", "", text).lower()


def program_unit(text, unit_mm):
    """ "mm" or "in": the first G20 or G21 of a program, else the unit of the machine (mm)."""
    for line in text.splitlines():
        found = re.search(r"g0*2([01])(?![\d.])", plain_text(line))
        if found:
            return "in" if found.group(1) == "0" else "mm"
    return "in" if abs(unit_mm - MM_PER_INCH) < 1e-6 else "mm"


def o_word(text):
    """(name, keyword) of an O-line, else None.  O0100 is O100, as in LinuxCNC."""
    match = _O_LINE.match(plain_text(text)) if "o" in text.lower() else None
    if not match:
        return None
    name = match.group(1).strip("<>")
    return (str(int(name)) if name.isdigit() else name), match.group(2) or ""


@lru_cache(maxsize=8)
def _lines_of(path, _stamp):
    """Lines of a file and its O-lines {number: (name, keyword)}."""
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8", "surrogateescape")
    except (NoRegularFile, TooLong) as error:
        if os.path.isdir(path):
            raise
        raise CycleError(f"{quoted(path)}: {error.strerror}", "put the contour sub into a file of its own") from error
    lines = tuple(text.replace("\r\n", "\n").split("\n"))  # not splitlines(): it knows more line ends than LinuxCNC
    return lines, {n: word for n, word in ((n, o_word(text)) for n, text in enumerate(lines, 1)) if word}


def read_file(path):
    """(lines, O-lines) of a file, None where it cannot be read; kept by its time of change and size."""
    try:
        status = os.stat(path)
        return _lines_of(os.path.abspath(path), (status.st_mtime_ns, status.st_size))
    except (OSError, ValueError):
        return None


def find_sub(job):
    """Found: the definition in the programs, in their order, else in a file of its own as LinuxCNC looks for it."""
    name = str(job.sub)
    places = [p for p in job.programs if p] + [os.path.join(folder, name + ".ngc") for folder in sub_folders(job.ini)]
    for path in places:
        read = read_file(path)
        _check_mark(path, read, name)
        first = next((n for n, word in read[1].items() if word == (name, "sub")), None) if read else None
        if first is None:
            continue
        last = next((n for n, word in read[1].items() if n > first and word == (name, "endsub")), None)
        if last is None:
            raise CycleError(
                f"sub O{name} begins in line {first} of {quoted(path)} and has no endsub",
                f"end it with a line O{name} endsub",
            )
        _check_once(path, read[1])
        return Found(os.path.abspath(path), read[0], first, last)
    own = [p for p in job.programs if p]
    raise CycleError(
        f"there is no sub O{name}"
        + (f" in {quoted(own[0])}" if own else "")
        + f" and no file {name}.ngc with it on the SUBROUTINE_PATH",
        f"put the sub between O{name} sub and O{name} endsub, before or after the program's M2",
    )


def _check_mark(path, read, name):
    """Raises CycleError for the file of a sub that begins with a byte order mark: LinuxCNC does not read its first line
    either."""
    if read and read[0][0].startswith("\ufeff") and os.path.basename(path) == name + ".ngc":
        raise CycleError(
            f"{quoted(path)} begins with a byte order mark, which LinuxCNC refuses", "save it as UTF-8 without one"
        )


def _check_once(path, words):
    """Raises CycleError for a sub that a file defines twice, as LinuxCNC does."""
    first = {}
    for number, (name, keyword) in words.items():
        if keyword == "sub" and first.setdefault(name, number) != number:
            raise CycleError(
                f"sub O{name} is defined twice in {quoted(path)}, in lines {first[name]} and {number}",
                "take one of them out",
            )


def sub_folders(ini):
    """Folders of sub files, in LinuxCNC's order: the current one, PROGRAM_PREFIX, SUBROUTINE_PATH."""
    folders = ["."]
    try:
        with open(ini, encoding="utf-8", errors="replace") as file:
            lines = file.readlines()
    except OSError:
        return folders
    folders += [section_of(lines, "DISPLAY").get("PROGRAM_PREFIX", "")]
    folders += section_of(lines, "RS274NGC").get("SUBROUTINE_PATH", "").split(":")
    return [os.path.expanduser(folder) for folder in folders if folder]


def quoted(path):
    return braceless(os.path.basename(path))


def sub_name(found):
    """The sub's name as its O-line gives it."""
    return o_word(found.lines[found.first - 1])[0]
