# SPDX-License-Identifier: GPL-2.0-or-later
"""The mode, phase by phase."""
from support.halrig import always

ON, OFF = 2, 0
WANTED = {
    "program on": ON, "program over": OFF, "the next program": OFF,
    "off: before": ON, "off": OFF, "on again": OFF, "mdi": ON, "mdi, program starts": OFF, "mdi, program over": OFF,
    "mdi again": ON, "mdi, off": OFF, "never seen to run": ON, "never seen, over": OFF, "seen late: before": ON,
    "seen late": ON}


def check(trace):
    for phase, mode in WANTED.items():
        part = trace.only(phase)
        always(part, "mode", mode)
        always(part, "status", mode)


SABOTAGE = {
    "never over": lambda t: t.put("mode", "program over", 2, -1),
    "over too soon": lambda t: t.put("mode", "never seen to run", 0, -1),
    "on again by the old commit": lambda t: t.put("mode", "on again", 2, -1),
    "MDI ends by itself": lambda t: t.put("mode", "mdi", 0, -1),
    "MDI outlives the start": lambda t: t.put("mode", "mdi, program starts", 2, 3),
    "status of before": lambda t: t.put("status", "off", 2, 5),
}
