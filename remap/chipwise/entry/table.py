# SPDX-License-Identifier: GPL-2.0-or-later
"""The stored order of each code's data: fields.toml, and over it a machine's own file, [CHIPWISE]ENTRY.

Called by typed.py, naming.py and planned.py.  A machine's file says in which order the data come and how they are
called; what a datum is and which numbers it may have is the code's own and stays.
"""

import functools
import os
import tomllib
from dataclasses import dataclass
from typing import Any, NoReturn, Optional

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.settings import load_settings

BUILT_IN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "fields.toml")
MAX_BYTES = 1 << 20
MAX_NAME = 40  # characters of a name or a title: a column of the panel
SHARED = "shared"  # table of the words that mean the same in all cycles
KINDS = ("length", "feed", "rate", "angle", "whole", "sub", "choice")
_UNITS = {"length": ("mm", "in"), "feed": ("mm/min", "in/min"), "rate": ("cm3/min", "in3/min"), "angle": ("deg", "deg")}
_REMEDY = "correct the file, or take [CHIPWISE]ENTRY out"


@dataclass(frozen=True)
class EntryField:
    """One datum of a code.

    letter      "D"
    name        "step-over"; English, or as the machine's file calls it
    kind        one of KINDS
    required    an empty place is refused
    default     in words, what an empty place means; "" if required
    above       the number has to be above it; least, most: from and to; in the unit it is typed in; None: no limit
    choices     ((number, meaning), ..) of the kind "choice"
    own_unit    unit of a whole number, "" without one
    """

    letter: str
    name: str
    kind: str
    required: bool = False
    default: str = ""
    above: Optional[float] = None
    least: Optional[float] = None
    most: Optional[float] = None
    choices: tuple = ()
    own_unit: str = ""

    @property
    def whole(self) -> bool:
        """Whether only a whole number will do."""
        return self.kind in ("whole", "sub", "choice")

    def unit(self, program_unit: str = "mm") -> str:
        """Unit of the number for a program in "mm" or "in"; "" without one."""
        return _UNITS[self.kind][program_unit == "in"] if self.kind in _UNITS else self.own_unit


@dataclass(frozen=True)
class CodeEntry:
    """A code: its title and its data in the order of entry."""

    code: str
    title: str
    fields: tuple


def codes(path: Optional[str] = None) -> tuple:
    """The codes that can be entered."""
    return tuple(load_table(path))


def fields(code: str, path: Optional[str] = None) -> tuple:
    """The data of a code in the order of entry: (EntryField, ..).  Raises CycleError for an unknown code or a broken
    file."""
    return _of(code, path).fields


def title(code: str, path: Optional[str] = None) -> str:
    """What a code does, in some words."""
    return _of(code, path).title


def _of(code, path):
    table = load_table(path)
    if code not in table:
        raise CycleError(
            "{given} is not a code that can be entered", "use one of " + ", ".join(table), given=_shown(code)
        )
    return table[code]


def load_table(path: Optional[str] = None) -> dict:
    """{code: CodeEntry}.  path: of the machine's own file, "" for none; None: [CHIPWISE]ENTRY.

    Raises CycleError naming file, code, letter and rule."""
    built_in = _built_in()
    path = load_settings().path("ENTRY") if path is None else path
    return _changed(built_in, path, _document(path)) if path else built_in


@functools.lru_cache(maxsize=1)
def _built_in():
    """{code: CodeEntry} of fields.toml."""
    document = _document(BUILT_IN)
    shared, found = document.pop(SHARED), {}
    for code, table in document.items():
        base = document.get(table.get("as"), {})
        words = {**shared, **base, **table}
        order = table.get("order", base.get("order"))
        found[code] = CodeEntry(code, table["title"], tuple(_field(letter, words[letter]) for letter in order))
    return found


def _field(letter, table):
    """One [CODE.LETTER] of fields.toml."""
    choices = tuple((int(number), meaning) for number, meaning in table.get("choices", {}).items())
    return EntryField(
        letter,
        table["name"],
        table["kind"],
        table.get("required", False),
        table.get("default", ""),
        table.get("above"),
        table.get("least", 0 if table["kind"] == "sub" else None),
        table.get("most"),
        choices,
        table.get("unit", ""),
    )


# ---- a machine's own file -------------------------------------------------------------------------------------


def _document(path):
    """A TOML file as a dict."""
    try:
        return tomllib.loads(read_bytes(path, MAX_BYTES).decode("utf-8"))
    except OSError as error:
        _fail(path, "", f"it cannot be read: {error.strerror}", "correct [CHIPWISE]ENTRY")
    except (ValueError, RecursionError) as error:
        _fail(path, "", f"is not TOML: {error}", _REMEDY)


def _fail(path: str, where: str, text: str, remedy: str) -> NoReturn:
    """Raise the message naming file, code, letter and rule."""
    raise CycleError(braceless(f"{os.path.basename(path)}: {where + ': ' if where else ''}{text}"), braceless(remedy))


def _changed(built_in, path, document):
    """The built-in table with order, names and titles of a machine's file."""
    found = dict(built_in)
    for code, table in document.items():
        if code not in built_in:
            _fail(path, "", f"[{_shown(code)}] is not a code that can be entered", "use " + ", ".join(built_in))
        if not isinstance(table, dict):
            _fail(path, code, "is not a table", f"write [{code}]")
        found[code] = _changed_code(path, built_in[code], table)
    return found


def _changed_code(path, entry, table):
    """A CodeEntry with the order, names and title of a table."""
    own = {field.letter: field for field in entry.fields}
    for key, value in table.items():
        if key in own:
            own[key] = _renamed(path, f"{entry.code}.{key}", own[key], value)
        elif key not in ("title", "order"):
            _fail(
                path,
                entry.code,
                f"{_shown(key)} is neither title, order nor a letter of the code",
                "use " + ", ".join(own),
            )
    order = _order(path, entry, table["order"]) if "order" in table else list(own)
    title = _name(path, entry.code, "title", table["title"]) if "title" in table else entry.title
    return CodeEntry(entry.code, title, tuple(own[letter] for letter in order))


def _order(path, entry, order):
    """The letters of an order: each once, the required ones all there."""
    letters = [field.letter for field in entry.fields]
    if not isinstance(order, list) or not all(isinstance(letter, str) for letter in order):
        _fail(path, entry.code, "order is not a list of letters", f"write order = {letters!r}")
    for k, letter in enumerate(order):
        if letter not in letters:
            _fail(
                path,
                entry.code,
                f"order has {_shown(letter)}, which is not a letter of the code",
                "use " + ", ".join(letters),
            )
        if letter in order[:k]:
            _fail(path, entry.code, f"order has {letter} twice", "take one of them out")
    for field in entry.fields:
        if field.required and field.letter not in order:
            _fail(
                path,
                entry.code,
                f"order lacks {field.letter} ({field.name}), which is always needed",
                f"add {field.letter}",
            )
    return order


def _renamed(path, where, field, table):
    """A datum with another name."""
    if not isinstance(table, dict):
        _fail(path, where, "is not a table", f"write [{where}] and name = ..")
    for key in table:
        if key != "name":
            _fail(
                path,
                where,
                f"{_shown(key)} cannot be changed",
                "change only name; what the number may be is the code's own",
            )
    name = _name(path, where, "name", table["name"]) if "name" in table else field.name
    return EntryField(**{**field.__dict__, "name": name})


def _name(path, where, key, value):
    """A name or a title."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable() or len(value) > MAX_NAME:
        _fail(
            path,
            where,
            f"{key} = {_shown(value)} is not a text of 1 to {MAX_NAME} printable characters",
            "correct the file",
        )
    return value.strip()


def _shown(value: Any) -> str:
    """A value of the file in a message."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of more digits than Python prints
        text = "a number of thousands of digits"
    return text if len(text) <= MAX_NAME else text[:MAX_NAME] + ".."
