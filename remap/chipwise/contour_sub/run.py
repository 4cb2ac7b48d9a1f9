# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a contour sub in a process of its own.  Called by read.py.

The file that holds the sub, with everything outside of sub definitions blanked so that line numbers stay, then the
caller's parameters and modes, then its call, go to a child process (runner.py) with LinuxCNC's own interpreter.  So
whatever LinuxCNC understands (expressions, loops, calls, subs in files of their own) is understood, and nothing the sub
does can hang or hurt the caller.  The child takes about 50 ms.

Departs from the call of a sub: what it assigns to parameters is gone afterwards.
"""

import os
import re
import time
from dataclasses import replace

from chipwise.contour_sub.check import check_text
from chipwise.program.find_sub import Found, plain_text, read_file, sub_folders
from chipwise.contour_sub.job import Job
from chipwise.program.program_code import PYTHON_REMEDY, RUNS_PYTHON
from chipwise.program.sub_process import Runner, call_of, decimal, run_sub

RUNNER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "runner.py")

CPU_S = 1.0  # computing time a sub may take, whatever else the machine does meanwhile, ..
LINE_S = 5e-5  # .. and more for each line of it: LinuxCNC reads 80,000 a second here
MAX_MOVES = 100_000  # moves of one sub; 20,000 elements are offset in half a second

_MARK = "chipwise: line "

_START = {
    False: re.compile(r"(n\d+)?(g40)?g0+(?=[xy])(?=.*x)(?=.*y)"),
    True: re.compile(r"(n\d+)?(g40)?g0+(?=[xz])(?=.*x)(?=.*z)"),
}


def relevant(job, found):
    """The job without what this sub cannot see, so that equal calls are equal jobs.

    A plain list of moves depends on units and modes, and on the position only where it does not begin with G0 X Y."""
    body = [plain_text(text) for _, text in found.body]
    if any("#" in text or "o" in text for text in body):
        return replace(job, program=found.path)
    if not job.incremental and _START[job.lathe].match(next((text for text in body if text), "")):
        job = replace(job, position=(0.0, 0.0, 0.0))
    return replace(job, numbered=(), named=(), feed=1000.0, tool=(0, 0.0), program=found.path)


def called_files(job, found):
    """((path, time of change), ..) of the files whose subs this one may call; something new every time where their
    names are expressions."""
    known, waiting = {}, [found.path]
    while waiting:
        read = read_file(waiting.pop())
        defined = {name for name, keyword in read[1].values() if keyword == "sub"}
        for name in {name for name, keyword in read[1].values() if keyword == "call"} - defined:
            for folder in sub_folders(job.ini):
                path = os.path.abspath(os.path.join(folder, name + ".ngc"))
                if read_file(path) and path not in known:
                    known[path] = os.stat(path).st_mtime_ns
                    waiting.append(path)
    if any(re.match(r"(n\d+)?o\[", plain_text(text)) for _, text in found.body):
        known[""] = time.monotonic_ns()
    return tuple(sorted(known.items()))


def run(found: Found, job: Job) -> list:
    """Moves of a found sub, as runner.py prints them."""
    check_text(found, job.lathe)
    order = {"mark": _MARK, "max_moves": MAX_MOVES, "cpu_s": _cpu_limit(found), "lathe": job.lathe}
    result = run_sub(found, job, Runner(RUNNER, order), _program(found, job), _ini_text(job.ini))
    last = result["moves"][-1][1] if result["moves"] else None
    for line, text in [end for end in (result["stop"], result["error"]) if end]:
        missing = re.search(r"EOF in file.*seeking o-word: o?<?(\w+)", text)
        text = f"there is no sub O{missing.group(1)}" if missing else text.rstrip(".")
        raise found.fault(
            line or found.first, text, PYTHON_REMEDY if text.endswith(RUNS_PYTHON) else "correct the line", last
        )
    return result["moves"]


def _program(found, job):
    """Lines for the runner: the sub definitions of the file, a mark before each line; the caller's state; the call."""
    lines, inside = [], None
    words = read_file(found.path)[1]
    for number, text in enumerate(found.lines, 1):
        word = words.get(number)
        if inside is None and word and word[1] == "sub":
            inside = word[0]
        if inside is not None:
            lines += [f"({_MARK}{number})", text]
        if word == (inside, "endsub"):
            inside = None
    feed = job.feed if job.feed > 0 else 1000.0
    modes = "G18 G8 " if job.lathe else "G17 "
    return lines + call_of(
        found, job, [modes + "G40 G90 G91.1 G94", f"F{decimal(feed)}"], ["G7"] if job.diameter else []
    )


_FOREIGN = re.compile(
    r"^\s*(REMAP|TOPLEVEL|PATH_PREPEND|PATH_APPEND|RS274NGC_STARTUP_CODE|ON_ABORT_COMMAND|"
    r"PARAMETER_FILE|LOG_LEVEL|USER_M_PATH)\s*=",
    re.IGNORECASE,
)


_PATHS = re.compile(r"^\s*(SUBROUTINE_PATH|PROGRAM_PREFIX|WIZARD_ROOT)\s*=", re.IGNORECASE)


def _ini_text(path):
    """The INI file as the runner may see it: without remaps, Python and start-up codes, ~ as it is here."""
    try:
        with open(path, encoding="utf-8", errors="surrogateescape") as file:
            lines = [line for line in file if not _FOREIGN.match(line)]
    except OSError:
        return "[RS274NGC]\n"
    home = os.path.expanduser("~")
    return "".join(
        re.sub(r"(?<=[=:\s])~(?=/|:|\s)", lambda m: home, line) if _PATHS.match(line) else line for line in lines
    )


def _cpu_limit(found):
    """Computing time (s) the sub may take."""
    return CPU_S + round(LINE_S * len(found.body), 1)
