# SPDX-License-Identifier: GPL-2.0-or-later
"""How many random cases a test gets (support/random_cases.py), and which share of them each target of make runs."""

import subprocess

import pytest

from support import ROOT
from support.random_cases import random_count

COUNT, SHARE, SEED = "CHIPWISE_RANDOM_COUNT", "CHIPWISE_RANDOM_SHARE", "CHIPWISE_SEED"


@pytest.mark.parametrize(
    "environment, default, least, count",
    [
        ({}, 60, 0, 60),
        ({SHARE: "0.2"}, 60, 0, 12),
        ({SHARE: "0.2"}, 61, 0, 13),
        ({SHARE: "0.2"}, 1, 0, 1),
        ({SHARE: "0.2"}, 0, 0, 0),
        ({SHARE: "0.2"}, 40, 40, 40),
        ({SHARE: "0.2"}, 40, 10, 10),
        ({SHARE: "0.2", COUNT: "3"}, 60, 40, 3),
        ({SHARE: "", COUNT: ""}, 60, 0, 60),
    ],
)
def test_how_many(monkeypatch, environment, default, least, count):
    for name in (COUNT, SHARE):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert random_count(default, least) == count


def chosen(folder, *arguments, **environment):
    """[share, seed] that pytest is started with, and what was printed."""
    (folder / "tests").mkdir(parents=True)
    (folder / "tools").mkdir()
    text = (ROOT / "tools/test").read_text()
    assert "exec /usr/bin/python3 -m pytest" in text
    (folder / "tools/test").write_text(
        text.replace(
            "exec /usr/bin/python3 -m pytest", f'exec printf "%s %s %s" "${{{SHARE}-}}" "${{{SEED}-}}"'
        ).replace("/usr/bin/python3 -m compileall", ": ")
    )
    done = subprocess.run(
        ["sh", folder / "tools/test", *arguments],
        env={"PATH": "/usr/bin:/bin", **environment},
        text=True,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "arguments, share",
    [([], "0.2"), (["--all"], "0.2"), (["--quick"], "0.2"), (["--shipped"], ""), (["tests/core"], "")],
)
def test_the_share_of_a_run(tmp_path, arguments, share):
    assert chosen(tmp_path / "a", *arguments).startswith(f"{share}  -q")


def test_a_long_run_has_a_seed_of_its_own_and_says_it(tmp_path):
    runs = [chosen(tmp_path / name, "--long").split("\n") for name in "ab"]
    for said, started in runs:
        assert (
            said.startswith(f"{SEED}=")
            and started.startswith(f" {said.partition('=')[2]} -q")
            and int(said.partition("=")[2]) > 0
        )
    assert runs[0] != runs[1]
    assert chosen(tmp_path / "c", "--long", **{SEED: "42"}).startswith(f"{SEED}=42\n 42 -q")
