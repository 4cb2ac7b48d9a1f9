# SPDX-License-Identifier: GPL-2.0-or-later
"""The material of the workpiece: the force that a chip of it needs.

Called by monitor/ and by whoever judges a load.  Source: O. Kienzle, Die Bestimmung von Kräften und Leistungen an
spanenden Werkzeugen, VDI-Z 94
(1952): F = kc11 b h^(1 - mc), of an edge that cuts b mm wide and h mm thick.  tool_data/materials.toml has the figures,
and where they are from.

 1. [CHIPWISE]MATERIALS names a file of the same form; what it has goes before the table of chipwise.
 2. A program names its material in a comment, (MATERIAL,NAME=6061); else the set-up that a person has confirmed for it
    does, while that is in force; else [CHIPWISE]MATERIAL.  None of them: the material is not known.
 3. Names are compared without regard to capitals, blanks and the signs - _ + /.
"""

import difflib
import os
import re
import sys
import tomllib
from dataclasses import dataclass
from typing import Any, NoReturn, Optional

from chipwise.program import comments
from chipwise.errors import CycleError, braceless
from chipwise.host.files import open_regular, read_bytes

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "materials.toml")
MAX_BYTES = 1 << 18  # of a file: some thousand materials
READ_BYTES = 4_000_000  # of a program: it names its material near its head
MAX_SHOWN = 40  # characters of a wrong value in a message
MOST_NEAR, LIKE = 3, 0.6  # names like a wrong one: how many, and how like
GROUPS = "PMKNSH"  # ISO 513
KEYS = ("names", "group", "kc11", "mc", "source")
# key: (smallest, largest, rule)
_NUMBERS = {
    "kc11": (10.0, 20_000.0, "a specific force from 10 to 20000 N/mm2"),
    "mc": (0.0, 0.6, "an exponent from 0 to 0.6"),
}


@dataclass(frozen=True)
class Material:
    """One material; kc11: N/mm2."""

    name: str
    group: str
    kc11: float
    mc: float
    source: str = ""


def _key(name: str) -> str:
    """What names are compared by [3]."""
    return re.sub(r"[\s_+/-]", "", name).casefold()


def _fail(path: str, name: Any, text: str, remedy: str = "correct the file") -> NoReturn:
    where = os.path.basename(path) + (f": {str(name)[:MAX_SHOWN]}" if name is not None else "")
    raise CycleError(braceless(f"{where}: {text}"), remedy)


def _names(path: str, name: str, table: dict) -> list[str]:
    """All names of a material."""
    found = table.get("names", [])
    if not isinstance(found, list) or not all(isinstance(one, str) and _key(one) for one in found):
        _fail(path, name, "names is not a list of names")
    return [name, *found]


def _parse_material(path: str, name: str, table: Any) -> Material:
    if not isinstance(table, dict) or not _key(name):
        _fail(path, name, "is not a material", "write [NAME] and below it kc11 = .. and mc = ..")
    for key in table:
        if key not in KEYS:
            _fail(path, name, f"{key[:MAX_SHOWN]} is not a key", "use " + ", ".join(KEYS))
    for key, (low, high, rule) in _NUMBERS.items():
        value = table.get(key)
        if value is None:
            _fail(path, name, f"{key} is missing", f"add {key} = .., {rule}")
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not low <= value <= high:
            _fail(path, name, f"{key} = {str(value)[:MAX_SHOWN]} is not {rule}")
    group = table.get("group", "")
    if group and (not isinstance(group, str) or group not in GROUPS or len(group) != 1):
        _fail(path, name, f"group = {str(group)[:MAX_SHOWN]} is not one of {', '.join(GROUPS)}")
    return Material(name, group, float(table["kc11"]), float(table["mc"]), str(table.get("source", "")))


def parse_materials(text: str, path: str) -> dict[str, Material]:
    """TOML text -> {compared name: Material}.  Raises CycleError naming file, material, key and rule."""
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        _fail(path, None, f"is not TOML: {error}")
    found: dict[str, Material] = {}
    for name, table in document.items():
        material = _parse_material(path, name, table)
        for one in _names(path, name, table):
            if found.setdefault(_key(one), material) is not material:
                _fail(
                    path, name, f"{one[:MAX_SHOWN]} is the name of {found[_key(one)].name}, too", "remove one of them"
                )
    return found


_cache: dict = {}


def _load(path: str) -> dict[str, Material]:
    """The materials of a file; cached by path and time of change."""
    try:
        stamp = (os.path.abspath(path), os.stat(path).st_mtime_ns)
        if stamp not in _cache:
            _cache[stamp] = parse_materials(read_bytes(path, MAX_BYTES).decode("utf-8"), path)
            for old in [one for one in _cache if one[0] == stamp[0] and one != stamp]:
                del _cache[old]
    except (OSError, UnicodeDecodeError, ValueError) as error:
        _fail(path, None, f"cannot be read: {getattr(error, 'strerror', None) or error}", "correct [CHIPWISE]MATERIALS")
    return _cache[stamp]


def find_material(name: str, own: str = "") -> Material:
    """The Material of a name; own: path of [CHIPWISE]MATERIALS, "" for none [1].  Raises CycleError for a name that is
    not known."""
    for path in (own, TABLE) if own else (TABLE,):
        found = _load(path).get(_key(name))
        if found:
            return found
    shown, like = name.strip()[:MAX_SHOWN] or "(none)", near(name, own)
    if like:
        raise CycleError(
            "the material {name} is not known",
            "use {like}, or another name of docs/user/materials.md, or add it to the file of [CHIPWISE]MATERIALS",
            name=shown,
            like=", ".join(like),
        )
    raise CycleError(
        "the material {name} is not known",
        "use a name of docs/user/materials.md, or add it to the file of [CHIPWISE]MATERIALS",
        name=shown,
    )


def near(name: str, own: str = "") -> list[str]:
    """Materials with a name like this one, MOST_NEAR of them at most."""
    known = {key: one.name for path in ((own, TABLE) if own else (TABLE,)) for key, one in _load(path).items()}
    found = difflib.get_close_matches(_key(name)[:MAX_SHOWN], known, 3 * MOST_NEAR, LIKE)
    return list(dict.fromkeys(known[key] for key in found))[:MOST_NEAR]


def named_in(text: str) -> Optional[str]:
    """The name in the first MATERIAL comment of a program [2]; None without one.  Raises CycleError for a comment
    without NAME=."""
    for line in text.split("\n"):
        for inside in comments.insides(line, "MATERIAL"):
            match = re.fullmatch(r"\s*NAME\s*=\s*(.*\S)\s*", inside, re.IGNORECASE)
            if not match:
                raise CycleError(
                    "(MATERIAL,{inside}) names no material",
                    "write (MATERIAL,NAME=6061)",
                    inside=inside.strip()[:MAX_SHOWN],
                )
            return match.group(1)
    return None


def material_of(text: str, setting: str = "", own: str = "", job: str = "") -> Optional[Material]:
    """The Material of a program's text, the INI file's keys MATERIAL and MATERIALS, and the name in the set-up [2];
    None: not known.  Raises CycleError."""
    name = named_in(text) or job or setting
    return find_material(name, own) if name else None


def material_of_file(path: str, setting: str = "", own: str = "", job: str = "") -> Optional[Material]:
    """material_of() of a program's file; one that cannot be read names none.  Raises CycleError."""
    text = b""
    try:
        with open_regular(path, sys.maxsize) as program:
            text = program.read(READ_BYTES)
    except (OSError, ValueError):
        pass
    return material_of(text.decode("utf-8", "replace") if b"MATERIAL" in text.upper() else "", setting, own, job)
