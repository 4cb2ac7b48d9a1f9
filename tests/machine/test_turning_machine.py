# SPDX-License-Identifier: GPL-2.0-or-later
"""A written program on the simulated lathe: LinuxCNC follows the planned path, spindle, tool changes and feed per revolution included."""
import json
import os
import subprocess

import numpy as np
import pytest

from chipwise import cli
from support import ROOT
from support.turning_oracle import moves

pytestmark = pytest.mark.machine


def distances(points, path):
    """Distance (n,) of points (n, 2) from a polyline (m, 2)."""
    a, b = path[:-1], path[1:]
    d = b - a
    square = np.maximum((d * d).sum(axis=1), 1e-18)
    found = np.full(len(points), np.inf)
    for k in range(len(a)):
        t = np.clip(((points - a[k]) @ d[k]) / square[k], 0.0, 1.0)
        found = np.minimum(found, np.hypot(*(points - a[k] - t[:, None] * d[k]).T))
    return found


@pytest.mark.parametrize("name", ["turning_half", "turning_flange"])
def test_linuxcnc_follows_the_plan(tmp_path, capsys, name):
    ini, log = os.path.join(ROOT, "configs", "lathe_headless.ini"), tmp_path / "log.npz"
    program, plan = tmp_path / "turned.ngc", tmp_path / "plan.json"
    assert cli.main(["turn", os.path.join(ROOT, "nc_files", name + ".ngc"), "-o", str(program), "--json", str(plan)]) == 1
    capsys.readouterr()
    environment = {**os.environ, "CHIPWISE_PROGRAM": str(program), "CHIPWISE_TIMEOUT": "280", "CHIPWISE_SUMMARY": str(tmp_path / "summary.json"),
                   "CHIPWISE_LOG": str(log)}
    done = subprocess.run([os.path.join(ROOT, "bin", "chipwise-sandbox"), "--speed", "5", "--timeout", "290", "--", "linuxcnc", ini],
                          env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["finished"] and summary["errors"] == []
    rows = np.load(log)
    path = np.array([p for _, _, points in moves(program.read_text(), 1.0) for p in points])
    moving = np.column_stack((rows["z"], rows["x"]))[rows["motion_type"] > 0]
    first = int(np.argmin(np.hypot(*(moving - path[0]).T)))         # before it the tool comes from its home
    kept = moving[first:][:: max(len(moving) // 4000, 1)]
    assert distances(kept, path).max() < 0.001
    planned = sum(s["time_s"] for s in json.loads(plan.read_text())["steps"])
    assert planned < summary["cycle_s"] < 1.6 * planned + 15
    feeds = np.array([points[-1] for _, kind, points in moves(program.read_text(), 1.0) if kind == "feed"])
    assert distances(feeds[:: max(len(feeds) // 200, 1)], moving[::5]).max() < 0.06          # every part of it has been travelled
