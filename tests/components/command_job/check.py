# SPDX-License-Identifier: GPL-2.0-or-later
"""Mode, target and end, phase by phase, and what the interpreter makes of `status`."""

import importlib
import sys
import types
from unittest import mock

from support.halrig import always, require

ON, OFF = 2, 0
GOES_ON, WHOLE, STOPPED = 0, 1, 2
CEILINGS = 1.0, 1.25, 9.99, 10.0  # as in stimulus.py
# phase: mode, job-active, run-end, mrr-target where the mode is on
WANTED = {
    "without: idle": (OFF, 0, GOES_ON, 0),
    "without: runs": (OFF, 0, GOES_ON, 0),
    "without: set up too late": (OFF, 0, GOES_ON, 0),
    "without: over": (OFF, 0, WHOLE, 0),
    "whole: before": (OFF, 0, WHOLE, 0),
    "whole: on": (ON, 1, GOES_ON, 3000),
    "whole: another tool": (ON, 1, GOES_ON, 5000),
    "whole: a drill": (OFF, 1, GOES_ON, 0),
    **{f"whole: odd {k}": (OFF, 1, GOES_ON, 0) for k in range(5)},
    "whole: back": (ON, 1, GOES_ON, 3000),
    "whole: over": (OFF, 0, WHOLE, 0),
    "own: on": (ON, 1, GOES_ON, 3000),
    "own: wins": (3, 0, GOES_ON, 7000),
    "own: over": (OFF, 0, WHOLE, 0),
    "own off: wins": (OFF, 0, GOES_ON, 0),
    "left over: goes on": (ON, 1, GOES_ON, 3000),
    "aborted: on": (ON, 1, GOES_ON, 3000),
    "aborted: stopped": (OFF, 0, GOES_ON, 0),
    "aborted: stays off": (OFF, 0, GOES_ON, 0),
    "aborted: over": (OFF, 0, STOPPED, 0),
    "off: stopped": (OFF, 0, GOES_ON, 0),
    "off: stays off": (OFF, 0, GOES_ON, 0),
    "off: over": (OFF, 0, STOPPED, 0),
    "withdrawn: on": (ON, 1, GOES_ON, 3000),
    "withdrawn: gone": (OFF, 0, GOES_ON, 0),
    "withdrawn: late": (OFF, 0, GOES_ON, 0),
    "withdrawn: over": (OFF, 0, WHOLE, 0),
}

# phase: mode, feed-carried, job-active
OF_MDI = {
    "carried: MDI": (3, 0, 0),
    "carried: runs": (3, 1, 0),
    "carried: is changed": (3, 1, 0),
    "carried: over": (OFF, 0, 0),
    "carried: again": (OFF, 0, 0),
    "set up: MDI": (3, 0, 0),
    "set up: runs": (3, 1, 0),
    "set up: over": (OFF, 0, 0),
    "set up: again": (ON, 0, 1),
    "other: MDI": (3, 0, 0),
    "other: runs": (OFF, 0, 0),
    "none: MDI": (3, 0, 0),
    "none: runs": (OFF, 0, 0),
    "stopped: runs": (3, 1, 0),
    "stopped: now": (OFF, 0, 0),
    "stopped: still": (OFF, 0, 0),
    "own wins: runs": (3, 1, 0),
    "own wins: on": (1, 0, 0),
}


def job_now(status):
    """As glue/registers.py reads it, with a stand-in for LinuxCNC's module."""
    canon = types.SimpleNamespace(GET_EXTERNAL_ANALOG_INPUT=lambda number, default: status)
    with mock.patch.dict(sys.modules, {"emccanon": canon}):
        registers = importlib.import_module("chipwise.glue.registers")
    with mock.patch.object(registers, "emccanon", canon):
        return registers.job_now({"ANALOG_IN": 0})


def check(trace):
    for phase, wanted in OF_MDI.items():
        for name, value in zip(("mode", "feed-carried", "job-active"), wanted):
            always(trace.only(phase), name, value)
    for phase, (mode, active, end, target) in WANTED.items():
        part = trace.only(phase)
        always(part, "mode", mode)
        always(part, "job-active", active)
        always(part, "run-end", end)
        if mode:
            always(part, "mrr-target", target)
            always(part, "mrr-lower", 0)
    for ceiling in CEILINGS:
        for waits in (0, 1):
            for active in (0, 1):
                part = trace.only(f"asked: {ceiling:g} {waits} {active}")
                found = [job_now(value) for value in part["status"]]
                require(
                    part,
                    "status",
                    [one == (ceiling, waits, active, waits) for one in found],
                    "(pin)",
                    f"{ceiling:g} {waits} {active}",
                )
                always(part, "air", waits * active)


SABOTAGE = {
    "set up in the middle of a run": lambda t: t.put("mode", "without: set up too late", 1, 3),
    "never on": lambda t: t.put("mode", "whole: on", 0, 0),
    "target of the tool before": lambda t: t.put("mrr-target", "whole: another tool", 3000.0),
    "a drill with a target": lambda t: t.put("mode", "whole: a drill", 2),
    "odd target taken": lambda t: t.put("mode", "whole: odd 3", 2),
    "it beats the program": lambda t: t.put("mode", "own: wins", 1, -1),
    "what was left ends it": lambda t: t.put("mode", "left over: goes on", 0, -1),
    "on again after an abort": lambda t: t.put("mode", "aborted: stays off", 1, -1),
    "on again after the machine": lambda t: t.put("job-active", "off: stays off", 1, -1),
    "withdrawn and still there": lambda t: t.put("mode", "withdrawn: gone", 1),
    "a stop that counts as an end": lambda t: t.put("run-end", "aborted: over", 1, -1),
    "M251 of MDI in another program": lambda t: t.put("mode", "other: runs", 3),
    "twice": lambda t: t.put("mode", "carried: again", 3, -1),
    "not taken into its program": lambda t: t.put("mode", "carried: runs", 0),
    "a set-up beats MDI": lambda t: t.put("job-active", "set up: runs", 1, -1),
    "outlives its program": lambda t: t.put("mode", "whole: over", 1),
}
