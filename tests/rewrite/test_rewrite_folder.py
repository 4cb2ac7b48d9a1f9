# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise rewrite with a folder: each program as alone, one bad one, refusals."""

import os

import pytest

from support.rewrite_rig import deep_program, make_machine, rewrite

SEEDS = (900, 903, 908)
BAD = "G1 X@\nM2\n"


@pytest.fixture(name="folder")
def make_folder(tmp_path):
    folder = tmp_path / "programs"
    folder.mkdir()
    for seed in SEEDS:
        (folder / f"{seed}.ngc").write_text(deep_program(seed))
    (folder / "bad.nc").write_text(BAD)
    (folder / "notes.txt").write_text("no program")
    return folder


@pytest.fixture(name="ini")
def make_ini(tmp_path):
    return make_machine(tmp_path / "mill")


def test_every_program_as_alone(tmp_path, folder, ini):
    done = rewrite(folder, tmp_path / "out", ini, "--flute", "--jobs", "2")
    assert (
        done.status == 2
        and done.errors
        == f"chipwise: {folder}/bad.nc: bad number format (conversion failed) parsing ''; correct the line (line 1)"
    )
    assert sorted(os.listdir(tmp_path / "out")) == [f"{seed}.ngc" for seed in SEEDS]
    said = []
    for seed in SEEDS:
        alone = rewrite(folder / f"{seed}.ngc", tmp_path / "alone.ngc", ini, "--flute")
        assert (tmp_path / "alone.ngc").read_bytes() == (tmp_path / "out" / f"{seed}.ngc").read_bytes()
        said.append(alone.said.replace(str(tmp_path / "alone.ngc"), str(tmp_path / "out" / f"{seed}.ngc")))
    assert sorted(done.said.splitlines()) == sorted(said)


def test_refused(tmp_path, folder, ini):
    """Nothing is written, and the programs stay as they are."""
    file, empty = tmp_path / "file", tmp_path / "empty"
    file.write_text("")
    empty.mkdir()
    one = folder / "900.ngc"
    for program, out, options, said in (
        (folder, folder, (), "-o is the folder of the programs; name another one"),
        (folder, file, (), f"-o {file} is not a folder; name one for the new programs"),
        (empty, tmp_path / "out", (), "there is no program (.ngc, .nc, .tap) in the folder"),
        (folder, file / "below", (), f"-o {file}/below: Not a directory; name a folder that can be made"),
        (folder, tmp_path / "out", ("--jobs", "0"), "--jobs 0 is not from 1 to 256"),
        (
            folder,
            tmp_path / "out",
            ("--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"),
            "--jobs counts processes of this computer",
        ),
        (one, tmp_path / "o.ngc", ("--jobs", "2"), "--jobs goes with a folder of programs"),
        (one, tmp_path / "o.ngc", ("--scheduler", "tcp://127.0.0.1:1"), "--scheduler goes with a folder of programs"),
    ):
        done = rewrite(program, out, ini, "--flute", *options)
        assert done.status == 2 and done.errors.startswith(f"chipwise: rewrite: {said}"), done.errors
        assert done.errors.count("\n") == 0 and not (tmp_path / "out").exists()
    assert one.read_text() == deep_program(900)
