# SPDX-License-Identifier: GPL-2.0-or-later
"""Time limits for processes that may have to wait for a processor.

Called by cli/load.py, monitor/ and glue/.  bin/chipwise-sandbox --speed N lets time pass N times as fast and sets
CHIPWISE_SPEED to it; a busy machine delays a process in real time, so such limits grow with the speed.
CHIPWISE_MONITOR_S: real seconds that chipwise-monitor may be silent at least, for simulations on a computer that may
keep it from running for longer than a machine may (the tests).
"""

import os

MAX_SPEED = 1000.0
MAX_SILENT_S = 3600.0


def _number(name: str, least: float, most: float) -> float:
    """The number in an environment variable, `least` if that has no number from `least` to `most`."""
    try:
        found = float(os.environ.get(name) or least)
    except ValueError:
        return least
    return found if least <= found <= most else least


def speed() -> float:
    """How many times as fast the clock runs here; 1 on a machine."""
    return _number("CHIPWISE_SPEED", 1.0, MAX_SPEED)


def patience(seconds: float) -> float:
    """Real seconds as seconds of the clock here."""
    return seconds * speed()


def monitor_patience(seconds: float) -> float:
    """patience() with chipwise-monitor."""
    return patience(max(seconds, _number("CHIPWISE_MONITOR_S", 0.0, MAX_SILENT_S)))
