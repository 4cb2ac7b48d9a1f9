# SPDX-License-Identifier: GPL-2.0-or-later
"""What an SVG draws, as rings of points: a reader written from the recommendation (SVG 1.1 and 2), apart from
svgelements.  Called by import_svg.py.

rings(path)     {layer: [points (n, 2) mm]} of the closed rings of all shapes that are shown, and the number of open
ones Shown is what is neither hidden (display, visibility, fill and stroke both none) nor in defs, symbol, clipPath,
mask, marker or pattern, unless a use shows it.  Of style sheets only the selectors *, element, .class and #id are read.
y points down, and the origin is the corner of the page: areas do not ask.
"""

import math
import re
import xml.etree.ElementTree as ET

import numpy as np

MM = {"": 25.4 / 96, "px": 25.4 / 96, "mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "q": 0.25}
UNSEEN = (
    "defs",
    "symbol",
    "clipPath",
    "mask",
    "marker",
    "pattern",
    "linearGradient",
    "radialGradient",
    "style",
    "metadata",
    "text",
    "title",
    "desc",
    "foreignObject",
)
CURVE = 96  # points on a curve
SAGITTA = 2e-4  # mm, of an arc
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
IDENTITY = np.eye(3)
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"


def rings(path):
    """({layer: closed rings}, number of open ones)."""
    root = ET.parse(path).getroot()
    page = _Page(root)
    page.show(root, IDENTITY, {}, None, "")
    return page.closed, page.open


def numbers(text):
    return [float(one) for one in NUMBER.findall(text or "")]


def length(text, whole):
    """A length in user units; whole: what 100 % are."""
    found = re.fullmatch(r"\s*([-+.\deE]+?)\s*(%|[a-zA-Z]*)\s*", text or "0")
    value, unit = float(found.group(1)), found.group(2).lower()
    return value * whole / 100 if unit == "%" else value * MM[unit] / MM["px"]


def matrix(text):
    """The matrix of a transform attribute."""
    found = IDENTITY
    for name, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", text or ""):
        v = numbers(inside)
        if name == "matrix":
            one = np.array([[v[0], v[2], v[4]], [v[1], v[3], v[5]], [0, 0, 1]])
        elif name == "translate":
            one = _moved(v[0], v[1] if len(v) > 1 else 0.0)
        elif name == "scale":
            one = np.diag((v[0], v[-1], 1.0))
        elif name == "rotate":
            c, s = math.cos(math.radians(v[0])), math.sin(math.radians(v[0]))
            x, y = v[1:] if len(v) > 2 else (0.0, 0.0)
            one = _moved(x, y) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ _moved(-x, -y)
        else:
            slope = math.tan(math.radians(v[0]))
            one = np.array(
                [[1, slope if name == "skewX" else 0, 0], [slope if name == "skewY" else 0, 1, 0], [0, 0, 1]]
            )
        found = found @ one
    return found


def _moved(x, y):
    return np.array([[1, 0, x], [0, 1, y], [0, 0, 1.0]])


def viewport(element, width, height):
    """The matrix of a viewBox in a viewport of that size (user units of what is around it)."""
    box = numbers(element.get("viewBox"))
    if len(box) != 4 or not box[2] or not box[3]:
        return IDENTITY, (width, height)
    sx, sy = width / box[2], height / box[3]
    how = (element.get("preserveAspectRatio") or "xMidYMid meet").split()
    x = y = 0.0
    if how[0] != "none":
        s = max(sx, sy) if "slice" in how else min(sx, sy)
        x, y = (
            {"Min": 0.0, "Mid": 0.5, "Max": 1.0}[part] * (whole - s * size)
            for part, whole, size in ((how[0][1:4], width, box[2]), (how[0][5:8], height, box[3]))
        )
        sx = sy = s
    return _moved(x, y) @ np.diag((sx, sy, 1.0)) @ _moved(-box[0], -box[1]), (box[2], box[3])


class _Page:
    """Elements of a document -> rings in mm."""

    def __init__(self, root):
        self.closed, self.open, self.size = {}, 0, (100.0, 100.0)
        self.known = {one.get("id"): one for one in root.iter() if one.get("id")}
        self.styles = {}
        for one in root.iter():
            if _tag(one) == "style":
                for names, rules in re.findall(
                    r"([^{}]+)\{([^}]*)\}", re.sub(r"/\*.*?\*/", "", one.text or "", flags=re.S)
                ):
                    for name in names.split(","):
                        self.styles[name.strip()] = self.styles.get(name.strip(), "") + ";" + rules

    def style(self, element, around):
        """The properties of an element."""
        found = {**around, "display": "inline"}
        found.update({key: element.get(key) for key in ("fill", "stroke", "display", "visibility") if element.get(key)})
        rules = [
            self.styles.get(name, "")
            for name in (
                "*",
                _tag(element),
                *("." + c for c in (element.get("class") or "").split()),
                "#" + (element.get("id") or ""),
            )
        ]
        for rule in ";".join((*rules, element.get("style") or "")).split(";"):
            key, _, value = rule.partition(":")
            if value:
                found[key.strip()] = value.replace("!important", "").strip()
        return found

    def show(self, element, on, around, used, layer):
        """An element and what is in it; on: matrix to user units of the page; used: size of the use that shows it;
        layer: as import names it: the label or id of the outermost group that has one."""
        tag, style = _tag(element), self.style(element, around)
        if style["display"] == "none" or tag in UNSEEN and not (tag == "symbol" and used is not None):
            return
        on, kept = on @ matrix(element.get("transform")), self.size
        if tag in ("svg", "symbol"):
            on = on @ self._viewport(element, used)
        if tag == "g":
            layer = layer or element.get(LABEL) or element.get("id") or ""
        if tag == "use":
            self._use(element, on, style, layer)
        elif tag in ("svg", "g", "a", "symbol", "switch"):
            for one in (
                list(element)[:1]
                if tag == "switch" and len(element) and _tag(element[0]) != "foreignObject"
                else element
            ):
                self.show(one, on, style, None, layer)
        elif style.get("visibility") not in ("hidden", "collapse") and (
            style.get("fill") != "none" or style.get("stroke", "none") != "none"
        ):
            self._shape(tag, element, on, layer)
        self.size = kept

    def _viewport(self, element, used):
        """The matrix of an svg or symbol."""
        box, outer = numbers(element.get("viewBox")), self.size
        if element.tag and used is None and _tag(element) == "svg" and not hasattr(self, "_begun"):
            self._begun, outer = True, tuple(box[2:]) or outer
            place = IDENTITY
        else:
            place = _moved(length(element.get("x"), outer[0]), length(element.get("y"), outer[1]))
        size = [
            length((used or {}).get(key) or element.get(key) or "100%", whole)
            for key, whole in zip(("width", "height"), outer)
        ]
        found, self.size = viewport(element, *size)
        return place @ found

    def _use(self, element, on, style, layer):
        link = element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or ""
        target = self.known.get(link[1:])
        if target is not None:
            self.show(
                target,
                on @ _moved(length(element.get("x"), self.size[0]), length(element.get("y"), self.size[1])),
                style,
                dict(element.attrib),
                layer,
            )

    def _shape(self, tag, element, on, layer):
        scale = math.sqrt(abs(np.linalg.det(on[:2, :2]))) * MM["px"]
        for points, closed in _SHAPES.get(tag, _nothing)(element, self.size, scale):
            if len(points) < 2:
                continue
            p = np.column_stack((np.array(points), np.ones(len(points)))) @ on.T[:, :2] * MM["px"]
            if closed or math.dist(p[0], p[-1]) < 0.01 and len(p) > 2:
                self.closed.setdefault(layer, []).append(p)
            else:
                self.open += 1


def _tag(element):
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _nothing(element, size, scale):
    return []


# ---- shapes: (points in user units, closed) ------------------------------------------------------------------------


def _rect(element, size, scale):
    x, y, w, h = (length(element.get(key), whole) for key, whole in zip(("x", "y", "width", "height"), (*size, *size)))
    rx, ry = (
        length(element.get(key), whole) if element.get(key) not in (None, "auto") else None
        for key, whole in zip(("rx", "ry"), size)
    )
    rx, ry = rx if rx is not None else ry or 0.0, ry if ry is not None else rx or 0.0
    rx, ry = min(rx, w / 2), min(ry, h / 2)
    if not w or not h:
        return
    if not rx or not ry:
        yield [(x, y), (x + w, y), (x + w, y + h), (x, y + h)], True
        return
    points = []
    for cx, cy, a in (
        (x + w - rx, y + ry, -90),
        (x + w - rx, y + h - ry, 0),
        (x + rx, y + h - ry, 90),
        (x + rx, y + ry, 180),
    ):
        points += _arc((cx, cy), rx, ry, 0.0, math.radians(a), math.radians(90), scale)
    yield points, True


def _round(element, size, scale):
    cx, cy = (length(element.get(key), whole) for key, whole in zip(("cx", "cy"), size))
    rx, ry = (
        length(element.get(key) or element.get("r"), whole)
        for key, whole in zip(("rx", "ry"), (math.hypot(*size) / math.sqrt(2),) * 2)
    )
    if rx and ry:
        yield _arc((cx, cy), rx, ry, 0.0, 0.0, 2 * math.pi, scale), True


def _poly(element, size, scale):
    v = numbers(element.get("points"))
    yield list(zip(v[::2], v[1::2])), _tag(element) == "polygon"


def _line(element, size, scale):
    yield (
        [
            tuple(length(element.get(key), whole) for key, whole in zip(pair, size))
            for pair in (("x1", "y1"), ("x2", "y2"))
        ],
        False,
    )


def _arc(centre, rx, ry, turn, first, sweep, scale):
    """Points on an arc of an ellipse."""
    count = max(4, math.ceil(abs(sweep) / math.sqrt(8 * SAGITTA / max(rx, ry) / scale)))
    c, s = math.cos(turn), math.sin(turn)
    t = first + sweep * np.arange(count + 1) / count
    u, v = rx * np.cos(t), ry * np.sin(t)
    return list(zip(centre[0] + c * u - s * v, centre[1] + s * u + c * v))


def _arc_to(here, rx, ry, turn, large, sweep, to, scale):
    """Points of the command A, by the implementation notes of the recommendation (F.6)."""
    rx, ry = abs(rx), abs(ry)
    if here == to:
        return []
    if not rx or not ry:
        return [to]
    c, s = math.cos(turn), math.sin(turn)
    dx, dy = (here[0] - to[0]) / 2, (here[1] - to[1]) / 2
    x, y = c * dx + s * dy, -s * dx + c * dy
    grow = math.sqrt(max(1.0, (x / rx) ** 2 + (y / ry) ** 2))
    rx, ry = rx * grow, ry * grow
    k = math.sqrt(max(0.0, (rx * ry) ** 2 / ((rx * y) ** 2 + (ry * x) ** 2) - 1.0)) * (-1 if large == sweep else 1)
    u, v = k * rx * y / ry, -k * ry * x / rx
    centre = (c * u - s * v + (here[0] + to[0]) / 2, s * u + c * v + (here[1] + to[1]) / 2)
    first = math.atan2((y - v) / ry, (x - u) / rx)
    turned = (math.atan2((-y - v) / ry, (-x - u) / rx) - first) % (2 * math.pi)
    return _arc(centre, rx, ry, turn, first, turned if sweep else turned - 2 * math.pi, scale)[1:-1] + [to]


TOKEN = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])|" + NUMBER.pattern)
COUNT = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def commands(text):
    """[(letter, numbers)] of a path; the flags of an arc need no space."""
    found, at, letter = [], 0, ""
    blank = re.compile(r"[\s,]*")
    while (at := blank.match(text, at).end()) < len(text):
        if text[at].upper() in COUNT:
            letter, at = text[at], at + 1
            if letter in "Zz":
                found.append((letter, []))
                continue
        values = []
        while len(values) < COUNT[letter.upper()]:
            at = blank.match(text, at).end()
            if letter in "Aa" and len(values) in (3, 4):
                values.append(float(text[at]))
                at += 1
            else:
                one = NUMBER.match(text, at)
                values.append(float(one.group()))
                at = one.end()
        found.append((letter, values))
        letter = {"M": "L", "m": "l"}.get(letter, letter)
    return found


def _path(element, size, scale):
    points, start, here, before = [], (0.0, 0.0), (0.0, 0.0), None
    for letter, v in commands(element.get("d") or ""):
        kind, base = letter.upper(), here if letter.islower() else (0.0, 0.0)
        if kind == "Z":
            yield points, True
            points, here, before = [start], start, None
            continue
        if kind == "M":
            if len(points) > 1:
                yield points, False
            start = here = (v[0] + base[0], v[1] + base[1])
            points, before = [here], None
            continue
        if kind == "A":
            to = (v[5] + base[0], v[6] + base[1])
            points += _arc_to(here, v[0], v[1], math.radians(v[2]), bool(v[3]), bool(v[4]), to, scale)
            here, before = to, None
            continue
        if kind in "HV":
            v = [v[0] + base[0], here[1]] if kind == "H" else [here[0], v[0] + base[1]]
            base = (0.0, 0.0)
        q = [(v[k] + base[0], v[k + 1] + base[1]) for k in range(0, len(v), 2)]
        if kind in "ST":
            same = before is not None and before[0] == ("C" if kind == "S" else "Q")
            q.insert(0, (2 * here[0] - before[1][0], 2 * here[1] - before[1][1]) if same else here)
        if len(q) == 1:
            points.append(q[0])
        else:
            points += _bezier([here, *q])
        before = ("C" if len(q) == 3 else "Q", q[-2]) if len(q) > 1 else None
        here = q[-1]
    if len(points) > 1:
        yield points, False


def _bezier(control):
    """Points on a curve, by de Casteljau."""
    t = np.arange(1, CURVE + 1)[:, None] / CURVE
    level = [np.array([p]) for p in control]
    while len(level) > 1:
        level = [(1 - t) * a + t * b for a, b in zip(level, level[1:])]
    return [tuple(p) for p in level[0]]


_SHAPES = {
    "rect": _rect,
    "circle": _round,
    "ellipse": _round,
    "polygon": _poly,
    "polyline": _poly,
    "line": _line,
    "path": _path,
}
