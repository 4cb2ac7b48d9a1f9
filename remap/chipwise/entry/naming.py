# SPDX-License-Identifier: GPL-2.0-or-later
"""The words of a made line with their names, as a reader wants them.  Pure; called as entry.words by cli/enter.py and
panel/entry_process.py."""

from typing import Callable, Optional

from chipwise.entry.table import fields


def words(line: str, unit: str = "mm", translate: Callable[[str], str] = str, path: Optional[str] = None) -> tuple:
    """((letter, name, value), ..) of a line of typed.line(): ("D", "step-over", "2.5 mm"), ("P", "side of the tool",
    "41, left").

    unit: "mm" or "in" of the program; translate: language.translator(); path as in table.load_table."""
    code, *texts = line.split()
    known = {field.letter: field for field in fields(code, path)}
    return tuple(
        (text[0], translate(known[text[0]].name), _value(known[text[0]], text[1:], unit, translate)) for text in texts
    )


def _value(field, number, unit, translate):
    """A number with its unit or its meaning."""
    meaning = next((meaning for value, meaning in field.choices if str(value) == number), "")
    return f"{number} {field.unit(unit)}".rstrip() + (f", {translate(meaning)}" if meaning else "")
