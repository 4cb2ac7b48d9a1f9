# SPDX-License-Identifier: GPL-2.0-or-later
"""The blocks of a program's text: subs, calls, loops and conditions.  Called by program.py and line_marks.py."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Iterable

_O_WORD = re.compile(rb"^\s*(?:/\s*)?(?:n\s*\d[\d\s]*)?o\s*(?:<([^>]*)>|(\d+)|(#\S+|\[[^\]]*\]))\s*([a-z]+)", re.I)
_M98 = re.compile(rb"^[^(;]*(?<![a-z<_])m\s*98(?!\d)", re.I)
_M99 = re.compile(rb"^[^(;]*(?<![a-z<_])m\s*99(?!\d)", re.I)
_P = re.compile(rb"p\s*(\d+)", re.I)
_FANUC = re.compile(rb"^\s*o\s*(\d+)\s*(?:[(;]|$)", re.I)  # of a sub that M99 ends
_MOVES = b"GXYZIJKFgxyzijkf("  # a line that begins so has no O-word
_OPENS, _CLOSES = {b"sub", b"while", b"do", b"if", b"repeat"}, {b"endsub", b"endwhile", b"endif", b"endrepeat"}


@dataclass(frozen=True)
class Block:
    """Lines first .. last of the program itself that run as one: a call, or a loop or condition that is in no other."""

    first: int
    last: int


@dataclass
class Blocks:
    """inside: numbers of the lines in subs, loops and conditions; subs: of those in subs; whether subs are called; the
    outermost Blocks by the number of each of their lines; subs that the file defines, subs that it calls (None: an
    expression names it)."""

    inside: set[int] = field(default_factory=set)
    subs: set[int] = field(default_factory=set)
    calls: bool = False
    outermost: dict[int, Block] = field(default_factory=dict)
    defined: set[bytes | None] = field(default_factory=set)
    called: set[bytes | None] = field(default_factory=set)


def _number(digits: bytes) -> bytes:
    """O0100 is O100."""
    return str(int(digits)).encode()


def o_word(text: bytes) -> tuple[bytes | None, bytes] | None:
    """(name as bytes or None: an expression, keyword) of an O-line, else None."""
    match = _O_WORD.match(text)
    if not match:
        return None
    name = match[1].strip().lower() if match[1] is not None else _number(match[2]) if match[2] else None
    return name, match[4].lower()


def blocks_of(lines: Iterable[bytes]) -> Blocks:
    """The Blocks of a program: lines of bytes."""
    result, begun = Blocks(), 0
    stack: list[tuple[bytes, bytes | None]] = []
    in_sub = False
    for number, text in enumerate(lines, 1):
        if text[:1] in _MOVES and b"M" not in text and b"m" not in text:
            if stack:
                result.inside.add(number)
                if in_sub:
                    result.subs.add(number)
            continue
        name, word = o_word(text) or (None, None)
        if word is None and (match := _FANUC.match(text)):
            result.defined.add(_number(match[1]))
        call = _call(result, text, name, word)
        if word in _CLOSES or (word == b"while" and stack[-1:] == [(b"do", name)]):
            del stack[-1:]
            if not stack and word != b"endsub":
                result.outermost.update(dict.fromkeys(range(begun, number + 1), Block(begun, number)))
        elif word in _OPENS:
            if not stack:
                begun = number
            stack.append((word, name))
            if word == b"sub":
                result.defined.add(name)
        elif call and not stack:
            result.outermost[number] = Block(number, number)
        if stack or word:
            result.inside.add(number)
        in_sub = any(opened == b"sub" for opened, _ in stack)
        if in_sub or word == b"endsub":
            result.subs.add(number)
    return result


def _call(result: Blocks, text: bytes, name: bytes | None, word: bytes | None) -> bool:
    """Whether a line calls a sub, which is noted."""
    if word == b"call":
        result.calls = True
        result.called.add(name)
        return True
    if match := _M98.match(text):
        number = _P.search(text, match.start())
        result.calls = True
        result.called.add(_number(number[1]) if number else None)
        return True
    result.calls = result.calls or bool(_M99.match(text))
    return False
