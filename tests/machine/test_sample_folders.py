# SPDX-License-Identifier: GPL-2.0-or-later
"""The sample machines where chipwise is installed: the folder of `chipwise new-config`, and the copy that LinuxCNC's
configuration selector makes, with the selector's own procedures (tests/support/pick_config.tcl).  The repository is not
there."""

import json
import os
import shutil
import subprocess

import pytest

from chipwise.headless import runner
from support import samples

pytestmark = pytest.mark.machine

SELECTOR = (
    f"{samples.IN_PLACE}/tcl/bin/pickconfig.tcl" if samples.IN_PLACE else "/usr/lib/tcltk/linuxcnc/bin/pickconfig.tcl"
)
FOLDERS = {
    "new-config": ("chipwise new-config", "linuxcnc/configs/chipwise"),
    "selector": (
        "HALLIB_DIR=$(linuxcnc_var HALLIB_DIR) tclsh pick_config.tcl "
        + SELECTOR
        + " /usr/share/linuxcnc/aux_examples/chipwise/mill.ini "
        '"$HOME/picked/configs" /usr/share/linuxcnc/ncfiles',
        "picked/configs/chipwise",
    ),
}
# a sub of the pattern library is found, the stock is followed and saved, and a work offset is set
PROGRAM = (
    "G21 G90 G64 P0.01\nT2 M6\nM250 P0 Q0 R-10 I60 J40 K10\nF900\nG0 X10 Y10 Z2\nG10 L2 P2 X5 Y6 Z7\n"
    "M251 P1 Q6\nG75 Q901\nM252\nM253 P1\nM2\n"
)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    return samples.stage(str(tmp_path_factory.mktemp("installed")))


@pytest.mark.parametrize("name", FOLDERS)
def test_it_runs_and_keeps_its_work_offsets_and_stock(name, installed, tmp_path):
    make, folder = FOLDERS[name]
    if name == "selector" and not (shutil.which("tclsh") and os.path.exists(SELECTOR)):
        pytest.skip("LinuxCNC's configuration selector is not here")
    shutil.copy(os.path.join(samples.HERE, "pick_config.tcl"), tmp_path)
    home = tmp_path / "home"
    (tmp_path / "program.ngc").write_text(PROGRAM)
    script = (
        f'{make} && cd "$HOME/{folder}" && linuxcnc -r lathe_headless.ini; CHIPWISE_PROGRAM={tmp_path}/program.ngc '
        f"CHIPWISE_SUMMARY={tmp_path}/summary.json linuxcnc -r mill_headless.ini"
    )
    done = subprocess.run(
        [
            samples.SANDBOX,
            "--installed",
            installed,
            "--home",
            str(home),
            "--speed",
            "8",
            "--timeout",
            "300",
            "--",
            "sh",
            "-c",
            script,
        ],
        cwd=tmp_path,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={key: value for key, value in os.environ.items() if key not in ("CHIPWISE_PROGRAM", "DISPLAY")},
    )
    assert done.returncode == 0, done.stdout
    assert "CHIPWISE_PROGRAM" in done.stdout, done.stdout  # the lathe has started, with nothing to do
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["finished"] and summary["errors"] == [] and summary["volume_mm3"] > 10, summary
    offsets = dict(line.split()[:2] for line in (home / folder / "mill_headless.var").read_text().splitlines())
    assert [float(offsets[number]) for number in ("5241", "5242", "5243")] == [5, 6, 7]
    assert [path.stat().st_size > 1000 for path in (home / folder / "stock").iterdir()] == [True]
    assert "cannot be written" not in done.stdout and runner.ROOT not in done.stdout
