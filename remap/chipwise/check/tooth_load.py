# SPDX-License-Identifier: GPL-2.0-or-later
"""The largest chip, the power and the side force of each move, as a check can tell them: from the section and the depth
that a move meets.

Called by tooth_rules.py.  Source: M. E. Martellotti, Trans. ASME 63 (1941): h = fz sin phi; O. Kienzle, VDI-Z 94
(1952): F = kc11 b h^(1 - mc).

 1. The share e = section / (largest section at that depth) is read as one arc from one side: cos phi = 1 - 2 e.  The
    chip is fz sin phi, and fz from half the diameter on.  Where stock is met in two arcs or in stairs this is up to 40
    % off; the machine reads the arcs themselves (components/core/tooth.h).
 2. Power is kc11 z n fz^(1 - mc) A_mc with A_mc, the integral of sin^(1 - mc) over the arc and the depth.
 3. The side force is RADIAL kc11 fz^(1 - mc) times the largest vector sum of all edges over a turn, each with sin^(1 -
    mc) over its length in the stock; of the walls only: the forces on the end of a tool that falls cancel each other.
 4. On the way down the end cuts: its chip is fz times the fall, and times the sine of half the tip angle where the end
    is a point.
 5. Sections are means over WINDOW_MM of path, since the cells give the volume of short moves in lumps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from chipwise.tool_data.bending import RADIAL, lacking, largest_force, stiffness
from chipwise.tool_data.chip_loads import chip_limit
from chipwise.errors import CycleError, unnamed
from chipwise.tool_data.materials import find_material, material_of_file
from chipwise.settings import spindle_limit

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.settings import Settings
    from chipwise.tool_data.geometry import ToolGeometry
    from chipwise.tool_data.materials import Material

WINDOW_MM = 4.0
LEAST_AREA = 1e-3  # mm2: less is air
STEPS = 256  # of the tables
UNBENT = "the bending of tool {number} is not judged: its {what} is not known; add it to its tool geometry"
UNFORCED = (
    "the bending of tool {number} is not judged: no material is known; add (MATERIAL,NAME=6061), or set "
    "[CHIPWISE]MATERIAL"
)
NOT_JUDGED = "chip and power of tool {number} are not judged: {what} not known"


def half_width(diameter: float, geometry: ToolGeometry, height: Floats) -> Floats:
    """(n,) mm: the tool's radius at heights (n,) above its tip."""
    radius, g = diameter / 2.0, geometry
    corner = radius if g.shape == "ball" else min(g.corner_radius or 0.0, radius)
    flat = max(radius - corner, 0.0)
    if g.shape in ("vee", "tapered-ball") and g.tip_angle:
        slope = math.tan(math.radians(g.tip_angle) / 2.0)
        half = math.radians(g.tip_angle) / 2.0
        begin = corner * (1.0 - math.sin(half))  # of the cone above a ball
        cone = corner * math.cos(half) + (height - begin) * slope
        low = np.sqrt(np.clip(corner**2 - (corner - height) ** 2, 0.0, None))
        return np.minimum(np.where(height < begin, low, cone), radius)
    low = np.sqrt(np.clip(corner**2 - (corner - np.minimum(height, corner)) ** 2, 0.0, None))
    return flat + low


def sums_of_edges(share: Floats, edges: int, exponent: float) -> Floats:
    """(n,) largest vector sums over a turn of `edges` edges in stock of 1 mm, met in one arc from one side that is
    `share` (n,) of the diameter wide."""
    phi = np.radians(
        np.arange(0.0, 360.0, 360.0 / (edges * max(1, 720 // edges)))
    )  # from beside the path on the side of the stock
    one = np.clip(np.sin(phi), 0.0, None) ** exponent * np.exp(1j * phi)
    met = phi[None, :] <= np.arccos(1.0 - 2.0 * np.clip(share, 0.0, 1.0))[:, None] + 1e-9
    return np.abs(np.where(met, one, 0.0).reshape(len(share), edges, -1).sum(axis=1)).max(axis=1)


class Profile:
    """A tool's largest section and steepest edge up to a depth, in tables."""

    def __init__(self, diameter: float, geometry: ToolGeometry, mc: float = 0.0) -> None:
        self.radius = diameter / 2.0
        self.top = 2.0 * diameter
        self.height = np.linspace(0.0, self.top, 4 * STEPS)
        width = half_width(diameter, geometry, self.height)
        step = self.height[1]
        self.area = np.concatenate(([0.0], np.cumsum((width[1:] + width[:-1]) * step)))
        slope = np.diff(width, append=width[-1]) / step
        self.edge = np.concatenate(
            ([0.0], np.cumsum((1.0 + slope[:-1] ** 2) ** (0.5 * mc) * step))
        )  # of a wall, over its (n . d)^(1 - mc)
        self.lean = np.maximum.accumulate(1.0 / np.sqrt(1.0 + slope**2))  # n . d of a wall, over that of its heading
        self.lean[-1] = 1.0
        is_point = geometry.shape in ("vee", "tapered-ball") and not geometry.corner_radius
        tip = geometry.tip_angle if is_point else None
        self.end = math.sin(math.radians(tip) / 2.0) if tip else 1.0  # n . d of a plunge

    def length(self, depth: Floats) -> Floats:
        """mm of edge, weighted as `edge`."""
        return np.interp(depth, self.height, self.edge) + np.maximum(depth - self.top, 0.0)

    def section(self, depth: Floats) -> Floats:
        """mm2 of a full slot."""
        return np.interp(depth, self.height, self.area) + np.maximum(depth - self.top, 0.0) * 2.0 * self.radius


class Loads:
    """Of n moves.  chip: over the feed per tooth; power_area: A_mc, mm2; side: of the side force, mm; sound: whether
    the window is long enough to be judged."""

    def __init__(self, chip: Floats, power_area: Floats, side: Floats, sound: Bools) -> None:
        self.chip, self.power_area, self.side, self.sound = chip, power_area, side, sound


class ToothLoad:
    """The limits of one tool in one program.  chip: mm, chip_load of the tool or the default; own_chip: chip_load;
    least_chip: chip_least; settings: for what the spindle gives; material: materials.Material; each None where not
    known."""

    def __init__(
        self,
        diameter: float,
        geometry: ToolGeometry,
        material: Material | None,
        settings: Settings,
        chip: float | None = None,
    ) -> None:
        if not geometry.flutes:
            raise ValueError("a tool of which the flutes are not known has no limits")
        self.profile, self.flutes = Profile(diameter, geometry, material.mc if material else 0.0), geometry.flutes
        self.own_chip, self.least_chip = geometry.chip_load, geometry.chip_least
        self.stiffness = (
            stiffness(diameter, geometry.stick_out, geometry.material) if geometry.deflection and material else 0.0
        )
        self.bending = geometry.deflection if self.stiffness else None  # mm
        self.chip = self.own_chip or chip
        self.material, self.settings = material, settings
        self._kc11 = material.kc11 if material else 0.0
        exponent = 1.0 - (material.mc if material else 0.0)
        phi = (np.arange(8 * STEPS) + 0.5) * math.pi / (8 * STEPS)
        total = np.concatenate((np.zeros(1), np.cumsum(np.sin(phi) ** exponent) * math.pi / (8 * STEPS)))
        share = np.linspace(0.0, 1.0, STEPS)
        self._share, self._sums, self.exponent = (
            share,
            np.interp(np.arccos(1.0 - 2.0 * share), np.linspace(0.0, math.pi, 8 * STEPS + 1), total),
            exponent,
        )
        self._sides = sums_of_edges(share, self.flutes, exponent) if self.bending else np.zeros(STEPS)

    def loads(self, steps: Floats, length: Floats, volume: Floats, depth: Floats, cuts: Bools) -> Loads:
        """Loads of moves: steps (n, 3), length, depth mm, volume mm3, cuts (n,): feeds that are judged."""
        number = np.floor(np.cumsum(length) / WINDOW_MM).astype(int)
        first = np.flatnonzero(np.diff(number, prepend=-1))
        number = np.cumsum(np.diff(number, prepend=-1) > 0) - 1
        distance = np.add.reduceat(np.where(cuts, length, 0.0), first)[number]
        area = np.add.reduceat(np.where(cuts, volume, 0.0), first)[number] / np.maximum(distance, 1e-9)
        deepest = np.maximum.reduceat(np.where(cuts, depth, 0.0), first)[number]
        fall = np.clip(-steps[:, 2] / np.maximum(length, 1e-12), 0.0, 1.0)
        level = np.sqrt(np.clip(1.0 - fall**2, 0.0, 1.0))
        end = np.minimum(fall * math.pi * self.profile.radius**2, area)
        share = np.clip((area - end) / np.maximum(level * self.profile.section(deepest), 1e-9), 0.0, 1.0)
        lean = np.interp(deepest, self.profile.height, self.profile.lean)
        chip = level * lean * np.where(share < 0.5, 2.0 * np.sqrt(share * (1.0 - share)), 1.0)
        walls = 0.5 * level * self.profile.section(deepest) * np.interp(share, self._share, self._sums)
        face = self.profile.end * fall
        power_area = walls + end * np.maximum(face, 1e-6) ** (self.exponent - 1.0)
        side = self.profile.length(deepest) * level**self.exponent * np.interp(share, self._share, self._sides)
        met = cuts & (area > LEAST_AREA)
        return Loads(
            np.where(met, np.maximum(chip, np.where(end > 0.0, face, 0.0)), 0.0),
            np.where(met, power_area, 0.0),
            np.where(met, side, 0.0),
            met & (distance > WINDOW_MM / 2),
        )

    def chips(self, loads: Loads, speed: Floats, turns: float) -> Floats:
        """(n,) mm at speeds (n,) mm/s and `turns` 1/min."""
        return loads.chip * speed * 60.0 / (self.flutes * turns)

    def powers(self, loads: Loads, speed: Floats, turns: float) -> Floats:
        """(n,) W; 0 without a material."""
        if not self.material:
            return np.zeros(len(speed))
        edges = self.flutes * turns / 60.0
        return self._kc11 * edges * (speed / edges) ** self.exponent * loads.power_area / 1000.0

    def bendings(self, loads: Loads, speed: Floats, turns: float) -> Floats:
        """(n,) mm that the tool bends by; 0 where it is not known."""
        if not self.bending:
            return np.zeros(len(speed))
        return (
            RADIAL * self._kc11 * (speed * 60.0 / (self.flutes * turns)) ** self.exponent * loads.side / self.stiffness
        )

    def power_limit(self, turns: float) -> float:
        """W that the spindle gives at a speed, 1/min; 0: no limit, or no material."""
        return spindle_limit(self.settings, turns) if self.material else 0.0

    def allowed(self, loads: Loads, turns: float) -> Floats:
        """(n,) mm/s: the largest speeds within the limits; inf where nothing limits."""
        edges, most = self.flutes * turns / 60.0, np.full(len(loads.chip), np.inf)
        with np.errstate(divide="ignore", over="ignore"):
            if self.chip:
                most = self.chip * edges / loads.chip
            limit = self.power_limit(turns)
            if limit:
                most = np.minimum(
                    most, edges * (limit * 1000.0 / (self._kc11 * edges * loads.power_area)) ** (1.0 / self.exponent)
                )
            if self.bending:
                most = np.minimum(
                    most,
                    edges
                    * (self.bending * self.stiffness / (RADIAL * self._kc11 * loads.side)) ** (1.0 / self.exponent),
                )
        return most


class Limits:
    """The limits of the tools of a program.  material: a name, that of its set-up; "": none."""

    def __init__(self, program: str, settings: Settings, material: str = "") -> None:
        self.settings = settings
        self.material: Material | None = None
        self.notes: list[list[int | str]] = []
        try:
            own = settings.path("MATERIALS")
            found = self.material = material_of_file(program, settings["MATERIAL"], own, material)
            if found and material and find_material(material, own).name != found.name:
                self.notes.append(
                    [
                        0,
                        f"the comment of the program names {found.name}, so the material {material} of its "
                        f"set-up does not count",
                    ]
                )
        except CycleError as error:
            self.notes.append([0, unnamed(error)])
        if (settings["SPINDLE_POWER"] or settings["SPINDLE_TORQUE"]) and not self.material and not self.notes:
            self.notes.append(
                [
                    0,
                    "the power is not judged: no material is known; add (MATERIAL,NAME=6061), or set "
                    "[CHIPWISE]MATERIAL",
                ]
            )

    def of_tool(self, diameter: float, geometry: ToolGeometry | None) -> ToothLoad | None:
        """A ToothLoad, or None where nothing limits the tool."""
        chip = chip_limit(diameter, geometry, self.material, self.settings)
        if (
            not geometry
            or not geometry.flutes
            or not (
                chip
                or self.material
                and largest_force(diameter, geometry)
                or self.material
                and (self.settings["SPINDLE_POWER"] or self.settings["SPINDLE_TORQUE"])
            )
        ):
            return None
        return ToothLoad(diameter, geometry, self.material, self.settings, chip)

    def unknown(self, number: int, line: int, geometry: ToolGeometry | None, turns: float) -> None:
        """Note once what a limit of a tool lacks."""
        what = lacking(geometry)
        if what or geometry and geometry.deflection and not self.material:
            self._note(line, UNBENT.format(number=number, what=what) if what else UNFORCED.format(number=number))
        if not geometry or not geometry.chip_load or geometry.flutes and turns > 0:
            return
        self._note(
            line, NOT_JUDGED.format(number=number, what="the spindle speed is" if geometry.flutes else "its flutes are")
        )

    def _note(self, line: int, text: str) -> None:
        if all(text != said for _line, said in self.notes):
            self.notes.append([line, text])
