# SPDX-License-Identifier: GPL-2.0-or-later
"""What the text of a contour sub may hold; what hides behind an expression the runner finds.  Called by run.py."""

import math
import re

from chipwise.program.find_sub import plain_text

LINE_LENGTH = 255  # linuxcnc.h: LINELEN; a longer line is an error in LinuxCNC, too
MAX_LINES = 100_000  # lines of one sub, as many as it may make moves

_ASSIGNMENT = re.compile(r"#+(?:<[^>]*>|\[[^]]*\]|\d+)=.*?(?=#+(?:<[^>]*>|\[[^]]*\]|\d+)=|$)")
_FUNCTION = re.compile(r"#+\d*|(?:exists|acos|asin|atan|round|sqrt|abs|cos|exp|fix|fup|sin|tan|ln)(?=#)")
_WORD = re.compile(r"([a-z@^])((?:[+-]?[0-9.]+)?)")
_MOVE = re.compile(r"\s*(?:[gG]0*[0-3])?(?:\s*[xXyYiIjJrRfF]\s*[-+]?(?:\d+(?:\.\d*)?|\.\d+))*\s*")  # most lines are one
_CODES = {0.0, 1.0, 2.0, 3.0, 40.0}
_LETTERS = "gnxyijrpf@^"
_LATHE_LETTERS = "gnxzikrpf"


def _without_values(plain):
    """A line with parameters and expressions taken out: what is left are letters and literal numbers."""
    plain = _ASSIGNMENT.sub("", plain)
    while True:
        fewer = re.sub(r"\[[^][]*\]|#<[^>]*>", "#", plain)
        if fewer == plain:
            return _FUNCTION.sub("", plain)
        plain = fewer


def check_text(found, lathe=False):
    """Refuse what no contour sub may hold, by its exact line; what hides behind an expression the runner finds."""
    if found.last - found.first > MAX_LINES:
        raise found.fault(
            found.first,
            f"the sub has {found.last - found.first - 1} lines, more than {MAX_LINES}",
            "divide the contour, or use a loop",
        )
    for number, text in found.body:
        if len(text) > LINE_LENGTH:
            raise found.fault(
                number, f"the line has {len(text)} characters, more than LinuxCNC's {LINE_LENGTH}", "divide the line"
            )
    _refuse_arguments(found)
    for number, text in found.body:
        if _MOVE.fullmatch(text) and not lathe:
            continue
        plain = plain_text(text).lstrip("/")
        if re.match(r"(n\d+)?o", plain):
            continue
        words = _WORD.findall(_without_values(plain))
        for letter, value in words:
            wrong = None
            if lathe:
                if letter not in _LATHE_LETTERS or (letter == "g" and value and _number(value) not in _CODES):
                    wrong, remedy = (
                        letter.upper() + value,
                        "the sub of a turned part holds G0 G1 G2 G3 in X and Z (G40 and F are ignored)",
                    )
            elif letter == "z":
                wrong, remedy = "a move in Z", "a contour lies in XY; heights are the words Z and R of the cycle"
            elif letter not in _LETTERS or (letter == "g" and value and _number(value) not in _CODES):
                wrong, remedy = letter.upper() + value, "a contour sub holds G0 G1 G2 G3 in XY (G40 and F are ignored)"
            if wrong:
                raise found.fault(number, f"{wrong} is not allowed in a contour sub", remedy)


_ARGUMENT = re.compile(r"#([1-9]|[12][0-9]|30)(?![0-9.])")


def _refuse_arguments(found):
    """A sub that reads #1 .. #30 before the line that sets them: written for a call with arguments, and there are
    none."""
    known: set[str] = set()
    for number, text in found.body:
        plain = plain_text(text)
        if "#" not in plain:
            continue
        assigned = set(re.findall(r"#(\d+)=", plain))
        for argument in _ARGUMENT.findall(re.sub(r"#\d+=", "", plain)):
            if argument not in known | assigned:
                raise found.fault(
                    number,
                    f"#{argument} is an argument of the sub, and a contour sub is called without any",
                    f"set #{argument} in the sub, or use a named parameter: #<_name>",
                )
        known |= assigned


def _number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan
