# SPDX-License-Identifier: GPL-2.0-or-later
"""The clamps that a cycle keeps clear of: those of M256, of the CLAMP comments of the program, and of the set-up that
is confirmed for it.

Called by plans.py.  mm, work coordinates.

 1. They follow from the text of the program, its job file, the work offsets and the M256 that was executed: so a
    preview and the machine have the same ones.
 2. Comments count for the whole program, also for cycles in front of them, as before the realtime guard
    (monitor/comment_clamps.py).
 3. M256 of the program takes the place of its set-up's clamps and of the comments in front of it.
 4. Where the text does not say in which coordinates they are (program/clamp_places.py), the cycle knows nothing of
    them, and a note says why.
"""

import math
import os
from functools import lru_cache

from chipwise.clamps import comment as comments
from chipwise.clamps import set_ups
from chipwise.clamps.clamp import Clamp
from chipwise.clib.height_map import Shape
from chipwise.cycles.obstacles import Obstacles
from chipwise.cycles.plan import Note
from chipwise.errors import MM_PER_INCH, CycleError, braceless, unnamed
from chipwise.host.files import read_bytes
from chipwise.program.clamp_places import files_of_subs, has_word, places_of
from chipwise.program.loaded import identity
from chipwise.program.program_file import MAX_BYTES
from chipwise.program.records import Frame
from chipwise.setup import job as jobs
from chipwise.tool_data.geometry import ToolGeometry, tool_geometry

_told = set()  # notes that have been said: (path, identity, line)


def in_force(asked):
    """(Obstacles or None, notes) of a ClampsAsked.  Raises CycleError for a set-up that is not there, and for a comment
    that is wrong."""
    clamps = list(set_ups.clamps_of(asked.file, asked.set_up) if asked.set_up else ())
    notes: list = []
    if asked.program:
        _add_of_program(asked, clamps, notes)
    if not clamps:
        return None, notes
    here = Frame(*asked.now[2])
    origin = here.to_machine((0.0, 0.0, 0.0))
    seen = tuple(clamp.seen_from(origin, math.degrees(here.turn)) for clamp in clamps)
    shape = Shape.of_tool(asked.diameter, tool_geometry(*asked.geometry) or ToolGeometry())
    return Obstacles(seen, asked.clearance, shape, asked.limits), notes


def _add_of_program(asked, clamps, notes):
    """Those of the set-up, and of the comments."""
    path = jobs.path_of(asked.program, asked.jobs)
    job = (
        None if asked.since else _job(asked.program, identity(asked.program), path, identity(path, follow_links=False))
    )
    if job and job.set_up:
        clamps += set_ups.clamps_of(asked.file, job.set_up)
    of_job = list(job.clamps.values()) if job else []
    found = _places(asked.program, identity(asked.program), asked.ini, bool(of_job))
    for place in found.places if found else ():
        if place.line < asked.since or not place.line and not of_job:
            continue
        own = of_job if not place.line else []
        why = found.unknown(place, asked.line)
        if why:
            _note(asked.program, place, why, notes)
            continue
        frame = _frame(asked, place.system)
        clamps += [clamp.on_machine(frame) for clamp in own or [_of_comment(place, asked)]]


def _of_comment(place, asked):
    """A Clamp, work coordinates of the comment."""
    try:
        low, high, shape = comments.read(place.inside, MM_PER_INCH if (place.units or asked.now[0]) == "in" else 1.0)
    except CycleError as error:
        raise CycleError(braceless(f"line {place.line}: {unnamed(error)}")) from error
    return Clamp(shape, 0.0, tuple(low), tuple(high), f"the clamp of line {place.line}")


def _frame(asked, system):
    return Frame(*(asked.now[2] if system in (None, asked.now[1]) else asked.systems[system - 1]))


def _note(path, place, why, notes):
    key = path, identity(path), place.line
    if key not in _told:
        _told.add(key)
        whose, why = (
            f"the clamp of line {place.line} is" if place.line else "the clamps of the program's set-up are",
            braceless(why),
        )
        notes.append(
            Note(
                f"{whose} not known to the cycles: {why}; say units and coordinates in front of it and keep them; the "
                f"machine stops before it comes too near",
                {},
            )
        )


@lru_cache(maxsize=4)
def _job(program, _identity, path, _job_identity):
    """The Job of a program, None without one that is confirmed for it."""
    if not os.path.lexists(path):
        return None
    try:
        return jobs.state_of(path, program, jobs.digest_of(program))[0]
    except (OSError, ValueError):
        return None


@lru_cache(maxsize=4)
def _places(program, _identity, ini, of_job):
    """The ClampPlaces of a program, None if it has none.  of_job: whether its set-up has some."""
    if not (of_job or has_word(program)):
        return None
    try:
        text = read_bytes(program, MAX_BYTES)
    except OSError:
        return None
    lost = comments.lost(text)
    if lost:
        raise CycleError(f"line {lost[0]}: {lost[1]}", "give it a line of its own")
    return places_of(text, files_of_subs(ini))
