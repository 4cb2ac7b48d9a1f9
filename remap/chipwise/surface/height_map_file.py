# SPDX-License-Identifier: GPL-2.0-or-later
"""Read a height map that a probing program has written -> heights at the crossings of a grid.

Called by model.py.  The kind is read from the content:

    Candle (.map)               lines x;y;width;height and nx;ny;..;.. and three more numbers, then ny lines of nx
    heights, the first at the smallest Y OpenCNCPilot (.hmap, XML)   <heightmap MinX=".." MinY=".." MaxX=".." MaxY=".."
    SizeX=".." SizeY=".."> <point X="0" Y="0">height</point> bCNC (.probe)               lines xmin xmax nx, ymin ymax
    ny and zmin zmax feed, then a line x y z for each point points (.xyz, .csv)         a line x y z for each point,
    between blanks, commas or semicolons; the columns' names may stand before

Points may be in any order and lie at uneven distances, but each crossing of their columns and rows has to have one:
what is between known heights is known, what is beside a gap is not.
"""

import re
from dataclasses import dataclass
from typing import Optional

import numpy as np

from chipwise.errors import CycleError

MAX_BYTES = 64_000_000
MAX_POINTS = 2_000_000  # two triangles each
MOST_WORD = 40  # characters of a number
SAME = 1e-4  # mm by which X or Y of points of one column or row may differ
SEPARATORS = re.compile(r"[;\s]+")

_HEIGHT_MAP = re.compile(rb"<heightmap\b([^<>]{0,2000})>", re.IGNORECASE)
_POINT = re.compile(rb"<point\b([^<>]{0,200})>([^<>]{0,60})</point>", re.IGNORECASE)
_ATTRIBUTE = re.compile(rb"(\w{1,20})\s*=\s*[\"']([^\"']{1,40})[\"']")
_BEGINS = re.compile(
    rb"^(?:\xef\xbb\xbf)?\s*(?:<\?xml|<heightmap|[-+.\d]|[\"']?x[\"']?\s*[,;\s]\s*[\"']?y)", re.IGNORECASE
)


@dataclass(frozen=True)
class HeightMap:
    """x (columns,), y (rows,) rising; height (rows, columns), the first row at the smallest y; in the file's unit."""

    x: np.ndarray
    y: np.ndarray
    height: np.ndarray


def may_be(head: bytes) -> bool:
    """Whether a file that begins so may be a height map."""
    return b"\0" not in head and bool(_BEGINS.match(head))


def read_height_map(data: bytes) -> Optional[HeightMap]:
    """None for a text of another kind; CycleError for a height map with gaps, or one that is damaged or too large."""
    if len(data) > MAX_BYTES:
        raise CycleError(f"the height map has {len(data)} bytes, more than {MAX_BYTES}", "probe fewer points")
    if _HEIGHT_MAP.search(data[:20000]):
        return _of_xml(data)
    text = data.removeprefix(b"\xef\xbb\xbf").decode("ascii", "replace")
    lines = [line for line in (line.strip() for line in text.splitlines()) if line]
    return _of_candle(lines) or _of_bcnc(lines) or _of_points(lines)


def _number(word):
    """A number of the file, a decimal comma too; None for another word."""
    if len(word) > MOST_WORD:
        return None
    try:
        return float(word.replace(",", "."))
    except ValueError:
        return None


def _numbers(line, separators=SEPARATORS):
    """The numbers of a line; None if something else is in it."""
    found = [_number(word) for word in separators.split(line.strip(" \t;,")) if word]
    return None if None in found else found


def _whole(*values):
    """Whole numbers of points; None for others."""
    counts = [int(value) for value in values if 2 <= value < 1e9 and value == int(value)]
    return counts if len(counts) == len(values) else None


def _counts(*values):
    """_whole(); CycleError for too many."""
    counts = _whole(*values)
    if counts and counts[0] * counts[1] > MAX_POINTS:
        raise CycleError(
            f"the height map has {counts[0]} x {counts[1]} points, more than {MAX_POINTS}", "probe fewer points"
        )
    return counts


def _of_candle(lines):
    """A map of Candle; None for another file."""
    if len(lines) < 5 or ";" not in lines[0]:
        return None
    semicolon = re.compile(";")
    head = [_numbers(line, semicolon) for line in lines[:3]]
    if [found and len(found) for found in head] != [4, 4, 3]:
        return None
    (x0, y0, width, depth), (nx, ny, *_), _ = head
    counts = _counts(nx, ny)
    if counts is None or not (width > 0 and depth > 0):
        return None
    rows = [_numbers(line, semicolon) for line in lines[3:]]
    if len(rows) != counts[1] or any(row is None or len(row) != counts[0] for row in rows):
        raise CycleError(f"the height map says {counts[0]} x {counts[1]} points and has others", "save it again")
    return _checked(np.linspace(x0, x0 + width, counts[0]), np.linspace(y0, y0 + depth, counts[1]), np.array(rows))


def _of_xml(data):
    """A map of OpenCNCPilot."""
    found = {
        name.lower(): _number(value.decode("ascii", "replace"))
        for name, value in _ATTRIBUTE.findall(_HEIGHT_MAP.search(data).group(1))
    }
    names = b"minx", b"miny", b"maxx", b"maxy", b"sizex", b"sizey"
    if any(found.get(name) is None for name in names):
        raise CycleError("the height map lacks MinX, MinY, MaxX, MaxY, SizeX or SizeY", "save it again")
    x0, y0, x1, y1, *sizes = (found[name] for name in names)
    counts = _counts(*sizes)
    if counts is None or not (x1 > x0 and y1 > y0):
        raise CycleError("the height map has no extent", "save it again")
    height = np.full(counts[::-1], np.nan)
    for head, value in _POINT.findall(data):
        place = {name.lower(): _number(word.decode("ascii", "replace")) for name, word in _ATTRIBUTE.findall(head)}
        x, y, z = place.get(b"x"), place.get(b"y"), _number(value.decode("ascii", "replace").strip())
        if None in (x, y, z) or not (0 <= x < counts[0] and 0 <= y < counts[1] and x == int(x) and y == int(y)):
            raise CycleError("the height map has a point that is not X, Y and a height", "save it again")
        height[int(y), int(x)] = z
    return _checked(np.linspace(x0, x1, counts[0]), np.linspace(y0, y1, counts[1]), height)


def _of_bcnc(lines):
    """A probe file of bCNC; None for another one."""
    head = [_numbers(line) for line in lines[:3]]
    if len(head) < 3 or any(row is None or len(row) != 3 for row in head):
        return None
    (x0, x1, nx), (y0, y1, ny), _ = head
    counts = _whole(nx, ny)
    if counts is None or not (x1 > x0 and y1 > y0):
        return None
    points = _points_of(lines[3:])
    if points is None or not len(points) or len(points) > counts[0] * counts[1]:
        return None  # three points of a list of points
    if (
        (points[:, 0] < x0 - SAME).any()
        or (points[:, 0] > x1 + SAME).any()
        or (points[:, 1] < y0 - SAME).any()
        or (points[:, 1] > y1 + SAME).any()
    ):
        return None
    counts = _counts(nx, ny)
    return _gridded(points, np.linspace(x0, x1, counts[0]), np.linspace(y0, y1, counts[1]))


def _of_points(lines):
    """A list of points; None for another text."""
    if lines and _numbers(lines[0]) is None and len(lines) > 1 and re.match(r"\W*x\W+y\W+z", lines[0], re.IGNORECASE):
        lines = lines[1:]
    points = _points_of(lines)
    if points is None or len(points) < 4:
        return None
    return _gridded(points, _levels(points[:, 0]), _levels(points[:, 1]))


def _points_of(lines):
    """(n, 3) of lines x y z; None if one is something else."""
    if len(lines) > MAX_POINTS:
        raise CycleError(f"the height map has {len(lines)} points, more than {MAX_POINTS}", "probe fewer points")
    commas = bool(lines) and ";" not in lines[0] and lines[0].count(",") >= 2
    separators = re.compile(r"[,\s]+") if commas else SEPARATORS
    points = []
    for line in lines:
        found = _numbers(line, separators)
        if found is None or len(found) != 3:
            return None
        points.append(found)
    return np.array(points).reshape(-1, 3)


def _levels(values):
    """The columns or rows that coordinates (n,) lie on, rising."""
    rising = np.sort(values[np.isfinite(values)])
    return rising[np.concatenate(([True], np.diff(rising) > SAME))] if len(rising) else rising


def _gridded(points, x, y):
    """Points (n, 3) at the crossings of columns x and rows y."""
    if min(len(x), len(y)) < 2:
        raise CycleError("the height map is one line of points: it has no surface", "probe two lines at least")
    if len(x) * len(y) > MAX_POINTS:
        raise CycleError(
            f"the points of the height map are not a grid: {len(points)} points have {len(x)} different X and {len(y)} "
            f"different Y",
            "probe a grid",
        )
    height = np.full((len(y), len(x)), np.nan)
    columns, rows = _nearest(x, points[:, 0]), _nearest(y, points[:, 1])
    if (np.abs(x[columns] - points[:, 0]) > 100 * SAME).any() or (np.abs(y[rows] - points[:, 1]) > 100 * SAME).any():
        raise CycleError("the points of the height map are not a grid", "probe a grid")
    height[rows, columns] = points[:, 2]
    return _checked(x, y, height)


def _nearest(levels, values):
    """(n,) int: the level that is nearest to each value."""
    after = np.clip(np.searchsorted(levels, values), 1, len(levels) - 1)
    return np.where(values - levels[after - 1] < levels[after] - values, after - 1, after)


def _checked(x, y, height):
    """A whole map, or CycleError."""
    gaps = int((~np.isfinite(height)).sum())
    if gaps:
        raise CycleError(f"{gaps} of {height.size} points of the height map are not known", "probe them")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise CycleError("the height map has a place that is not a finite number", "save it again")
    return HeightMap(x, y, height)
