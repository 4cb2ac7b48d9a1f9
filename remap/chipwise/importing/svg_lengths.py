# SPDX-License-Identifier: GPL-2.0-or-later
"""Lengths of an SVG as plain user units.  Called by svg_tree.py.

svgelements 1.7 knows only lower-case units without spaces about them, takes a page of which one side is given for the
other side's viewBox number, and every percentage of r as one of the width.  Source: SVG 1.1 7.2, 7.10; SVG 2 7.8, 8.
"""

import math
import re

# px of each unit; a user unit is a px.
PX = {
    "": 1.0,
    "px": 1.0,
    "in": 96.0,
    "cm": 96.0 / 2.54,
    "mm": 96.0 / 25.4,
    "q": 24.0 / 25.4,
    "pt": 96.0 / 72,
    "pc": 16.0,
}
REAL = ("in", "cm", "mm", "q", "pt", "pc")  # that say how large a page is
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"\s*({NUMBER})\s*(%|[a-zA-Z]*)\s*")

# Attributes that are lengths, by what a percentage of them is of: width, height or both.
ALONG = {
    **dict.fromkeys(("x", "x1", "x2", "cx", "rx", "width"), 0),
    **dict.fromkeys(("y", "y1", "y2", "cy", "ry", "height"), 1),
    "r": 2,
}
SIZED = {"rect", "circle", "ellipse", "line", "use", "svg", "symbol", "image"}


def length(text, whole=None):
    """A length in user units; whole: what 100 % are.  None for `auto`, for a unit that depends on a font or a window,
    and for a percentage of what is not known."""
    found = _LENGTH.fullmatch(text or "")
    if found is None:
        return None
    unit = found.group(2).lower()
    share = PX.get(unit) if unit != "%" else None if whole is None else whole / 100.0
    return None if share is None else float(found.group(1)) * share


def box(element):
    """(width, height) of a viewBox in user units; None without one."""
    found = [float(one) for one in re.findall(NUMBER, element.get("viewBox") or "")]
    return (found[2], found[3]) if len(found) == 4 and min(found[2:]) > 0.0 else None


def page(root):
    """Writes the size of a page in px; (width, height) of its user units, and whether the page says how large it is."""
    own, inner = [length(root.get(key)) for key in ("width", "height")], box(root)
    real = any((root.get(key) or "").strip().lower().endswith(REAL) for key in ("width", "height"))
    if inner:
        if own[0] is None and own[1] is None:
            own = list(inner)
        elif None in own:  # the other side has the shape of the viewBox
            k = own.index(None)
            own[k] = own[1 - k] * inner[k] / inner[1 - k]
    for key, size in zip(("width", "height"), own):
        root.attrib.pop(key, None)
        if size is not None:
            root.set(key, repr(size))
    return inner or tuple(1000.0 if size is None else size for size in own), real


def plain(element, name, size):
    """Writes the lengths of an element as user units, of a viewport (width, height).  False if one has a unit that is
    not known."""
    if name not in SIZED:
        return True
    wholes = (*size, math.hypot(*size) / math.sqrt(2.0))
    for key, whole in ((key, wholes[ALONG[key]]) for key in list(element.attrib) if key in ALONG):
        text = element.attrib.pop(key).strip()
        found = length(text, whole)
        if found is not None:
            element.set(key, repr(found))
        elif text and text != "auto":
            return False
    if name == "svg":
        for key, whole in zip(("width", "height"), size):
            element.set(key, element.get(key) or repr(whole))
    if name == "ellipse":
        for key, other in (("rx", "ry"), ("ry", "rx")):
            element.set(key, element.get(key) or element.get(other) or "0")
    return True


def drawn(element, name):
    """Whether a shape has a size: a rect needs a width and a height."""
    return name != "rect" or all(element.get(key) for key in ("width", "height"))
