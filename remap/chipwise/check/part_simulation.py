# SPDX-License-Identifier: GPL-2.0-or-later
"""A check that ends with a comparison of what is left and a model of the part.  Called by cli/check.py, through
check/run.py."""

import os
from dataclasses import dataclass

from chipwise.check.culprit import Culprit
from chipwise.check.findings import GOUGE, Finding
from chipwise.check.part import compared
from chipwise.program.records import Frame
from chipwise.check.result import PartFigures
from chipwise.check.simulate import Simulation
from chipwise.errors import CycleError, format_length
from chipwise.surface.model import Placing, read_model

TOLERANCE_MM = 0.05
MOST_TRIANGLES = 1_000_000  # two minutes and half a gigabyte, if nothing is cut at all


@dataclass(frozen=True)
class PartOrder:
    """path: of the model; placing: in work coordinates of the first move; tolerance: mm.  Called as a Simulation is, it
    makes one of its own."""

    path: str
    placing: Placing
    tolerance: float = TOLERANCE_MM

    def __call__(self, *arguments, **more):
        return PartSimulation(self, *arguments, **more)


class PartSimulation(Simulation):
    """A program under way, and the part."""

    def __init__(self, order, *arguments, **more):
        super().__init__(*arguments, **more)
        self._again, self._gouge = arguments, None
        self._order, self._model = (
            order,
            read_model(order.path, order.placing),
        )  # before the program is read: it may take long
        if len(self._model.triangles) > MOST_TRIANGLES:
            raise CycleError(
                f"the part has {len(self._model.triangles)} triangles, more than {MOST_TRIANGLES}",
                "export it with a larger tolerance",
            )

    def finish(self, messages, notes):
        """-> the Result, with the part."""
        result, order = super().finish(messages, notes), self._order
        frame = result.drawing.frame or Frame()
        found = compared(self.map, self._model, frame, order.tolerance)
        result.notes = [*result.notes, *([0, note] for note in self._model.notes)]
        if found.beyond > order.tolerance:
            result.notes.append(
                [
                    0,
                    f"the part reaches {format_length(round(found.beyond, 3), result.unit)} out of the stock: what is "
                    f"there is not judged",
                ]
            )

        def at(deviation):
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

    def second_look(self):
        """For the move that has gouged the part -> (Culprit, what takes its result); None without a gouge."""
        if self._gouge is None:
            return None
        program, machine, _cell, settings, tools, _needles, assumption = self._again

        def name(found):
            if found:
                self._gouge.line, self._gouge.tool = found
                self._gouge.last_line = self._gouge.line

        return Culprit(self._gouge.machine, self.stock_number, program, machine, settings, tools, assumption), name
