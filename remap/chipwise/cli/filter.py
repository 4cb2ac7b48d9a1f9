# SPDX-License-Identifier: GPL-2.0-or-later
"""Check a program while it is opened in LinuxCNC's GUI, and rewrite it if the INI file asks for it.

For the section [FILTER] of an INI file:

    PROGRAM_EXTENSION = .nc,.NC,.tap,.TAP G-code, checked
    nc = chipwise filter

The program goes to standard output, byte for byte if it needs no change; what is to be said of it goes to the
operator's screen.  Settings are FILTER_TIME, FILTER_REFUSE, FILTER_REWRITE, FILTER_RATE and FILTER_CEILING in
[CHIPWISE].

Exit status: 0 the program is opened, 1 it has findings and is not opened, 2 it cannot be used and is not opened.
"""

import ctypes
import os
import signal
import sys
import time

from chipwise.options.machine import add_ini, ini_of, refuser
from chipwise.errors import CycleError
from chipwise.host.temp_folder import OwnFolder
from chipwise.host.processes import PR_SET_PDEATHSIG
from chipwise.settings import load_settings, parse_settings

NAME = "filter"
HELP = "check and rewrite a program while a GUI opens it"

refuse = refuser(NAME)


def add_arguments(parser):
    parser.add_argument("program", metavar="PROGRAM", help="G-code file")
    add_ini(parser)
    parser.error = refuse


def run(options):
    """-> exit status."""
    from chipwise.filter.screen import Screen

    started = time.monotonic()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)  # when the GUI ends
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, ended)
    output = own_output()
    ini = ini_of(options)
    try:
        settings = load_settings(ini)
    except CycleError:  # work.py says so
        settings = parse_settings({})
    screen = Screen(ini, os.environ)
    with OwnFolder(NAME) as folder:
        verdict = verdict_of(options.program, ini, settings, folder, started + settings["FILTER_TIME"], screen)
        deliver(output, options.program, verdict)
    screen.tell(options.program, verdict)
    return verdict.status


def ended(number, _frame):
    """A signal: nothing is opened."""
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)


def own_output():
    """A handle of standard output for the program alone; whatever else is printed goes nowhere."""
    null = os.open(os.devnull, os.O_RDWR)
    try:
        output = os.dup(1)
    except OSError:  # it was closed
        output = os.dup(null)
    os.dup2(null, 1)
    os.set_inheritable(output, False)
    return output


def verdict_of(program, ini, settings, folder, deadline, screen):
    """-> the Verdict, with `found`: the os.stat_result of the file it is about."""
    from chipwise.filter.process import Work

    try:
        found = os.stat(program)
    except (OSError, ValueError):
        found = None
    work = Work(program, ini, settings, folder)
    try:
        verdict = work.verdict(deadline, screen.progress)
    finally:
        work.end()
    verdict.judged = found
    return verdict


def deliver(output, program, verdict):
    """The program to the GUI, if the verdict lets it; one that cannot be written whole changes the verdict."""
    from chipwise.filter import verdict as verdicts
    from chipwise.filter.program_out import Changed, put_program

    if verdict.status != verdicts.OPENED:
        return
    try:
        if verdict.path:
            put_program(output, verdict.path)
        else:
            put_program(output, program, verdict.judged)
        return
    except Changed:
        refused = verdicts.not_opened("it has changed while it was checked; open it again")
    except OSError as error:
        refused = verdicts.not_opened(f"{error.strerror} where the GUI keeps a copy of it; make room there")
    verdict.status, verdict.notes, verdict.more = refused.status, refused.notes, []
