# SPDX-License-Identifier: GPL-2.0-or-later
"""The part of a simulation that judges chip, power and side force of the edges.  Called by simulate.py, whose
Simulation it is a part of."""

import numpy as np

from chipwise.check.findings import BENDING, CHIP, POWER
from chipwise.check.times import OFF
from chipwise.check.tooth_load import Limits
from chipwise.errors import format_length

TOOTH_SLACK = 1.1  # the arc of a cut is known to some per cent (tooth_load.py)
LEAST_RUB_S = 0.5  # what a tool rubs as it enters and leaves is not spoken of
RUBS = (
    "tool {number} rubs for {seconds:.1f} s, its largest chip is below chip_least {least}; take wider cuts, or raise F"
)


class ToothRules:
    """tooth: {tool number: ToothLoad or None}; turns: S, 1/min."""

    def begin_tooth(self, program, settings, material):
        """Before the first record."""
        self.limits, self.tooth, self.turns = Limits(program, settings, material), {}, 0.0

    def tooth_notes(self):
        """[[line, text]] of what is not judged, and of tools that rub."""
        rubs = [
            [
                tool.rub_line,
                RUBS.format(
                    number=tool.number,
                    seconds=tool.rub_s,
                    least=format_length(tool.geometry.chip_least, self.result.unit),
                ),
            ]
            for tool in self.result.tools.values()
            if tool.rub_s >= LEAST_RUB_S
        ]
        return self.limits.notes + rubs

    def _tooth_loads(self, part, depth):
        """tooth_load.Loads of a PathPart, None where nothing limits; the timer gets what they allow.  depth (n,): mm,
        None: nothing is cut."""
        self.timer.allowed = None
        if depth is None or self.tool is None:
            return None
        cuts, tooth = part.cutting, self.tooth.get(self.tool.number)
        if cuts.any() and part.volume.any():
            self.limits.unknown(self.tool.number, int(part.lines[cuts][0]), self.tool.geometry, self.turns)
        if tooth is None or not self.turns > 0:
            return None
        loads = tooth.loads(part.steps, part.length, part.volume, depth.astype(np.float64), cuts)
        self.timer.allowed = tooth.allowed(loads, self.turns)
        return loads

    def _check_tooth(self, loads, length, block):
        """Largest chip, power and bending at F, and findings where they are above the limits."""
        if loads is None or not loads.sound.any():
            return
        tool, tooth = self.tool, self.tooth[self.tool.number]
        speed = np.where(
            loads.sound, np.minimum(block[:, 5] / 60.0, length / np.maximum(self.timer.seconds[0], 1e-12)), 0.0
        )
        chips, powers = tooth.chips(loads, speed, self.turns), tooth.powers(loads, speed, self.turns)
        tool.peak_chip = max(tool.peak_chip or 0.0, float(chips.max()))
        limit = tooth.power_limit(self.turns) or None
        if tooth.material and (tool.peak_power is None or powers.max() > tool.peak_power):
            tool.peak_power, tool.power_limit = float(powers.max()), limit
        bendings = tooth.bendings(loads, speed, self.turns)
        if tooth.bending:
            tool.peak_bending = max(tool.peak_bending or 0.0, float(bendings.max()))
        self._rub(loads, length, block[:, 1])
        if self.timer.mode != OFF:
            return
        met = np.zeros(len(chips), [("at", "<f4")])
        met["at"] = 1.0
        for rule, values, most in (
            (CHIP, chips, tooth.own_chip),
            (POWER, powers, limit),
            (BENDING, bendings, tooth.bending),
        ):
            if most:
                self._find(rule, values > TOOTH_SLACK * most, values, most, block[:, 2:5], block[:, 1].astype(int), met)

    def _rub(self, loads, length, lines):
        """The time with a largest chip below the smallest one of the tool, at F or with the M251 in force."""
        least, seconds = self.tool.geometry.chip_least, self.timer.seconds[0 if self.timer.mode == OFF else 1]
        if least:
            chips = self.tooth[self.tool.number].chips(loads, length / np.maximum(seconds, 1e-12), self.turns)
            rubs = loads.sound & (chips < least)
            self.tool.rub_line = self.tool.rub_line or int(lines[rubs][0]) if rubs.any() else self.tool.rub_line
            self.tool.rub_s += float(seconds[rubs].sum())
