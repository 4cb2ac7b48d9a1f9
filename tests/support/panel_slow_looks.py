# SPDX-License-Identifier: GPL-2.0-or-later
"""Looks at the machine as the process of `chipwise panel` does, but LOOK_S apart, as on a busy computer; prints the
path done as JSON.

Called by tests/machine/test_panel_path.py inside a LinuxCNC: panel_slow_looks.py LOOK_S, from before a program begins
until it has ended.
"""

import json
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "remap"))
from chipwise.panel.machine import Machine  # noqa: E402
from chipwise.panel.watch import Watch  # noqa: E402

GIVE_UP_S = 120.0


def main(look_s):
    watch = Watch(Machine())
    end, began = time.monotonic() + GIVE_UP_S, False
    looks = 0
    while time.monotonic() < end and not (began and not watch.was_running):
        watch.look()
        began = began or watch.was_running
        looks += watch.was_running
        time.sleep(look_s if began else 0.1)
    print(json.dumps({"looks": looks, "points": watch.path_since(0, 0)["points"]}), flush=True)
    watch.close()


if __name__ == "__main__":
    main(float(sys.argv[1]))
