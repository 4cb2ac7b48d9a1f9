# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise filter: how long a file takes to be opened, and how soon after FILTER_TIME the filter and the GUIs answer
again.

First the filter alone, as a GUI calls it, with files of every kind and one of 90 MB that is too long for the limit;
then AXIS, gmoccapy and QtDragon, as far as they are installed, under Xvfb.  Arguments: names of GUIs (default: all;
none: no GUI).
"""

import json
import os
import subprocess
import sys
import tempfile
import time

from bench_check import MEGA, memory
from roots import ROOT
from rows import row

from support import filter_rig, samples
from support.rewrite_rig import make_machine

LATE_S = 2.0  # target: from the limit to the answer
LONG_MB = 90


def show(*values, **more):
    print(json.dumps(row(*values, **more)), flush=True)


def filtered(ini, path, out):
    """-> (status, s, most memory in bytes) of the filter on a file."""
    begun, most = time.monotonic(), 0
    with open(out, "wb") as file:
        process = subprocess.Popen(
            [ROOT / "bin" / "chipwise", "filter", "--ini", ini, path],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.DEVNULL,
        )
        while process.poll() is None:
            most = max(most, memory(process.pid))
            time.sleep(0.02)
    return process.returncode, time.monotonic() - begun, most


def alone(folder):
    """The filter without a GUI; -> whether a target is missed."""
    ini = make_machine(folder / "machine")
    ini.write_text(ini.read_text() + f"\n[CHIPWISE]\nFILTER_TIME = {filter_rig.LIMIT_S}\n")
    paths = filter_rig.make_programs(str(folder / "nc"))
    del paths["killed.nc"]
    paths["long.nc"] = str(folder / "nc" / "long.nc")
    with open(paths["long.nc"], "w", encoding="ascii") as file:
        file.write(filter_rig.HEAD + "F1000\n")
        for k in range(LONG_MB * MEGA // 14):
            file.write(f"G1 X{k % 100:02} Y{k % 60:02}.5\n")
        file.write("M2\n")
    failed = False
    for name, path in paths.items():
        status, seconds, most = filtered(ini, path, folder / "out")
        late = seconds - filter_rig.LIMIT_S
        if late > 0:
            show(
                f"{name}: the filter after its limit",
                late,
                "s",
                f"exit status {status}, {most / MEGA:.0f} MB",
                target=LATE_S,
            )
            failed |= late > LATE_S
        else:
            show(f"{name}: the filter", seconds, "s", f"exit status {status}, {most / MEGA:.0f} MB")
    return failed


def in_gui(name, folder):
    """One GUI; -> whether a target is missed."""
    sample = filter_rig.screens()[name]
    if filter_rig.missing(sample):
        print(f"{name}: {filter_rig.missing(sample)}")
        return False
    paths, failed = filter_rig.make_programs(str(folder / "nc")), False
    result = filter_rig.open_all(
        sample,
        folder,
        samples.stage(str(folder)),
        [{"path": path, "kill": kind == "killed.nc"} for kind, path in paths.items()],
    )
    if result["trouble"]:
        print(f"{name}: {result['trouble']}")
    for record in result["records"]:
        kind, seconds = os.path.basename(record["path"]), record["seconds"]
        if kind == "endless.nc":
            show(f"{name}, {kind}: answers after the limit", seconds - filter_rig.LIMIT_S, "s", target=LATE_S)
            failed |= seconds - filter_rig.LIMIT_S > LATE_S
        else:
            show(f"{name}, {kind}: answers", seconds, "s", "opened" if record["loaded"] else "not opened")
    return failed or bool(result["trouble"])


def main(names):
    from pathlib import Path

    failed = False
    with tempfile.TemporaryDirectory(prefix="chipwise-bench-") as folder:
        failed |= alone(Path(folder))
    for name in names or list(filter_rig.screens()):
        if name != "none":
            with tempfile.TemporaryDirectory(prefix="chipwise-bench-") as folder:
                failed |= in_gui(name, Path(folder))
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
