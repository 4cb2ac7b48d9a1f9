# SPDX-License-Identifier: GPL-2.0-or-later
"""Assumes the stock of the loaded program, in a process of its own: an order as JSON on standard input, the answer as
JSON on standard output.  Called by monitor/shadow.py.

    {"ini", "program", "scene"}     scene: loaded.scene()
    -> {"why": the reason for assuming no stock, "" with a stock or where the operator needs no word; "remedy";
        "asks_tool": whether a tool is what is missing; "low", "high": mm, work coordinates, null
        without a stock; "text": where it comes from, and its corners; "to_machine": [turn (rad), offset, G92 offset];
        "tools": {number: [diameter, corner radius (mm), tip angle (degrees)]} that only comments describe, "spindle":
        number or null}

Computing time and memory are limited, and LinuxCNC comes first.
"""

import json

from chipwise.check.assume import COMMENT, STOCK, TOOL, Unknown, assume, surveyed
from chipwise.check.asked import take_order
from chipwise.check.in_force import machine_in_force
from chipwise.program.program_file import Unreadable
from chipwise.program.reader import Reader
from chipwise.errors import CycleError, format_place, unnamed
from chipwise.host.temp_folder import OwnFolder

NICE = 10
CPU_S = 60
MEMORY_MB = 1000  # of this process, and of the one that reads
MOST_MOVES = 5_000_000
SILENT = {"why": "", "low": None}
REMEDIES = {STOCK: "define it with M250", TOOL: "call the tool with T.. M6 first, or give it a D in the tool table"}


def _tool(tool):
    """[diameter, corner radius, tip angle] of an AssumedTool."""
    shape = tool.geometry
    corner = 0.0 if shape is None else tool.diameter / 2 if shape.shape == "ball" else shape.corner_radius or 0.0
    return [tool.diameter, corner, (shape and shape.tip_angle) or 0.0]


def answer(order, folder):
    """-> the answer."""
    machine = machine_in_force(order["ini"], order["scene"], folder)
    if not machine.has_y:
        return SILENT  # a lathe
    survey = surveyed(
        Reader(order["program"], machine, cpu_s=CPU_S, most_moves=MOST_MOVES, memory_mb=MEMORY_MB), machine
    )
    if survey.has_stock:
        return SILENT
    if not survey.tools:
        return {"why": "it has no feed moves"}
    found = assume(survey, order["program"], machine)
    if found.low is None or found.high is None:  # it has no stock of its own, so it is assumed
        return SILENT
    frame = survey.first_frame or survey.frame
    source = "its comments" if found.source == COMMENT else "its path"
    text = (
        f"{source}, from {format_place(found.low, machine.unit)} to {format_place(found.high, machine.unit)} "
        f"{machine.unit}"
    )
    return {
        "why": "",
        "text": text,
        "low": found.low,
        "high": found.high,
        "to_machine": [frame.turn, frame.offset, frame.g92],
        "tools": {number: _tool(tool) for number, tool in found.tools.items()},
        "spindle": found.spindle,
    }


def main():
    order = take_order(NICE, 2 * MEMORY_MB)
    with OwnFolder("shadow") as folder:
        try:
            said = answer(order, folder)
        except Unknown as error:
            said = {
                "why": error.fact,
                "remedy": ", ".join(REMEDIES[about] for about in error.about),
                "asks_tool": TOOL in error.about,
            }
        except Unreadable as error:
            said = {"why": str(error).partition(";")[0]}
        except CycleError as error:
            said = {"why": unnamed(error)}
    print(json.dumps(said))


if __name__ == "__main__":
    main()
