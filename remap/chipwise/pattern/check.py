# SPDX-License-Identifier: GPL-2.0-or-later
"""What the text of a pattern's sub may hold.  Called by run.py, before LinuxCNC's interpreter reads the sub.

A pattern's moves are transformed after they have been computed, so whatever acts apart from a move of X, Y and Z, or
depends on where the machine is, has no place in it.
"""

import math
import re

from chipwise.program.find_sub import plain_text
from chipwise.errors import CycleError

PATH_CODES = {61, 61.1, 64}
G_CODES = PATH_CODES | {
    0,
    1,
    2,
    3,
    4,
    12,
    13,
    17,
    18,
    19,
    20,
    21,
    33,
    40,
    41,
    41.1,
    42,
    42.1,
    73,
    75,
    76,
    77,
    78,
    79,
    80,
    81,
    82,
    83,
    85,
    86,
    89,
    90,
    90.1,
    91,
    91.1,
    93,
    94,
    97,
    98,
    99,
}
M_CODES = {3, 4, 5, 7, 8, 9, 70, 71, 72, 73, 98, 99}
_BEFORE = "program it before G75"
REASONS = {
    "g": ({28, 28.1, 30, 30.1, 53}, "moves in machine coordinates", "use positions of the pattern"),
    "G": (
        {10, 43, 43.1, 43.2, 49, 52, 54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3, 92, 92.1, 92.2, 92.3},
        "changes an offset",
        _BEFORE,
    ),
    "surface": (
        {24},
        "follows the stock at one place only",
        "program it outside of the pattern, each time with a SURFACE comment of its own",
    ),
    "probe": ({38.2, 38.3, 38.4, 38.5}, "probes", "probe outside of the pattern"),
    "sync": (
        {33.1, 74, 84},
        "taps in step with the spindle",
        "tap outside of the pattern, or with G81 and a floating holder",
    ),
    "mode": ({7, 8, 93, 94, 95, 96}, "sets a mode of the whole machine", _BEFORE),
}

_WORD = re.compile(r"([gm])(\d+(?:\.\d+)?|[#\[])")
_POSITION = re.compile(r"#5(?:06\d|07[0-2]|42[0-8])(?!\d)|#<_(?:abs_)?[xyzabcuvw]>|#<_(?:hal|ini)\[")
_SAYING = re.compile(r"\(\s*(msg|print|debug|log\w*|py\w*|probe\w*)\s*,", re.IGNORECASE)
_O_LINE = re.compile(r"(n\d+(\.\d+)?)?o")


def check_text(found, per_rev=False):
    """Refuse what a pattern may not hold, by its line; per_rev: called under G95."""
    for number, text in found.body:
        plain = plain_text(text).lstrip("/")
        where = _POSITION.search(plain)
        if where:
            raise found.fault(
                number,
                f"{where.group().rstrip('[')} reads the machine, not the pattern",
                "put the value into a parameter before G75",
            )
        if _O_LINE.match(plain):
            continue
        for letter, value in _WORD.findall(re.sub(r"#<[^>]*>", "#<>", plain)):
            _check_code(found, number, letter, value, per_rev)
            if letter == "g" and value[0].isdigit() and float(value) in PATH_CODES and _SAYING.search(text):
                raise found.fault(
                    number, f"G{float(value):g} is on a line with a message", "put it on a line of its own"
                )


def _check_code(found, number, letter, value, per_rev):
    if value in ("#", "["):
        raise found.fault(
            number, f"{letter.upper()}{value}.. is a code that only the machine knows", "write the code as a number"
        )
    try:
        check_code(letter, float(value), per_rev)
    except CycleError as error:
        raise found.fault(number, error.problem, error.remedy) from None


def check_code(letter, code, per_rev=False):
    """Raise CycleError, without the line, for a G or M code that no pattern may hold.  Called by runner.py too: for
    subs that the sub calls."""
    named = f"{letter.upper()}{code:g}"
    if code in (G_CODES if letter == "g" else M_CODES) and not (per_rev and named in ("G93", "G94")):
        return
    if letter == "m":
        raise CycleError(
            f"{named} is not allowed in a pattern",
            "a pattern has M3 M4 M5 M7 M8 M9; program the rest before or after G75",
        )
    for codes, reason, remedy in REASONS.values():
        if code in codes:
            raise CycleError(f"{named} {reason}", remedy)
    raise CycleError(f"{named} is not allowed in a pattern", "use moves, canned cycles and the cycles of chipwise")


def refuse_odd(found, line, numbers):
    """Refuse coordinates that are not finite."""
    if not all(math.isfinite(v) for v in numbers):
        raise found.fault(line or found.first, "a coordinate is not a finite number", "give every expression a value")
