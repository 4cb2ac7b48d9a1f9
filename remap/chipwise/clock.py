"""How long to wait for a process that has to get the processor first.

Called by load.py, monitor.py, supervise.py and glue/volumetric.py.  bin/chipwise-sandbox --speed N lets time pass N times as fast
and says so in CHIPWISE_SPEED; a busy machine leaves a process waiting in real time, so such limits grow with it.
"""

import os

MOST_SPEED = 1000.0


def speed():
    """How many times as fast the clock goes here; 1 on a machine."""
    try:
        found = float(os.environ.get("CHIPWISE_SPEED") or 1.0)
    except ValueError:
        return 1.0
    return found if 1.0 <= found <= MOST_SPEED else 1.0


def patience(seconds):
    """Real seconds as seconds of the clock here."""
    return seconds * speed()
