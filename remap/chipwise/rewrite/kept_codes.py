# SPDX-License-Identifier: GPL-2.0-or-later
"""What stays of an executed line when its moves are written out: the words that do something else, with their values.

Called by unroll.py with the items of program/executed_words.py.  G codes as numbers (61.1), M codes as whole numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chipwise.program.reader import Unreadable

if TYPE_CHECKING:
    from chipwise.program.executed_words import MarkItem

_MOVES = {0, 1, 2, 3, 5, 5.1, 5.2, 5.3, 73, 80, 81, 82, 83, 85, 86, 89, 12, 13, 77, 78, 79}  # written out as moves
MOTIONS = {0, 1, 2, 3, 5, 33, 38, 70, 71, 72, 73, 74, 76, *range(80, 90)}
_MODES = {17, 18, 19, 20, 21, 90, 91, 90.1, 91.1, 40, 41, 41.1, 42, 42.1, 94}  # of moves: unroll.py follows them
OWN_MOVES = {28, 30, 53}  # in machine coordinates: they stay, with their axes
# letters that a G code takes; those of M codes are _M_LETTERS
_G_LETTERS = {
    4: "P",
    10: "XYZPQRLIJ",
    28: "XYZ",
    28.1: "",
    30: "XYZ",
    30.1: "",
    43: "H",
    43.1: "XYZ",
    43.2: "H",
    49: "",
    52: "XYZ",
    53: "XYZ",
    61: "",
    61.1: "",
    64: "PQ",
    92: "XYZ",
    92.1: "",
    92.2: "",
    92.3: "",
    96: "D",
    97: "",
    98: "",
    99: "",
    **dict.fromkeys((54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3), ""),
}
_M_LETTERS = {
    **dict.fromkeys((0, 1, 3, 4, 5, 6, 7, 8, 9, 48, 49, 60), ""),
    19: "RPQ",
    50: "P",
    51: "P",
    52: "P",
    53: "P",
    61: "Q",
    62: "P",
    63: "P",
    64: "P",
    65: "P",
    67: "EQ",
    68: "EQ",
    **{code: "PQ" for code in range(100, 200)},
    250: "PQRIJK",
    251: "QPER",
    252: "",
    253: "P",
    255: "PQH",
}
_REASONS = {
    2: "it ends the program",
    30: "it ends the program",
    66: "what it reads is known on the machine only",
    70: "it saves modes",
    71: "it restores modes",
    72: "it restores modes",
    73: "it saves modes",
}


def kept(item: MarkItem, line: int) -> tuple[list[tuple[str, float]], bool]:
    """([(letter, value)] in the order they are written, letters of axes among them, whether the line moves by what is
    kept).

    item: of a WORDS mark.  Raises Unreadable for a code that cannot be written out.
    """
    codes: list[tuple[str, float]] = []
    letters = ""
    for code in item["g"]:
        if code in _MOVES or code in _MODES:
            continue
        if code not in _G_LETTERS:
            raise cannot(f"G{code:g}", line)
        codes.append(("G", code))
        letters += _G_LETTERS[code]
    for code in item["m"]:
        if code in (98, 99):  # call and return
            continue
        if code not in _M_LETTERS:
            raise cannot(f"M{code}", line, _REASONS.get(code))
        codes.append(("M", code))
        letters += _M_LETTERS[code]
    words = item["words"]
    codes += [(letter, words[letter]) for letter in dict.fromkeys("ST" + letters) if letter in words]
    return codes, any(letter == "G" and code in OWN_MOVES for letter, code in codes)


def may_move(item: MarkItem) -> bool:
    """Whether a line makes moves by its own words: not what a remapped M code makes."""
    return (
        any(code in _MOVES for code in item["g"])
        or any(letter in item["words"] for letter in "XYZ")
        or not (item["m"] or item["g"])
    )


def cannot(what: str, line: int, why: str | None = None) -> Unreadable:
    """Unreadable for a code in a block that has to be written out."""
    return Unreadable(
        f"a move in a sub, a loop or a condition has to change, and {what} there cannot be written out: "
        f"{why or 'what it does is not known'}",
        "write the program without the block",
        line,
    )
