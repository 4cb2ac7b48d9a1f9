# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines of programs that make LinuxCNC's interpreter run Python or a shell, found in the text, before an interpreter
starts.

Called by program/reader.py, program/sub_process.py, program/rs274.py and filter/work.py.  Read in LinuxCNC 2.9 and
2.10:

1. A comment (py,..), (pyrun,..) or (pyreload), in any case and with blanks before it, runs Python: convert_comment() in
   interp_convert.cc.  So does a line that begins with ;py, (read_semicolon() in interp_read.cc).
2. The name of a sub that is called is expanded by wordexp(): find_ngc_file() in rs274ngc_pre.cc.  $(..) and `..` in it
   run a command.
3. A line ends at a NUL, and what is behind 254 bytes from its beginning is a line of its own (read_text() in
   interp_read.cc): no file with a NUL is read.
4. Blanks do not count, nor does the case, but in a comment they do, and a comment in a name is a part of it:
   close_and_downcase().

Looked at are the program, and every file that a call in one of them may open.  If the number of a called sub is an
expression, every file named by a number counts.  A comment outside of what is executed counts, too.

Departs from LinuxCNC: a line ;py, counts with blanks and in any case.
"""

import glob
import os
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Iterable, Iterator, Optional, Sequence

from chipwise.errors import printable
from chipwise.host.files import read_bytes
from chipwise.ini import section_of, values_of

MAX_BYTES = 1 << 28  # of a program or a file of subs, as in program/find_sub.py
PYTHON, SHELL, NUL = "python", "shell", "nul"  # kinds
SHOWN = 60  # characters of a line in a message
RUNS_PYTHON = "runs Python"
PYTHON_REMEDY = "take the line out, or set [CHIPWISE]PROGRAM_PYTHON = yes"
REASONS = {
    PYTHON: ("runs Python: {text}", PYTHON_REMEDY),
    SHELL: ("has the name of a sub expanded by a shell: {text}", "name it with letters, digits, - and _"),
    NUL: ("is not a text file, it has a byte 0", "save it as text"),
}

_BLANK = rb"[ \t\r\v\f]*"
_PYTHON = re.compile(_BLANK + rb"py(?:,|run,|reload)", re.IGNORECASE)
_PYTHON_LINE = re.compile(rb"^" + _BLANK + rb";" + _PYTHON.pattern, re.IGNORECASE)
_CALL = b"c" + _BLANK + b"a" + _BLANK + b"l" + _BLANK + b"l"
_M98 = rb"m[0 \t\r]*9" + _BLANK + b"8"
# most programs have none of these, in lower case; each alone is found fast
_HINTS = [re.compile(hint) for hint in (rb"py(?:,|run,|reload)", _CALL, _M98, b"\0")]
_ODD = re.compile(
    rb"[(;]" + _PYTHON.pattern + b"|" + _CALL + b"|" + _M98 + b"|\0", re.IGNORECASE
)  # lines worth a closer look
_PARTS = re.compile(rb"\([^)]*\)?|;.*|[^(;]+", re.DOTALL)
_NAME = re.compile(rb"o(?:<|(\d+))")
_SUB_PROGRAM = re.compile(rb"m0*98(?!\d).*?p(?:(\d+)|[^\d])|m0*98(?!\d)")
_EXPANDED = re.compile(rb"[$`*?\[\]'\"\\|&{}]")
_NUMBER_FILE = re.compile(r"\d+\.ngc")


@dataclass(frozen=True)
class Code:
    """A line that runs something: path and number; its text; kind."""

    path: str
    line: int
    text: str
    kind: str

    @property
    def fact(self) -> str:
        """What the line does, without saying where."""
        return REASONS[self.kind][0].format(text=self.text)

    @property
    def remedy(self) -> str:
        return REASONS[self.kind][1]

    def sentence(self, program: str) -> tuple[str, int]:
        """(fact, line: 0 where the text has it) for a reader of `program`."""
        if os.path.abspath(self.path) == os.path.abspath(program):
            return f"it {self.fact}", self.line
        return f"{os.path.basename(self.path)}, which it may call, {self.fact} in line {self.line}", 0


@dataclass(frozen=True)
class Places:
    """Where LinuxCNC looks for the file of a sub: folders in their order, and the root of a tree ("": none)."""

    folders: tuple
    tree: str = ""

    @classmethod
    def of(cls, lines: Sequence[str], folder: str) -> "Places":
        """From the lines of an INI file; folder: LinuxCNC's current one."""
        names = [".", section_of(lines, "DISPLAY").get("PROGRAM_PREFIX", "")]
        names += section_of(lines, "RS274NGC").get("SUBROUTINE_PATH", "").split(":")
        tree = section_of(lines, "WIZARD").get("WIZARD_ROOT", "")
        return cls(
            tuple(os.path.join(folder, os.path.expanduser(name)) for name in names if name),
            os.path.join(folder, os.path.expanduser(tree)) if tree else "",
        )

    def file_of(self, name: str) -> Optional[str]:
        """Path of the file that a call of a sub opens."""
        own = os.path.expanduser(name) + ".ngc"
        for folder in self.folders:
            if os.path.isfile(os.path.join(folder, own)):
                return os.path.join(folder, own)
        return (
            next(glob.iglob(os.path.join(glob.escape(self.tree), "**", glob.escape(own)), recursive=True), None)
            if self.tree
            else None
        )

    def numbered(self) -> Iterator[str]:
        """Every file that the call of a number may open."""
        for folder in self.folders:
            if os.path.isdir(folder):
                yield from (
                    os.path.join(folder, name) for name in sorted(os.listdir(folder)) if _NUMBER_FILE.fullmatch(name)
                )


def code_in(lines: Iterable[tuple[int, bytes]], path: str, python: bool = True) -> Optional[Code]:
    """The first of a file's (number, line) that runs something; python: whether Python counts."""
    return next(
        (
            Code(path, number, _shown(line), kind)
            for number, line in lines
            for kind in _runs(line)
            if python or kind != PYTHON
        ),
        None,
    )


def first_code(programs: Sequence[str], places: Places, python: bool = True) -> Optional[Code]:
    """code_in() of the programs and of every file that they may call."""
    return next((code for path, lines in _reached(programs, places) if (code := code_in(lines, path, python))), None)


def first_code_of(
    lines: Sequence[tuple[int, bytes]], path: str, places: Places, apart: Sequence[str]
) -> Optional[Code]:
    """code_in() of some lines of a file, and of every file that they may call but those `apart`."""
    skipped = {os.path.realpath(path) for path in apart}
    called = [file for name in _called(lines) for file in _files_of(name, places)]
    return code_in(lines, path) or next(
        (
            code
            for file, odd in _reached(called, places)
            if os.path.realpath(file) not in skipped and (code := code_in(odd, file))
        ),
        None,
    )


def of_machine(lines: Sequence[str], places: Places, programs: Sequence[str]) -> list[str]:
    """Paths of the files that remapped codes of an INI file execute (ngc=..) and the programs do not call: they are the
    machine's own."""
    names = [
        found[1]
        for text in values_of(lines, "RS274NGC", "REMAP")
        if (found := re.search(r"(?i)\bngc\s*=\s*([^\s]+)", text))
    ]
    own = [path for name in names if (path := places.file_of(name))]
    called = {os.path.realpath(path) for path, _lines in _reached(programs, places)}
    return [real for path, _lines in _reached(own, places) if (real := os.path.realpath(path)) not in called]


def _reached(paths: Sequence[str], places: Places) -> Iterator[tuple[str, tuple]]:
    """Yield (path, its lines that may run or call something) of the files and of all that they may call."""
    waiting, seen = list(paths), set()
    while waiting:
        path = waiting.pop(0)
        if os.path.realpath(path) in seen:
            continue
        seen.add(os.path.realpath(path))
        try:
            state = os.stat(path)
            lines = _lines_of(path, (state.st_mtime_ns, state.st_size))
        except OSError:  # no interpreter reads it either
            continue
        yield path, lines
        waiting += [file for name in _called(lines) for file in _files_of(name, places)]


def _files_of(name: Optional[str], places: Places) -> list[str]:
    """Paths of the files that the call of a name may open; None: of any number."""
    if name is None:
        return list(places.numbered())
    path = places.file_of(name)
    return [path] if path else []


@lru_cache(maxsize=64)
def _lines_of(path: str, _stamp: tuple) -> tuple:
    """odd_lines() of a file.  Raises OSError."""
    return tuple(odd_lines(read_bytes(path, MAX_BYTES)))


def odd_lines(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield (number, line) of those that may run or call something."""
    low, number, counted = data.lower(), 1, 0
    if not any(hint.search(low) for hint in _HINTS):
        return
    for found in _ODD.finditer(data):
        start = data.rfind(b"\n", 0, found.start()) + 1
        if start < counted:  # this line has been given
            continue
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        number, counted = number + data.count(b"\n", counted, start), start
        yield number, data[start:end]
        number, counted = number + 1, end + 1


def _runs(line: bytes) -> Iterator[str]:
    """Yield the kinds of what a line runs."""
    if b"\0" in line:
        yield NUL
    if _PYTHON_LINE.match(line) or any(part[:1] == b"(" and _PYTHON.match(part, 1) for part in _PARTS.findall(line)):
        yield PYTHON
    if any(name and _EXPANDED.search(name) for name in _names(*_closed(line))):
        yield SHELL


def _closed(line: bytes) -> tuple[bytes, bytes]:
    """(a line as LinuxCNC reads it: lower case and without blanks, but for its comments, and without one behind ; and
    the same with its comments blackened)."""
    parts = [(part, part[:1] == b"(") for part in _PARTS.findall(line) if part[:1] != b";"]
    texts = [(part if comment else re.sub(rb"[ \t\r]", b"", part).lower(), comment) for part, comment in parts]
    return b"".join(text for text, _ in texts), b"".join(
        b"~" * len(text) if comment else text for text, comment in texts
    )


def _names(closed: bytes, code: bytes) -> set:
    """Names of the subs that a line of _closed() calls; None: one whose number is an expression."""
    found: set = set()
    if b"call" in code:
        found = {
            b"%d" % int(word[1]) if word[1] else closed[word.end() :].partition(b">")[0]
            for word in _NAME.finditer(code)
        } or {None}
    program = _SUB_PROGRAM.search(code)
    return found | {program[1] and b"%d" % int(program[1])} if program else found


def _called(lines: Iterable[tuple[int, bytes]]) -> set:
    """Names of the subs that (number, line) of a file call; None: one whose number is an expression."""
    found: set = set()
    for _number, line in lines:
        found |= {None if name is None else os.fsdecode(name) for name in _names(*_closed(line))}
    return found


def _shown(line: bytes) -> str:
    text = printable(line.decode("utf-8", "replace")).strip()
    return text if len(text) <= SHOWN else text[: SHOWN - 2] + ".."
