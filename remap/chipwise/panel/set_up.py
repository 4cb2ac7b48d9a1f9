# SPDX-License-Identifier: GPL-2.0-or-later
"""The set-up of the loaded program for the page of `chipwise panel`: measures it, gives the tool's place as a corner of
the stock, and writes the job file that a person has confirmed.  Called by entry_process.py, in a process of its own.

    {"do": "measure", "ini", "stock": [x0, y0, z0, x1, y1, z1] mm or null, "material"}
        -> {"program", "path_of_program", "stock", "source", "tools", "notes", "findings", "own_m251", "dwell_s",
            "path": [[x, y, z, traverse], ..], "confirmed", "job", "frame", "clamps": [{"name", "seen": [shape, turn in
                                                    degrees, [x, y], [half x, half y]], "bottom", "top"}]} stock, path,
                                                    clamps: mm, work coordinates of the first move; job: the text that
                                                    "confirm" wants
    {"do": "corner", "frame"}                       frame: of the last measure, or null; -> {"corner": [x, y, z]}
    {"do": "confirm", "ini", "program", "job"}      -> {"file"}

It is what `chipwise setup` does: setup/measure.py, setup/confirmed.py.
"""

import math
import os
from typing import TYPE_CHECKING

from chipwise.clamps.clamp import Clamp
from chipwise.check.findings import grouped_notes
from chipwise.check.in_force import machine_in_force
from chipwise.program.program_file import Unreadable
from chipwise.program.records import Frame
from chipwise.errors import CycleError, printable, with_line
from chipwise.host.temp_folder import OwnFolder
from chipwise.panel import Json
from chipwise.settings import load_settings
from chipwise.setup import confirmed
from chipwise.setup import job as jobs
from chipwise.setup.measure import Measured, Wanted
from chipwise.setup.measure import measure as measured
from chipwise.tool_data.materials import find_material

if TYPE_CHECKING:  # entry_process.py imports this one
    from chipwise.panel.entry_process import Mdi

Corner = tuple[float, float, float]  # of a box, mm

CPU_S = 100


def _stock_of(order: Json) -> tuple[Corner, Corner] | None:
    """(lower corner, upper corner), or None if the program's own stock is asked for."""
    if not order["stock"]:
        return None
    x0, y0, z0, x1, y1, z1 = order["stock"]
    stock = (x0, y0, z0), (x1, y1, z1)
    if not all(b - a >= jobs.LEAST_MM for a, b in zip(*stock)):
        raise CycleError("the stock has no extent", "give its lower corner first, then its upper one")
    return stock


def measure(order: Json, machine: "Mdi") -> Json:
    """The answer to "measure"; machine: entry/mdi.py, or what a test has in its place."""
    program, scene = machine.read().program, machine.scene()
    if not program:
        raise CycleError("no program is loaded", "open one on LinuxCNC's screen")
    stock = _stock_of(order)
    settings = load_settings(order["ini"])
    if order["material"]:
        find_material(order["material"], settings.path("MATERIALS"))
    with OwnFolder("setup") as folder:
        try:
            loaded = machine_in_force(order["ini"], scene, folder)
            clamps = confirmed.clamps_before(jobs.path_of(program, settings.path("JOBS")), program)
            found = measured(
                program,
                loaded,
                confirmed.names(program, loaded),
                stock=stock,
                wanted=Wanted(order["material"], *clamps),
                cpu_s=CPU_S,
            )
        except Unreadable as error:
            raise CycleError(str(error).partition(";")[0], str(error).partition("; ")[2]) from error
    if found.result.error:
        text, line = found.result.error
        raise CycleError(with_line(text.partition(";")[0], line), text.partition("; ")[2] or "see chipwise check")
    air = settings["SETUP_AIR"]
    job = confirmed.job_of(program, found, order["material"], air, *clamps)
    before, _why = jobs.state_of(jobs.path_of(program, settings.path("JOBS")), program, found.digest)
    low, high, source = found.stock
    return {
        "path_of_program": program,
        "program": printable(os.path.basename(program)),
        "stock": [*low, *high],
        "source": source,
        "tools": [tool.json() | ({"time_with_s": tool.time_air_s} if air else {}) for tool in found.tools],
        "notes": [printable(text) for text in grouped_notes(found.result.notes)]
        + ["feeds above the stock are as fast as the axes (SETUP_AIR)"] * air,
        "findings": found.result.findings.count,
        "own_m251": found.has_own_rate,
        "dwell_s": found.result.dwell_s,
        "path": _drawn(found),
        "confirmed": before == jobs.as_written(job),
        "job": jobs.text_of(job),
        "frame": [found.frame.turn, list(found.frame.offset), list(found.frame.g92)],
        "clamps": [_seen(clamp, found.frame) for clamp in job.obstacles(settings.path("CLAMPS"), found.frame)],
    }


def _seen(clamp: Clamp, frame: Frame) -> Json:
    """A Clamp of the machine, in work coordinates."""
    here = clamp.seen_from(frame.to_machine((0.0, 0.0, 0.0)), math.degrees(frame.turn))
    half = [(b - a) / 2 for a, b in zip(here.low[:2], here.high[:2])]
    return {
        "name": printable(clamp.name),
        "seen": [here.shape, here.turn, [float(value) for value in here.middle], half],
        "bottom": float(here.bottom),
        "top": float(here.top),
    }


def _drawn(found: Measured) -> list[list[float]]:
    """Points of the path, work coordinates of the first move."""
    if found.path is None:
        return []
    x, y, z = found.frame.to_work(found.path.points.astype(float).T)
    return [[round(a, 3), round(b, 3), round(c, 3), int(d)] for a, b, c, d in zip(x, y, z, found.path.rapid)]


def corner(order: Json, machine: "Mdi") -> Json:
    """The answer to "corner": where the tip of the tool is."""
    frame = order["frame"] and Frame(order["frame"][0], tuple(order["frame"][1]), tuple(order["frame"][2]))
    return {"corner": [round(float(value), 4) for value in machine.tip(frame)]}


def confirm(order: Json, machine: "Mdi") -> Json:
    """The answer to "confirm"; only at rest: a new set-up would end the one that is in force."""
    state = machine.read()
    if not (state.idle and state.at_rest):
        raise CycleError(
            "the set-up is not confirmed: a program or a command is under way, or the machine moves",
            "wait for its end, or press Stop",
        )
    if state.program != order["program"]:
        raise CycleError("the set-up is not confirmed: another program is loaded", "look at the set-up of that one")
    path = jobs.path_of(order["program"], load_settings(order["ini"]).path("JOBS"))
    confirmed.write(path, order["program"], jobs.of_text(order["job"]))
    return {"file": printable(os.path.basename(path))}
