# SPDX-License-Identifier: GPL-2.0-or-later
"""Changes one tool in the file of tool geometry (tool_data/geometry.py), without losing comments, order, blanks and
line ends.  Called by panel/entry_process.py.

1. A line is the unit of change: a value is replaced in its line, a key is added behind the last one of its table, or
   its line taken out; a tool that is new comes to the end of the file.
2. Only a table that begins with a line [tool.N] and has one key in each line is changed.  Whether the new text means
   the old one with this change and nothing else is found out by reading both with tomllib.  Else the change is refused:
   so nothing depends on how well the lines were understood.
3. The loader's own rules decide what a tool may be.
4. Who changes a tool names the checksum of the file that they have seen.
5. The file as it was before the first change of a day stays beside it, as NAME.DATE.bak.
6. A rate is cm3/min here: a tool that has the old key, in mm3/min, is shown with the new one and has it in its line
   once it is changed.
"""

import copy
import hashlib
import json
import os
import re
import time
import tomllib
from typing import Any

from chipwise.errors import CycleError
from chipwise.host.files import locked, read_bytes, write_durable
from chipwise.tool_data.geometry import KEYS, MAX_BYTES, MAX_DIGITS, OLD_RATE, load_tools, parse_tools, rate_of

UNFINISHED = ".unfinished"
_HEADER = re.compile(r"[ \t]*\[[ \t]*tool[ \t]*\.[ \t]*(\d+)[ \t]*\][ \t]*(#.*)?$")
_KEY = re.compile(
    r"(?P<before>[ \t]*(?P<key>\w+)[ \t]*=[ \t]*)(?P<value>\"[^\"\\]*\"|[^\s#\"'\[{]+)(?P<after>[ \t]*(?:#.*)?)$"
)


def checksum(data: bytes) -> str:
    """Of the file's bytes."""
    return hashlib.sha256(data).hexdigest()


def listed(path: str) -> dict:
    """{"file": name, "checksum", "tools": {number: {key: value}}} of a file.  Raises CycleError."""
    if not path:
        raise CycleError("this machine has no file of tool geometry", "set [CHIPWISE]TOOL_GEOMETRY in the INI file")
    data, name = _read(path), os.path.basename(path)
    parse_tools(data.decode("utf-8"), path)
    found = tomllib.loads(data.decode("utf-8")).get("tool", {})
    return {
        "file": name,
        "checksum": checksum(data),
        "tools": {str(int(number)): _with_new_rate(values) for number, values in found.items()},
    }


def change(path: str, seen: str, number: int, values: dict) -> None:
    """Give tool `number` these values, {key: text or number, None to take the key out}; seen: checksum of the file.
    Raises CycleError; the file is then as before."""
    path = os.path.realpath(path)
    try:
        with locked(os.path.dirname(path)):
            data = _read(path)
            if checksum(data) != seen:
                raise CycleError(
                    "{file} has changed since this page has read it",
                    "look at it, and change it again",
                    file=os.path.basename(path),
                )
            text = changed(data.decode("utf-8"), os.path.basename(path), number, values)
            if text.encode("utf-8") == data:
                return
            if not os.access(path, os.W_OK):
                raise CycleError(
                    "{file} may not be written by this user", "correct its rights", file=os.path.basename(path)
                )
            _keep(path, data)
            write_durable(path, text.encode("utf-8"), UNFINISHED, os.stat(path).st_mode & 0o777)
    except OSError as error:
        raise CycleError(
            "{file} cannot be written: {why}",
            "correct the file, its folder or [CHIPWISE]TOOL_GEOMETRY",
            file=os.path.basename(path),
            why=error.strerror or str(error),
        ) from error
    load_tools(path)


def _read(path):
    try:
        data = read_bytes(path, MAX_BYTES)
        data.decode("utf-8")
        return data
    except (OSError, UnicodeDecodeError) as error:
        raise CycleError(
            "{file} cannot be read: {why}",
            "correct [CHIPWISE]TOOL_GEOMETRY",
            file=os.path.basename(path),
            why=getattr(error, "strerror", None) or "it is not UTF-8",
        ) from error


def _keep(path, data):
    """Keep the file as it is now, unless there is one of today already."""
    kept = f"{path}.{time.strftime('%Y-%m-%d')}.bak"
    if not os.path.exists(kept):
        write_durable(kept, data, UNFINISHED, os.stat(path).st_mode & 0o777)


# ---- the text ----------------------------------------------------------------------------------------------------


def changed(text: str, name: str, number: int, values: dict) -> str:
    """The text of the file `name` with these values of tool `number`.  Raises CycleError if the tool would be wrong, or
    a line is not understood."""
    if not 0 <= number < 10**MAX_DIGITS:
        raise CycleError(
            f"{str(number)[:12]} is not a tool number", f"use a whole number of at most {MAX_DIGITS} digits"
        )
    for key in values:
        if key not in KEYS:
            raise CycleError("{key} is not a key of a tool", "use " + ", ".join(KEYS), key=str(key)[:40])
    parse_tools(text, name)  # a file that is wrong is corrected by hand
    before = tomllib.loads(text)
    wanted, converted = _wanted(before, number, values), _with_new_key(text, before, number)
    found = _with_values(converted, number, _differing(tomllib.loads(converted), number, values))
    try:
        parse_tools(found, name)
    except CycleError as error:
        raise CycleError(
            error.problem, error.remedy.replace("correct the file", "correct the value"), **error.values
        ) from None
    if tomllib.loads(found) != wanted:
        raise CycleError(
            "{file}: tool {number} is written in a form that is not changed here",
            "change it with an editor",
            file=name,
            number=str(number),
        )
    return found


def _name_of(document, number):
    """The key of a tool in the table `tool`: "3", or "03" as the file has it."""
    return next((name for name in document.get("tool", {}) if int(name) == number), str(number))


def _wanted(document, number, values):
    """What the new text has to mean."""
    found = copy.deepcopy(document)
    tables, name = found.setdefault("tool", {}), _name_of(document, number)
    table = tables[name] = _with_new_rate(tables.get(name, {}))
    for key, value in values.items():
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    return found


def _with_new_rate(table):
    """A tool's table with max_rate in the place of the old key."""
    if OLD_RATE not in table:
        return dict(table)
    found = {}
    for key, value in table.items():
        if key in ("max_rate", OLD_RATE):
            found["max_rate"] = rate_of(table)
        else:
            found[key] = value
    return found


def _with_new_key(text, document, number):
    """The text with max_rate in the line of a tool's old key; where both are given the new one's line has the
    smaller."""
    table = document.get("tool", {}).get(_name_of(document, number), {})
    lines = re.findall(r"[^\n]*\n|[^\n]+", text)
    first, end = _table(lines, number)
    if OLD_RATE not in table or first is None:
        return text
    if "max_rate" in table:
        _change_lines(
            lines,
            first,
            end,
            {OLD_RATE: None, "max_rate": rate_of(table)} if rate_of(table) != table["max_rate"] else {OLD_RATE: None},
        )
        return "".join(lines)
    for at in range(first + 1, end):
        match = _KEY.match(lines[at].rstrip("\r\n"))
        if match and match["key"] == OLD_RATE:
            line_end = lines[at][len(lines[at].rstrip("\r\n")) :]
            lines[at] = (
                match["before"].replace(OLD_RATE, "max_rate")
                + _written(rate_of(table))
                + re.sub(r"^(\s*#\s*)mm3/min", r"\1cm3/min", match["after"])
                + line_end
            )
    return "".join(lines)


def _differing(document, number, values):
    """The values that the file has not yet: what is not changed keeps its form, as 1_000."""
    table = document.get("tool", {}).get(_name_of(document, number), {})
    return {key: value for key, value in values.items() if value != table.get(key) or type(value) is bool}


def _with_values(text, number, values):
    """The text with lines replaced, taken out and added."""
    lines = re.findall(r"[^\n]*\n|[^\n]+", text)
    line_end = "\r\n" if "\r\n" in text else "\n"
    first, end = _table(lines, number)
    if first is None:
        lines = _ended(lines, line_end) + ([line_end] if text.strip() else []) + [f"[tool.{number}]{line_end}"]
        last = len(lines) - 1
    else:
        last = _change_lines(lines, first, end, values)
    added = [f"{key} = {_written(value)}{line_end}" for key, value in values.items() if value is not None]
    if added and last == len(lines) - 1:
        lines = _ended(lines, line_end)
    return "".join([*lines[: last + 1], *added, *lines[last + 1 :]])


def _ended(lines, line_end):
    """The lines, the last one with its end."""
    return [*lines[:-1], lines[-1] if lines[-1].endswith("\n") else lines[-1] + line_end] if lines else []


def _change_lines(lines, first, end, values):
    """Change the lines of a table in place and take their keys out of the values; -> where its last line with a key is,
    or its first line."""
    last = first
    for at in range(end - 1, first, -1):
        body = lines[at].rstrip("\r\n")
        match = _KEY.match(body)
        if not match:
            continue
        last = max(last, at)
        if match["key"] in values:
            value = values.pop(match["key"])
            if value is None:
                del lines[at]
                last -= 1
            else:
                lines[at] = match["before"] + _written(value) + match["after"] + lines[at][len(body) :]
    return last


def _table(lines, number):
    """Where the table of a tool begins, and the line behind its end; (None, None) without one."""
    first = next(
        (
            at
            for at, line in enumerate(lines)
            if (match := _HEADER.match(line.rstrip("\r\n"))) and int(match[1]) == number
        ),
        None,
    )
    if first is None:
        return None, None
    return first, next(
        (at for at in range(first + 1, len(lines)) if lines[at].lstrip(" \t").startswith("[")), len(lines)
    )


def _written(value: Any) -> str:
    """A value in TOML."""
    return json.dumps(value)
