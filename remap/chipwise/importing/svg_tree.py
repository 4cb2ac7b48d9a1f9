# SPDX-License-Identifier: GPL-2.0-or-later
"""The elements of an SVG as svgelements reads them right.  Called by svg.py.

svgelements 1.7 shows what is in masks, and symbols where they are defined, and knows no use before its target.  So
before it reads a file:
0. style sheets are written into the elements (svg_style.py), lengths as user units (svg_lengths.py);
1. what is never shown is taken out: masks, markers, patterns, clip paths, filters, definitions, and words about
   the drawing;
2. each use becomes a group that holds a copy of its target, a symbol there an svg or a group;
3. an svg without a viewBox within the drawing becomes a group at its place, and so do links;
4. of a switch the first element stays that is not for another program.
"""

import copy
import io
import re
import xml.etree.ElementTree as ET
from collections import Counter
from typing import NamedTuple, BinaryIO

from chipwise.importing import svg_lengths, svg_style
from chipwise.importing.drawn import Unreadable
from chipwise.importing.svg_style import name_of

LINKS = ("href", "{http://www.w3.org/1999/xlink}href")
PLACE = ("x", "y", "width", "height")
UNSEEN = {
    "mask",
    "marker",
    "pattern",
    "clipPath",
    "filter",
    "defs",
    "symbol",
    "linearGradient",
    "radialGradient",
    "metadata",
    "title",
    "desc",
    "namedview",
    "style",
    "script",
}
MOST_ELEMENTS = 200_000  # after copies; each may be a shape
MOST_DEEP = 100  # groups within groups, copies within copies


# What a path may hold; svgelements drops one with anything else without a word.
PATH = re.compile(r"\s*(?:[Mm][MmZzLlHhVvCcSsQqTtAa\d\s,.eE+-]*)?")


class Prepared(NamedTuple):
    """stream: of the elements that are shown; clipped: how many are clipped or masked; real: whether the page says how
    large it is; left: what was left out, counted by name."""

    stream: BinaryIO
    clipped: int
    real: bool
    left: Counter


def prepared(path):
    """Prepared of a file.  Raises what ElementTree raises, and Unreadable."""
    root = ET.parse(path).getroot()
    svg_style.applied(root)
    size, real = svg_lengths.page(root)
    tree = _Tree(root)
    tree.shown(root, 0, size)
    return Prepared(io.BytesIO(ET.tostring(root)), tree.clipped, real, tree.left)


class _Tree:
    """What a use may show, by id, and what was counted."""

    def __init__(self, root):
        self.count, self.clipped = 0, 0
        self.left: Counter = Counter()
        used = {_target(element) for element in root.iter() if name_of(element) == "use"}
        self.known = {element.get("id"): copy.deepcopy(element) for element in root.iter() if element.get("id") in used}

    def shown(self, element, deep, size):
        """Makes what is in an element what is shown; size: (width, height) of the viewport around it, user units."""
        if deep > MOST_DEEP:
            raise Unreadable(
                f"its groups are more than {MOST_DEEP} deep, or a copy holds itself", "ungroup the drawing"
            )
        self.clipped += any(
            key in element.attrib or key + ":" in element.get("style", "").replace(" ", "")
            for key in ("clip-path", "mask")
        )
        children = [child for child in element if name_of(child) not in UNSEEN]
        if name_of(element) == "switch":
            children = [child for child in children if name_of(child) != "foreignObject"][:1]
            element.tag = _named(element, "g")
        kept = []
        for child in children:
            self.count += 1
            if self.count > MOST_ELEMENTS:
                raise Unreadable(
                    f"the drawing has more than {MOST_ELEMENTS} elements with its copies",
                    "export the layer that is to be cut",
                )
            if self._left_out(child, size):
                continue
            kept.append(self._own(child))
            self.shown(kept[-1], deep + 1, _inner(child, size))
        element[:] = kept

    def _left_out(self, element, size):
        """Whether an element cannot be read, or is nothing; writes its lengths as user units."""
        name = name_of(element)
        if not svg_lengths.plain(element, name, size):
            self.left[f"{name} with a length in a unit that is not known"] += 1
            return True
        if name == "path" and not PATH.fullmatch(element.get("d") or ""):
            self.left["path that cannot be read"] += 1
            return True
        if name == "use" and any(not element.get(link, "#").startswith("#") for link in LINKS):
            self.left["copy of another file"] += 1
            return True
        return not svg_lengths.drawn(element, name)

    def _own(self, element):
        """What svgelements reads in place of an element."""
        if name_of(element) == "use":
            group, target = self._placed(element), self.known.get(_target(element))
            group[:] = [] if target is None else [_copied(target, element)]
            return group
        if name_of(element) == "a" or name_of(element) == "svg" and not element.get("viewBox"):
            return self._placed(element)
        return element

    @staticmethod
    def _placed(element):
        """A group with what is in an element, at its place."""
        made = ET.Element(
            _named(element, "g"), {key: value for key, value in element.attrib.items() if key not in (*PLACE, *LINKS)}
        )
        x, y = (float(element.get(key) or 0.0) for key in PLACE[:2])
        made.set("transform", f"{element.get('transform', '')} translate({x:.9g}, {y:.9g})")
        made[:] = list(element)
        return made


def _inner(element, size):
    """The viewport (width, height) of what is in an element."""
    if name_of(element) not in ("svg", "symbol"):
        return size
    return svg_lengths.box(element) or tuple(float(element.get(key) or one) for key, one in zip(PLACE[2:], size))


def _target(use):
    """The id of what a use shows."""
    return next((use.get(link)[1:] for link in LINKS if use.get(link, "").startswith("#")), "")


def _copied(target, use):
    """A copy of what a use shows, with the size that it has there."""
    made = copy.deepcopy(target)
    if name_of(made) in ("symbol", "svg"):
        made.tag = _named(made, "svg" if made.get("viewBox") else "g")
        made.attrib.update({key: use.get(key) for key in PLACE[2:] if use.get(key)})
    return made


def _named(element, name):
    """The tag of another element in its namespace."""
    return element.tag[: len(element.tag) - len(name_of(element))] + name
