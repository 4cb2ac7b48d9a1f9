# SPDX-License-Identifier: GPL-2.0-or-later
"""The one error a cycle, a setting or a tool description may raise.

Called by everything below remap/chipwise; caught only in glue/session.py, which prints it in program units.

A message has the problem, the value with its unit, the rule and the remedy:

    chipwise: G12: hole radius I2 mm is not larger than the tool radius 3 mm; use I above 3 mm (line 12)

Pure code uses millimetres only, the operator the units of the program.  So an error holds a template and its lengths,
and the text is made when the unit is known: `text("in")`.

Nothing here can fail, whatever the texts contain (braces, line breaks, bytes that are not UTF-8), because every other
failure is reported through it.
"""

import re
from typing import Any, Iterable, Optional

MM_PER_INCH = 25.4

NAME = "chipwise: "
MESSAGE_BYTES = 250  # linuxcnc.h: LINELEN is 255


class Area(float):
    """An area in mm2 as a value of a message's template: shown in mm2 or in2."""


class Across(float):
    """A radius in mm as a value of a message's template, which the program may give as a diameter:
    CycleError.across()."""


def format_length(value_mm: float, unit: str = "mm") -> str:
    """Length (mm) -> "2 mm" or "0.07874 in": at most 4 decimals of a mm, 5 of an inch, no trailing zeros."""
    if unit == "in":
        number = f"{value_mm / MM_PER_INCH:.5f}"
    else:
        number = f"{value_mm:.4f}"
    number = number.rstrip("0").rstrip(".")
    if number in ("-0", ""):
        number = "0"
    return f"{number} {unit}"


def format_place(place_mm: Iterable[float], unit: str = "mm") -> str:
    """Lengths (mm) -> "2 3.5 -1": as format_length() has them, without the unit."""
    return " ".join(format_length(value, unit).split()[0] for value in place_mm)


def format_minutes(seconds: float) -> str:
    """Time (s) -> "45.2 s", "7:35"."""
    return f"{seconds:.1f} s" if seconds < 60 else f"{int(seconds + 0.5) // 60}:{int(seconds + 0.5) % 60:02}"


def format_area(value_mm2: float, unit: str = "mm") -> str:
    """Area (mm2) -> "3.434 mm2" or "0.005323 in2": four significant digits."""
    return f"{value_mm2 / MM_PER_INCH**2:.4g} in2" if unit == "in" else f"{value_mm2:.4g} mm2"


def braceless(text: str) -> str:
    """The text with its braces doubled: a message's template takes single ones for lengths."""
    return text.replace("{", "{{").replace("}", "}}")


def fill(template: str, values: dict[str, Any], unit: str) -> str:
    """A template with its {names} replaced by values (mm, Area or text); braces that name no value stay as they are.

    {{ and }} give one brace.  The template may contain any text: a name that is not among the values stays.
    """

    def shown(match: re.Match) -> str:
        if match.group() in ("{{", "}}"):
            return match.group()[0]
        if match.group(1) not in values:
            return match.group()
        value = values[match.group(1)]
        if isinstance(value, str):
            return value
        return format_area(value, unit) if isinstance(value, Area) else format_length(value, unit)

    return re.sub(r"\{\{|\}\}|\{(\w+)\}", shown, template)


def printable(text: str) -> str:
    """One line of text that LinuxCNC's messages can carry: no control characters, no lone surrogates."""
    text = re.sub(r"[\x00-\x1f\x7f]+", " ", text)
    return text.encode("utf-8", "replace").decode("utf-8")


def with_line(text: str, line: int) -> str:
    """A message with its line (0: none), unless it has one already."""
    return f"{text} (line {line})" if line and "(line " not in text else text


def clip(text: str, end: str = "") -> str:
    """text + end, shortened in the text to what a message of LinuxCNC holds."""
    room = MESSAGE_BYTES - len(end.encode())
    data = text.encode("utf-8", "replace")
    if len(data) <= room:
        return text + end
    return data[: room - 3].decode("utf-8", "ignore") + ".." + end


def unnamed(message: object) -> str:
    """A message, or an error's text in mm, without the package's name: for those who put a name of their own before
    it."""
    return str(message).removeprefix(NAME)


class LibraryError(Exception):
    """The C core cannot be used: it is missing, damaged, or built from other sources; the text has the remedy."""


def of_unexpected(error: BaseException) -> str:
    """What a command says of an exception that nobody raised for the operator, without "chipwise: "."""
    if isinstance(error, LibraryError):
        return unnamed(error)
    return f"internal error: {type(error).__name__}: {error}; please report it with what CHIPWISE_TRACEBACK=1 adds"


class CycleError(Exception):
    """A request that cannot be carried out.

    problem  what, value and rule: a template, whose {names} are replaced by values
    remedy   same format; "" if there is none
    code     the G-code or M-code concerned, None while not known (glue fills it in)
    values   by name: lengths in mm, Area, or text (of a file, a word or a comment) that is shown as it is

    str() gives the text in mm.
    """

    def __init__(self, problem: str, remedy: str = "", code: Optional[str] = None, **values: Any):
        super().__init__(problem)
        self.problem = problem
        self.remedy = remedy
        self.code = code
        self.values = values

    def across(self, diameter: bool) -> "CycleError":
        """The error with its radii as the program gives X: as diameters under G7."""
        if diameter:
            self.values = {name: float(2 * v) if isinstance(v, Across) else v for name, v in self.values.items()}
        return self

    def text(self, unit: str = "mm") -> str:
        """The whole message, lengths in "mm" or "in"."""
        parts = ["chipwise"]
        if self.code:
            parts.append(self.code)
        sentence = fill(self.problem, self.values, unit)
        if self.remedy:
            sentence += "; " + fill(self.remedy, self.values, unit)
        parts.append(sentence)
        return printable(": ".join(parts))

    def __str__(self) -> str:
        return self.text("mm")
