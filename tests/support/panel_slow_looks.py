# SPDX-License-Identifier: GPL-2.0-or-later
"""Looks at the machine as the process of `chipwise panel` does, but LOOK_S apart, as on a busy computer, and writes the
path done as JSON.

Called by tests/machine/test_panel_path.py inside a LinuxCNC: panel_slow_looks.py LOOK_S FOLDER, while a program is
paused, until it has ended.  FOLDER gets a file `began` when that has been seen, and `seen` at the end.
"""

import json
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "remap"))
from chipwise.panel.machine import Machine  # noqa: E402
from chipwise.panel.watch import Watch  # noqa: E402

GIVE_UP_S = 1200.0  # of a clock that may be fast
FIRST_LOOKS = 3  # at the paused program: the map is found, and what is kept of the path


def main(look_s, folder):
    watch = Watch(Machine())
    end, began = time.monotonic() + GIVE_UP_S, False
    looks = 0
    while time.monotonic() < end and not (began and not watch.was_running):
        watch.look()
        looks += watch.was_running
        if looks >= FIRST_LOOKS and not began:
            began = True
            Path(folder, "began").touch()
        time.sleep(look_s if began else 0.1)
    Path(folder, "part").write_text(json.dumps({"looks": looks, "points": watch.path_since(0, 0)["points"]}))
    Path(folder, "part").rename(Path(folder, "seen"))
    watch.close()


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2])
