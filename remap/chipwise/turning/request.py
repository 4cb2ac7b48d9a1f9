# SPDX-License-Identifier: GPL-2.0-or-later
"""What a program asks for: its G26 line, the modes before it, barriers, tools, blank.  Text only: nothing is run.

Called by cli/turn.py, and by glue/turning.py, which has words and modes from the interpreter.  Only numbers are
understood on the lines that are read as text; an expression is refused.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn, TypedDict

from chipwise.program import comments
from chipwise.errors import MM_PER_INCH, CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.turning.profile_function import Box
from chipwise.turning.tool import ROLES

MAX_BYTES = 1 << 26  # of a program
FAR_MM = 1e4  # a barrier without K ends here, to the left
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+))")
_KNOWN, _KNOWN_BARRIER = "GQPIDEFHLN", "GXZIKN"
_OFFSETS = {10.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3, 92.0, 92.1, 92.2, 92.3}


Roles = dict[str, tuple[int, ...]]  # {role: (tool numbers)}


class Words(TypedDict, total=False):
    """Words of G26, lengths in mm; complete() sets all of them."""

    Q: int
    P: int
    I: float
    D: float
    F: float
    E: float
    H: int


@dataclass
class Request:
    """line of G26; unit "mm" or "in"; diameter: G7; per_rev: G95; spindle: words of the program (G96 D S M3); feed: F
    in force, program units; plane: 17, 18 or 19; incremental: G91; ijk_absolute: G90.1; barriers mm ((z0, z1, x0, x1),
    ..), x as radii; roles {role: (tool numbers)}; words of G26, lengths in mm."""

    line: int = 0
    unit: str = "mm"
    diameter: bool = False
    per_rev: bool = False
    css: bool = False
    cap: float = 0.0
    speed: float = 0.0
    direction: int = 0
    feed: float = 0.0
    plane: int = 18
    incremental: bool = False
    ijk_absolute: bool = False
    barriers: tuple[Box, ...] = ()
    roles: Roles = field(default_factory=dict)
    words: Words = field(default_factory=lambda: Words())

    @property
    def scale(self) -> float:
        """mm of a program unit."""
        return MM_PER_INCH if self.unit == "in" else 1.0


def read_program(path: str) -> str:
    """Text of the program that G26 is in, "" for the path ""."""
    if not path:
        return ""
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise CycleError(f"{braceless(path)}: {error.strerror}", "open the program again") from error


def read_request(text: str, before: str = "") -> Request:
    """Request of a program's text.  before: codes in force when it begins (Ini.startup_codes()).  Raises CycleError
    naming the line."""
    request = Request()
    _modes(request, *_split(before), before)
    request.roles = read_roles(text)
    for number, line in _program_lines(text):
        codes, words = _split(line)
        if codes & {22.0, 26.0, 27.0} and re.search(r"[#\[]", line):
            raise CycleError(
                "the line holds an expression, which is read only when the program runs (line {line})",
                "write numbers",
                line=str(number),
            )
        _modes(request, codes, words, line)
        if request.barriers and codes & _OFFSETS:
            raise CycleError(
                "the work offset changes after G22: only the machine knows where the barrier is then (line {line})",
                "set the work offset before G22",
                line=str(number),
            )
        if 22.0 in codes:
            _only(words, _KNOWN_BARRIER, "G22", number, "use X Z I K")
            request.barriers += (_barrier(request, words, number),)
        elif 23.0 in codes:
            request.barriers = ()
        elif codes & {26.0, 27.0}:
            _only(words, _KNOWN, "G26", number, "use Q P I D E F H")
            if request.plane != 18:
                raise CycleError(f"the plane is G{request.plane} (line {number})", "program G18 before", "G26")
            if request.incremental:
                raise CycleError(
                    f"G91 is on: the sub begins where the tool is, which only the machine knows (line {number})",
                    "program G90 before",
                    "G26",
                )
            request.line = number
            return complete(request, {"F": request.feed, **words}, f" (line {number})")
    raise CycleError(
        "the program has no G26 outside of its subs",
        "add a line like G26 Q100 I0.3 D1 E0.08 F0.2, with Q the sub of the part",
    )


def lines_of_plans(text: str) -> list[int]:
    """Numbers of the lines with G26 or G27: only the first is planned without a machine."""
    return [number for number, line in _program_lines(text) if _split(line)[0] & {26.0, 27.0}]


def _only(words: dict[str, float], known: str, code: str, number: int, remedy: str) -> None:
    """CycleError for a word that a code does not have."""
    for letter in words:
        if letter not in known and letter not in "ST":
            raise CycleError(f"{letter} is not a word of {code} (line {number})", remedy, code)


def read_spindle(text: str, last: int) -> tuple[bool, float, float]:
    """(css, cap, speed) that the lines of a program up to number `last` set; 0 for what they do not set as a number."""
    request = Request()
    for number, line in _program_lines(text):
        if number > last:
            break
        _modes(request, *_split(line), line)
    return request.css, request.cap, request.speed


def _program_lines(text: str) -> Iterator[tuple[int, str]]:
    """(number, line in capitals without comments) outside of subs."""
    inside: str | None = None
    for number, raw in enumerate(text.splitlines(), 1):
        line = re.sub(r"\([^)]*\)?|;.*", "", raw).upper()
        o_word = re.match(r"(?:N\d+)?O(\d+|<[^>]*>)(SUB|ENDSUB)", line.replace(" ", ""))
        if o_word:
            inside = o_word.group(1) if o_word.group(2) == "SUB" else None
        elif inside is None:
            yield number, line


def _split(line: str) -> tuple[set[float], dict[str, float]]:
    """({G-codes}, {letter: number} of the other words) of a line."""
    words = _WORD.findall(line)
    return {float(v) for letter, v in words if letter == "G"}, {
        letter: float(v) for letter, v in words if letter not in "GM"
    }


def rpm(request: Request, x: float) -> float:
    """Speed of the spindle at radius x (mm), 1/min."""
    if not request.css:
        return request.speed
    surface = request.speed * (1000.0 if request.unit == "mm" else 12 * 25.4)  # mm/min
    speed = surface / (2 * math.pi * max(x, 0.5))
    return min(speed, request.cap) if request.cap else speed


def read_roles(text: str) -> Roles:
    """{role: (tool numbers)} of the LATHE comments of a program."""
    roles: Roles = {}
    for inside in comments.insides(text, "LATHE"):
        roles.update(_roles(inside))
    return roles


def _roles(text: str) -> Roles:
    """{role: (number,)} of the inside of a LATHE comment."""
    found: Roles = {}
    for part in filter(None, (p.strip() for p in text.split(","))):
        key, _, number = (w.strip() for w in part.partition("="))
        if key.lower() not in ROLES or not re.fullmatch(r"\d{1,9}", number):
            raise CycleError(
                "LATHE comment: {part} is not a role and a tool number",
                "use (LATHE,ROUGH=1,FINISH=2); roles are " + ", ".join(r.upper() for r in ROLES),
                part=part,
            )
        found[key.lower()] = (*found.get(key.lower(), ()), int(number))
    return found


def _modes(request: Request, codes: set[float], words: dict[str, float], line: str) -> None:
    """Modes that a line sets.  A change of unit or kind of feed ends the feed before."""
    before = request.unit, request.per_rev
    for code, name, value in (
        (20, "unit", "in"),
        (21, "unit", "mm"),
        (7, "diameter", True),
        (8, "diameter", False),
        (94, "per_rev", False),
        (95, "per_rev", True),
        (90, "incremental", False),
        (91, "incremental", True),
        (90.1, "ijk_absolute", True),
        (91.1, "ijk_absolute", False),
        (97, "css", False),
        (96, "css", True),
    ):
        if code in codes:
            setattr(request, name, value)
    request.plane = next((int(code) for code in (17, 18, 19) if code in codes), request.plane)
    if before != (request.unit, request.per_rev):
        request.feed = 0.0
    if "F" in words or re.search(r"F\s*[-+]?\s*[\[#]", line):
        request.feed = words.get("F", 0.0)
    if 96 in codes:
        request.cap = words.get("D", 0.0)
    if "S" in words or re.search(r"S\s*[-+]?\s*[\[#]", line):
        request.speed = words.get("S", 0.0)
    stops = {int(float(v)) for letter, v in _WORD.findall(line) if letter == "M"}
    request.direction = 3 if 3 in stops else 4 if 4 in stops else 0 if 5 in stops else request.direction


def _barrier(request: Request, words: dict[str, float], number: int) -> Box:
    """(z0, z1, x0, x1) mm of a G22 line."""
    if "X" not in words or "Z" not in words:
        raise CycleError(
            "G22 lacks X or Z (line {line})", "give a corner of the box by X Z, the other one by I K", line=str(number)
        )
    half = request.scale * (0.5 if request.diameter else 1.0)
    return box(
        words["X"] * half,
        words["Z"] * request.scale,
        words.get("I", 0.0) * half,
        words["K"] * request.scale if "K" in words else None,
    )


def box(x: float, z: float, i: float, k: float | None) -> Box:
    """(z0, z1, x0, x1) of a barrier's corners X Z and I K, mm, x as radii; K None: it goes on to the left."""
    other = -FAR_MM if k is None else k
    return min(z, other), max(z, other), min(abs(x), abs(i)), max(abs(x), abs(i))


def complete(request: Request, words: dict[str, float], where: str = "") -> Request:
    """The Request with the words of G26 or G27, in program units, checked; where: " (line 5)" for the messages."""

    def wrong(fact: str, remedy: str) -> NoReturn:
        raise CycleError(fact + where, remedy, "G26" if where else None)

    if "Q" not in words:
        wrong("there is no Q", "give the number of the part's O-sub")
    for letter in "QP":
        if letter in words and not (words[letter] > 0 and words[letter] == int(words[letter])):
            wrong(f"{letter}{words[letter]:g} is not the number of an O-sub", "use a whole number above 0")
    i, d = (
        words.get("I", 0.0) * request.scale,
        words.get("D", 1.0 / (1 if request.unit == "mm" else 25.4)) * request.scale,
    )
    if not 0.0 <= i <= 20.0:
        wrong(f"the allowance I{words['I']:g} is not from 0 to 20 mm", "give the material that is left for finishing")
    if not 0.01 <= d <= 50.0:
        wrong(f"the depth of cut D{words['D']:g} is not from 0.01 to 50 mm", "give the depth on one side")
    if words.get("H", 0) not in (0, 1):
        wrong(f"H{words['H']:g} is neither 0 nor 1", "H1 only says the plan")
    feed = words.get("F", 0.0)
    if not 0.0 < feed < math.inf:
        wrong("there is no feed F above 0", "give the feed of roughing")
    fine = words.get("E", feed / 2)
    if not 0.0 < fine < math.inf:
        wrong(f"the finish feed E{fine:g} is not above 0", "give E above 0")
    if request.css and not request.cap > 0.0:
        wrong("G96 has no D: near the axis the speed has no limit", "give the largest speed, 1/min, as G96 D2500 S180")
    if request.per_rev and not request.speed > 0.0:
        wrong("G95 is on and there is no speed S above 0", "give S before G26")
    request.words = {
        "Q": int(words["Q"]),
        "P": int(words.get("P", 0)),
        "I": i,
        "D": d,
        "F": feed * request.scale,
        "E": fine * request.scale,
        "H": int(words.get("H", 0)),
    }
    return request
