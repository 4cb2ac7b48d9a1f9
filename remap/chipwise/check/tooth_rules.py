# SPDX-License-Identifier: GPL-2.0-or-later
"""The part of a simulation that judges chip, power and side force of the edges.  Called by simulate.py."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chipwise.check.findings import BENDING, CHIP, POWER
from chipwise.check.times import OFF
from chipwise.check.tooth_load import Limits
from chipwise.errors import format_length

if TYPE_CHECKING:
    from chipwise.clib.arrays import Bools, Floats
    from chipwise.check.path_part import PathPart
    from chipwise.check.result import ToolFigures
    from chipwise.check.times import Timer
    from chipwise.check.tooth_load import Loads, ToothLoad
    from chipwise.settings import Settings
    from chipwise.tool_data.geometry import ToolGeometry

TOOTH_SLACK = 1.1  # the arc of a cut is known to some per cent (tooth_load.py)
LEAST_RUB_S = 0.5  # what a tool rubs as it enters and leaves is not spoken of
RUBS = (
    "tool {number} rubs for {seconds:.1f} s, its largest chip is below chip_least {least}; take wider cuts, or raise F"
)


@dataclass(frozen=True)
class LoadedPart:
    """Moves of a tool that has limits.  length (n,): mm; allowed (n,): mm/s that the limits allow."""

    tool: ToolFigures
    tooth: ToothLoad
    loads: Loads
    length: Floats
    allowed: Floats


class ToothRules:
    """tooth: {tool number: ToothLoad or None}; turns: S, 1/min."""

    def __init__(self, program: str, settings: Settings, material: str) -> None:
        self.limits = Limits(program, settings, material)
        self.tooth: dict[int, ToothLoad | None] = {}
        self.turns = 0.0

    def add_tool(self, number: int, diameter: float, geometry: ToolGeometry | None) -> None:
        """A tool that is used.  diameter: mm, 0: not known."""
        self.tooth[number] = self.limits.of_tool(diameter, geometry) if diameter > 0 else None

    def notes(self, tools: Iterable[ToolFigures], unit: str) -> list[list[int | str]]:
        """[[line, text]] of what is not judged, and of tools that rub."""
        rubs: list[list[int | str]] = [
            [
                tool.rub_line,
                RUBS.format(
                    number=tool.number, seconds=tool.rub_s, least=format_length(tool.geometry.chip_least, unit)
                ),
            ]
            for tool in tools
            if tool.rub_s >= LEAST_RUB_S and tool.geometry and tool.geometry.chip_least
        ]
        return self.limits.notes + rubs

    def loaded(self, part: PathPart, tool: ToolFigures | None, depth: Floats | None) -> LoadedPart | None:
        """What loads the edges in a PathPart, None where nothing limits.  depth (n,): mm, None: nothing is cut."""
        if depth is None or tool is None:
            return None
        cuts, tooth = part.cutting, self.tooth.get(tool.number)
        if cuts.any() and part.volume.any():
            self.limits.unknown(tool.number, int(part.lines[cuts][0]), tool.geometry, self.turns)
        if tooth is None or not self.turns > 0:
            return None
        loads = tooth.loads(part.steps, part.length, part.volume, depth.astype(np.float64), cuts)
        return LoadedPart(tool, tooth, loads, part.length, tooth.allowed(loads, self.turns))

    def judged(self, part: LoadedPart, timer: Timer, block: Floats) -> Iterator[tuple[str, Bools, Floats, float]]:
        """Largest chip, power and bending at F -> (rule, whether it is broken (n,), values (n,), limit) of each limit
        that counts.  timer: which has spent the part; block: its records."""
        tool, tooth, loads = part.tool, part.tooth, part.loads
        if not loads.sound.any():
            return
        speed = np.where(
            loads.sound, np.minimum(block[:, 5] / 60.0, part.length / np.maximum(timer.seconds[0], 1e-12)), 0.0
        )
        chips, powers = tooth.chips(loads, speed, self.turns), tooth.powers(loads, speed, self.turns)
        tool.peak_chip = max(tool.peak_chip or 0.0, float(chips.max()))
        limit = tooth.power_limit(self.turns) or None
        if tooth.material and (tool.peak_power is None or powers.max() > tool.peak_power):
            tool.peak_power, tool.power_limit = float(powers.max()), limit
        bendings = tooth.bendings(loads, speed, self.turns)
        if tooth.bending:
            tool.peak_bending = max(tool.peak_bending or 0.0, float(bendings.max()))
        self._rub(part, timer, block[:, 1])
        if timer.mode != OFF:
            return
        for rule, values, most in (
            (CHIP, chips, tooth.own_chip),
            (POWER, powers, limit),
            (BENDING, bendings, tooth.bending),
        ):
            if most:
                yield rule, values > TOOTH_SLACK * most, values, most

    def _rub(self, part: LoadedPart, timer: Timer, lines: Floats) -> None:
        """The time with a largest chip below the smallest one of the tool, at F or with the M251 in force."""
        tool, least = part.tool, part.tooth.least_chip
        seconds = timer.seconds[0 if timer.mode == OFF else 1]
        if least:
            chips = part.tooth.chips(part.loads, part.length / np.maximum(seconds, 1e-12), self.turns)
            rubs = part.loads.sound & (chips < least)
            tool.rub_line = tool.rub_line or int(lines[rubs][0]) if rubs.any() else tool.rub_line
            tool.rub_s += float(seconds[rubs].sum())
