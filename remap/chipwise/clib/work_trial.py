# SPDX-License-Identifier: GPL-2.0-or-later
"""How much of the stock model's work this computer does in a servo period: components/offline/work_trial.c from Python.

Called by cli/load.py (`work=` of stock_tracker), and by bench/bench_slow.py.
"""

from chipwise.clib.library import library
from chipwise.host.clock import speed

STEPS = (100, 70, 50, 35, 25)  # per cent
SHARE = 0.3  # of the servo period for the costliest one, out of a warm cache: the rest is for motion, for a cold cache
# and for what else interrupts the thread
REPEATS = 3


def costliest_us(percent: int) -> float:
    """us of processor time of the costliest period with so much of its work; 0 if it cannot be measured.  Takes 0.05 s
    on a PC."""
    return max(0.0, library().chip_work_trial(percent, REPEATS)) / 1000.0 / speed()


def choose(period_s: float, slower: float = 1.0) -> int:
    """Per cent of the work that a servo period has time for, the smallest of STEPS if none fits.

    slower: how many times slower than this one the computer is, to try it here.
    """
    return next((percent for percent in STEPS if slower * costliest_us(percent) <= SHARE * period_s * 1e6), STEPS[-1])
