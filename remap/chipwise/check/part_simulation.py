# SPDX-License-Identifier: GPL-2.0-or-later
"""A check that ends with a comparison of what is left and a model of the part.  Called by cli/check.py, through
check/run.py."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chipwise.check.culprit import Culprit
from chipwise.check.findings import GOUGE, Finding
from chipwise.check.part import compared
from chipwise.program.records import Frame
from chipwise.check.result import PartFigures
from chipwise.check.simulate import Simulation
from chipwise.errors import CycleError, format_length
from chipwise.surface.model import Placing, read_model

if TYPE_CHECKING:
    from chipwise.check.part import Deviation
    from chipwise.check.result import Result
    from chipwise.check.simulate import Case
    from chipwise.clib.arrays import Floats

TOLERANCE_MM = 0.05
MOST_TRIANGLES = 1_000_000  # two minutes and half a gigabyte, if nothing is cut at all


@dataclass(frozen=True)
class PartOrder:
    """path: of the model; placing: in work coordinates of the first move; tolerance: mm.  Called as a Simulation is, it
    makes one of its own."""

    path: str
    placing: Placing
    tolerance: float = TOLERANCE_MM

    def __call__(self, case: Case, cell: float, needles: dict[int, Floats] | None = None) -> PartSimulation:
        return PartSimulation(self, case, cell, needles)


class PartSimulation(Simulation):
    """A program under way, and the part."""

    def __init__(self, order: PartOrder, case: Case, cell: float, needles: dict[int, Floats] | None) -> None:
        super().__init__(case, cell, needles)
        self._case, self._order = case, order
        self._gouge: Finding | None = None
        self._model = read_model(order.path, order.placing)  # before the program is read: it may take long
        if len(self._model.triangles) > MOST_TRIANGLES:
            raise CycleError(
                f"the part has {len(self._model.triangles)} triangles, more than {MOST_TRIANGLES}",
                "export it with a larger tolerance",
            )

    def finish(self, messages: list[list[int | str]], notes: list[list[int | str]]) -> Result:
        """-> the Result, with the part."""
        result, order = super().finish(messages, notes), self._order
        frame = self.drawn.frame or Frame()
        found = compared(self.drawn.stock, self._model, frame, order.tolerance)
        result.notes = [*result.notes, *([0, note] for note in self._model.notes)]
        if found.beyond > order.tolerance:
            result.notes.append(
                [
                    0,
                    f"the part reaches {format_length(round(found.beyond, 3), result.unit)} out of the stock: what is "
                    f"there is not judged",
                ]
            )

        def at(deviation: Deviation) -> tuple[float, ...] | None:
            return tuple(map(float, frame.to_work(deviation.at))) if deviation.at else None

        result.part = PartFigures(
            os.path.basename(order.path),
            order.tolerance,
            found.gouge.most,
            at(found.gouge),
            found.gouge.area,
            found.rest.most,
            at(found.rest),
            found.rest.area,
        )
        if found.gouge.at:
            self._gouge = Finding(
                GOUGE,
                0,
                0,
                0,
                at(found.gouge),
                found.gouge.most,
                order.tolerance,
                at=self.segments,
                machine=found.gouge.at,
            )
            result.findings.add(self._gouge)
        return result

    def second_look(self) -> tuple[Simulation, Callable[[], None]] | None:
        """For the move that has gouged the part; None without a gouge."""
        gouge = self._gouge
        if gouge is None or gouge.machine is None:
            return None
        culprit = Culprit(gouge.machine, self.stock_number, self._case)
        return culprit, functools.partial(_name, gouge, culprit)


def _name(gouge: Finding, culprit: Culprit) -> None:
    """Give a finding the move that has made it, if that was found."""
    if culprit.found:
        gouge.line, gouge.tool = culprit.found
        gouge.last_line = gouge.line
