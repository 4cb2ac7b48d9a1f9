# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise stations: list, check, edit."""

import json
import os

import pytest
from support import forked

GOOD = (
    "[station.3]      # vice\n1 = [100, 50, -20]\n2 = [300, 50, -20.02]\n3 = [100, 200, -20.01]\n4 = [300, 200, -20]\n"
)


def stations(path, *arguments, env=None):
    return forked.run(
        [forked.CHIPWISE, "stations", *(["--file", path] if path else []), *arguments],
        env={**os.environ, "INI_FILE_NAME": "", **(env or {})},
        timeout=300,
    )


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "stations.toml"
    file.write_text(GOOD)
    return file


def test_list(path, tmp_path):
    done = stations(path, "--at", "500", "0", "0", "--error", "0.02", "--json", str(tmp_path / "out.json"))
    assert done.returncode == 0 and done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[0].startswith("station 3: X axis at 0.0000 degrees, tilt 0.00")
    assert lines[1].startswith("  point  1 X100.0000 Y50.0000 Z-20.0000   residual ")
    found = json.loads((tmp_path / "out.json").read_text())["stations"]["3"]
    heights = [found["residuals"][q] for q in "1234"]
    assert sum(heights) == pytest.approx(0, abs=1e-9) and max(map(abs, heights)) == pytest.approx(0.0075, abs=1e-4)
    assert (
        lines[-1].startswith("  if each point is off by 0.02 mm, the station is off by up to ")
        and " at X500 Y0 Z0" in lines[-1]
    )
    assert found["error_at"] > found["error_at_points"] > 0.02


def test_edit(path):
    assert stations(path, "--set", "3", "5", "200", "100", "-20").returncode == 0
    assert "5 = [200.0, 100.0, -20.0]" in path.read_text() and "# vice" in path.read_text()
    done = stations(path, "--level", "3")
    assert done.returncode == 0 and "tilt 0.0000 degrees" in done.stdout
    assert path.read_text().count("-20.0]") == 5
    done = stations(path, "--remove", "3")
    assert (
        done.returncode == 0
        and "there are no stations" in done.stdout
        and stations(path, "--remove", "3").returncode == 2
    )


def test_a_station_that_is_not_usable(path):
    path.write_text(GOOD + "[station.4]\n1 = [0, 0, 0]\n")
    done = stations(path)
    assert done.returncode == 1
    assert "station 4: not usable: point 2, 3 are not taught; teach it with M255 Q2" in done.stdout


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--set", "3", "1", "0", "x", "0"], "--set: x is not a number"),
        (["--set", "0", "1", "0", "0", "0"], "--set: station P0 is not from 1 to 999"),
        (["--set", "3", "100", "0", "0", "0"], "--set: point Q100 is not from 1 to 99"),
        (["--set", "3", "1", "0", "nan", "0"], "Ynan of point 1"),
        (["--level", "8"], "there is no station 8; there are 3"),
        (["--error", "0"], "--error 0 is not a length above 0 mm"),
        (["--at", "0", "inf", "0"], "--at needs three finite numbers"),
        (["--remove", "3", "--level", "3"], "not allowed with"),
        (["--json", "/nowhere/x"], "there is no folder /nowhere"),
    ],
)
def test_wrong_input(path, arguments, words):
    done = stations(path, *arguments)
    assert done.returncode == 2 and done.stdout == "" and words in done.stderr and done.stderr.count("\n") == 1
    assert path.read_text() == GOOD


def test_the_file_of_a_machine(tmp_path):
    ini = tmp_path / "machine.ini"
    ini.write_text("[CHIPWISE]\nSTATIONS = mine/fixtures.toml\n")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "fixtures.toml").write_text(GOOD)
    for done in (stations(None, "--ini", str(ini)), stations(None, env={"INI_FILE_NAME": str(ini)})):
        assert done.returncode == 0 and done.stdout.startswith("station 3: ")
    done = stations(None)
    assert done.returncode == 2 and "no machine is named; use --ini INI or --file FILE" in done.stderr


def test_options_may_be_repeated(path):
    """All of them count, and none if one cannot be done."""
    before = path.read_text()
    done = stations(path, *"--set 7 1 0 0 0 --set 7 2 10 0 0 --set 7 3 0 10 nan".split())
    assert done.returncode == 2 and "is not a position" in done.stderr and path.read_text() == before
    done = stations(path, *"--set 7 1 0 0 5 --set 7 2 10 0 0 --set 7 3 0 10 0".split())
    assert done.returncode == 0 and "station 7: X axis at 0.0000" in done.stdout, done.stdout
    done = stations(path, "--level", "7", "--level", "3")
    assert (
        done.returncode == 0
        and "X10.0000 Y0.0000 Z5.0000" in done.stdout
        and "X300.0000 Y50.0000 Z-20.0000" in done.stdout
    ), done.stdout
    taught = path.read_text()
    done = stations(path, "--remove", "7", "--remove", "8")
    assert done.returncode == 2 and "there is no station 8" in done.stderr and path.read_text() == taught
    done = stations(path, "--remove", "7", "--remove", "3", "--remove", "7")
    assert done.returncode == 0 and "there are no stations" in done.stdout
