# SPDX-License-Identifier: GPL-2.0-or-later
"""The elements of an SVG as svgelements reads them right.  Called by svg.py.

svgelements 1.7 shows what is in masks, and symbols where they are defined, knows no use before its target, and no style
sheet before its end.  So before it reads a file:
1. what is never shown is taken out: masks, markers, patterns, clip paths, filters, definitions, words about the
   drawing; style sheets go first;
2. each use becomes a group that holds a copy of its target, a symbol there an svg or a group;
3. an svg without a viewBox within the drawing becomes a group at its place, and so do links;
4. of a switch the first element stays that is not for another program.
"""

import copy
import io
import xml.etree.ElementTree as ET

from chipwise.importing.drawn import Unreadable

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


def prepared(path, ppi):
    """(stream of the elements that are shown, number of elements that are clipped or masked); ppi: user units in an
    inch.  Raises what ElementTree raises, and Unreadable."""
    root = ET.parse(path).getroot()
    tree = _Tree(root, ppi)
    sheets = [element for element in root.iter() if name_of(element) == "style"]
    tree.shown(root, 0)
    root[:0] = sheets
    return io.BytesIO(ET.tostring(root)), tree.clipped


def name_of(element):
    """The name of an element without its namespace."""
    return element.tag.rpartition("}")[2]


class _Tree:
    """What a use may show, by id, and what was counted."""

    def __init__(self, root, ppi):
        self.count, self.clipped, self.ppi = 0, 0, ppi
        used = {_target(element) for element in root.iter() if name_of(element) == "use"}
        self.known = {element.get("id"): copy.deepcopy(element) for element in root.iter() if element.get("id") in used}

    def shown(self, element, deep):
        """Makes what is in an element what is shown."""
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
            kept.append(self._own(child))
            self.shown(kept[-1], deep + 1)
        element[:] = kept

    def _own(self, element):
        """What svgelements reads in place of an element."""
        if name_of(element) == "use":
            group, target = self._placed(element), self.known.get(_target(element))
            group[:] = [] if target is None else [_copied(target, element)]
            return group
        if name_of(element) == "a" or name_of(element) == "svg" and not element.get("viewBox"):
            return self._placed(element)
        return element

    def _placed(self, element):
        """A group with what is in an element, at its place."""
        made = ET.Element(
            _named(element, "g"), {key: value for key, value in element.attrib.items() if key not in (*PLACE, *LINKS)}
        )
        x, y = (self._length(element.get(key)) for key in PLACE[:2])
        made.set("transform", f"{element.get('transform', '')} translate({x:.9g}, {y:.9g})")
        made[:] = list(element)
        return made

    def _length(self, text):
        """A length in user units."""
        import svgelements

        found = svgelements.Length(text or "0").value(ppi=self.ppi)
        return found if isinstance(found, (int, float)) else 0.0


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
