# SPDX-License-Identifier: GPL-2.0-or-later
"""Random drawings in the manner of seven programs that write SVG, with the area to be cut by closed forms.  Called by
import_svg.py.

drawing(seed, path) writes an SVG and returns (manner, mm2 of the pockets, largest first).  The parts are those of
  drawings_cad.py.  The manners:
  inkscape     a page in mm, layers that move and turn, arcs with both flags, a hidden layer, clones, a clip path in
               defs
  illustrator  points without a unit, style sheets, cubic curves with S, compact numbers, the frame of the artboard
               without fill and stroke
  corel        inch, a viewBox in ten-thousandths, whole numbers, absolute commands
  figma        pixels, groups within groups, symbols and use, a mask outside defs
  cairo        points, symbols of letters placed by use with x and y, a clip path of the page
  hand         flags without spaces, relative moves after z, H V Q T, cm and in, percent, a viewBox that begins
               elsewhere and keeps no shape
  nested       an svg within the svg, with a place, a size and a viewBox of its own
"""

import math

import numpy as np

from drawings_cad import _is_circle, _part, _tip

MANNERS = ("inkscape", "illustrator", "corel", "figma", "cairo", "hand", "nested")
WIDTH, HEIGHT = 200.0, 140.0  # mm of the page
HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
)
KAPPA = 4 / 3


def drawing(seed, path):
    """-> (manner, [mm2, ..])"""
    rng = np.random.default_rng([seed, 47])
    manner, loops, areas = MANNERS[seed % len(MANNERS)], [], []
    for k in range(int(rng.integers(1, 6))):
        found, area = _part(rng, 30.0 + 60.0 * (k % 3), 30.0 + 60.0 * (k // 3))
        loops += found
        areas += area
    with open(path, "w", encoding="utf-8") as file:
        file.write(_WRITERS[manner](loops, rng))
    return manner, sorted(areas, reverse=True)


# ---- a loop as a path ----------------------------------------------------------------------------------------------


def _d(loop, unit, digits, style):
    """The d of a loop; unit: user units in a mm; style: "arc", "tight" (flags without spaces, relative), "cubic" or
    "quadratic" (arcs as curves)."""
    if loop[0][0] == "E" or _is_circle(loop[0]):
        (x, y), a, b = loop[0][1], loop[0][2], loop[0][3] if loop[0][0] == "E" else loop[0][2]
        quarter = [(x + a * math.cos(t), y + b * math.sin(t)) for t in np.arange(4) * math.pi / 2]
        steps = [("E", quarter[(k + 1) % 4], a, b, k * math.pi / 2, math.pi / 2) for k in range(4)]
        first = quarter[0]
    else:
        first = loop[0][1] if loop[0][0] == "L" else _tip(loop[0], 3)
        steps = [
            ("L", part[2]) if part[0] == "L" else ("E", _tip(part, 4), part[2], part[2], part[3], part[4] - part[3])
            for part in loop
        ]
    here, words = first, [("M" if style != "tight" else "m") + _xy(first, unit, digits)]
    for step in steps:
        words.append(_step(here, step, unit, digits, style))
        here = step[1]
    return " ".join(words) + ("z" if style == "tight" else " Z")


def _step(here, step, unit, digits, style):
    """One command; y of the drawing points up, that of the path down."""
    to = step[1]
    if step[0] == "L":
        if style == "tight":
            return "l" + _xy((to[0] - here[0], to[1] - here[1]), unit, digits)
        return "L" + _xy(to, unit, digits)
    _, _, a, b, first, turn = step
    if style == "arc":
        return f"A{a * unit:.{digits}f},{b * unit:.{digits}f} 0 0 0 " + _xy(to, unit, digits)
    if style == "tight":
        return (
            f"a{a * unit:.{digits}f} {b * unit:.{digits}f} 0 00"
            + _xy((to[0] - here[0], to[1] - here[1]), unit, digits).strip()
        )
    parts = 2 if style == "cubic" else 8
    words, centre = [], (here[0] - a * math.cos(first), here[1] - b * math.sin(first))
    for k in range(parts):
        t0, t1 = first + turn * k / parts, first + turn * (k + 1) / parts
        p, q = ((centre[0] + a * math.cos(t), centre[1] + b * math.sin(t)) for t in (t0, t1))
        out = (KAPPA * math.tan((t1 - t0) / 4)) if style == "cubic" else math.tan((t1 - t0) / 2)
        c = (p[0] - out * a * math.sin(t0), p[1] + out * b * math.cos(t0))
        e = (q[0] + out * a * math.sin(t1), q[1] - out * b * math.cos(t1))
        if style == "quadratic":
            words.append(("Q" + _xy(c, unit, digits) if k == 0 else "T") + _xy(q, unit, digits))
        else:
            words.append(("C" + _xy(c, unit, digits) if k == 0 else "S") + _xy(e, unit, digits) + _xy(q, unit, digits))
    return " ".join(words)


def _xy(p, unit, digits):
    return f" {p[0] * unit:.{digits}f},{-p[1] * unit:.{digits}f}"


def _path(d, more=""):
    return f'<path {more} d="{d}"/>'


def _page(unit):
    """The transform that turns y = 0 below into the page's upper edge."""
    return f'transform="translate(0 {HEIGHT * unit:g})"'


# ---- manners -------------------------------------------------------------------------------------------------------


def _inkscape(loops, rng):
    turn, x, y = float(rng.uniform(-180, 180)), *rng.uniform(-20, 20, 2)
    paths = []
    for k, loop in enumerate(loops):
        if _is_circle(loop[0]) and rng.random() < 0.6:
            (cx, cy), r = loop[0][1:3]
            paths.append(f'<circle id="c{k}" cx="{cx:.6f}" cy="{-cy:.6f}" r="{r:.6f}" style="fill:none;stroke:#000"/>')
        elif loop[0][0] == "E" and rng.random() < 0.6:
            (cx, cy), a, b = loop[0][1:]
            paths.append(
                f'<ellipse cx="{cx:.6f}" cy="{-cy:.6f}" rx="{a:.6f}" ry="{b:.6f}" style="fill:none;stroke:#000"/>'
            )
        else:
            scale = float(rng.uniform(0.2, 3.0))
            paths.append(_path(_d(loop, 1 / scale, 7, "arc"), f'style="fill:#f00" transform="scale({scale:.9f})"'))
    return (
        HEAD + f'width="{WIDTH:g}mm" height="{HEIGHT:g}mm" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"><defs><clipPath '
        f'id="clip"><rect width="9" height="9"/></clipPath>'
        '<path id="unused" d="M0 0h50v50z"/></defs><g inkscape:groupmode="layer" inkscape:label="Aids" '
        'style="display:none"><rect width="99" height="99"/></g>'
        f'<g inkscape:groupmode="layer" inkscape:label="Cut" id="layer1" transform="translate({x:.5f},{y:.5f}) '
        f'rotate({turn:.6f})"><g id="g7" {_page(1)}>' + "".join(paths) + "</g></g></svg>"
    )


def _illustrator(loops, rng):
    unit = 96 / 25.4
    paths = "".join(
        _path(
            _d(loop, unit, 4, "cubic").replace(" 0.", " .").replace(",0.", ",.").replace(",-0.", ",-."), 'class="cls-1"'
        )
        for loop in loops
    )
    return (
        HEAD + f'viewBox="0 0 {WIDTH * unit:.4f} '
        f'{HEIGHT * unit:.4f}"><defs><style>.cls-1,.cls-3{{fill:none;stroke:#231f20;}}.cls-2{{fill:none;}}</style>'
        f"</defs>"
        f'<title>part</title><rect class="cls-2" width="{WIDTH * unit:.3f}" height="{HEIGHT * unit:.3f}"/><g '
        f'id="Layer_1" data-name="Layer 1" {_page(unit)}>{paths}</g></svg>'
    )


def _corel(loops, rng):
    unit = 10000 / 25.4
    paths = "".join(_path(_d(loop, unit, 0, "cubic"), 'class="fil0 str0"') for loop in loops)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">\n'
        + HEAD
        + f'xml:space="preserve" width="{WIDTH / 25.4:.5f}in" height="{HEIGHT / 25.4:.5f}in" version="1.1" viewBox="0 '
        f'0 {WIDTH * unit:.2f} {HEIGHT * unit:.2f}">'
        '<defs><style type="text/css"><![CDATA[ .str0 {stroke:#2B2A29;stroke-width:7.62} .fil0 {fill:none} '
        "]]></style></defs>"
        f'<g id="Layer_x0020_1" {_page(unit)}><metadata id="CorelCorpID_0Corel-Layer"/>{paths}</g></svg>'
    )


def _figma(loops, rng):
    unit, shown, symbols = 96 / 25.4, [], []
    for k, loop in enumerate(loops):
        if k % 3 == 2:
            symbols.append(f'<symbol id="s{k}" overflow="visible">{_path(_d(loop, unit, 6, "arc"))}</symbol>')
            shown.append(f'<use xlink:href="#s{k}"/>')
        else:
            x, y = rng.uniform(-50, 50, 2)
            moved = _path(_d(loop, unit, 6, "cubic"), f'transform="translate({-x:.6f} {-y:.6f})" fill="white"')
            shown.append(f'<g transform="translate({x:.6f} {y:.6f})"><g>{moved}</g></g>')
    return (
        HEAD + f'width="{WIDTH * unit:.4f}" height="{HEIGHT * unit:.4f}" viewBox="0 0 {WIDTH * unit:.4f} '
        f'{HEIGHT * unit:.4f}" fill="none">'
        f'<mask id="m0" maskUnits="userSpaceOnUse" x="0" y="0" width="400" height="400"><path d="M0 0H400V400H0V0Z" '
        f'fill="white"/></mask>'
        f'{"".join(symbols)}<g id="Frame 1" {_page(unit)} fill="black">{"".join(shown)}</g></svg>'
    )


def _cairo(loops, rng):
    unit, places = 72 / 25.4, [tuple(rng.uniform(-100, 100, 2)) for _ in loops]
    symbols = "".join(
        f'<symbol overflow="visible" id="glyph0-{k}">'
        + _path(_d([_shifted(part, -x / unit, y / unit) for part in loop], unit, 6, "cubic"), 'style="stroke:none;"')
        + "</symbol>"
        for k, (loop, (x, y)) in enumerate(zip(loops, places))
    )
    uses = "".join(f'<use xlink:href="#glyph0-{k}" x="{x:.6f}" y="{y:.6f}"/>' for k, (x, y) in enumerate(places))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        + HEAD
        + f'width="{WIDTH * unit:.6f}pt" height="{HEIGHT * unit:.6f}pt" viewBox="0 0 {WIDTH * unit:.6f} '
        f'{HEIGHT * unit:.6f}" version="1.1">'
        f'<defs><g>{symbols}</g><clipPath id="clip1"><path d="M 0 0 L 600 0 L 600 600 L 0 600 Z"/></clipPath></defs>'
        f'<g id="surface1" clip-path="url(#clip1)" clip-rule="nonzero"><g {_page(unit)} '
        f'style="fill:rgb(0%,0%,0%);fill-opacity:1;">{uses}</g></g></svg>'
    )


def _shifted(part, x, y):
    """A part that lies elsewhere by (x, y) mm."""
    if part[0] == "L":
        return "L", (part[1][0] + x, part[1][1] + y), (part[2][0] + x, part[2][1] + y)
    return (part[0], (part[1][0] + x, part[1][1] + y), *part[2:])


def _hand(loops, rng):
    """The page is 2 in to 100 units across and 1 cm to 20 units down."""
    sx, sy = 100 / 50.8, 2.0
    tight, rest = loops[: len(loops) // 2], loops[len(loops) // 2 :]
    whole = _subpaths([_d(loop, 1.0, 6, "tight") for loop in tight], tight)
    paths = [_path(whole)] if tight else []
    paths += [_path(_d(loop, 1.0, 6, "quadratic")) for loop in rest]
    return (
        HEAD + f'width="{WIDTH / 25.4:.7f}in" height="{HEIGHT / 10:.6f}cm" viewBox="-10 20 {WIDTH * sx:.6f} '
        f'{HEIGHT * sy:.6f}" preserveAspectRatio="none">'
        f'<g transform="matrix({sx:.9f} 0 0 {sy:.9f} -10 {20 + HEIGHT * sy:.6f})">{"".join(paths)}</g></svg>'
    )


def _subpaths(texts, loops):
    """Paths in one d: every m after the first is relative to the start of the loop before."""
    found, here = [], (0.0, 0.0)
    for text, loop in zip(texts, loops):
        first = _first(loop)
        rest = text[text.index(" ", 2) :] if " " in text[2:] else text
        found.append("m" + _xy((first[0] - here[0], first[1] - here[1]), 1.0, 6) + rest)
        here = first
    return "".join(found)


def _first(loop):
    """Where the path of a loop begins."""
    part = loop[0]
    if part[0] == "E" or _is_circle(part):
        return part[1][0] + part[2], part[1][1]
    return part[1] if part[0] == "L" else _tip(part, 3)


def _nested(loops, rng):
    inner, x, y = float(rng.uniform(0.5, 4.0)), *rng.uniform(0, 30, 2)
    paths = "".join(_path(_d(loop, inner, 6, "arc")) for loop in loops)
    return (
        HEAD
        + f'width="{WIDTH:g}mm" height="{HEIGHT:g}mm" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"><svg x="{x:.5f}" y="{y:.5f}" '
        f'width="50%" height="50%" '
        f'viewBox="0 0 {WIDTH * inner / 2:.6f} {HEIGHT * inner / 2:.6f}" overflow="visible"><g '
        f"{_page(inner)}>{paths}</g></svg></svg>"
    )


_WRITERS = {
    "inkscape": _inkscape,
    "illustrator": _illustrator,
    "corel": _corel,
    "figma": _figma,
    "cairo": _cairo,
    "hand": _hand,
    "nested": _nested,
}
