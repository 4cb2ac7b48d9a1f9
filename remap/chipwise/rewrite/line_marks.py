# SPDX-License-Identifier: GPL-2.0-or-later
"""A program with a comment on each of its lines that says which line is executed (program/executed_words.py).  Called
by marked_reader.py.

1. Each line of code gets the mark `chipwise-at FILE LINE WHAT` in the place of its comments: the last comment of a line
   counts.  A comment that does something comes before it, on a line of its own.  Lines with O-words and remarks stay as
   they are.
2. Marks stand before and behind each outermost block.
3. Subs in files of their own come before the program: LinuxCNC takes a sub that it has read before it looks for a file
   (2.9: interp_o_word.cc, control_back_to).
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Iterable, Sequence

from chipwise.program.program_file import MAX_BYTES
from chipwise.program.reader import Unreadable
from chipwise.program.executed_words import BEGIN, COMMENT, END, PLAIN, PREFIX, STATE, WORDS
from chipwise.program.find_sub import sub_folders
from chipwise.host.files import read_bytes
from chipwise.rewrite.blocks import blocks_of, o_word
from chipwise.rewrite.words import active_comments, code, plain_move

if TYPE_CHECKING:
    from chipwise.program.executed_words import Watched
    from chipwise.rewrite.blocks import Blocks

MOST_BYTES = 250  # of a line; LinuxCNC takes 255
_PARAMETER = re.compile(r"(?<!#)#\s*(?:(\d+)|<([^<>]*)>)\s*$")  # before a =
_NUMBERS = range(1, 5001)  # of parameters that are the user's


@dataclass
class SubFile:
    """A file of subs that the program calls: path and lines (bytes)."""

    path: str
    lines: list[bytes]


def mark(file: int, line: int, what: str) -> str:
    return f"({PREFIX}{file} {line} {what})\n"


def marked_line(text: str, file: int, number: int) -> str:
    """[1]: a line of text with its mark."""
    bare = text.rstrip("\r\n")
    own, comments = code(bare).strip(), active_comments(text)
    if own == "%" or o_word(bare.encode("utf-8", "surrogateescape")):
        return bare + "\n"
    before = mark(file, number, COMMENT) + comments[-1] + "\n" if comments else ""
    if not own:
        return before or bare + "\n"
    end = " " + mark(file, number, PLAIN if plain_move(own) else WORDS)
    if len(own) + len(end) > MOST_BYTES:
        own = re.sub(r"\s+", "", own)
        if len(own) + len(end) > MOST_BYTES:
            raise Unreadable(
                f"a line of {len(own)} characters in a program with calls or loops cannot be followed",
                "divide the line",
                number,
            )
    return before + own + end


def marked(source: Sequence[str], blocks: Blocks, files: list[SubFile], checks: dict[int, int]) -> bytes:
    """Bytes of a program with marks.  source: lines of text; blocks: its Blocks [2]; files: SubFiles [3]; checks:
    {line: number that the mark behind it has, which says what holds there}."""
    outermost = blocks.outermost
    out, top = [], 0
    if source and source[0].strip() == "%":
        out.append(source[0].rstrip("\r\n") + "\n")
        top = 1
    for file, sub in enumerate(files, 1):
        out += [marked_line(text, file, n) for n, text in _subs_of(sub)]
    for number, text in enumerate(source[top:], top + 1):
        block = outermost.get(number)
        if block and number == block.first:
            out.append(mark(0, number, BEGIN))
        out.append(marked_line(text, 0, number))
        if block and number == block.last:
            out.append(mark(0, block.first, END))
        if number in checks:
            out.append(mark(0, checks[number], STATE))
    return "".join(out).encode("utf-8", "surrogateescape")


def _subs_of(sub: SubFile) -> list[tuple[int, str]]:
    """[(number, text)] of the lines in subs."""
    subs = blocks_of(sub.lines).subs
    return [(n, text.decode("utf-8", "surrogateescape")) for n, text in enumerate(sub.lines, 1) if n in subs]


def sub_files(blocks: Blocks, ini: str) -> tuple[list[SubFile], str | None]:
    """(SubFiles that a program's Blocks need, directly or not; name of a sub that is in none of them, or None)."""
    defined, waiting = set(blocks.defined), list(blocks.called)
    found: list[SubFile] = []
    missing: bytes | None = None
    while waiting:
        name = waiting.pop()
        if name in defined:
            continue
        sub = _sub_file(name, ini) if name else None
        own = blocks_of(sub.lines) if sub else None
        if sub is None or own is None or name not in own.defined or own.defined & defined or not _only_subs(sub, own):
            missing = missing or (name or b"[..]")
            continue
        defined |= own.defined
        waiting += own.called
        found.append(sub)
    return found, missing.decode("utf-8", "replace") if missing else None


def _only_subs(sub: SubFile, own: Blocks) -> bool:
    """Whether a file has nothing but O-word subs."""
    outside = (
        code(text.decode("utf-8", "replace")).strip().lower()
        for n, text in enumerate(sub.lines, 1)
        if n not in own.subs
    )
    return all(text in ("", "%", "m2", "m02", "m30") for text in outside)


def _sub_file(name: bytes, ini: str) -> SubFile | None:
    for folder in sub_folders(ini):
        path = os.path.join(
            os.path.dirname(os.path.abspath(ini)), folder, name.decode("utf-8", "surrogateescape") + ".ngc"
        )
        try:
            return SubFile(path, read_bytes(path, MAX_BYTES).splitlines(keepends=True))
        except OSError:
            continue
    return None


def _assigned(text: str) -> list[int | str | None]:
    """[number, name or None: an expression says which] of the parameters that a line sets."""
    result = []
    for before in code(text).split("=")[:-1]:
        match = _PARAMETER.search(before)
        number, name = match.groups() if match else (None, None)
        result.append(int(number) if number else re.sub(r"\s", "", name).lower() if name else None)
    return result


def watched(texts: Iterable[str]) -> Watched:
    """{"numbers", "names"}: the parameters of the user that lines of text set; all numbers if an expression says
    which."""
    found = {own for text in texts if "=" in text for own in _assigned(text)}
    numbers = set(_NUMBERS) if None in found else {own for own in found if isinstance(own, int)} & set(_NUMBERS)
    return {"numbers": sorted(numbers), "names": sorted(own for own in found if isinstance(own, str))}


def not_the_users(text: str) -> int | None:
    """A parameter of LinuxCNC's own that a line sets, None without one."""
    return next((own for own in _assigned(text) if isinstance(own, int) and own not in _NUMBERS), None)
