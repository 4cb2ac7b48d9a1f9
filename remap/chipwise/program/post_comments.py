# SPDX-License-Identifier: GPL-2.0-or-later
"""Tools and stock that the comments of CAM systems' programs name.

Called by check/assume.py.  The forms are those that the posts write; the interpreter does not see all of them (LinuxCNC
passes no comments behind a semicolon on), so the text of the file is read.  Lengths of the result are mm; those of a
comment are in the program's unit unless the form has its own.

    Fusion, HSM     (T3 D=6. CR=0. - ZMIN=-5. - flat end mill)
    Carbide Create  (stockMin:0.00mm, 0.00mm, -12.70mm) (stockMax:..), (STOCK/BLOCK,100,60,12,0,0,12),
                    (TOOL/MILL,3.175,0.0,20,0.0)
    Vectric         (X= 100.000, Y= 60.000, Z= 12.000) behind (Material Size), (Z Origin for Material= ..), (1 = End
                    Mill {6 mm})
    Kiri:Moto       ; Stock X:100 Y:60 Z:12, ; tool#=1 flute=6 len=20 unit=metric
    Makera          (Z Origin Set To: ..), (Stock Height: 12 mm)
    FreeCAD         (M6 T3), (Compensated Tool Path. Diameter: 6.0)         CamBam      (T3 : 6.0)
    Mastercam       (T3 | FLAT END MILL | H3 | D3 | TOOL DIA. - 6.)
    chipwise        (WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-20,XMAX=100,YMAX=60,ZMAX=0),
                    (WORKPIECE,CYLINDER,AXIS=Z,X=..,Y=..,ZMIN=..,ZMAX=..,DIAMETER=..) of a program that has no M250; of
                    a cylinder the box around it.  It goes before all others
"""

import re
from dataclasses import dataclass, field
from typing import Optional

from chipwise.host.files import open_regular

INCH_MM = 25.4
MAX_BYTES = 100_000_000  # of a program
MAX_LINE = 512  # characters of a line that are looked at
MAX_TOOLS = 200
SIZES_MM = 0.01, 1000.0  # diameters of tools; others are a mistake
EXTENT_MM = 0.05, 20000.0  # of a stock
LOWEST, MIDDLE, HIGHEST = 0.0, 0.5, 1.0  # where zero lies between the two faces of a stock of known size

_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+))"
_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)")
_NAME = re.compile(r"<[^<>]*>")
_CALL = re.compile(r"T\s*(\d{1,9})(?![\d.])")
_UNIT = re.compile(r"G\s*0*2([01])(?![\d.])")


def _form(text):
    return re.compile(text.replace("NUM", _NUMBER), re.IGNORECASE)


_FUSION = _form(r"^\s*T(\d{1,9})\s+(.{0,200}?)D=NUM\s+CR=NUM(?:\s+TAPER=NUMdeg)?\s+-\s+ZMIN=NUM(?:\s+-\s+(.{1,80}))?")
_PERSONAL = _form(r"using Fusion(?: 360)? for Personal Use, the feedrate of")
_STOCK_CORNER = _form(r"stock(Min|Max):\s*NUM\s*(mm|in)\s*,\s*NUM\s*(?:mm|in)\s*,\s*NUM\s*(?:mm|in)")
_BLOCK = _form(r"STOCK/BLOCK\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM")
_MILL = _form(r"TOOL/MILL\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM\s*,\s*NUM")
_MATERIAL = _form(r"Material Size")
_SIZE = _form(r"^\s*X\s*=\s*NUM\s*,\s*Y\s*=\s*NUM\s*,\s*Z\s*=\s*NUM")
_Z_ORIGIN = _form(r"Z Origin (?:for Material|Set To)\s*[=:]\s*(.{1,60})")
_XY_ORIGIN = _form(r"XY Origin for Material\s*[=:]\s*(.{1,60})")
_VECTRIC_TOOL = _form(r"^\s*T?(\d{1,9})\s*=\s*(.{0,200}?)\{NUM\s*(mm|inch|inches|in)\}")
_KIRI_STOCK = _form(r"^\s*Stock X:\s*NUM\s+Y:\s*NUM\s+Z:\s*NUM")
_KIRI_TOOL = _form(r"tool#\s*=\s*(\d{1,9})\s+flute\s*=\s*NUM\s+len\s*=\s*NUM\s+unit\s*=\s*(metric|imperial)")
_HEIGHT = _form(r"Stock Height\s*:\s*NUM\s*(mm|in)?")
_FREECAD_CALL = _form(r"^\s*M0?6\s+T(\d{1,9})")
_FREECAD = _form(r"Compensated Tool Path\.\s*Diameter:\s*NUM")
_CAMBAM = _form(r"^\s*T(\d{1,9})\s*:\s*NUM\s*$")
_MASTERCAM = _form(r"^\s*T(\d{1,9})\s*\|\s*([^|]{0,200}?)\s*\|\s*H\d+(?:\s*\|\s*D\d+)?\s*\|\s*TOOL DIA\.\s*-\s*NUM")
_WORKPIECE = _form(r"^\s*WORKPIECE\s*,\s*(BOX|CYLINDER)\s*,(.{1,300})$")
_KEY = _form(r"\b(XMIN|YMIN|ZMIN|XMAX|YMAX|ZMAX|X|Y|DIAMETER)\s*=\s*NUM")


@dataclass(frozen=True)
class SaidTool:
    """A tool that a comment describes; mm, degrees (included angle of a cone; None: not said)."""

    number: Optional[int]
    diameter: float
    corner_radius: float = 0.0
    tip_angle: Optional[float] = None
    name: str = field(default="", compare=False)


@dataclass
class Said:
    """What the comments of one program say."""

    low: Optional[tuple] = None  # mm, work coordinates: corners of the stock
    high: Optional[tuple] = None
    size: Optional[tuple] = None  # mm, x y z (None: not said), where the corners are not known
    tools: dict = field(default_factory=dict)  # number -> SaidTool; None: of no number
    calls: list = field(default_factory=list)  # numbers of T words, in their order, each once
    rapids_are_feeds: bool = False  # the post wrote its traverses as G1
    unit_mm: float = 1.0  # of the program


class Reading:
    """The lines of one program, one after the other: take(), then end() -> Said."""

    def __init__(self, unit_mm):
        self.said = Said(unit_mm=unit_mm)
        self._corners, self._number, self._pending = {}, None, None
        self._size_follows = False
        self._z_zero, self._xy_zero = None, None
        self._vectric = self._loose = self._workpiece = None

    def take(self, line):
        """One line of the program."""
        code = _code(line)
        if "T" in code:
            for call in _CALL.finditer(code):
                self._called(int(call.group(1)))
        for comment in _COMMENT.finditer(line):
            self._take(comment.group(1) or comment.group(2) or "")

    def _called(self, number):
        self._number = number
        if number not in self.said.calls and len(self.said.calls) < MAX_TOOLS:
            self.said.calls.append(number)
        if self._pending:  # a tool described before its number
            self._keep(number, *self._pending)
            self._pending = None

    def _keep(self, number, diameter, corner=0.0, tip=None, name=""):
        low, high = SIZES_MM
        if low <= diameter <= high and len(self.said.tools) < MAX_TOOLS and number not in self.said.tools:
            self.said.tools[number] = SaidTool(
                number,
                diameter,
                min(max(corner, 0.0), diameter / 2),
                tip if tip and 1 <= tip < 179 else None,
                name.strip(" -"),
            )

    def _take(self, text):
        """One comment."""
        if self._size_follows and (found := _SIZE.search(text)):
            self._vectric = tuple(map(float, found.groups()))
        self._size_follows = bool(_MATERIAL.search(text)) or (self._size_follows and not text.strip())
        if "=" in text or ":" in text or "/" in text or "|" in text or "T" in text.upper():
            self._take_tool(text)
            self._take_stock(text)
        if _PERSONAL.search(text):
            self.said.rapids_are_feeds = True

    def _take_tool(self, text):
        unit = self.said.unit_mm
        if found := _FUSION.search(text):
            number, remark, diameter, corner, taper, _lowest, kind = found.groups()
            self._keep(
                int(number),
                float(diameter) * unit,
                float(corner) * unit,
                2 * float(taper) if taper else None,
                kind or remark,
            )
        elif found := _MASTERCAM.search(text):
            self._keep(int(found.group(1)), float(found.group(3)) * unit, name=found.group(2))
        elif found := _KIRI_TOOL.search(text):
            self._keep(
                int(found.group(1)), float(found.group(2)) * (1.0 if found.group(4).lower() == "metric" else INCH_MM)
            )
        elif found := _VECTRIC_TOOL.search(text):
            self._keep(
                int(found.group(1)),
                float(found.group(3)) * (1.0 if found.group(4).lower() == "mm" else INCH_MM),
                name=found.group(2),
            )
        elif found := _CAMBAM.search(text):
            self._keep(int(found.group(1)), float(found.group(2)) * unit)
        elif found := _FREECAD_CALL.search(text):
            self._called(int(found.group(1)))
        elif found := _FREECAD.search(text):
            self._keep(self._number, float(found.group(1)))  # FreeCAD's own unit is mm
        elif found := _MILL.search(text):
            diameter, corner, _length, half = map(float, found.groups())
            self._pending = diameter * unit, corner * unit, 2 * half

    def _take_stock(self, text):
        unit = self.said.unit_mm
        if found := _WORKPIECE.search(text):
            self._workpiece = _workpiece(
                found.group(1).upper(),
                {key.upper(): float(value) * unit for key, value in _KEY.findall(found.group(2))},
            )
        elif found := _STOCK_CORNER.search(text):
            which, x, given, y, z = found.groups()
            factor = 1.0 if given.lower() == "mm" else INCH_MM
            self._corners[which.lower()] = tuple(float(value) * factor for value in (x, y, z))
        elif found := _BLOCK.search(text):
            size, zero = (tuple(float(value) * unit for value in found.groups()[k : k + 3]) for k in (0, 3))
            self._corners = {"min": tuple(-b for b in zero), "max": tuple(a - b for a, b in zip(size, zero))}
        elif found := _KIRI_STOCK.search(text):
            self._loose = tuple(float(value) * unit for value in found.groups())
        elif found := _HEIGHT.search(text):
            factor = {"mm": 1.0, "in": INCH_MM}.get((found.group(2) or "").lower(), unit)
            self._loose = None, None, float(found.group(1)) * factor
        elif found := _XY_ORIGIN.search(text):
            self._xy_zero = _across(found.group(1))
        elif found := _Z_ORIGIN.search(text):
            self._z_zero = _along(found.group(1))

    def end(self):
        """-> Said."""
        said = self.said
        if self._pending and not said.tools:
            self._keep(None, *self._pending)
        if self._vectric:
            self._loose = tuple(value * said.unit_mm for value in self._vectric)
        if self._workpiece:
            said.low, said.high = self._workpiece
        elif len(self._corners) == 2:
            said.low, said.high = self._corners["min"], self._corners["max"]
        elif self._loose:
            said.size = self._loose
            if None not in (*self._loose, self._z_zero, self._xy_zero):
                zero = [share * size for share, size in zip((*self._xy_zero, self._z_zero), self._loose)]
                said.low, said.high = tuple(-z for z in zero), tuple(size - z for size, z in zip(self._loose, zero))
        if said.low and not all(EXTENT_MM[0] <= b - a <= EXTENT_MM[1] for a, b in zip(said.low, said.high)):
            said.low = said.high = None
        if said.size and not all(size is None or EXTENT_MM[0] <= size <= EXTENT_MM[1] for size in said.size):
            said.size = None
        return said


def _workpiece(shape, values):
    """(low, high) of a WORKPIECE comment of chipwise; None for one that is not complete."""
    try:
        if shape == "BOX":
            return tuple(tuple(values[axis + end] for axis in "XYZ") for end in ("MIN", "MAX"))
        radius = values["DIAMETER"] / 2
        return (
            (values["X"] - radius, values["Y"] - radius, values["ZMIN"]),
            (values["X"] + radius, values["Y"] + radius, values["ZMAX"]),
        )
    except KeyError:
        return None


def _along(text):
    """ "Material Surface", "Table", .. -> share of the height below Z0; None: not understood."""
    text = text.lower()
    if any(word in text for word in ("table", "bed", "bottom")):
        return LOWEST
    return HIGHEST if "surface" in text or "top" in text else MIDDLE if "cent" in text or "middle" in text else None


def _across(text):
    """ "Bottom Left Corner", "Center", .. -> shares (x, y) of the size before zero; None: not understood."""
    text = text.lower()
    if not any(word in text for word in ("left", "right", "cent")):
        return None
    x = LOWEST if "left" in text else HIGHEST if "right" in text else MIDDLE
    y = LOWEST if "bottom" in text or "front" in text else HIGHEST if "top" in text or "back" in text else MIDDLE
    return x, y


def _code(line):
    """A line without its comments and names of parameters, in capitals."""
    return _NAME.sub(" ", _COMMENT.sub(" ", line)).upper()


def _lines(path):
    """The lines of a program, each to MAX_LINE characters."""
    with open_regular(path, MAX_BYTES) as file:
        while line := file.readline(MAX_LINE):
            yield line.decode("utf-8", "replace")
            while line and len(line) == MAX_LINE and not line.endswith(b"\n"):
                line = file.readline(MAX_LINE)


def read(path, unit_mm=1.0):
    """Said of a program.  unit_mm: of a program that names none (the machine's).  OSError for a file that cannot be
    read."""
    found = next(filter(None, (_UNIT.search(_code(line)) for line in _lines(path))), None)
    if found:  # comments with tools come before it
        unit_mm = INCH_MM if found.group(1) == "0" else 1.0
    reading = Reading(unit_mm)
    for line in _lines(path):
        reading.take(line)
    return reading.end()
