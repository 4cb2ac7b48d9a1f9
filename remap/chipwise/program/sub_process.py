# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs a sub in an interpreter of its own, for contour subs and for patterns.

Called by contour_sub/run.py and pattern/run.py; the other side is program/canon.py.
"""

import json
import math
import os
import signal
import subprocess
import time
from typing import NamedTuple

from chipwise.program import program_code
from chipwise.host.clock import patience
from chipwise.program.find_sub import o_word, sub_name
from chipwise.errors import MM_PER_INCH
from chipwise.host.temp_folder import OwnFolder, check_room, put, writing
from chipwise.host.processes import tree_cpu_s
from chipwise.settings import load_settings

PYTHON = "/usr/bin/python3"  # the interpreter LinuxCNC is built for
STUCK_S = 20.0  # a process that computes nothing for so long waits for something that never comes
BEGIN, END = "chipwise: sub begins", "chipwise: sub has ended"  # comments around the call


def decimal(value: float) -> str:
    """A number LinuxCNC reads: it knows no exponents, and no lines of more than 255 characters."""
    if value == 0 or 1e-3 <= abs(value) < 1e15:
        return f"{value:.12f}"
    mantissa, _, exponent = f"{value:.17e}".partition("e")
    return f"[{mantissa} * 10 ** {int(exponent)}]" if int(exponent) > 0 else f"[{mantissa} / 10 ** {-int(exponent)}]"


def assignments(named) -> list:
    """Lines that set named parameters ((name, value), ..); those that LinuxCNC itself keeps exist already, and may be
    read-only."""
    lines = []
    for number, (name, value) in enumerate(named):
        if math.isfinite(value):
            lines += [
                f"o<chipwise-{number}> if [EXISTS[#<{name}>] EQ 0]",
                f"#<{name}> = {decimal(value)}",
                f"o<chipwise-{number}> endif",
            ]
    return lines


def call_of(found, job, before, behind=(), axes="XYZ", turned=()) -> list:
    """Lines that call a sub from the position and in the modes of its Job.  before: lines for the modes; behind: those
    that need the position; axes: letters of the machine's axes; turned: (letter, degrees) of its rotary ones."""
    scale = 1.0 / (MM_PER_INCH if job.unit == "in" else 1.0)
    places = [(letter, value * scale) for letter, value in zip("XYZ", job.position) if letter in axes]
    place = " ".join(f"{letter}{decimal(value)}" for letter, value in [*places, *turned])
    modes = ("G91" if job.incremental else "G90") + (" G90.1" if job.ijk_absolute else " G91.1")
    return [
        *before,
        *assignments(job.named),
        f"G0 {place}",
        *behind,
        modes,
        f"({BEGIN})",
        f"o{sub_name(found)} call",
        f"({END})",
        "M2",
    ]


def own_code(found, job, ini):
    """As program/reader.py: Machine.own_code(), for a sub: only what itself executes counts; the machine executes the
    rest of the program.

    ini: text.  Python in subs that it calls in the same files is seen while it runs (program/canon.py)."""
    allowed, programs = load_settings(job.ini)["PROGRAM_PYTHON"] if job.ini else False, [found.path, *job.programs]
    places = program_code.Places.of(ini.splitlines(), os.getcwd())
    body = [(number, text.encode("utf-8", "surrogateescape")) for number, text in found.body]
    code = program_code.first_code(programs, places, False) or (
        None if allowed else program_code.first_code_of(body, found.path, places, programs)
    )
    if code:
        text, line = code.sentence(found.path)
        raise found.fault(line or found.first, text, code.remedy)
    return None if allowed else program_code.of_machine(ini.splitlines(), places, programs)


class Runner(NamedTuple):
    """The program that runs a sub.  path: of it; order: what it gets beside the common part; environment: variables."""

    path: str
    order: dict
    environment: dict = {}


def run_sub(found, job, runner, program, ini) -> dict:
    """What a Runner prints about a Found sub.  program: lines; ini: text.  Raises CycleError for a sub that does not
    end, that stops, or that the runner itself has found wrong."""
    order = {**runner.order, "own_code": own_code(found, job, ini)}
    with OwnFolder("sub") as folder:
        name = os.path.basename(found.path)
        with writing():
            os.mkdir(os.path.join(folder, "sub"))  # its name may be that of one of the other files
        contents = {
            os.path.join("sub", name if name.isprintable() else "sub.ngc"): "\n".join(program) + "\n",
            "machine.ini": ini,
            "machine.var": "".join(f"{n} {v!r}\n" for n, v in job.numbered) or "5161 0\n",
        }
        paths = [put(folder, name, text) for name, text in contents.items()]
        common = {
            "program": paths[0],
            "parameters": paths[2],
            "units_per_mm": 1.0 / job.machine_unit,
            "tool": job.tool,
            "block_delete": job.block_delete,
            "codes": ["G20" if job.unit == "in" else "G21", "G0"],
            "begin": BEGIN,
            "end": END,
        }
        process = subprocess.Popen(
            [PYTHON, "-s", runner.path, str(os.getpid())],
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, "HOME": folder, "INI_FILE_NAME": paths[1], "LC_ALL": "C", **runner.environment},
        )
        answer = answer_of(process, json.dumps({**common, **order}))
        check_room(folder, process.returncode)
    return _result(found, process.returncode, answer, order)


def _result(found, status, answer, order):
    """The result in what a runner printed.  Raises the CycleErrors of run_sub()."""
    if answer is None:
        raise found.fault(
            found.first,
            "the sub waits for a file that does not answer",
            "look at the files that it calls on the SUBROUTINE_PATH",
        )
    if status == -signal.SIGPROF:
        loops = [n for n, text in found.body if (o_word(text) or ("", ""))[1] in ("while", "do", "repeat", "call")]
        where = f" (loops and calls: line {', '.join(map(str, loops[:5]))})" if loops else ""
        raise found.fault(
            found.first,
            f"the sub does not end within {order['cpu_s']:g} s of computing time" + where,
            "correct the loop's condition, or make the sub simpler",
        )
    if status != 0:
        said = (answer[1].strip().splitlines() or [f"exit {status}"])[-1]
        raise found.fault(found.first, f"LinuxCNC's interpreter did not run it ({said})", "see whether `rs274` runs")
    result = json.loads(answer[0])
    if not (result["ended"] or result["stop"] or result["error"]):
        raise found.fault(
            result["line"] or found.first, "the program ends inside the sub", "take the M2 or M30 out of it"
        )
    return result


def answer_of(process, order: str):
    """(stdout, stderr) of a process that gets the order on stdin; None if it was given up: neither it nor its children
    computed anything for STUCK_S.  It limits its computing time itself."""
    had, since, rest = -1.0, time.monotonic(), [order]
    while True:
        try:
            return process.communicate(*rest, timeout=0.5)
        except subprocess.TimeoutExpired:
            rest = []  # communicate() keeps what is left of it
        now = tree_cpu_s(process.pid)
        if now != had:
            had, since = now, time.monotonic()
        elif time.monotonic() - since > patience(STUCK_S):
            process.kill()
            process.communicate()
            return None
