# SPDX-License-Identifier: GPL-2.0-or-later
"""Folders that resume cannot write in: the sentence has the true cause, and nothing is written."""

import os
import subprocess
import sys

import pytest

from support import ROOT
from support.resume_stop import CHIPWISE, Stop, own_words

# The superuser may write in a folder that is read-only, but not without this right.
AS_EVERYBODY = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search"] if os.geteuid() == 0 else []
PAGE = (
    "import sys\nfrom chipwise.errors import CycleError\nfrom chipwise.panel import resume\n"
    "from support.resume_page import Mdi, OPTIONS\nm = Mdi(sys.argv[1])\norder = {**OPTIONS, 'ini': sys.argv[2]}\n"
    "found = resume.plan(order, m)\n"
    "try:\n    resume.go_on({**order, **found}, m)\nexcept CycleError as error:\n    print(error.text())\n"
)


@pytest.fixture(name="stop", scope="module")
def make_stop(tmp_path_factory):
    """The stop, its program in a folder of its own."""
    folder = tmp_path_factory.mktemp("stop")
    stop = Stop(folder)
    (folder / "programs").mkdir()
    stop.program = stop.program.rename(folder / "programs" / "part.ngc")
    return stop


@pytest.fixture(name="read_only")
def make_read_only():
    """A function that takes the right to write in a folder, until the end of the test."""
    taken = []

    def take(folder):
        folder.chmod(0o555)
        taken.append(folder)

    yield take
    for folder in taken:
        folder.chmod(0o755)


def asked(stop, *words):
    """The words of a command that refuses, without a right of the superuser."""
    done = subprocess.run(
        [*AS_EVERYBODY, CHIPWISE, "resume", str(stop.program), "--ini", str(stop.ini), *words],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
        check=False,
    )
    said = own_words(done.stderr)
    assert done.returncode == 2 and said.count("\n") == 1 and "Traceback" not in said, (
        done.returncode,
        done.stdout,
        said,
    )
    return said


def files(stop):
    return sorted(str(path) for folder in (stop.ini.parent, stop.program.parent) for path in folder.rglob("*"))


def test_the_folder_of_the_new_program(stop, read_only, tmp_path):
    before = files(stop)
    read_only(tmp_path)
    said = asked(stop, "-o", str(tmp_path / "out.ngc"))
    assert (
        f"-o {tmp_path}/out.ngc cannot be written: {tmp_path} is read-only for this user; name a file in a folder of "
        f"yours" in said
    )
    assert files(stop) == before and not list(tmp_path.iterdir())


def test_the_new_program_itself(stop, tmp_path):
    before, out = files(stop), tmp_path / "out.ngc"
    out.write_text("mine")
    out.chmod(0o444)
    assert f"-o {out} cannot be written: it is read-only for this user; name a file" in asked(stop, "-o", str(out))
    assert "cannot be written: it is not a file; name a file" in asked(stop, "-o", str(tmp_path))
    assert files(stop) == before and out.read_text() == "mine"


def test_the_folder_of_the_stock(stop, read_only, tmp_path):
    """Planned all the same."""
    folder = stop.journal.parent
    before = files(stop)
    read_only(folder)
    said = asked(stop, "-o", str(tmp_path / "out.ngc"))
    assert f"the stock cannot be written: {folder} is read-only for this user; make that folder writable" in said
    assert files(stop) == before and not (tmp_path / "out.ngc").exists()
    assert stop.resume("--plan")[0] == 0


@pytest.mark.parametrize("empty", [False, True], ids=["none", "emptied"])
def test_no_stock_is_kept_because_the_folder_is_read_only(stop, read_only, empty):
    """The monitor empties the file of another stock where it cannot delete it."""
    folder, data = stop.journal.parent, stop.journal.read_bytes()
    stop.journal.unlink()
    if empty:
        stop.journal.touch()
    read_only(folder)
    try:
        assert f"no stock is kept in {folder}: it is read-only for this user; make it writable, and say where" in asked(
            stop, "--plan"
        )
    finally:
        folder.chmod(0o755)
        stop.journal.write_bytes(data)
    assert stop.resume("--plan")[0] == 0


def test_the_page(stop, read_only):
    """The folder of the loaded program is where the page writes: nothing is written, the slot neither."""
    folder = stop.program.parent
    before = files(stop)
    read_only(folder)
    done = subprocess.run(
        [*AS_EVERYBODY, sys.executable, "-c", PAGE, str(stop.program), str(stop.ini)],
        text=True,
        capture_output=True,
        timeout=300,
        check=False,
        env={**os.environ, "PYTHONPATH": f"{ROOT}/remap:{ROOT}/tests", "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert (
        f"part.resume.ngc cannot be written: {folder} is read-only for this user; make that folder writable, or use "
        f"chipwise resume -o" in done.stdout
    ), done
    assert files(stop) == before
