# SPDX-License-Identifier: GPL-2.0-or-later
"""The job file of a program: the stock and the feeds that a person has confirmed for it.

Called by cli/setup.py.  part.ngc has part.job.toml beside it, or in the folder [CHIPWISE]JOBS.  It has the digest of
the program: a program that was changed since, or another one of that name, has no set-up.  Nothing else of the file is
trusted either: whatever is in it, read() ends in a Job or in a CycleError.  mm, mm3/min; the file has rates in cm3/min,
as a person types them.
"""

import hashlib
import json
import math
import os
import re
import tomllib
from dataclasses import dataclass, field
from typing import Any, NoReturn, Optional

from chipwise.errors import CycleError, braceless, unnamed
from chipwise.host.files import open_regular, printable, read_bytes, write_durable
from chipwise.program import program_file
from chipwise.rates import MAX_RATE, MM3_PER_CM3
from chipwise.settings import SETTINGS
from chipwise.stock.reasons import SET_UPS
from chipwise.tool_data.geometry import MAX_DIGITS

FORMAT = 1
ENDING, UNFINISHED = ".job.toml", ".unfinished"
MAX_BYTES = 1 << 18
MAX_TOOLS = 200
MAX_TEXT = 200  # characters of a name
SOURCES = "program", "comment", "option", "assumed"
FARTHEST_MM, LEAST_MM = 1e5, 1e-3  # of a stock: corners, extents
MAX_DIAMETER_MM = 2000.0
_DIGEST = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class JobTool:
    """target: mm3/min, None: F stays; ceiling: times the F of a move that does not go down."""

    diameter: float
    target: Optional[float]
    ceiling: float


@dataclass(frozen=True)
class Job:
    """program: its name; digest: SHA-256; low, high: mm, work coordinates of the first move; source: one of SOURCES;
    tools: {number: JobTool}; air: whether feeds above the stock may be as fast as the axes; set_up: number of the
    clamps of M256 that it switches on, 0: none; clamps: {name: Clamp} of its own, mm, work coordinates of the first
    move."""

    program: str
    digest: str
    low: tuple
    high: tuple
    source: str
    material: str
    tools: dict
    air: bool = False
    set_up: int = 0
    clamps: dict = field(default_factory=dict)

    def obstacles(self, path: str, frame) -> tuple:
        """All its Clamps, machine coordinates.  path: [CHIPWISE]CLAMPS; frame: of the first move.  Raises CycleError
        for a set-up that the file does not have."""
        from chipwise.clamps import set_ups  # needs numpy, which LinuxCNC's task must not load for every machine

        known = set_ups.clamps_of(path, self.set_up) if self.set_up else ()
        return (*known, *(clamp.on_machine(frame) for clamp in self.clamps.values()))


def path_of(program: str, folder: str = "") -> str:
    """Path of a program's job file.  folder: [CHIPWISE]JOBS, "": beside it."""
    path = os.path.abspath(program)
    stem = os.path.splitext(program_file.opened_name(path))[0]
    return os.path.join(folder or os.path.dirname(path), stem + ENDING)


def name_of(program: str) -> str:
    """The name that the file of a program has in its job."""
    return printable(program_file.opened_name(program))[:MAX_TEXT]


# ---- write -----------------------------------------------------------------------------------------------------------


def text_of(job: Job) -> str:
    """The content of a file."""
    lines = [
        "# chipwise: the set-up of a program, confirmed by a person; made by chipwise setup",
        f"format = {FORMAT}",
        f"program = {_quoted(job.program)}",
        f'sha256 = "{job.digest}"',
        *([f"material = {_quoted(job.material)}"] if job.material else []),
        *(["air = true              # feeds above the stock are as fast as the axes"] if job.air else []),
        *([f"clamps = {job.set_up}               # set-up of M256"] if job.set_up else []),
        "",
        "[stock]                 # mm, work coordinates of the first move",
        f"min = {_numbers(job.low)}",
        f"max = {_numbers(job.high)}",
        f'source = "{job.source}"',
    ]
    for number, tool in job.tools.items():
        lines += ["", f"[tool.{number}]", f"diameter = {_number(tool.diameter)}"]
        if tool.target is not None:
            lines += [
                f"target = {_number(tool.target / MM3_PER_CM3)}      # cm3/min",
                f"ceiling = {_number(tool.ceiling)}      # times F",
            ]
    for number, (name, clamp) in enumerate(job.clamps.items()):
        from chipwise.clamps.set_ups import numbers_of

        shape, values = numbers_of(clamp)
        lines += [
            "",
            f"[clamp.{name}]" + (" " * 14 + "# mm, work coordinates of the first move") * (not number),
            f"{shape} = {_numbers(values)}",
        ]
    return "\n".join(lines) + "\n"


def _quoted(text):
    """A basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _number(value):
    return f"{value:.6g}" if abs(value) < 1e5 else repr(float(value))


def _numbers(values):
    return "[" + ", ".join(f"{value:.4f}".rstrip("0").rstrip(".") for value in values) + "]"


def of_text(text: str) -> Job:
    """The Job of a text_of()."""
    return _Document("", tomllib.loads(text)).job()


def as_written(job: Job) -> Job:
    """The Job that its file holds: rounded."""
    return of_text(text_of(job))


def write(path: str, job: Job) -> None:
    """Write a job file, whole or not at all; CycleError where it cannot be written, or something else is there."""
    here = _name(path)
    if os.path.lexists(path):
        other = read(path)  # any other file stays: this raises
        if other.program != job.program:
            raise CycleError(
                f"{here} is the set-up of {braceless(other.program)}", "remove that file, or rename one of the programs"
            )
    try:
        write_durable(path, text_of(job).encode(), UNFINISHED)
    except OSError as error:
        raise CycleError(
            f"{here} cannot be written: {error.strerror}",
            "use a folder that you may write, or set [CHIPWISE]JOBS to one",
        ) from error


# ---- read ------------------------------------------------------------------------------------------------------------


def _name(path):
    return braceless(printable(os.path.basename(path)))


def read(path: str) -> Job:
    """The Job of a file.  Raises CycleError for any other file."""
    if os.path.islink(path):
        raise CycleError(f"{_name(path)} is a link", "remove it; a job file is a file of its own")
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8")
    except UnicodeDecodeError:
        _fail(path, "it is not UTF-8")
    except OSError as error:
        raise CycleError(
            f"{_name(path)} cannot be read: {error.strerror}", "remove it, and set the program up again"
        ) from error
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError):  # a number of 5,000 digits is a ValueError
        _fail(path, "it is not TOML")
    return _Document(path, document).job()


def _fail(path, text) -> NoReturn:
    raise CycleError(
        f"{_name(path)} is not a job file of chipwise: {braceless(text)}", "remove it, and set the program up again"
    )


class _Document:
    """A document of TOML as a job."""

    def __init__(self, path, document):
        self.path, self.document = path, document

    def _fail(self, text) -> NoReturn:
        _fail(self.path, text)

    def job(self) -> Job:
        document = self.document
        if document.get("format") != FORMAT or isinstance(document["format"], bool):
            self._fail(f"format is not {FORMAT}")
        self._keys(
            document, ("format", "program", "sha256", "material", "air", "clamps", "clamp", "stock", "tool"), "the file"
        )
        program, digest = self._text(document, "program"), self._text(document, "sha256")
        if not _DIGEST.fullmatch(digest):
            self._fail("sha256 is not a digest")
        material = self._text(document, "material") if "material" in document else ""
        air = document.get("air", False)
        if not isinstance(air, bool):
            self._fail("air is not true or false")
        stock, tools = (self._table(document, key) for key in ("stock", "tool"))
        self._keys(stock, ("min", "max", "source"), "[stock]")
        low, high = self._corner(stock, "min"), self._corner(stock, "max")
        if not all(b - a >= LEAST_MM for a, b in zip(low, high)):
            self._fail("the stock has no extent")
        if stock.get("source") not in SOURCES:
            self._fail("source of the stock is not one of " + ", ".join(SOURCES))
        if not 1 <= len(tools) <= MAX_TOOLS:
            self._fail(f"it has not from 1 to {MAX_TOOLS} tools")
        return Job(
            program,
            digest,
            low,
            high,
            stock["source"],
            material,
            dict(self._tool(name, table) for name, table in tools.items()),
            air,
            self._set_up(),
            self._clamps(program),
        )

    def _set_up(self):
        number = self.document.get("clamps", 0)
        if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < SET_UPS:
            self._fail(f"clamps is not a whole number from 1 to {SET_UPS - 1}")
        return number

    def _clamps(self, program):
        if "clamp" not in self.document:
            return {}
        from chipwise.clamps import set_ups

        tables = self._table(self.document, "clamp")
        if len(tables) > set_ups.MAX_CLAMPS:
            self._fail(f"it has more than {set_ups.MAX_CLAMPS} clamps")
        try:
            return {
                name: set_ups.clamp_of(
                    self.path, f"clamp {name[:40]}", name, fields, f"clamp {name} of the set-up of {program}"
                )
                for name, fields in tables.items()
            }
        except CycleError as error:
            self._fail(unnamed(error).partition(";")[0].removeprefix(f"{os.path.basename(self.path)}: "))

    def _tool(self, name, table):
        if not (name.isascii() and name.isdigit() and len(name) <= MAX_DIGITS and str(int(name)) == name):
            self._fail("[tool.N]: N is not a tool number")
        if not isinstance(table, dict):
            self._fail(f"[tool.{name}] is not a table")
        self._keys(table, ("diameter", "target", "ceiling"), f"[tool.{name}]")
        if ("target" in table) != ("ceiling" in table):
            self._fail(f"[tool.{name}] has one of target and ceiling")
        diameter = self._bounded(table, "diameter", 0.0, MAX_DIAMETER_MM)
        if "target" not in table:
            return int(name), JobTool(diameter, None, 1.0)
        ceiling = self._bounded(table, "ceiling", 0.0, 1e3)
        if not SETTINGS["SETUP_CEILING"].allowed(ceiling):
            self._fail(f"ceiling of [tool.{name}] is not {SETTINGS['SETUP_CEILING'].rule}")
        return int(name), JobTool(
            diameter, self._bounded(table, "target", 0.0, MAX_RATE / MM3_PER_CM3) * MM3_PER_CM3, ceiling
        )

    def _keys(self, table, known, what):
        if not set(table) <= set(known):
            self._fail(f"{what} has other keys than " + ", ".join(known))

    def _table(self, document, key):
        if not isinstance(document.get(key), dict):
            self._fail(f"[{key}] is missing")
        return document[key]

    def _text(self, table, key):
        value = table.get(key)
        if not (isinstance(value, str) and 0 < len(value) <= MAX_TEXT and value.isprintable()):
            self._fail(f"{key} is not a text of at most {MAX_TEXT} characters")
        return value

    def _corner(self, table, key):
        value = table.get(key)
        if not (
            isinstance(value, list) and len(value) == 3 and all(_is_number(v) and abs(v) <= FARTHEST_MM for v in value)
        ):
            self._fail(f"{key} of the stock is not three lengths")
        return tuple(map(float, value))

    def _bounded(self, table, key, above, most):
        value: Any = table.get(key)
        if not (_is_number(value) and above < value <= most):
            self._fail(f"{key} is not above {above:g}, at most {most:g}")
        return float(value)


def _is_number(value):
    return (
        isinstance(value, (int, float))
        and not isinstance(value, bool)
        and (isinstance(value, int) or math.isfinite(value))
    )


def state_of(path: str, program: str, digest: str) -> tuple[Optional[Job], str]:
    """(the Job for a program with this digest, or None; the reason for None, "" if there is no file)."""
    if not os.path.lexists(path):
        return None, ""
    try:
        job = read(path)
    except CycleError as error:
        return None, str(error)
    if job.program != name_of(program):
        return None, f"{_name(path)} is the set-up of {job.program}, not of this program"
    if job.digest != digest:
        return None, f"the program was changed since it was set up in {_name(path)}; confirm it again"
    return job, ""


def digest_of(program: str) -> str:
    """SHA-256 of a file.  Raises OSError."""
    found = hashlib.sha256()
    with open_regular(program, program_file.MAX_BYTES) as file:
        while part := file.read(1 << 20):
            found.update(part)
    return found.hexdigest()


def confirmed_of(program: str, settings) -> Optional[Job]:
    """The Job that is confirmed for a program as it is now, or None.  settings: [CHIPWISE]."""
    path = path_of(program, settings.path("JOBS"))
    try:
        return state_of(path, program, digest_of(program))[0] if os.path.lexists(path) else None
    except (OSError, ValueError):
        return None


def material_of(program: str, settings) -> str:
    """The material of confirmed_of(), "" for none."""
    job = confirmed_of(program, settings)
    return job.material if job else ""
