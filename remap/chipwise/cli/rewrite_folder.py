# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise rewrite with a folder: every program in it, into another folder under the same name.  Called by
rewrite.py."""

import os
import sys

from chipwise.options.machine import UsageError
from chipwise.options.machine import Progress
from chipwise.cli.output import write_whole
from chipwise.errors import printable, with_line

MAX_JOBS = 256


def check_options(options, refuse):
    """UsageError for what cannot be meant."""
    if options.scheduler is not None and options.jobs is not None:
        refuse("--jobs counts processes of this computer; leave it out with --scheduler")
    if options.jobs is not None and not 1 <= options.jobs <= MAX_JOBS:
        refuse(f"--jobs {options.jobs} is not from 1 to {MAX_JOBS}")
    if not os.path.isdir(options.program):
        if options.jobs is not None or options.scheduler is not None:
            refuse(
                f"--{'jobs' if options.scheduler is None else 'scheduler'} goes with a folder of programs; name the "
                f"folder, or leave it out"
            )
        return
    if os.path.exists(options.output) and not os.path.isdir(options.output):
        refuse(f"-o {options.output} is not a folder; name one for the new programs")
    if os.path.realpath(options.output) == os.path.realpath(options.program):
        refuse("-o is the folder of the programs; name another one")


def run(options, arguments, refuse):
    """-> exit status."""
    from chipwise.check.run import programs_of

    programs = programs_of([options.program])
    if not programs:
        refuse(f"there is no program (.ngc, .nc, .tap) in the folder {options.program}")
    try:
        os.makedirs(options.output, exist_ok=True)
    except OSError as error:
        refuse(f"-o {options.output}: {error.strerror}; name a folder that can be made")
    progress, status = Progress(sys.stderr), 0
    for _number, result in results_of(options, programs, progress, arguments):
        progress.clear()
        status = max(status, kept(os.path.join(options.output, os.path.basename(result.program)), result))
    progress.end()
    return status


def results_of(options, programs, progress, arguments):
    """Yield (number, Rewritten) of each program as it is ready."""
    from chipwise.batch.cluster import ClusterError, on_cluster
    from chipwise.batch.pool import on_processes
    from chipwise.rewrite.batch_job import failed, one

    if options.scheduler is None:
        yield from on_processes(options.jobs or os.cpu_count() or 1, one, programs, arguments, failed, progress)
        return
    try:
        yield from on_cluster(options.scheduler, "rewrite", programs, arguments, failed, progress)
    except ClusterError as error:
        raise UsageError(f"rewrite: {error}") from None


def kept(output, result):
    """Write a new program, and say so; -> its exit status."""
    error = result.error
    if not error:
        try:
            write_whole(output, result.data)
            print(printable(f"{output}: {result.said}"), flush=True)
            return 0
        except OSError as trouble:
            error = f"-o {output}: {trouble.strerror}; name a file in a folder of yours that has room", 0
    print(printable(f"chipwise: {result.program}: {with_line(*error)}"), file=sys.stderr, flush=True)
    return 2
