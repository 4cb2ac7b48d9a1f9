# SPDX-License-Identifier: GPL-2.0-or-later
"""What starting a sub in an interpreter of its own needs, for contour subs and for patterns.

Called by contour_sub/run.py and pattern/run.py; the other side is interpreter_process.py.
"""

import math
import subprocess
import time

from chipwise.processes import tree_cpu_s

PYTHON = "/usr/bin/python3"     # the interpreter LinuxCNC is built for
STUCK_S = 20.0                  # a process that computes nothing for so long waits for something that never comes


def decimal(value: float) -> str:
    """A number LinuxCNC reads: it knows no exponents, and no lines of more than 255 characters."""
    if value == 0 or 1e-3 <= abs(value) < 1e15:
        return f"{value:.12f}"
    mantissa, _, exponent = f"{value:.17e}".partition("e")
    return f"[{mantissa} * 10 ** {int(exponent)}]" if int(exponent) > 0 else f"[{mantissa} / 10 ** {-int(exponent)}]"


def assignments(named) -> list:
    """Lines that set named parameters ((name, value), ..); those that LinuxCNC itself keeps exist already, and may be read-only."""
    lines = []
    for number, (name, value) in enumerate(named):
        if math.isfinite(value):
            lines += [f"o<chipwise-{number}> if [EXISTS[#<{name}>] EQ 0]", f"#<{name}> = {decimal(value)}",
                      f"o<chipwise-{number}> endif"]
    return lines


def answer_of(process, order: str):
    """(stdout, stderr) of a process that gets the order on stdin; None if it was given up: neither it nor its children
    computed anything for STUCK_S.  It limits its computing time itself."""
    had, since, rest = -1.0, time.monotonic(), [order]
    while True:
        try:
            return process.communicate(*rest, timeout=0.5)
        except subprocess.TimeoutExpired:
            rest = []                       # communicate() keeps what is left of it
        now = tree_cpu_s(process.pid)
        if now != had:
            had, since = now, time.monotonic()
        elif time.monotonic() - since > STUCK_S:
            process.kill()
            process.communicate()
            return None
