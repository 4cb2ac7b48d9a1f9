# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise load-factors: list and reset what chipwise-monitor keeps."""

import contextlib
import errno
import json
import os

import pytest
from support import forked

from chipwise.cli import build_parser
from chipwise.cli import load_factors as command
from chipwise.options.machine import UsageError
from chipwise.tool_data import load_factors

KEPT = {(3, "6061"): 1.312, (3, "C45"): 0.9, (12, "6061"): 2.0, (12, 'old "x"'): 1.5}


def factors(*arguments, **env):
    return forked.run(
        [forked.CHIPWISE, "load-factors", *arguments], env={**os.environ, "INI_FILE_NAME": "", **env}, timeout=300
    )


@pytest.fixture(name="path")
def make_path(tmp_path):
    file = tmp_path / "loads.toml"
    load_factors.write(str(file), KEPT)
    return file


def test_list(path, tmp_path):
    before = path.read_bytes()
    done = factors("--file", path, "--json", tmp_path / "out.json")
    assert (
        done.returncode == 0
        and done.stderr == ""
        and done.stdout.splitlines()[0] == "tool 3 in 6061: 1.312 times the predicted power"
        and done.stdout.count("\n") == 4
    )
    assert json.loads((tmp_path / "out.json").read_text())["factors"][1] == {
        "tool": 3,
        "material": "C45",
        "factor": 0.9,
    }
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    "words, left",
    [
        (["--reset", "3"], [(12, "6061"), (12, 'old "x"')]),
        (["--reset", "3", "6061-T6"], [(3, "C45"), (12, "6061"), (12, 'old "x"')]),
        (["--reset", "12", 'old "x"'], [(3, "6061"), (3, "C45"), (12, "6061")]),
        (["--reset", "3", "--reset", "12"], []),
    ],
)
def test_reset(path, words, left):
    done = factors("--file", path, *words)
    assert done.returncode == 0 and done.stderr == "" and sorted(load_factors.read(str(path))) == left, done.stderr
    assert done.stdout.count("reset, the next cut teaches it") == len(KEPT) - len(left) and (
        "no factor is kept" in done.stdout
    ) == (not left)


@pytest.mark.parametrize(
    "words, said",
    [
        (["--reset", "4"], "has no factor of tool 4; it has tool 3 in 6061, tool 3 in C45, tool 12 in 6061"),
        (["--reset", "12", "C45"], "has no factor of tool 12 in C45; it has"),
        (["--reset", "x"], "is not a tool number and a material; write --reset 3"),
        (["--reset", "3", "a", "b"], "is not a tool number and a material"),
        (["--reset"], "expected at least one argument"),
        (["--reset", "3", "--reset", "4"], "has no factor of tool 4"),
    ],
)
def test_what_is_refused_changes_nothing(path, words, said):
    before = path.read_bytes()
    done = factors("--file", path, *words)
    assert (
        done.returncode == 2 and said in done.stderr and "Traceback" not in done.stderr and path.read_bytes() == before
    ), done.stderr


def test_files(path, tmp_path):
    """That of the machine; none, a broken one, and none that is named."""
    ini = tmp_path / "mill.ini"
    ini.write_text("[CHIPWISE]\nSPINDLE_LOADS = loads.toml\n")
    assert "tool 12 in 6061: 2.000" in factors("--ini", ini).stdout == factors(INI_FILE_NAME=str(ini)).stdout
    done = factors("--file", path, "--json", path)
    assert done.returncode == 2 and "is the file of the factors itself" in done.stderr
    path.write_text("[3")
    assert factors("--file", path).returncode == 2
    path.unlink()
    done = factors("--ini", ini)
    assert (
        done.returncode == 0
        and "no factor is kept" in done.stdout
        and factors("--ini", ini, "--reset", "3").returncode == 2
    )
    done = factors()
    assert done.returncode == 2 and "no machine is named" in done.stderr


def test_what_another_one_has_just_written_stays(path, monkeypatch):
    """The file is read when nobody else changes it any more: with the lock of its folder."""

    @contextlib.contextmanager
    def others_first(folder, waits):
        assert waits and folder == str(path.parent)
        load_factors.write(str(path), {**KEPT, (7, "6061"): 3.0})
        yield

    monkeypatch.setattr(load_factors, "locked", others_first)
    parser, _modules = build_parser(("load-factors",))
    assert command.run(parser.parse_args(["load-factors", "--file", str(path), "--reset", "3"])) == 0
    assert sorted(load_factors.read(str(path))) == [(7, "6061"), (12, "6061"), (12, 'old "x"')]


def test_a_disk_that_is_full(path, tmp_path, monkeypatch, capsys):
    """One sentence, and the file is as it was."""

    def full(*_arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    before = path.read_bytes()
    monkeypatch.setattr(load_factors, "write_durable", full)
    monkeypatch.chdir(tmp_path)
    parser, _modules = build_parser(("load-factors",))
    with pytest.raises(UsageError, match="cannot be written: No space left on device; make room"):
        command.run(parser.parse_args(["load-factors", "--file", str(path), "--reset", "3"]))
    assert capsys.readouterr().out == "" and path.read_bytes() == before
