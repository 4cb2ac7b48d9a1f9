# SPDX-License-Identifier: GPL-2.0-or-later
"""What a person confirms: the Job of a measured program, and its file.  Called by cli/setup.py and panel/set_up.py;
this is the one way to a job file."""

from chipwise.program import post_comments
from chipwise.errors import CycleError
from chipwise.setup import job as jobs
from chipwise.setup.job import digest_of
from chipwise.tool_data.table import remarks


def names(program, machine):
    """{tool number: name}: of the tool table, else of the program's comments."""
    try:
        said = post_comments.read(program, machine.unit_mm).tools
    except OSError:  # whoever reads the program says why
        said = {}
    return {number: tool.name for number, tool in said.items() if number is not None and tool.name} | remarks(
        machine.table
    )


def job_of(program, measured, material, air=False, set_up=0, clamps=None):
    """jobs.Job of a measure.Measured.  air: whether feeds above the stock are to be as fast as the axes; set_up,
    clamps: as in a Job."""
    low, high, source = measured.stock
    return jobs.Job(
        jobs.name_of(program),
        measured.digest,
        tuple(low),
        tuple(high),
        source,
        material,
        {tool.number: jobs.JobTool(tool.diameter, tool.target, tool.ceiling) for tool in measured.tools},
        bool(air),
        set_up,
        clamps or {},
    )


def clamps_before(path, program):
    """(set_up, clamps) that were confirmed for a program, perhaps as it was before; 0, {} without any."""
    try:
        found = jobs.read(path)
    except CycleError:
        return 0, {}
    return (found.set_up, found.clamps) if found.program == jobs.name_of(program) else (0, {})


def write(path, program, job):
    """Write the file of a job.  Raises CycleError, also if the program is not what was measured any more."""
    try:
        digest = digest_of(program)
    except OSError:
        digest = ""
    if digest != job.digest:
        raise CycleError("the program was changed while it was read", "set it up again")
    jobs.write(path, job)
