# SPDX-License-Identifier: GPL-2.0-or-later
"""A model, a job file or a drawing that is opened in the GUI -> a program, as `chipwise surface` and `chipwise import`
make it.

Called by process.py, in a process of its own.

 1. part.toml is a job file (options/surface_job.py).
 2. part.stl with a part.toml beside it is that job.
 3. part.stl alone is one cut with the tool in the spindle: a step-over of STEP_SHARE of its diameter, lowest safe
    links, the defaults of `chipwise surface` for all else.  A message says with what.
 4. part.dxf and part.svg become a program of contour subs, which the preview shows and which moves nothing.
"""

import argparse
import os

from chipwise.filter import verdict as verdicts
from chipwise.host.temp_folder import FolderError, put

DRAWINGS = (".dxf", ".svg")
ENDINGS = (".stl", ".toml", *DRAWINGS)
TOLERANCE_MM = 0.01  # of a drawing, as in `chipwise import`
STEP_SHARE = 0.1  # of the tool's diameter


def is_model(path):
    """Whether a file is one of these, by its name: LinuxCNC chooses the filter so, too."""
    return path.lower().endswith(ENDINGS)


def made(path, ini, folder, progress):
    """Verdict of a model or job file.

    folder: for the program; progress(share): called.
    """
    if path.lower().endswith(DRAWINGS):
        return _drawing(path, folder)
    from chipwise.options.machine import UsageError
    from chipwise.options.machine import refuser
    from chipwise.options.surface_job import NAME, check_options
    from chipwise.options.surface_job import message_of
    from chipwise.options.surface_program import planned, program_text, unit_of
    from chipwise.errors import CycleError, unnamed

    unit = unit_of(argparse.Namespace(ini=ini))
    try:
        cuts, how = _cuts(path, ini)
        for cut in cuts:
            check_options(cut)
        parts = planned(cuts, refuser(NAME), progress)
        text = program_text(parts)
    except (CycleError, UsageError) as error:
        return verdicts.not_opened(message_of(error, unit))
    try:
        program = put(folder, "surface.ngc", text)
    except FolderError as error:
        return verdicts.not_opened(unnamed(error))
    verdict = verdicts.Verdict(path=program)
    notes = [unnamed(CycleError(note.text, **note.lengths).text(unit)) for part in parts for note in part.plan.notes]
    for note in dict.fromkeys(notes):
        verdict.note(note, True)
    tools = ", ".join(f"tool {part.options.tool}: {part.plan.cuts} cuts" for part in parts)
    verdict.note(f"it is made into a program ({tools}){how}; look at it before you start it")
    return verdict


def _drawing(path, folder):
    """Verdict of a drawing."""
    from chipwise.errors import CycleError, unnamed
    from chipwise.importing.run import imported
    from chipwise.importing.sub import program

    try:
        found = imported(path, TOLERANCE_MM, 1.0)
        text, numbers = program(found, os.path.basename(path), TOLERANCE_MM)
        made_path = put(folder, "imported.ngc", text)
    except (CycleError, FolderError) as error:
        return verdicts.not_opened(unnamed(error))
    verdict = verdicts.Verdict(path=made_path)
    for word in found.words:
        verdict.note(word, found.doubtful)
    subs = ", ".join(f"O{number}" for own in numbers.values() for _, number in own[:1])
    verdict.note(f"it is shown as contour subs ({subs}) and moves nothing; `chipwise import` makes a file of them")
    return verdict


def _cuts(path, ini):
    """(options of each cut, what the operator should know of them)."""
    from chipwise.options.surface_job import job_defaults
    from chipwise.options.surface_job import ENDING, is_job, read_job

    stem = os.path.splitext(path)[0]
    job = path if is_job(path) else stem + ENDING
    if is_job(path) or os.path.exists(job):
        cuts, how = read_job(job, job_defaults()), "" if job == path else f" by {os.path.basename(job)}"
    else:
        tool, diameter = _tool_in_spindle(ini, os.path.basename(job))
        cuts = [
            argparse.Namespace(
                **{**job_defaults(), "model": path, "tool": tool, "step": STEP_SHARE * diameter, "link": 1}
            )
        ]
        how = (
            f", step-over {STEP_SHARE:g} of its diameter; a job file {os.path.basename(job)} beside it says it "
            f"otherwise"
        )
    for cut in cuts:
        cut.ini = ini
    return cuts, how


def _tool_in_spindle(ini, job):
    """(number, diameter in machine units).  Raises CycleError."""
    from chipwise.program.reader import Machine, Unreadable
    from chipwise.errors import CycleError, braceless
    from chipwise.filter.work import spindle_tool
    from chipwise.tool_data.table import diameter_of

    try:
        machine = Machine(ini)
    except Unreadable as error:
        raise CycleError(braceless(str(error)), "correct the configuration") from error
    tool = spindle_tool()
    if tool <= 0:
        raise CycleError(
            "no tool is in the spindle to cut the model with",
            f"load one, or write a job file {braceless(job)} beside it",
        )
    return tool, diameter_of(machine.table, tool)
