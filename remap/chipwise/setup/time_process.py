# SPDX-License-Identifier: GPL-2.0-or-later
"""How long the loaded program takes, and would take set up, in a process of its own: an order as JSON on standard
input, the answer as JSON on standard output.  Called by monitor/set_up_time.py.

    {"ini", "program", "scene"}      scene: loaded.scene()
    -> {"time": s at F, "time_with": s with what `chipwise setup --yes` would confirm, SETUP_AIR included}; {} where
    that does not change the feed, or the program cannot be judged

Computing time and memory are limited, and LinuxCNC comes first.
"""

import json

from chipwise.check.asked import take_order
from chipwise.check.in_force import machine_in_force
from chipwise.program.program_file import MAX_BYTES
from chipwise.errors import CycleError
from chipwise.host.temp_folder import OwnFolder
from chipwise.settings import load_settings, planner_limits_jerk
from chipwise.setup import keeps_feed
from chipwise.setup.measure import measure

NICE = 10
CPU_S = 60
MEMORY_MB = 1000  # of this process, and of the one that reads
MOST_MOVES = 5_000_000


def answer(order, folder):
    """-> the answer."""
    if planner_limits_jerk(order["ini"]) or keeps_feed.code_of(order["program"], order["ini"], MAX_BYTES):
        return {}
    machine = machine_in_force(order["ini"], order["scene"], folder)
    if not machine.has_y:
        return {}
    measured = measure(
        order["program"], machine, {}, cpu_s=CPU_S, limits={"most_moves": MOST_MOVES, "memory_mb": MEMORY_MB}
    )
    if measured.result.error or measured.has_own_rate:
        return {}
    return {"time": measured.time_s, "time_with": measured.time_set_up_s(load_settings(order["ini"])["SETUP_AIR"])}


def main():
    order = take_order(NICE, 2 * MEMORY_MB)
    with OwnFolder("set-up-time") as folder:
        try:
            said = answer(order, folder)
        except (CycleError, OSError):
            said = {}  # `chipwise setup` says why
    print(json.dumps(said))


if __name__ == "__main__":
    main()
