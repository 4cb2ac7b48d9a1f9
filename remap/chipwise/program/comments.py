# SPDX-License-Identifier: GPL-2.0-or-later
"""Comments of a program that chipwise reads, such as (SURFACE,FILE=part.stl).

Called by glue/, turning/, setup/ and monitor/.  As LinuxCNC does with (MSG, ..): what is behind a ; is a remark, and so
is what is in another comment.
"""

import re
from collections.abc import Iterator

_COMMENT = re.compile(r"\(([^()\n]*)\)|;[^\n]*")
REMARK = re.compile(rb"\([^)\n]*\)|;[^\n]*")  # in the bytes of a program
BLANKS = b" \t\r"
BLOCK = 1 << 18  # bytes: while a substitution works, each comment takes memory


def bare(program: bytes) -> bytes:
    """A program without comments and blanks, in capitals; it keeps its lines."""
    return b"".join(REMARK.sub(b"", part).translate(None, BLANKS).upper() for part in _blocks(program))


def _blocks(program: bytes) -> Iterator[bytes]:
    """A program in parts of whole lines."""
    start = 0
    while start < len(program):
        end = program.find(b"\n", start + BLOCK) + 1 or len(program)
        yield program[start:end]
        start = end


def insides(text: str, name: str, comma: bool = True) -> list[str]:
    """What is behind the name in each comment of a line, or of a whole program, that begins with it and, if `comma`, a
    comma."""
    if name not in text.upper():
        return []
    begins = re.compile(rf"\s*{name}\s*," if comma else rf"\s*{name}\b", re.IGNORECASE)
    found = ((inside, begins.match(inside)) for inside in (match.group(1) or "" for match in _COMMENT.finditer(text)))
    return [inside[match.end() :] for inside, match in found if match]
