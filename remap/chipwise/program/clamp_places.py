# SPDX-License-Identifier: GPL-2.0-or-later
"""In which units and work coordinates the CLAMP comments of a program are, from its text: for cycles, which are planned
while the program runs.

Called by planner/program_clamps.py and resume/clamps.py; monitor/comment_clamps.py asks for the word.  A comment has
those of the first move behind it
(program/clamp_comments.py), and the clamps of a program's set-up those of its first move.  Lines outside of all subs,
loops and branches are executed in their order, so their words say what is in force; what does not follow from that is
said, with the line it is for.  Departs from an interpreter: parameters by expression (#[..]=) are taken not to be work
offsets.
"""

import math
import os
import re
from dataclasses import dataclass, field
from typing import Optional

from chipwise.clamps import comment as comments
from chipwise.host.files import open_regular, read_bytes
from chipwise.program import find_sub
from chipwise.program.comments import bare
from chipwise.program.program_file import MAX_BYTES

UNITS, SYSTEM = "units", "coordinate system"
OFFSET = "work offset"
PART, WORD = 1 << 20, b"clamp"
ANY = "any"  # a value that is not known from the text
_ASKED = re.compile(rb"^/?(?:N[\d.]+)?O|G0*(?:2[01]|5[24-9]|10|92)(?!\d)|G[#\[]|M0*(?:72|98)(?!\d)|#0*5[23]\d\d=")
_O_WORD = re.compile(rb"^/?(?:N[\d.]+)?O(\d+|<[^>\n]*>)([A-Z]*)")
_NAMED = re.compile(rb"<[^>\n]*>")
_G_WORD, _L_WORD = re.compile(rb"G([\d.]+|[#\[])"), re.compile(rb"L0*(\d+)(?![\d.])")
_MOVES = re.compile(rb"[XYZABCUVW][-+.\d#\[]|G0*(?:28|30|1[23]|2[467]|7[5789])(?![\d.])")
_UNITS = {20.0: "in", 21.0: "mm"}
SYSTEMS = {54.0: 1, 55.0: 2, 56.0: 3, 57.0: 4, 58.0: 5, 59.0: 6, 59.1: 7, 59.2: 8, 59.3: 9}
_TABLE_ONLY = {0, 1, 10, 11}  # L words of G10 that change the tool table
_BEGIN, _END = {b"SUB", b"IF", b"WHILE", b"DO", b"REPEAT"}, {b"ENDSUB", b"ENDIF", b"ENDWHILE", b"ENDREPEAT"}


@dataclass
class Place:
    """line: of a comment, 0 for the first move of the program; inside: of the comment; move: line of the first move
    behind it; units: "mm" or "in", system: from 1, both as the text says them in front of that move, None without a
    word; unknown: why they are not known, ""."""

    line: int
    inside: str
    move: int = 0
    units: Optional[str] = None
    system: Optional[int] = None
    unknown: str = ""


@dataclass(frozen=True)
class ClampPlaces:
    """places: [Place] that a move follows; offsets: lines that change a work offset; first: {UNITS, SYSTEM: line of its
    first word}."""

    places: list
    offsets: list
    first: dict

    def unknown(self, place, line):
        """Why units and coordinates of a Place are not known while `line` is executed, "" if they are: as said there,
        without a word as they are now."""
        if place.unknown:
            return place.unknown
        low, high = sorted((place.move, line))
        for number in self.offsets:
            if low < number <= high:
                return f"line {number} changes the {OFFSET}"
        for kind, value in ((UNITS, place.units), (SYSTEM, place.system)):
            if value is None and self.first[kind] <= high:
                return f"no word in front of line {place.move} says the {kind}"
        return ""


def has_word(path):
    """Whether a file has the word CLAMP."""
    before = b""
    try:
        with open_regular(path, MAX_BYTES) as file:
            while part := file.read(PART):
                if WORD in (before + part).lower():
                    return True
                before = part[-len(WORD) :]
    except (OSError, ValueError):
        pass
    return False


def files_of_subs(ini):
    """The function of places_of() that finds the file of a sub as LinuxCNC does."""

    def text_of_sub(name):
        for folder in find_sub.sub_folders(ini):
            try:
                return read_bytes(os.path.join(folder, name_of(name) + ".ngc"), find_sub.MAX_BYTES)
            except (OSError, ValueError):
                continue
        return None

    return text_of_sub


def places_of(program, text_of_sub):
    """The ClampPlaces of the bytes of a program.  text_of_sub: function of a name, the bytes of its file or None."""
    scan = _Scan(comments.of_program(program), text_of_sub)
    for number, text in enumerate(_lines(bare(program)), 1):
        scan.take(number, text)
    return scan.found()


def _lines(text):
    """The lines of a text, one after the other."""
    start = 0
    while start <= len(text):
        end = text.find(b"\n", start)
        end = len(text) if end < 0 else end
        yield text[start:end]
        start = end + 1


def name_of(word):
    """The name of a sub as its file has it, of the bytes behind an O."""
    name = word.decode("utf-8", "replace").strip("<>").lower()
    return str(int(name)) if name.isdigit() else name


def changes(line):
    """[(UNITS, SYSTEM or OFFSET, value or ANY)] of a line of bare() without names."""
    found = []
    for word in _G_WORD.findall(line):
        try:
            number = float(word)
        except ValueError:
            if word in (b"#", b"["):
                found += [(UNITS, ANY), (SYSTEM, ANY), (OFFSET, ANY)]
            continue
        if number in _UNITS:
            found.append((UNITS, _UNITS[number]))
        elif number in SYSTEMS:
            found.append((SYSTEM, SYSTEMS[number]))
        elif number == 52 or math.floor(number) == 92:
            found.append((OFFSET, ANY))
        elif number == 10:
            kind = _L_WORD.search(line)
            if kind is None or int(kind.group(1)) not in _TABLE_ONLY:
                found.append((OFFSET, ANY))
    if re.search(rb"M0*(?:72|98)(?!\d)", line):
        found += [(UNITS, ANY), (SYSTEM, ANY)]
    if re.search(rb"M0*98(?!\d)|#0*5[23]\d\d=", line):
        found.append((OFFSET, ANY))
    return found


@dataclass
class _Scan:
    """Takes the lines of a program in their order."""

    comments: list
    text_of_sub: object
    now: dict = field(default_factory=lambda: {UNITS: None, SYSTEM: None})
    first: dict = field(default_factory=lambda: {UNITS: math.inf, SYSTEM: math.inf})
    offsets: list = field(default_factory=list)
    hidden: list = field(default_factory=list)  # [(kind, value, where)] of lines that are perhaps executed
    called: set = field(default_factory=set)
    own: set = field(default_factory=set)  # subs that the program defines, and those that have been looked into
    blocks: list = field(default_factory=list)  # [(name, keyword)] that are open
    pending: list = field(default_factory=lambda: [(Place(0, ""), None)])
    done: list = field(default_factory=list)

    def take(self, number, text):
        """One line of bare()."""
        asked = bool(_ASKED.search(text))
        if not (asked or self.pending or self.comments and self.comments[0][0] == number):
            return
        before, word = len(self.blocks), None
        if asked:
            word = _O_WORD.match(text)
            if word:
                self._block(*word.groups())
            text = _NAMED.sub(b"<>", text)
        certain = not before and not text.startswith(b"/")
        while self.comments and self.comments[0][0] == number:
            place = Place(*self.comments.pop(0))
            if not certain:
                place.unknown = f"line {number} is in a sub, a loop or a branch, or is one that may be left out"
                self.done.append(place)
            else:
                self.pending.append((place, None))
        if asked:
            self._change(number, text, certain)
        if self.pending and not any(keyword == b"SUB" for _name, keyword in self.blocks):
            calls = word is not None and word.group(2) == b"CALL"
            if (
                calls
                or word is None
                and _MOVES.search(text)
                and not any(kind == OFFSET for kind, _value in changes(text))
            ):
                self._move(number, certain and not calls)

    def _block(self, name, keyword):
        if keyword == b"WHILE" and self.blocks and self.blocks[-1] == (name, b"DO"):
            self.blocks.pop()
        elif keyword in _BEGIN:
            self.blocks.append((name, keyword))
            self.own |= {name} if keyword == b"SUB" else set()
        elif keyword in _END and self.blocks:
            self.blocks.pop()
        elif keyword == b"CALL":
            self.called.add(name)

    def _change(self, number, text, certain):
        for kind, value in changes(text):
            if kind in self.first:
                self.first[kind] = min(self.first[kind], number)
            if not certain:
                self.hidden.append((kind, value, f"line {number}"))
            elif kind == OFFSET:
                self.offsets.append(number)
            else:
                self.now[kind] = value

    def _move(self, number, certain):
        """The first move behind those that are pending; not certain: perhaps."""
        now, left = (self.now[UNITS], self.now[SYSTEM], len(self.offsets)), []
        for place, then in self.pending:
            if then is None:
                place.move, then = number, now
                place.units, place.system = now[:2]
            if not certain:
                left.append((place, then))
                continue
            if then != now:
                place.unknown = f"the first move behind it is perhaps in line {place.move}, perhaps in line {number}"
            self.done.append(place)
        self.pending = left

    def found(self):
        """The ClampPlaces."""
        self.done += [place for place, then in self.pending if then is not None]
        for name in sorted(self.called - self.own):
            self._look_into(name)
        for place in self.done:
            for kind, value, where in self.hidden:
                said = {UNITS: place.units, SYSTEM: place.system}.get(kind)
                if value == ANY or value != said:
                    place.unknown = place.unknown or f"{where} may change the {kind}"
            if ANY in (place.units, place.system):
                place.unknown = place.unknown or f"the words in front of line {place.move} have expressions"
        return ClampPlaces(self.done, self.offsets, self.first)

    def _look_into(self, name):
        """What the file of a sub, and those it calls, may change."""
        self.own.add(name)
        text = self.text_of_sub(name)
        for line in bare(text).split(b"\n") if text else ():
            word = _O_WORD.match(line)
            if word and word.group(2) == b"CALL" and word.group(1) not in self.own:
                self._look_into(word.group(1))
            self.hidden += [
                (kind, value, f"the file of sub {name_of(name)}") for kind, value in changes(_NAMED.sub(b"<>", line))
            ]
