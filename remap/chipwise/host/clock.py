# SPDX-License-Identifier: GPL-2.0-or-later
"""Time limits for processes that may have to wait for a processor.

Called by cli/load.py, monitor/ and glue/.  bin/chipwise-sandbox --speed N lets time pass N times as fast and sets
CHIPWISE_SPEED to it; a busy machine delays a process in real time, so such limits grow with the speed.
"""

import os

MAX_SPEED = 1000.0


def speed() -> float:
    """How many times as fast the clock runs here; 1 on a machine."""
    try:
        found = float(os.environ.get("CHIPWISE_SPEED") or 1.0)
    except ValueError:
        return 1.0
    return found if 1.0 <= found <= MAX_SPEED else 1.0


def patience(seconds: float) -> float:
    """Real seconds as seconds of the clock here."""
    return seconds * speed()
