# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads the job file of the loaded program, in a process of its own: an order as JSON on standard input, the answer as
JSON on standard output.  Called by monitor/set_up.py.

    {"ini", "program", "job", "scene"}      job: path of its file; scene: loaded.scene()
    -> {"why": the reason for not using it, or ""; "low", "high": mm, work coordinates of the first move; "to_machine":
        [turn (rad), offset, G92 offset] of those, null if the program defines its stock itself; "text": the corners;
        "material": its name, or ""; "clamps": [[shape, turn (degrees), low, high, name]] mm, machine coordinates;
        "tools": {number: [diameter (mm), target (mm3/min) or null, ceiling]}, "air": whether feeds above the stock may
        be as fast as the axes, "keeps_f": the code of the program with which the feed never rises above F, or ""}

The program is read up to its first move only.  Computing time and memory are limited, and LinuxCNC comes first.
"""

import json

from chipwise.check.survey import Survey
from chipwise.check.asked import reasoned, take_order
from chipwise.check.in_force import machine_in_force
from chipwise.program.program_file import MAX_BYTES
from chipwise.program.reader import Reader
from chipwise.errors import format_place, unnamed
from chipwise.settings import load_settings, planner_limits_jerk
from chipwise.setup import keeps_feed
from chipwise.setup.job import digest_of, state_of
from chipwise.setup.measure import PROGRAM

NICE = 10
CPU_S = 60
MEMORY_MB = 1000  # of this process, and of the one that reads
MOST_MOVES = 5_000_000


def _frame(program, machine):
    """The coordinates of a program's first move, and those in force if it has none."""
    survey = Survey(machine)
    with Reader(program, machine, cpu_s=CPU_S, most_moves=MOST_MOVES, memory_mb=MEMORY_MB) as reader:
        for block in reader:
            survey.take(block)
            if survey.first_frame:
                break
    return survey.first_frame or survey.frame


def answer(order, folder):
    """-> the answer."""
    try:
        digest = digest_of(order["program"])
    except OSError as error:
        return {"why": f"the program cannot be read: {error.strerror}"}
    job, why = state_of(order["job"], order["program"], digest)
    if job is None:
        return {"why": unnamed(why) if why else "it is not there any more"}
    if planner_limits_jerk(order["ini"]):
        return {"why": "LinuxCNC's planner of [TRAJ]PLANNER_TYPE = 1 leaves the path where the feed changes"}
    machine = machine_in_force(order["ini"], order["scene"], folder)
    if not machine.has_y:
        return {"why": "this machine is a lathe"}
    first = _frame(order["program"], machine) if job.source != PROGRAM or job.clamps else None
    frame = None if job.source == PROGRAM else first
    clamps = job.obstacles(load_settings(order["ini"]).path("CLAMPS"), first)
    return {
        "why": "",
        "material": job.material,
        "low": job.low,
        "high": job.high,
        "to_machine": frame and [frame.turn, frame.offset, frame.g92],
        "text": f"from {format_place(job.low, machine.unit)} to {format_place(job.high, machine.unit)} {machine.unit}",
        "tools": {number: [tool.diameter, tool.target, tool.ceiling] for number, tool in job.tools.items()},
        "clamps": [clamp.row for clamp in clamps],
        "air": job.air and not keeps_feed.code_of(order["program"], order["ini"], MAX_BYTES, keeps_feed.FEEDS_OUT),
        "keeps_f": keeps_feed.code_of(order["program"], order["ini"], MAX_BYTES),
    }


def main():
    order = take_order(NICE, 2 * MEMORY_MB)
    print(json.dumps(reasoned(answer, order, "job")))


if __name__ == "__main__":
    main()
