# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's `halcmd` from Python: commands, pins and components.

Called by the command line tool, the monitor and the headless display.  HAL's own Python module cannot connect pins of
other components.
"""

import re
import subprocess
from typing import Sequence

from chipwise.errors import CycleError, braceless

ARROWS = ("==>", "<==", "<=>")


def attempt(*words: str) -> subprocess.CompletedProcess:
    """One halcmd command in script form, also a failing one -> CompletedProcess."""
    return subprocess.run(
        ["halcmd", "-s", *words],
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def halcmd(*words: str) -> str:
    """One halcmd command -> what it printed.  Raises CycleError with what it said."""
    done = attempt(*words)
    if done.returncode:
        said = braceless((done.stdout + done.stderr).strip())
        raise CycleError(f"halcmd {braceless(' '.join(words))}: {said}", "see the lines above")
    return done.stdout


def halcmds(*commands: Sequence[str]) -> None:
    """Several commands in one halcmd, up to the first that fails.  Raises CycleError with that command and what halcmd
    said."""
    script = "".join(" ".join(words) + "\n" for words in commands)
    done = subprocess.run(
        ["halcmd", "-s", "-f"], text=True, check=False, input=script, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    if done.returncode:
        said = (done.stdout + done.stderr).strip()
        line = re.search(r"^<stdin>:(\d+):", said, re.MULTILINE)
        words = commands[int(line[1]) - 1] if line else commands[0]
        raise CycleError(f"halcmd {braceless(' '.join(words))}: {braceless(said)}", "see the lines above")


def getp(pin: str) -> str:
    """The value of a pin or parameter as text, "" if there is none."""
    return attempt("getp", pin).stdout.strip()


def pins(start: str = "") -> dict[str, tuple[str, str]]:
    """{pin: (arrow, signal)} of the pins in HAL whose names begin with `start`; ("", "") if one is on no signal."""
    found = {}
    for line in halcmd("show", "pin", *([start] if start else [])).splitlines():
        words = line.split()
        if len(words) >= 5:
            found[words[4]] = (words[5], words[6]) if len(words) >= 7 and words[5] in ARROWS else ("", "")
    return found


def signal_of(pin: str) -> str:
    """Name of the signal a pin is on, "" if it is on none."""
    return pins(pin).get(pin, ("", ""))[1]


def components() -> dict[str, int]:
    """{name: PID} of the user space components in HAL; the PID of a realtime component is 0."""
    found = {}
    for line in halcmd("show", "comp").splitlines():
        words = line.split()
        if len(words) >= 3:
            found[words[2]] = int(words[3]) if len(words) >= 4 and words[3].isdigit() else 0
    return found


def thread_functions() -> list[str]:
    """Names of the functions in realtime threads (script form: one line per thread, period, FP, name, ..)."""
    return [word for line in halcmd("show", "thread").splitlines() for word in line.split()]
