# SPDX-License-Identifier: GPL-2.0-or-later
"""The result of a check of one program: figures of each tool, findings, load over time, pictures.

Made by simulate.py; read by cli/check.py and page.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from chipwise.check.drawing import Drawing
from chipwise.check.findings import OF_STOCK, Findings
from chipwise.errors import format_area, format_length, printable
from chipwise.tool_data.geometry import ToolGeometry

if TYPE_CHECKING:
    from chipwise.check.assume import Assumption
    from chipwise.check.findings import Finding
    from chipwise.check.survey import Survey


@dataclass
class ToolFigures:
    """One tool in one program; mm, mm3, s."""

    number: int
    diameter: float
    geometry: Optional[ToolGeometry] = None  # None: not described
    feed_s: float = 0.0  # at F and the rapid rate, no acceleration
    planned_s: float = 0.0  # with the machine's acceleration
    volumetric_s: float = 0.0  # with M251
    volumetric_planned_s: float = 0.0
    cutting_s: float = 0.0  # planned, while stock is removed
    volume: float = 0.0
    feed_volume: float = 0.0  # the same without what traverses remove
    peak_rate: float = 0.0  # mm3/min at F, over RATE_WINDOW_MM
    peak_chip: Optional[float] = None  # mm at F, over tooth_load.WINDOW_MM; None: not known
    peak_power: Optional[float] = None  # W
    power_limit: Optional[float] = None  # W, at the speed of the largest power
    peak_bending: Optional[float] = None  # mm
    rub_s: float = 0.0  # planned, with a largest chip below chip_least
    rub_line: int = 0
    depth: float = 0.0
    depth_line: int = 0
    depth_position: Optional[tuple] = None  # mm, work coordinates
    lowest: float = math.inf  # Z of the tip below the top of the stock
    reach: float = 0.0  # stick-out that is enough for any holder

    @property
    def mean_rate(self) -> float:
        """mm3/min of the feed moves that cut."""
        return self.feed_volume / self.cutting_s * 60.0 if self.cutting_s > 0 else 0.0

    def json(self) -> dict[str, Any]:
        """As in --json."""
        g = self.geometry or ToolGeometry()
        return {
            "tool": self.number,
            "diameter_mm": self.diameter,
            "shape": g.shape if self.geometry else None,
            "flute_length_mm": g.flute_length,
            "stick_out_mm": g.stick_out,
            "feed_s": self.feed_s,
            "planned_s": self.planned_s,
            "volumetric_s": self.volumetric_s,
            "volumetric_planned_s": self.volumetric_planned_s,
            "cutting_s": self.cutting_s,
            "volume_mm3": self.volume,
            "mean_rate_mm3_min": self.mean_rate,
            "peak_rate_mm3_min": self.peak_rate,
            "peak_chip_mm": self.peak_chip,
            "peak_power_w": self.peak_power,
            "peak_bending_mm": self.peak_bending,
            "rub_s": self.rub_s,
            "depth_mm": self.depth,
            "depth_line": self.depth_line,
            "depth_place": self.depth_position,
            "least_flute_length_mm": math.ceil(self.depth * 10 - 1e-6) / 10,
            "least_stick_out_mm": math.ceil(max(self.reach, self.depth) * 10 - 1e-6) / 10,
        }


@dataclass
class PartFigures:
    """What is left against the model of the part: mm and mm2, work coordinates; at: None without any."""

    model: str
    tolerance: float
    gouge: float
    gouge_at: Optional[tuple]
    gouge_area: float
    rest: float
    rest_at: Optional[tuple]
    rest_area: float

    def json(self) -> dict[str, Any]:
        """As in --json."""
        return {
            "model": self.model,
            "tolerance_mm": self.tolerance,
            "gouge_mm": self.gouge,
            "gouge_place": self.gouge_at,
            "gouge_mm2": self.gouge_area,
            "rest_mm": self.rest,
            "rest_place": self.rest_at,
            "rest_mm2": self.rest_area,
        }

    def said(self, unit: str) -> str:
        """One line for the operator."""

        def words(most: float, at: Sequence[float], area: float) -> str:
            place = " at X{} Y{} Z{}".format(*(format_length(round(v, 3), unit).split()[0] for v in at))
            return f"at most {format_length(round(most, 3), unit)}{place}, on {format_area(area, unit)}"

        gouge = f"gouged, {words(self.gouge, self.gouge_at, self.gouge_area)}" if self.gouge_at else "not gouged"
        rest = f"left on it {words(self.rest, self.rest_at, self.rest_area)}" if self.rest_at else "nothing left on it"
        return printable(f"part {self.model}: {gouge}; {rest} (tolerance {format_length(self.tolerance, unit)})")


@dataclass
class Result:
    """One program.  error: (text, line) if it cannot be checked, else None."""

    program: str
    error: Optional[tuple] = None
    state: str = ""  # of a program with an error: Unreadable.state
    unit: str = "mm"
    cell: float = 0.0
    moves: int = 0
    tools: dict = field(default_factory=dict)
    findings: Findings = field(default_factory=Findings)
    messages: list = field(default_factory=list)
    notes: list = field(default_factory=list)  # [line, text] about how it was judged
    load: Optional[tuple] = None  # (seconds of a bin, mm3/min) at F
    load_volumetric: Optional[tuple] = None  # the same with M251; None without
    drawing: Optional[Drawing] = None
    part: Optional[PartFigures] = None
    dwell_s: float = 0.0  # of G4; not in the times of the tools
    tool_changes: int = 0  # nor is the time that these take
    stock: Optional[tuple] = None  # (low, high, source) mm, work coordinates, of one that is assumed
    guessed: bool = False  # whether findings depend on a stock or a tool that nobody has confirmed
    extents: Optional[tuple] = None  # (low, high) mm, work coordinates, of the tips of feed moves

    @property
    def status(self) -> int:
        return 2 if self.error else 1 if self.findings.count else 0

    def assume(self, assumption: Assumption) -> None:
        """What was assumed (check/assume.py)."""
        if assumption.low:
            self.stock = assumption.low, assumption.high, assumption.source
        self.notes, self.guessed = [[0, text] for text in assumption.notes], assumption.guessed

    def is_assumed(self, finding: Finding) -> bool:
        """Whether a Finding depends on what is assumed."""
        return self.guessed and finding.rule in OF_STOCK

    def survey(self, survey: Survey) -> None:
        """What is known of a program that is not judged (check/survey.py)."""
        self.tools = {number: path.figures for number, path in survey.tools.items()}
        self.dwell_s, self.tool_changes, box = survey.dwell_s, survey.tool_changes, survey.extents()
        if box:
            self.extents = tuple(box.low.tolist()), tuple(box.high.tolist())

    def json(self) -> dict[str, Any]:
        """As in --json."""
        kept = self.findings
        return {
            "program": self.program,
            "status": self.status,
            "error": self.error and self.error[0],
            "error_line": self.error and self.error[1],
            "cell_mm": self.cell,
            "moves": self.moves,
            "dwell_s": self.dwell_s,
            "tool_changes": self.tool_changes,
            "tools": [t.json() for t in self.tools.values()],
            "findings": [{**f.json(), "assumed": self.is_assumed(f)} for f in kept.kept],
            "more_findings": kept.dropped,
            "messages": self.messages,
            "notes": self.notes,
            "stock": self.stock and {"min": self.stock[0], "max": self.stock[1], "source": self.stock[2]},
            "extents_mm": self.extents and {"min": self.extents[0], "max": self.extents[1]},
            "part": self.part and self.part.json(),
            "load": self.load and {"bin_s": self.load[0], "mm3_min": np.round(self.load[1], 1).tolist()},
            "load_volumetric": self.load_volumetric
            and {"bin_s": self.load_volumetric[0], "mm3_min": np.round(self.load_volumetric[1], 1).tolist()},
        }
