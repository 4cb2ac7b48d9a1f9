# SPDX-License-Identifier: GPL-2.0-or-later
"""remap/chipwise/host/temp_folder.py: folders of processes that live, that were killed, and that are nobody's."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from chipwise.host import temp_folder
from chipwise.host.temp_folder import LOCK, NAME, OwnFolder

HOLDS = (
    "import os, sys\nfrom chipwise.host.temp_folder import OwnFolder\nwith OwnFolder('test') as folder:\n"
    "    open(folder + '/big', 'w').close()\n"
    "    print(folder, flush=True)\n    sys.stdin.read()\n"
)


@pytest.fixture(name="scratch", autouse=True)
def make_scratch(tmp_path, monkeypatch):
    """$TMPDIR."""
    folder = tmp_path / "a [folder]"
    folder.mkdir()
    monkeypatch.setattr(temp_folder.tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


@pytest.fixture(name="holder")
def start_holder():
    """A process that holds a folder: its first line is the folder's path."""
    package = str(Path(temp_folder.__file__).parents[2])
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": package},
    ) as process:
        yield process
        process.kill()


def test_it_goes_with_its_block(scratch):
    with OwnFolder("test") as folder:
        assert Path(folder).parent == scratch and Path(folder).name.startswith(NAME + "test-")
        Path(folder, "sub").mkdir()
        Path(folder, "sub", "file").write_text("x")
    assert not list(scratch.iterdir())


def test_that_of_a_killed_process_goes_with_the_next(scratch, holder):
    folder = Path(holder.stdout.readline().strip())
    with OwnFolder("other") as own:
        assert sorted(scratch.iterdir()) == sorted([folder, Path(own)]) and (folder / "big").exists()  # it lives
        holder.kill()
        holder.wait()
        assert (folder / "big").exists()
        with OwnFolder("next") as after:
            assert sorted(scratch.iterdir()) == sorted([Path(own), Path(after)])


def test_what_is_nobodys_stays(scratch, tmp_path):
    """Without a lock, of another name, a link, a FIFO (which must not be waited for): it is not ours."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / LOCK).touch()
    for name in ("chipwise-plain", "other", "chipwise-fifo", "chipwise-to-a-lock", "chipwise-folder"):
        (scratch / name).mkdir()
    (scratch / "other" / LOCK).touch()
    os.mkfifo(scratch / "chipwise-fifo" / LOCK)
    (scratch / "chipwise-to-a-lock" / LOCK).symlink_to(elsewhere / LOCK)
    (scratch / "chipwise-folder" / LOCK).mkdir()
    (scratch / "chipwise-link").symlink_to(elsewhere)
    before = sorted(scratch.iterdir())
    temp_folder.remove_left_behind()
    assert sorted(scratch.iterdir()) == before and (elsewhere / LOCK).exists()


def test_what_is_another_users_stays(scratch, monkeypatch):
    with OwnFolder("test") as folder:
        pass
    Path(folder).mkdir()
    (Path(folder) / LOCK).touch()
    own = os.geteuid()
    monkeypatch.setattr(temp_folder.os, "geteuid", lambda: own + 1)
    temp_folder.remove_left_behind()
    assert Path(folder).exists()
    monkeypatch.setattr(temp_folder.os, "geteuid", lambda: own)
    temp_folder.remove_left_behind()
    assert not list(scratch.iterdir())
