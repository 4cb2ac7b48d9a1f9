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

from chipwise import ROOT

SANDBOX = os.path.join(ROOT, "bin", "chipwise-sandbox")
HEADLESS = os.path.join(ROOT, "configs", "mill_headless.ini")
GRACE_S = 60.0  # real time for start and end, beside the program's own
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


def start_command(ini, settings):
    """The command that starts LinuxCNC; other settings go into a copy of the INI file beside it,
    which the sandbox throws away.  Of two equal keys the first counts."""
    if not settings:
        return ["linuxcnc", "-r", ini]
    lines = "".join("\n%s = %s" % pair for pair in settings.items())
    copy = os.path.join(os.path.dirname(ini), "settings-" + os.path.basename(ini))
    script = 'awk -v lines="$1" \'{print} /^\\[CHIPWISE\\]/ {print lines}\' "$2" > "$3" && exec linuxcnc -r "$3"'
    return ["sh", "-c", script, "sh", lines, ini, copy]


def _environment(program, timeout, summary_path, log):
    """Variables of the process that runs a program."""
    variables = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "CHIPWISE_REPORT")}
    variables.update(
        CHIPWISE_PROGRAM=os.path.abspath(program), CHIPWISE_TIMEOUT="%g" % timeout, CHIPWISE_SUMMARY=summary_path
    )
    if log:
        variables["CHIPWISE_LOG"] = os.path.abspath(log)
    return variables


def run_headless(
    program, ini=HEADLESS, speed=1.0, timeout=3600.0, log=None, output=None, env=None, sandbox_options=(), settings=None
):
    """-> the summary (dict) of one run; it has `exit_status` besides its own keys.

    program          path of the G-code program
    speed            let time pass that many times as fast
    timeout          s of the machine's time for the whole run
    log              save the servo-period log there (.npz, .csv)
    output           keep what LinuxCNC printed there
    env              more environment variables
    sandbox_options  more options of chipwise-sandbox
    settings         {key: value} that take the place of those in [CHIPWISE]
    """
    with tempfile.TemporaryDirectory(prefix="chipwise-run.") as folder:
        summary_path = os.path.join(folder, "summary.json")
        variables = _environment(program, timeout, summary_path, log) | (env or {})
        command = [
            SANDBOX,
            "--timeout",
            "%g" % (timeout / speed + GRACE_S),
            "--speed",
            "%g" % speed,
            *sandbox_options,
            "--",
            *start_command(os.path.abspath(ini), settings or {}),
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
