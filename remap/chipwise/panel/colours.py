# SPDX-License-Identifier: GPL-2.0-or-later
"""The colour of each display item in light and dark mode: colours.toml, and over it a machine's own file,
[CHIPWISE]COLOURS.

Called by the panel, and by cli/enter.py for its drawing.

    load()["tool"].light        "#b35c00"
    colour("tool", "dark")

Source: abstract on a colour display for an NC without one: relations between display items and colours are stored
beforehand, whoever shows an item asks for it by its name and draws it in its colour.
"""

import os
import re
import tomllib
from dataclasses import dataclass, replace
from typing import Any, NoReturn, Optional

from chipwise.errors import CycleError, braceless
from chipwise.host.files import read_bytes
from chipwise.settings import load_settings

BUILT_IN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "colours.toml")
MODES = ("light", "dark")
BACKGROUND = "background"
LEAST_CONTRAST = 3.0  # of an item to the background: WCAG 2.1, 1.4.11
MAX_BYTES = 1 << 20
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")
_SHOWN = 40
_REMEDY = 'write it as "#rrggbb", two hexadecimal digits for each of red, green and blue'


@dataclass(frozen=True)
class Item:
    """A display item: its name (English), the groups in which it is shown with others, and its colours as "#rrggbb"."""

    name: str
    groups: tuple[str, ...]
    light: str
    dark: str

    def colour(self, mode: str) -> str:
        """The colour in "light" or "dark"."""
        return {"light": self.light, "dark": self.dark}[mode]


def load(path: Optional[str] = None) -> dict:
    """{item: Item}.  path: of the machine's own file, "" for none; None: [CHIPWISE]COLOURS.

    Raises CycleError naming file, item, mode and rule."""
    items = {
        item: Item(table["name"], tuple(table.get("groups", ())), table["light"], table["dark"])
        for item, table in _document(BUILT_IN).items()
    }
    path = load_settings().path("COLOURS") if path is None else path
    if path:
        items = _changed(items, path, _document(path))
    return items


def colour(item: str, mode: str = "light", path: Optional[str] = None) -> str:
    """Colour of an item, "#rrggbb"."""
    return load(path)[item].colour(mode)


def contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours "#rrggbb", 1 to 21.  Source: WCAG 2.1, "contrast ratio" and "relative
    luminance"."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def _luminance(text: str) -> float:
    parts = [int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


# ---- a machine's own file -------------------------------------------------------------------------------------


def _document(path: str) -> dict[str, Any]:
    """A TOML file as a dict."""
    try:
        return tomllib.loads(read_bytes(path, MAX_BYTES).decode("utf-8"))
    except OSError as error:
        _fail(path, "", f"it cannot be read: {error.strerror}", "correct [CHIPWISE]COLOURS")
    except (ValueError, RecursionError) as error:
        _fail(path, "", f"is not TOML: {error}", "correct the file, or take [CHIPWISE]COLOURS out")


def _fail(path: str, item: str, text: str, remedy: str) -> NoReturn:
    """Raise the message naming file, item and rule."""
    raise CycleError(braceless(f"{os.path.basename(path)}: {item + ': ' if item else ''}{text}"), braceless(remedy))


def _changed(items: dict[str, Item], path: str, document: dict[str, Any]) -> dict[str, Item]:
    """The items with the colours of a machine's file, checked."""
    found = dict(items)
    for item, table in document.items():
        if item not in items:
            _fail(path, "", f"{_shown(item)} is not a display item", "use " + ", ".join(items))
        if not isinstance(table, dict):
            _fail(path, item, "is not a table", f"write [{item}], light = .. and dark = ..")
        for mode, value in table.items():
            if mode not in MODES:
                _fail(path, item, f"{_shown(mode)} is not a mode", "use light and dark")
            if not isinstance(value, str) or not _COLOUR.fullmatch(value):
                _fail(path, item, f"{mode} = {_shown(value)} is not a colour", _REMEDY)
        found[item] = replace(found[item], **{mode: value.lower() for mode, value in table.items()})
    _check_contrast(found, path)
    return found


def _check_contrast(items: dict[str, Item], path: str) -> None:
    """Refuse a colour that cannot be seen."""
    for item, entry in items.items():
        for mode in MODES:
            behind, own = items[BACKGROUND].colour(mode), entry.colour(mode)
            ratio = contrast(own, behind)
            if item != BACKGROUND and ratio < LEAST_CONTRAST:
                better = "darker" if contrast(behind, "#000000") > contrast(behind, "#ffffff") else "lighter"
                _fail(
                    path,
                    item,
                    f"{mode} = {own} has a contrast of {ratio:.2f} to the background {behind}, less than "
                    f"{LEAST_CONTRAST:g}",
                    f"use a {better} colour",
                )


def _shown(value: Any) -> str:
    """A value of the file in a message."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of more digits than Python prints
        text = "a number of thousands of digits"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + ".."
