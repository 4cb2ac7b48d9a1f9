# SPDX-License-Identifier: GPL-2.0-or-later
"""Run a program on a LinuxCNC of its own and return the summary.

    summary = run_headless('nc_files/panel.ngc', speed=5)

Called by `chipwise demo` and by the tests.  The machine is
configs/mill_headless.ini in bin/chipwise-sandbox, so nothing of the system is
touched and several can run at once.
"""

import json
import os
import subprocess
import tempfile
from typing import NamedTuple

from chipwise import ROOT

SANDBOX = os.path.join(ROOT, "bin", "chipwise-sandbox")
HEADLESS = os.path.join(ROOT, "configs", "mill_headless.ini")
GRACE_S = 60.0  # real time for start and end, beside the program's own
MOTION_S = 60.0  # real time for motion to answer the task, however fast the clock is
TAIL_LINES = 25  # of LinuxCNC's output in an error


class RunError(Exception):
    """LinuxCNC ended without a summary; str() ends with its last words."""


def can_run_at(speed):
    """Whether this machine lets time pass that fast in a sandbox."""
    return (
        subprocess.run(
            [SANDBOX, "--speed", "%g" % speed, "--", "true"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ).returncode
        == 0
    )


def start_command(ini, settings, speed=1.0):
    """The command that starts LinuxCNC; other settings, and COMM_TIMEOUT where the clock is fast, go into a copy of the
    INI file beside it, which the sandbox throws away.  Of two equal keys the first counts."""
    if not settings and speed <= 1.0:
        return ["linuxcnc", "-r", ini]
    lines = "".join("\n%s = %s" % pair for pair in settings.items())
    motion = "COMM_TIMEOUT = %g" % (MOTION_S * speed) if speed > 1.0 else ""
    copy = os.path.join(os.path.dirname(ini), "settings-" + os.path.basename(ini))
    put = "{print} /^\\[CHIPWISE\\]/ {print lines} /^\\[EMCMOT\\]/ {print motion}"
    script = f'awk -v lines="$1" -v motion="$2" \'{put}\' "$3" > "$4" && exec linuxcnc -r "$4"'
    return ["sh", "-c", script, "sh", lines, motion, ini, copy]


def _environment(program, timeout, summary_path, log):
    """Variables of the process that runs a program."""
    variables = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "CHIPWISE_REPORT")}
    variables.update(
        CHIPWISE_PROGRAM=os.path.abspath(program), CHIPWISE_TIMEOUT="%g" % timeout, CHIPWISE_SUMMARY=summary_path
    )
    if log:
        variables["CHIPWISE_LOG"] = os.path.abspath(log)
    return variables


class Machine(NamedTuple):
    """The LinuxCNC that runs a program.

    settings  {key: value} that take the place of those in [CHIPWISE]
    env       more environment variables
    """

    ini: str = HEADLESS
    settings: dict | None = None
    env: dict | None = None


def run_headless(program, machine=Machine(), speed=1.0, timeout=3600.0, log=None, output=None):
    """-> the summary (dict) of one run; it has `exit_status` besides its own keys.

    program  path of the G-code program
    speed    let time pass that many times as fast
    timeout  s of the machine's time for the whole run
    log      save the servo-period log there (.npz, .csv)
    output   keep what LinuxCNC printed there
    """
    with tempfile.TemporaryDirectory(prefix="chipwise-run.") as folder:
        summary_path = os.path.join(folder, "summary.json")
        variables = _environment(program, timeout, summary_path, log) | (machine.env or {})
        command = [
            SANDBOX,
            "--timeout",
            "%g" % (timeout / speed + GRACE_S),
            "--speed",
            "%g" % speed,
            "--",
            *start_command(os.path.abspath(machine.ini), machine.settings or {}, speed),
        ]
        done = subprocess.run(
            command,
            env=variables,
            text=True,
            errors="replace",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if output:
            with open(output, "w") as handle:
                handle.write(done.stdout)
        if not os.path.exists(summary_path):
            tail = "\n".join(done.stdout.splitlines()[-TAIL_LINES:])
            raise RunError("LinuxCNC ended with status %d and no summary:\n%s" % (done.returncode, tail))
        with open(summary_path) as handle:
            summary = json.load(handle)
        summary["exit_status"] = done.returncode
        return summary
