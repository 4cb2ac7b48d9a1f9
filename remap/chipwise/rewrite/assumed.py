# SPDX-License-Identifier: GPL-2.0-or-later
"""Rewriting a program that names no stock or no tool: on what check/ assumes, too (check/assume.py), as far as that is
safe.

Called by run.py.  The true stock may be larger than an assumed one, and the true tool another than that of a comment.
So

 1. no F is raised: a cut that looks light may be a heavy one;
 2. no flutes are respected: the new traverses would be laid over a stock that nobody has named.  A program whose flutes
    are long enough stays.

What the user names is not assumed.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

from chipwise.check.assume import assume, surveyed
from chipwise.program.reader import Reader, Unreadable
from chipwise.errors import format_length
from chipwise.rewrite import depth_proof, read_back

if TYPE_CHECKING:
    from chipwise.check.assume import Assumption, Named
    from chipwise.program.reader import Limits, Machine
    from chipwise.rewrite.run import Job
    from chipwise.tool_data.geometry import ToolGeometry

NEVER_RAISED = "no F is raised, because nobody has confirmed that"


def assumed(path: str, machine: Machine, line: int, named: Named, limits: Limits) -> Assumption:
    """Assumption for a program that cannot be cut in `line`; named: by the user.  Raises Unknown."""
    few = {key: value for key, value in limits.items() if key in ("cpu_s", "quiet_s", "memory_mb")}
    survey = surveyed(Reader(path, machine, None, **few), machine)
    return assume(survey, path, machine, line, named)


def machine_with(machine: Machine, assumption: Assumption) -> Machine:
    """A reader.Machine with the tools of an Assumption."""
    result = copy.copy(machine)
    result.diameters = {number: tool.diameter for number, tool in assumption.tools.items()}
    result.spindle = assumption.spindle
    return result


def geometry_with(geometry: dict[int, ToolGeometry], assumption: Assumption) -> dict[int, ToolGeometry]:
    """{number: ToolGeometry} with the tools of an Assumption: a number's own counts if it is that tool's."""
    result = dict(geometry)
    for number, tool in assumption.tools.items():
        described = result.pop(number, None)
        described = tool.described and described or tool.geometry
        if described is not None:
            result[number] = described
    return result


def keep_flutes(job: Job) -> tuple[bytes, str]:
    """The program's own bytes and what is said, if its flutes are long enough; else Unreadable [2]."""
    found = depth_proof.too_deep(job.program, job.geometry, job.cell, read_back.OVER_MM)
    if found:
        worst = max(found, key=lambda witness: witness.depth - witness.tool.flutes)
        unit = job.reads.machine.unit
        raise Unreadable(
            f"tool {worst.tool.number} cuts {format_length(round(worst.depth, 3), unit)} deep in the assumed stock, "
            f"its flutes are "
            f"{format_length(worst.tool.flutes, unit)} long, and no traverse is laid over a stock or beside a "
            f"tool that nobody has confirmed",
            "name the stock with --stock, the tool with --tool and its diameter",
            worst.line,
        )
    return job.program.content(), "the flutes are long enough everywhere in it, the program is unchanged"
