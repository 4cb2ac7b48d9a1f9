# SPDX-License-Identifier: GPL-2.0-or-later
"""The words of a line of G-code, as text: found and changed.  Called by program.py, text.py and run.py."""

from __future__ import annotations

import re

_COMMENT = re.compile(r"\([^)]*\)?|;.*$")
_WORD = re.compile(r"([a-z])\s*(?:((?:[+-]\s*)?(?:\d+(?:\.\d*)?|\.\d+))|(?=[#\[+-]))", re.I)
# A line of an N word, G0 to G3 and numbers behind X Y Z I J K R F, without comments: nearly every line of a long
# program.
_PLAIN_MOVE = re.compile(
    r"[ \t]*(?:n\d+[ \t]*)?(g0*[0-3](?![\d.])[ \t]*)?(?:[xyzijkrf][ \t]*[+-]?(?:\d+(?:\.\d*)?|\.\d+)[ \t]*)*[\r\n]*",
    re.I,
)
_NAME = re.compile(
    r"<[^>]*(?:>|\Z)"
)  # of a parameter; one that does not end takes the rest, or a line of `<` costs the square of its length
MOTION = re.compile(r"(?<![a-z<_])g\s*0*([0-3])(?![\d.])", re.I)


def code(text: str) -> str:
    """A line without comments."""
    return _COMMENT.sub(" ", text)


def plain_move(text: str) -> re.Match[str] | None:
    """The match of a line that has nothing but a move or an F, its group 1 the G word; None for any other line."""
    return _PLAIN_MOVE.fullmatch(text)


def only_comment(text: str) -> bool:
    """Whether a line is one comment in round brackets."""
    return text.startswith("(") and text.find(")") == len(text.rstrip()) - 1


def active_comments(text: str) -> list[str]:
    """The comments of a line that do something: (MSG,..), (PRINT,..), (LOG,..), (WORKPIECE,..)."""
    return [
        m.group() for m in _COMMENT.finditer(text.rstrip("\r\n")) if re.match(r"[(;]\s*[a-z]+\s*,", m.group(), re.I)
    ]


def words_of(text: str) -> list[tuple[str, float | None]]:
    """[(letter, number or None)] of a line's code; None: an expression or a parameter."""
    return [
        (m.group(1).upper(), float(m.group(2).replace(" ", "")) if m.group(2) else None)
        for m in _WORD.finditer(_NAME.sub("", code(text)))
    ]


def with_feed(text: str, feed: str) -> str | None:
    """A line's text with another F (text of a number); None where its F cannot be found."""
    body, end = text.rstrip("\r\n"), text[len(text.rstrip("\r\n")) :]
    parts, last = [], 0
    for comment in _COMMENT.finditer(body):
        parts += [body[last : comment.start()], comment.group()]
        last = comment.end()
    parts.append(body[last:])
    pattern = re.compile(r"f\s*[+-]?(?:\d+(?:\.\d*)?|\.\d+)", re.I)
    found = [k for k in range(0, len(parts), 2) if pattern.search(parts[k])]
    if any(re.search(r"f\s*[+-]?[#\[]", _NAME.sub("", parts[k]), re.I) for k in range(0, len(parts), 2)):
        return None
    if found:
        parts[found[0]] = pattern.sub("F" + feed, parts[found[0]], count=1)
    else:
        k = max((k for k in range(0, len(parts), 2) if parts[k].strip()), default=0)
        parts[k] = parts[k].rstrip() + " F" + feed + (" " if k + 1 < len(parts) else "")
    return "".join(parts) + end


def with_word(text: str, word: str) -> str:
    """A line with a G word put in front of its first word, behind N."""
    return re.sub(r"\s*/?\s*(?:n\s*\d+(?:\.\d*)?\s*)?", lambda head: head[0] + word + " ", text, count=1, flags=re.I)
