# SPDX-License-Identifier: GPL-2.0-or-later
"""From a typed line of data to the G-code line.  Pure; called by panel/entry.py, and through entry/__init__.py by the
rest.

   data, data, , data <Enter>          distinguished by order and comma; an empty place keeps the default

1. The places are looked at from the left, and the first that is wrong is reported, by its number, letter and name.
2. A number is written as LinuxCNC reads it: digits with a point, no exponent.  It is never rounded: the digits of the
   line are those that were typed, without zeros that say nothing.
3. A comma in a number by itself looks like one between two data.  It is refused wherever the line shows it: `1, 2,5, 3`
   (a comma without a blank among commas with one), `1,05` (no datum begins with a spare 0), `-0,5` (no datum is minus
   0), a semicolon between the data, one datum too many, or a number that its place refuses.
"""

import re
from decimal import Decimal
from typing import Optional, Sequence

from chipwise.entry.table import EntryField, fields
from chipwise.errors import CycleError, braceless, printable

DIGITS = 9  # of a number, before and behind the point
MAX_TEXT = 1000  # characters of a line
_NUMBER = re.compile(r"([-+]?)([0-9]*)(?:\.([0-9]*))?")
_TIGHT = re.compile(r"[0-9],[0-9]")
_SPARE_ZERO = re.compile(r"0[0-9]+")
_MINUS_ZERO = re.compile(r"-0+")
BLANKS = " \t"
_SHOWN = 20  # characters of a datum in a message


class EntryError(CycleError):
    """A line that cannot be used.

    number      of the place, from 1
    field       its EntryField; None: the code has fewer data
    fact        what is wrong, without the place
    remedy      what to do
    """

    def __init__(self, number: int, field: Optional[EntryField], fact: str, remedy: str, code: str):
        self.number, self.field, self.fact = number, field, fact
        where = f"field {number}" + (f", {field.letter} ({field.name})" if field else "")
        super().__init__(braceless(f"{where}: {fact}"), braceless(remedy), code=code)

    @property
    def letter(self) -> str:
        """Letter of the datum, "" if the code has none there."""
        return self.field.letter if self.field else ""

    @property
    def name(self) -> str:
        """Name of the datum, "" if the code has none there."""
        return self.field.name if self.field else ""


class _Wrong(Exception):
    """(fact, remedy) of one place."""


def line(code: str, text: str, path: Optional[str] = None) -> str:
    """G-code line of what was typed.  path as in table.load_table.  Raises EntryError, or CycleError for the code
    itself."""
    known = fields(code, path)
    if len(text) > MAX_TEXT:
        raise EntryError(
            1,
            known[0] if known else None,
            f"the line has more than {MAX_TEXT} characters",
            "type the data of one code",
            code,
        )
    return _join(code, known, split(text), True)


def form(code: str, texts: Sequence[str], path: Optional[str] = None) -> str:
    """G-code line of the texts of a form, a place each.  Raises as line()."""
    return _join(code, fields(code, path), texts, False)


def split(text: str) -> list:
    """The texts of the places of a line, as they were typed; the end of the line is not part of them."""
    return re.sub(r"\r?\n\Z", "", text).split(",")


def _join(code, known, texts, typed):
    """G-code line of the texts of the places; typed: there was a comma between them."""
    words = [code]
    if not known and len(texts) == 1 and not texts[0].strip(BLANKS):
        return code
    for number, text in enumerate(texts, 1):
        field = known[number - 1] if number <= len(known) else None
        if typed:
            _check_comma(code, number, field, texts)
        if field is None:
            raise _too_many(code, known, number, texts)
        word = _word(code, number, field, text.strip(BLANKS), texts)
        if word:
            words.append(word)
    for number, field in enumerate(known[len(texts) :], len(texts) + 1):
        if field.required:
            raise _nothing(code, number, field)
    return " ".join(words)


def _too_many(code, known, number, texts):
    """EntryError for a place behind the last."""
    tight = _one_number(texts, range(len(texts) - 1))
    end = f"; {tight}" if tight else ""
    return EntryError(
        number,
        None,
        f"{len(texts)} data are given, {code} has {len(known)}",
        (f"take out what comes behind {known[-1].letter} ({known[-1].name})" if known else "press Enter alone") + end,
        code,
    )


def number(field: EntryField, text: str) -> str:
    """A number by itself as LinuxCNC reads it, "" for an empty text.  Raises CycleError."""
    text = text.strip(BLANKS)
    try:
        return _digits(field, text) if text else ""
    except _Wrong as error:
        fact, remedy = error.args
        raise CycleError(braceless(f"{field.name}: {fact}"), braceless(remedy)) from None


# ---- commas -------------------------------------------------------------------------------------------------


def _check_comma(code, number, field, texts):
    """EntryError for a semicolon in a place, or a comma behind it that looks like that of a decimal number."""
    text = texts[number - 1]
    if ";" in text:
        raise EntryError(
            number,
            field,
            f"{_shown(text)} has a semicolon",
            "put a comma between the data and a point into numbers: 1.5",
            code,
        )
    if number == len(texts) or not _is_tight(texts, number - 1):
        return
    before, following = text.strip(BLANKS), texts[number].strip(BLANKS)
    if _has_blanks(texts) or _SPARE_ZERO.fullmatch(following) or _MINUS_ZERO.fullmatch(before):
        pair = f"{before},{following}"
        raise EntryError(
            number,
            field,
            f"{_shown(pair)} looks like a number with a decimal comma",
            f"write numbers with a point: {_shown(pair.replace(',', '.'))}, or two data with a blank behind each comma",
            code,
        )


def _has_blanks(texts):
    """Whether a comma has a blank beside it."""
    return bool(re.search(r"[ \t],|,[ \t]", ",".join(texts)))


def _is_tight(texts, k):
    """Whether the comma behind place k has a digit on either side."""
    return bool(_TIGHT.fullmatch(texts[k][-1:] + "," + texts[k + 1][:1]))


def _one_number(texts, places):
    """What to say if one of the commas behind these places could be that of a decimal number; "" if none could."""
    pairs = [
        f"{texts[k].strip()}.{texts[k + 1].strip()}"
        for k in places
        if 0 <= k < len(texts) - 1
        and _is_tight(texts, k)
        and _NUMBER.fullmatch(f"{texts[k].strip()}.{texts[k + 1].strip()}")
    ]
    return f"write decimals with a point: {_shown(pairs[0])}" if pairs else ""


# ---- one place ------------------------------------------------------------------------------------------------


def _nothing(code, number, field):
    """EntryError for an empty place without a default."""
    return EntryError(number, field, "nothing is given", f"give the {field.name}", code)


def _word(code, number, field, text, texts):
    """The word of a place, "" for an empty one."""
    if not text:
        if field.required:
            raise _nothing(code, number, field)
        return ""
    try:
        return field.letter + _digits(field, text)
    except _Wrong as error:
        fact, remedy = error.args
        hint = _one_number(texts, (number - 1, number - 2))
        raise EntryError(number, field, fact, remedy + (f"; {hint}" if hint else ""), code) from None


def _digits(field, text):
    """The number of a place as it is written behind the letter.  Raises _Wrong(fact, remedy)."""
    match = _NUMBER.fullmatch(text)
    whole, part = ((match.group(2) or "").lstrip("0"), (match.group(3) or "").rstrip("0")) if match else ("", "")
    if not match or not (match.group(2) or match.group(3)):
        raise _Wrong(f"{_shown(text)} is not a number", "use digits and a point, as 12.5 or -8")
    if len(whole) > DIGITS or len(part) > DIGITS:
        raise _Wrong(f"{_shown(text)} has more than {DIGITS} digits before or behind the point", "use fewer digits")
    shown = (whole or "0") + (f".{part}" if part else "")
    shown = "-" + shown if match.group(1) == "-" and (whole or part) else shown
    _check(field, Decimal(shown), shown)
    return shown


def _check(field, value, shown):
    """Raise _Wrong(fact, remedy) for a number that the datum cannot have."""
    if field.whole and value != int(value):
        raise _Wrong(f"{shown} is not a whole number", "leave the decimals out")
    if field.kind == "choice" and value not in [number for number, _meaning in field.choices]:
        raise _Wrong(
            f"{shown} is not a choice",
            "use " + " or ".join(f"{number} ({meaning})" for number, meaning in field.choices),
        )
    if field.above is not None and not value > field.above:
        raise _Wrong(f"{shown} is not above {field.above:g}", f"give a number above {field.above:g}")
    if field.least is not None and value < field.least or field.most is not None and value > field.most:
        rule = f"{field.least:g} or more" if field.most is None else f"from {field.least:g} to {field.most:g}"
        raise _Wrong(f"{shown} is not {rule}", f"give a number {rule}")


def _shown(text):
    """What was typed, in a message."""
    text = printable(text).strip()
    return text if len(text) <= _SHOWN else text[:_SHOWN] + ".."
