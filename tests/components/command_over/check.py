# SPDX-License-Identifier: GPL-2.0-or-later
"""The mode, phase by phase."""

from support.halrig import always

ON, OFF = 2, 0
WANTED = {
    "program on": ON,
    "program over": OFF,
    "the next program": OFF,
    "off: before": ON,
    "off": OFF,
    "on again": OFF,
    "mdi": ON,
    "mdi, program starts": OFF,
    "mdi, program over": OFF,
    "mdi again": ON,
    "mdi, off": OFF,
    "never seen to run": ON,
    "never seen, over": OFF,
    "seen late: before": ON,
    "seen late": ON,
    "never seen, moves": ON,
    "never seen, at rest: before": ON,
    "never seen, at rest: over": OFF,
}


def check(trace):
    for phase, mode in WANTED.items():
        part = trace.only(phase)
        always(part, "mode", mode)
        always(part, "status", mode)
        always(part, "request", 0)
    for commit, request in ((27, 1), (28, 2)):
        for how in ("aborted", "off"):
            for phase, wanted in (("asked", request), ("given up", 0), ("afterwards", 0)):
                always(trace.only(f"file {commit} {how}: {phase}"), "request", wanted)


SABOTAGE = {
    "never over": lambda t: t.put("mode", "program over", 2, -1),
    "over too soon": lambda t: t.put("mode", "never seen to run", 0, -1),
    "over in a cut": lambda t: t.put("mode", "never seen, moves", 0, -1),
    "on again by the old commit": lambda t: t.put("mode", "on again", 2, -1),
    "MDI ends by itself": lambda t: t.put("mode", "mdi", 0, -1),
    "MDI outlives the start": lambda t: t.put("mode", "mdi, program starts", 2, 3),
    "request outlives the abort": lambda t: t.put("request", "file 28 aborted: afterwards", 2, 7),
    "request outlives the machine": lambda t: t.put("request", "file 27 off: given up", 1),
    "request lost": lambda t: t.put("request", "file 27 aborted: asked", 0, 3),
    "status of before": lambda t: t.put("status", "off", 2, 5),
}
