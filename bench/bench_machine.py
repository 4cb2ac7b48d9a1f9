# SPDX-License-Identifier: GPL-2.0-or-later
"""The cost of the components beside LinuxCNC's own motion controller, in one run of the simulated mill.

Called by bench/run.py (prints JSON rows).  bench/nc/entry.ngc runs at the machine's own speed with
bench/lib/timed_display, which reads the time pins of HAL (processor clocks of the last period)
during feed moves.  Means and medians; the largest (tmax) holds what an ordinary kernel does in
between, for every function alike.
"""

import json
import os
import shutil
import tempfile
from pathlib import Path

import numpy as np

from roots import ROOT
from chipwise.headless import runner

FUNCTIONS = ("motion-controller", "stock-tracker.0", "volumetric-feed.0", "chipwise-command.0")
PROGRAM = ROOT / "bench" / "nc" / "entry.ngc"


def machine(folder):
    """The INI of a copy of configs/ in `folder` whose display is bench/lib/timed_display."""
    shutil.copytree(ROOT / "configs", folder / "configs", symlinks=True)
    for name in ("hal", "bin", "remap", "nc_files", "bench", "build"):
        (folder / name).symlink_to(ROOT / name)
    ini = folder / "configs" / "mill_headless.ini"
    ini.write_text(ini.read_text().replace("../bin/chipwise-headless", "../bench/lib/timed_display"))
    return ini


def measured():
    """{function: {"times": clocks (n,), "tmax": clocks}}"""
    with tempfile.TemporaryDirectory(prefix="chipwise-bench.") as scratch:
        folder = Path(scratch)
        os.chmod(folder, 0o777)
        times = folder / "times.json"
        runner.run_headless(
            str(PROGRAM),
            runner.Machine(
                str(machine(folder)), env={"CHIPWISE_TIMED": " ".join(FUNCTIONS), "CHIPWISE_TIMES": str(times)}
            ),
        )
        return json.loads(times.read_text())


def main():
    found = measured()
    motion = np.array(found["motion-controller"]["times"], float)
    for name in FUNCTIONS:
        times = np.array(found[name]["times"], float)
        print(
            json.dumps(
                {
                    "name": f"{name}: mean",
                    "value": round(float(times.mean()), 1),
                    "unit": "clocks",
                    "note": f"median {np.median(times):.0f}, largest {found[name]['tmax']}, {len(times)} readings",
                }
            )
        )
    both = np.array(found["stock-tracker.0"]["times"], float) + np.array(found["volumetric-feed.0"]["times"], float)
    print(
        json.dumps(
            {
                "name": "tracker and feed / motion-controller: mean",
                "unit": "x",
                "value": round(float(both.mean() / motion.mean()), 3),
                "note": f"median {np.median(both) / np.median(motion):.3f}",
            }
        )
    )


if __name__ == "__main__":
    main()
