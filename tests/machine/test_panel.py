# SPDX-License-Identifier: GPL-2.0-or-later
"""The panel beside AXIS's plot and in gmoccapy, and the line at the end of a program, on the mills of configs/ as
installed."""

import os
import re
import shutil

import pytest

from support import samples

pytestmark = pytest.mark.machine

PYVCP = [
    "pyvcp.chipwise-stock.legend1",
    "pyvcp.chipwise-mode.legend1",
    "pyvcp.chipwise-by.legend1",
    "pyvcp.chipwise-rate",
    "pyvcp.chipwise-target",
    "pyvcp.chipwise-share",
    "pyvcp.chipwise-unit.legend1",
]
GLADE = [
    "chipwise-panel." + name
    for name in ("stock-is-defined", "mode-limit", "by-stock", "rate", "rate-target", "share", "unit-in3")
]


@pytest.mark.parametrize(
    "name, screen, watch, per, late_s",
    [
        ("mill.ini", "axis", PYVCP, 1.0, 0),
        ("mill_inch.ini", "axis", PYVCP, 16.387064, 0),
        ("mill_gmoccapy.ini", "gmoccapy", GLADE, 1.0, 0),
        ("mill_gmoccapy.ini", "gmoccapy", GLADE, 1.0, 5),
    ],
)
def test_panel_and_line(name, screen, watch, per, late_s, tmp_path):
    """M251 P1 Q6 on a full slot: while it cuts, and after it.  late_s: the tab of gmoccapy is so late, as on a busy
    computer."""
    sample = samples.Sample(name, name, screen)
    if samples.missing(sample):
        pytest.skip(samples.missing(sample))
    installed = samples.stage(str(tmp_path))
    share = tmp_path / "share"
    original = os.path.join(installed, "usr/local/share/chipwise")
    shutil.copytree(
        original, share, symlinks=True, ignore=lambda folder, _names: ["build"] if folder == original else []
    )
    (share / "build").symlink_to(os.path.join(original, "build"))  # its links to the library lead nowhere from here
    if late_s:
        late, ini = tmp_path / "late_gladevcp", share / "configs" / name
        late.write_text(f'#!/bin/sh\nsleep {late_s}\nexec gladevcp "$@"\n')
        late.chmod(0o755)
        ini.write_text(ini.read_text().replace(" gladevcp ", f" {late} "))
    result = samples.drive(sample, str(share / "configs" / name), str(tmp_path), installed, watch=watch)
    assert samples.verdict(sample, result) == ""
    stock, mode, by, rate, target, share_of_target, inch = (result["during"][pin] for pin in watch)
    assert (stock, mode, by, inch) == ("TRUE", "TRUE", "TRUE", "TRUE" if per > 1 else "FALSE")
    assert float(target) == pytest.approx(6 / per, rel=1e-4)
    assert float(rate) == pytest.approx(6 / per, rel=0.05) and float(share_of_target) == pytest.approx(100, rel=0.05)
    line = next(said for said in result["said"] if "than at F" in said)
    found = re.fullmatch(
        r"chipwise: sample.ngc: ([0-9.]+) s, ([0-9.]+) s more than at F; "
        r"peak ([0-9.]+), target ([0-9.]+) (cm3|in3)/min",
        line,
    )
    assert found, line
    assert float(found[3]) == pytest.approx(6 / per, rel=0.05) and found[5] == ("in3" if per > 1 else "cm3")
    # 14 mm of full slot at 6 cm3/min: 500 mm/min for 600
    assert 0.05 < float(found[2]) < 1.0
