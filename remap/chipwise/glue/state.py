# SPDX-License-Identifier: GPL-2.0-or-later
"""What a cycle must know of the interpreter: words, units, position, tool, modes.

The conversion between the program's units, the machine's and ours (mm) happens here and in emit.py, nowhere else.
Read in LinuxCNC 2.9.0~pre1: interpmodule.cc (properties), pyblock.cc (blocks), interp_remap.cc (kwargs).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Mapping, Sequence

import emccanon

from chipwise import ini, report
from chipwise.program import preview
from chipwise.errors import MM_PER_INCH, CycleError
from chipwise.glue import clamps, named
from chipwise.program import known_stock
from chipwise.machine import limits
from chipwise.order import Order
from chipwise.settings import MAX_SEAM_OVERLAP, MIN_ANGLE, load_settings
from chipwise.tool_data.geometry import tool_geometry

if TYPE_CHECKING:
    from chipwise.contour_sub.job import Job
    from chipwise.pattern.job import PatternJob
    from chipwise.program.interp import Block, Context, Interp, Words

# Words any line may carry besides those of the cycle: LinuxCNC deals with them before or after it.
COMMON_WORDS = "fst"
ALL_WORDS = "abcdefhijklpqrstuvwxyz"

# A table in inches gives 3 mm as 2.9999999999998: where a pocket has several starts that are as good, the rounding
# would choose.
DIAMETER_DECIMALS = 9

_INVERSE_TIME, _UNITS_PER_REVOLUTION = 1, 2  # interp_internal.hh: FEED_MODE


def path_of(context: Context | Interp) -> str:
    """The `filename` of the interpreter, or of one of its calls; Python cannot hold one that is not UTF-8 (boost)."""
    try:
        return context.filename
    except UnicodeDecodeError:
        raise CycleError("the path of the program is not valid UTF-8", "rename the file or its folder") from None


class State:
    """The interpreter's state when a cycle is called."""

    def __init__(self, interp: Interp, code: str, kwargs: Words) -> None:
        """interp: the interpreter; code: "G12"; kwargs: words as LinuxCNC passes them, `n` the line number."""
        self.interp = interp
        self.code = code
        self.line_number = int(kwargs.get("n", 0))
        self.words = {letter: value for letter, value in kwargs.items() if letter != "n"}
        inch = interp.length_units == emccanon.CANON_UNITS.CANON_UNITS_INCHES
        self.unit = "in" if inch else "mm"
        self.unit_mm = MM_PER_INCH if inch else 1.0
        self.incremental = bool(interp.distance_mode)
        self.settings = load_settings()

    def order(self, cycle: str, fields: Mapping[str, object], job: Job | PatternJob | None = None) -> Order:
        """The Order of this cycle: a function of planner/plans.py, the fields of its request, the Job of its sub."""
        return Order(
            cycle=cycle,
            code=self.code,
            fields=dict(fields, most_moves=self.settings["PLAN_MOVES"]),
            job=job,
            unit=self.unit,
            unit_mm=self.unit_mm,
            start=self.position(),
            memory_mb=self.settings["PLAN_MEMORY"],
            report=bool(self.interp.task and report.path()),
            targets=preview.wants_targets(),
            clamps=None if cycle == "turning" else clamps.asked(self),
        )

    # ---- modes ----------------------------------------------------------------------------------------------

    def check_modes(self) -> None:
        """Raise CycleError where a mode is active that no cycle of a mill works in.  (G53 on the line: LinuxCNC's own
        error.)"""
        interp = self.interp
        if interp.plane != emccanon.CANON_PLANE.CANON_PLANE_XY:
            raise CycleError("the plane is not G17", "program G17 before")
        self.check_common_modes()
        if interp.params["_lathe_diameter_mode"]:
            raise CycleError("lathe diameter mode (G7) is on", "program G8 before")

    def check_common_modes(self) -> None:
        """As check_modes(), of what no cycle of a lathe works in either."""
        interp = self.interp
        if interp.cutter_comp_side:
            raise CycleError("cutter compensation is on", "program G40 before")
        if interp.feed_mode == _INVERSE_TIME:
            raise CycleError("inverse time feed (G93) is on", "program G94 before")
        if interp.feed_mode == _UNITS_PER_REVOLUTION and not interp.speed[0] > 0:
            raise CycleError("feed per revolution (G95) without a spindle speed", "program S above 0 before, or G94")

    def axes(self) -> str:
        """Letters of the machine's axes, of X Y Z A B C."""
        path = ini.file_name()
        if path:
            return limits.machine_axes(tuple(ini.read_lines(path)))
        mask = emccanon.GET_EXTERNAL_AXIS_MASK()
        return "".join(letter for k, letter in enumerate("XYZABC") if mask & 1 << k)

    def program(self) -> str:
        """Path of the file that the line is in."""
        return path_of(self.interp)

    # ---- words ----------------------------------------------------------------------------------------------

    def _block(self) -> Block:
        """The block (line) that called the cycle."""
        return self.interp.blocks[self.interp.remap_level]

    def check_words(self, allowed: str, remedy: str = "") -> None:
        """Raise CycleError for a word on the line that is not in `allowed` (lower-case letters); remedy: what they are,
        if that helps.

        LinuxCNC leaves this to the remap: words outside argspec are dropped in silence.
        """
        block = self._block()
        for letter in ALL_WORDS:
            if letter not in allowed and letter not in COMMON_WORDS and getattr(block, letter + "_flag"):
                raise CycleError(
                    f"word {letter.upper()} is not used here", remedy or f"words are {' '.join(allowed.upper() + 'F')}"
                )

    def has_any(self, letters: str) -> bool:
        """Whether one of these words is on the line, also outside argspec."""
        block = self._block()
        return any(getattr(block, letter + "_flag") for letter in letters)

    def number(self, letter: str) -> float | None:
        """A word's plain value, None where absent."""
        return self.words.get(letter)

    def length(self, letter: str) -> float | None:
        """A word in program units -> mm, None where absent."""
        value = self.words.get(letter)
        return None if value is None else value * self.unit_mm

    def needed(self, letter: str, meaning: str) -> float:
        """As length(), but an error where absent."""
        value = self.length(letter)
        if value is None:
            raise CycleError(f"word {letter.upper()} ({meaning}) is missing", f"add {letter.upper()}")
        return value

    # ---- place and height -----------------------------------------------------------------------------------

    def position(self) -> tuple[float, float, float]:
        """(x, y, z) of the tool, mm, work coordinates."""
        interp = self.interp
        return interp.current_x * self.unit_mm, interp.current_y * self.unit_mm, interp.current_z * self.unit_mm

    def place(self) -> tuple[float, float]:
        """(x, y) from the words X Y: mm, absolute; an axis without a word stays where it is; G91: from here."""
        here = self.position()
        found = []
        for letter, now in zip("xy", here):
            value = self.length(letter)
            found.append(now if value is None else now + value if self.incremental else value)
        x, y = found
        return x, y

    def machine_point(self, point: Sequence[float]) -> tuple[float, float, float]:
        """(x, y, z) mm, work coordinates -> mm, machine coordinates of the tool's tip (no tool offset in them).

        As canon does: the G92 offset, then the G10 L2 R rotation, then the offset of the coordinate system.
        """
        interp, unit = self.interp, self.unit_mm
        x, y, z = (
            value + unit * shift
            for value, shift in zip(point, (interp.axis_offset_x, interp.axis_offset_y, interp.axis_offset_z))
        )
        angle = math.radians(interp.rotation_xy)
        along = x * math.cos(angle) - y * math.sin(angle)
        across = x * math.sin(angle) + y * math.cos(angle)
        return (
            along + unit * interp.origin_offset_x,
            across + unit * interp.origin_offset_y,
            z + unit * interp.origin_offset_z,
        )

    def heights(self) -> tuple[float, float]:
        """(clearance plane, final depth) from R and Z: mm, absolute.  G91: R from current Z, Z from R."""
        now = self.position()[2]
        depth = self.needed("z", "final depth")
        plane = self.length("r")
        if self.incremental:
            clearance = now + (plane or 0.0)
            return clearance, clearance + depth
        return (now if plane is None else plane), depth

    # ---- feeds ----------------------------------------------------------------------------------------------

    def feed_per_minute(self) -> float:
        """F in force, mm/min.  CycleError in other feed modes than G94."""
        if self.interp.feed_mode in (_INVERSE_TIME, _UNITS_PER_REVOLUTION):
            raise CycleError(
                f"G{93 if self.interp.feed_mode == _INVERSE_TIME else 95} is on, and the rate of a cut I, J needs a "
                f"feed per minute",
                "program G94 before, or give Q",
            )
        return self.interp.feed_rate * self.unit_mm

    def feeds(self) -> dict[str, object]:
        """For a request: the active feed and E, mm/min (mm/rev under G95); E is half the feed without a word.

        The line's own F is active already when a remap runs.
        """
        feed = self.interp.feed_rate * self.unit_mm
        plunge_feed = self.length("e")
        return {
            "feed": feed,
            "plunge_feed": feed / 2 if plunge_feed is None else plunge_feed,
            "feed_per": "rev" if self.interp.feed_mode == _UNITS_PER_REVOLUTION else "min",
        }

    # ---- tool and settings ----------------------------------------------------------------------------------

    def tool_diameter(self) -> float:
        """Diameter (mm) of the tool in the spindle, to DIAMETER_DECIMALS.  The tool table is in machine units, whatever
        G20/G21 says."""
        tool = self.interp.tool_table[0]
        if tool.toolno <= 0:
            raise CycleError("no tool is in the spindle", "load one with T.. M6")
        diameter = round(tool.diameter / emccanon.GET_EXTERNAL_LENGTH_UNITS(), DIAMETER_DECIMALS)
        if not diameter > 0:
            raise CycleError(
                f"tool {tool.toolno} has a diameter of {{d}}, which is not above 0",
                "give it a D in the tool table",
                d=diameter,
            )
        return diameter

    def flute_length(self) -> float | None:
        """Flute length (mm) of the tool in the spindle, None where unknown."""
        geometry = tool_geometry(self.settings.path("TOOL_GEOMETRY"), self.interp.tool_table[0].toolno)
        return None if geometry is None else geometry.flute_length

    def depth_step(self) -> dict[str, float | None]:
        """For a request: J or, without it, the flute length and the top of the stock (mm), each None where unknown.

        No pass is deeper in the stock than the cutting edge.  Source: CN105492980 [0010]: only the edge cuts, the shank
        above it does not.
        """
        word = self.length("j")
        if word is not None:
            return {"depth_step": word}
        flutes, top = self.flute_length(), known_stock.top(self.interp)
        if flutes is None or top is None:
            return {"depth_step": flutes}
        return {"depth_step": flutes, "stock_top": top - self.machine_point((0.0, 0.0, 0.0))[2]}

    def parameter(self, name: str) -> float | None:
        """A global named parameter, None where the program has not set it."""
        return named.value(self.interp, name)

    def chop_size(self) -> float:
        """H (mm): 0 with the word H0, else #<_chipwise_chop_size> in program units, else [CHIPWISE]CHOP_SIZE."""
        word = self.number("h")
        if word is not None:
            if word != 0:
                raise CycleError(
                    f"word H{word:g} is not H0", "H0 means do not chop; the chop size is #<_chipwise_chop_size>"
                )
            return 0.0
        size = self.parameter("_chipwise_chop_size")
        if size is None:
            return self.settings["CHOP_SIZE"]
        if not math.isfinite(size) or size < 0:
            raise CycleError(
                "chop size {h} is negative",
                "set #<_chipwise_chop_size> to 0 (never chop) or more",
                h=size * self.unit_mm,
            )
        return size * self.unit_mm

    def approach_angle(self) -> float:
        """Degrees to the work plane: #<_chipwise_approach_angle>, else [CHIPWISE]APPROACH_ANGLE."""
        return self._angle("approach")

    def ramp_angle(self) -> float:
        """Degrees of an entry: #<_chipwise_ramp_angle>, else [CHIPWISE]RAMP_ANGLE."""
        return self._angle("ramp")

    def seam_overlap(self) -> float:
        """How far a finished wall is run on over its start (mm): #<_chipwise_seam_overlap> in program units, else
        [CHIPWISE]SEAM_OVERLAP."""
        length, most = self.parameter("_chipwise_seam_overlap"), MAX_SEAM_OVERLAP
        if length is None:
            return self.settings["SEAM_OVERLAP"]
        if not 0.0 <= length * self.unit_mm <= most:
            raise CycleError(
                "seam overlap {o} is not a length from 0 to {most}",
                "set #<_chipwise_seam_overlap> to a length in that range",
                o=length * self.unit_mm,
                most=most,
            )
        return length * self.unit_mm

    def to_and_fro(self) -> bool:
        """Whether open paths of G77 may run in either direction: #<_chipwise_to_and_fro>, else [CHIPWISE]TO_AND_FRO."""
        value = self.parameter("_chipwise_to_and_fro")
        if value is None:
            return self.settings["TO_AND_FRO"]
        if value not in (0.0, 1.0):
            raise CycleError(
                f"#<_chipwise_to_and_fro> = {value:g} is neither 0 nor 1",
                "set it to 1 to rough open contours in both directions",
            )
        return value == 1.0

    def _angle(self, kind: str) -> float:
        """A named parameter from MIN_ANGLE to 90 degrees, or its INI default."""
        name = f"_chipwise_{kind}_angle"
        angle = self.parameter(name)
        if angle is None:
            return self.settings[f"{kind.upper()}_ANGLE"]
        if not MIN_ANGLE <= angle <= 90:
            raise CycleError(
                f"{kind} angle {angle:g} is not from {MIN_ANGLE:g} to 90 degrees",
                f"set #<{name}> to an angle in that range",
            )
        return angle

    def turns_clockwise(self) -> bool:
        """Whether the spindle turns as with M3; one that is off counts as M3."""
        params = self.interp.params
        return not params["_spindle_on"] or bool(params["_spindle_cw"])
