# SPDX-License-Identifier: GPL-2.0-or-later
"""Cuts a program at its own F and makes the proposal of each tool.

Called by cli/setup.py, panel/set_up.py and time_process.py.  It is the simulation of chipwise check (check/simulate.py)
with another clock.  Besides the times at F it has those at the ceiling, which is a multiple of the F of each move
(moves down keep their F), and those with feeds above the stock as fast as the axes.  mm, s, mm3/min.
"""

from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from chipwise.check import blends
from chipwise.program import records
from chipwise.check.drawn_path import Path, Thinner
from chipwise.program.program_file import MAX_BYTES, Unreadable
from chipwise.check.answer import check
from chipwise.check.result import Result
from chipwise.check.simulate import Simulation
from chipwise.check.times import CONSTANT, OFF, Timer
from chipwise.check.tooth_rules import TOOTH_SLACK
from chipwise.setup.chip_ceiling import ceilings
from chipwise.setup.job import Job, digest_of
from chipwise.setup.rates import ToolLoad

SAME_Z = 1e-4  # mm: a retract plane at the clearance is clear of the stock
UPRIGHT = 0.999999  # of a move's length: what rises by more goes straight up
FALL = 1e-4  # of a move's length: what falls more goes down
LEAST_GAIN = 0.02  # of a tool's time at F; the estimate is not better than that
DRAWN_POINTS = 4000  # of a path in a picture
PROGRAM, OPTION = "program", "option"  # where a stock comes from, besides those of check/assume.py


@dataclass(frozen=True)
class Proposal:
    """One tool.  time_s with traverses; air_s: feeds that meet no stock; rate: the largest mean over 1 s sideways,
    mean: of all cutting; target: None:  F stays; ceiling: times the F of a move; time_air_s: time_with_s with feeds
    above the stock as fast as the axes; limited: whether the tool geometry's rate is the target; of_chip: whether its
    chip is the ceiling; longer: seconds that the rate would take, if it keeps F because that is longer; chip, power,
    bending: the largest at F, mm, W and mm, None: not known; chip_limit, power_limit, bending_limit: of the tool and
    the spindle, None: no limit."""

    number: int
    name: str
    diameter: float
    flutes: Optional[int]
    time_s: float
    air_s: float
    rate: float
    mean: float
    target: Optional[float]
    ceiling: float
    time_with_s: float
    time_air_s: float
    limited: bool = False
    of_chip: bool = False
    longer: Optional[float] = None
    chip: Optional[float] = None
    power: Optional[float] = None
    chip_limit: Optional[float] = None
    power_limit: Optional[float] = None
    bending: Optional[float] = None
    bending_limit: Optional[float] = None

    @property
    def slowed_by(self):
        """The limits that are exceeded at F, so that M251 and the set-up go below F there."""
        return [
            name
            for name, most, limit in (
                ("chip", self.chip, self.chip_limit),
                ("power", self.power, self.power_limit),
                ("bending", self.bending, self.bending_limit),
            )
            if most and limit and most > TOOTH_SLACK * limit
        ]

    def json(self):
        """As in --json."""
        return {
            "number": self.number,
            "name": self.name,
            "diameter": self.diameter,
            "flutes": self.flutes,
            "time_s": self.time_s,
            "air_s": self.air_s,
            "rate_mean_mm3_min": self.mean,
            "rate_1s_mm3_min": self.rate,
            "target_mm3_min": self.target,
            "ceiling": self.ceiling,
            "time_with_s": self.time_with_s,
            "time_air_s": self.time_air_s,
            "chip_mm": self.chip,
            "power_w": self.power,
            "chip_limit_mm": self.chip_limit,
            "power_limit_w": self.power_limit,
            "bending_mm": self.bending,
            "bending_limit_mm": self.bending_limit,
            "slowed_by": self.slowed_by,
        }


class SetupTimer(Timer):
    """The clock; the second time of each move is that at the ceiling, `share` times F, instead of that of M251, and a
    third one that of the axes where it stays above the stock or goes straight up: `clear_z` mm or more; end_z: of the
    last move of the next spend()."""

    def __init__(self, machine, share, of_chip):
        """of_chip: {tool number: times F}, in place of share."""
        super().__init__(machine)
        self.mode, self.share, self.of_chip = CONSTANT, share, of_chip
        self.loads, self.has_own_rate = {}, False
        self._down = self._above = np.zeros(0, bool)  # of the last part
        self._air = None
        self._speed_air = [0.0]
        self.clear_z, self.end_z = np.inf, 0.0

    def set_feed_mode(self, mode, target, lower, ceiling):
        """M251 of the program: it is seen, and what counts here is F."""
        self.has_own_rate = self.has_own_rate or int(mode) != OFF

    def spend(self, part, tool, stops=False):
        """As Timer.spend."""
        rise = part.steps[:, 2]
        self._down = rise < -FALL * part.length
        begin = self.end_z - np.cumsum(rise[::-1])[::-1]  # Z
        self._above = (np.minimum(begin, begin + rise) >= self.clear_z - SAME_Z) | (rise > UPRIGHT * part.length)
        rates = super().spend(part, tool, stops)
        if tool is not None:
            self.loads.setdefault(tool.number, ToolLoad()).add(
                part.cutting, self._down, part.length, part.volume, *self.seconds
            )
            self.loads[tool.number].add_air(part.cutting & self._above, *self.seconds, self._air)
        return rates

    def _plan_more(self, part, wanted, rapid_speed, accel, stops):
        asked = np.where(part.cutting & self._above, rapid_speed, wanted)
        self._air = self._planned(part, blends.moves(part, rapid_speed, accel), asked, accel, self._speed_air, stops)

    def _volumetric(self, moves, part, plain, tool):
        raised = np.where(self._down, plain, self.ceiling_of(tool.number if tool else 0) * plain)
        return raised if self.allowed is None else np.minimum(raised, self.allowed)  # as the machine will

    def ceiling_of(self, number):
        """Times F, of a tool."""
        return self.of_chip.get(number, self.share)


class SetupSimulation(Simulation):
    """A program under way, with the clock above."""

    timer: SetupTimer

    def __init__(self, case, cell, needles=None):
        super().__init__(case, cell, needles)
        of_chip = ceilings(case.program, case.tools, case.machine.unit_mm, MAX_BYTES)
        self.timer = SetupTimer(case.machine, self.settings["SETUP_CEILING"], of_chip)
        self.first_stock = None  # (low, high) mm, work coordinates
        self.thinner, self.first_frame = Thinner(DRAWN_POINTS), None

    def take(self, block, last=False):
        """As Simulation.take; keeps the path for a picture."""
        super().take(block, last)
        moves = block[block[:, 0] <= records.ARC]
        if len(moves) and self.first_frame is None:
            self.first_frame = self.frame
        self.thinner.add(moves[:, 2:5], moves[:, 0] == records.RAPID, moves[:, 1])

    def _take_moves(self, block, stops):
        self.timer.end_z = float(block[-1, 4])
        super()._take_moves(block, stops)

    def _define(self, line, values):
        super()._define(line, values)
        self.timer.clear_z = self.drawn.stock.z_max + self.settings["AIR_CLEARANCE"]
        if self.first_stock is None:
            low, high = np.array(values[2:5]), np.array(values[5:8])
            middle, half = np.array(self.frame.to_work((low + high) / 2)), (high - low) / 2
            self.first_stock = tuple(np.round(middle - half, 4).tolist()), tuple(np.round(middle + half, 4).tolist())

    def proposal(self, figures, name):
        """Proposal of a tool from its ToolFigures."""
        load, g = self.timer.loads[figures.number], figures.geometry
        rate = load.rate(figures.feed_volume)
        most = g.max_removal_rate if g else None
        target = min(rate, most or rate) if rate > 0 else None
        time_with = figures.planned_s
        if target:
            time_with = (
                figures.volumetric_planned_s - float(load.by_rate.seconds.sum()) + load.by_rate.with_target(target)
            )
        limited, longer = bool(target and target < rate), None
        if (
            target and time_with > (1.0 - LEAST_GAIN) * figures.planned_s and not limited
        ):  # time lost where it cuts more is not made good elsewhere
            target, longer, time_with = None, time_with, figures.planned_s
        ceiling = self.timer.ceiling_of(figures.number) if target else 1.0
        saved = load.air_saved_s if target else load.air_saved_at_f_s
        return Proposal(
            figures.number,
            name,
            figures.diameter,
            g.flutes if g else None,
            figures.planned_s,
            load.air_s,
            rate,
            figures.mean_rate,
            target,
            ceiling,
            time_with,
            time_with - max(0.0, saved),
            limited,
            bool(target and figures.number in self.timer.of_chip),
            longer,
            figures.peak_chip,
            figures.peak_power,
            *self._tooth_limits(figures),
        )

    def _tooth_limits(self, figures):
        """(mm, W, mm as it is, mm) of a tool: chip, power, bending; None where there is none."""
        tooth = self.teeth.tooth.get(figures.number)
        if tooth is None:
            return None, None, None, None
        return (
            tooth.chip if figures.peak_chip is not None else None,
            figures.power_limit,
            figures.peak_bending,
            tooth.bending,
        )


@dataclass
class Measured:
    """A program.  result: check's; stock: (low, high, source) mm, work coordinates of the first move, which frame has;
    digest: of the file as it was read; path: drawn_path.Path of at most DRAWN_POINTS points, or None."""

    result: Result
    digest: str = ""
    stock: Optional[tuple] = None
    tools: tuple = ()
    has_own_rate: bool = False
    path: Optional[Path] = None
    frame: records.Frame = records.Frame()

    @property
    def time_s(self):
        """At F, in all."""
        return sum(tool.time_s for tool in self.tools) + self.result.dwell_s

    @property
    def time_with_s(self):
        """Set up, in all."""
        return sum(tool.time_with_s for tool in self.tools) + self.result.dwell_s

    @property
    def time_air_s(self):
        """Set up, with feeds above the stock as fast as the axes, in all."""
        return sum(tool.time_air_s for tool in self.tools) + self.result.dwell_s

    def time_set_up_s(self, air):
        """Set up, in all; air: whether feeds above the stock are as fast as the axes."""
        return self.time_air_s if air else self.time_with_s


def _source(result, stock, first_stock):
    """Whence the first stock of a program is.  stock: the one that was given, or None."""
    if result.stock:
        return result.stock[2]
    if stock and (first_stock is None or np.allclose(np.concatenate(stock), np.concatenate(first_stock), atol=1e-3)):
        return OPTION
    return PROGRAM


@dataclass(frozen=True)
class Wanted:
    """What is asked for beside the program; as in a Job."""

    material: str = ""
    set_up: int = 0
    clamps: dict = field(default_factory=dict)

    def job(self):
        """A Job with nothing else."""
        return Job("", "", (), (), "", self.material, {}, False, self.set_up, self.clamps)


def measure(program, machine, names, stock=None, wanted=Wanted(), **arguments):
    """What was measured in a program.  names: {tool number: name}; stock, arguments: those of answer.check."""
    made: list = []
    job = wanted.job()

    def simulated(case, cell, needles):
        made[:] = [SetupSimulation(case, cell, needles)]
        return made[0]

    try:
        digest = digest_of(program)
    except OSError:
        digest = ""  # check says why
    result = check(
        program,
        machine,
        stock,
        assumes=True,
        simulated=simulated,
        confirmed=lambda _program, _settings: job,
        **arguments,
    )
    if result.error:
        return Measured(result)
    simulation = made[0]
    source = _source(result, stock, simulation.first_stock)
    if source != PROGRAM and simulation.carries_stock:
        line = next((line for line, text in result.notes if "(G38)" in text), 0)
        error = Unreadable(
            "the program probes its zero (G38), so only the machine knows where the stock lies",
            "define it with M250 behind the probing",
            line,
        )
        result.error = str(error), error.line
        return Measured(result)
    tools = tuple(
        simulation.proposal(figures, names.get(number, ""))
        for number, figures in result.tools.items()
        if number in simulation.timer.loads
    )
    return Measured(
        result,
        digest,
        (*simulation.first_stock, source),
        tools,
        simulation.timer.has_own_rate,
        simulation.thinner.path(),
        simulation.first_frame or simulation.frame,
    )
