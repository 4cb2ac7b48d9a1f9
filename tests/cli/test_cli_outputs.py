# SPDX-License-Identifier: GPL-2.0-or-later
"""An output of a command never replaces what the command reads, nor another output: a typing error must not cost a
program."""

import os
import shutil

import pytest

from support import ROOT, forked

PROGRAM = "G21 G90\nT1 M6\nM250 P0 Q0 R-5 I20 J20 K5\nF300 S1000 M3\nG0 X-10 Y10 Z5\nG1 Z-1\nG1 X30\nG0 Z5\nM2\n"
STATIONS = "[station.1]\n1 = [0.0, 0.0, 0.0]\n2 = [10.0, 0.0, 0.0]\n3 = [0.0, 10.0, 0.0]\n"
INI = os.path.join(ROOT, "configs", "mill.ini")


def chipwise(folder, *arguments):
    """CompletedProcess of a command in a folder."""
    return forked.run([forked.CHIPWISE, *arguments], cwd=folder, timeout=300)


# (what is read, its content or the file it is a copy of, the command on it, what the message calls it)
READ = {
    "check json": (
        "part.ngc",
        PROGRAM,
        "check part.ngc --json part.ngc",
        "--json part.ngc is one of the programs itself",
    ),
    "check report": (
        "part.ngc",
        PROGRAM,
        "check part.ngc --report part.ngc",
        "--report part.ngc is one of the programs itself",
    ),
    "check folder": (
        "part.ngc",
        PROGRAM,
        "check . --report part.ngc",
        "--report part.ngc is one of the programs itself",
    ),
    "check by a link": (
        "part.ngc",
        PROGRAM,
        "check part.ngc --report link.html",
        "--report link.html is one of the programs itself",
    ),
    "rewrite": ("part.ngc", PROGRAM, "rewrite part.ngc --feed 1 -o ./part.ngc", "-o ./part.ngc is the program itself"),
    "rewrite ini": (
        "part.ini",
        INI,
        "rewrite other.ngc --ini part.ini --feed 1 -o part.ini",
        "-o part.ini is the INI file itself",
    ),
    "contour": (
        "part.svg",
        ROOT / "nc_files" / "contour.ngc",
        "contour part.svg --sub 100 --tool 12 -o part.svg",
        "-o part.svg is the program itself",
    ),
    "stations": (
        "part.toml",
        STATIONS,
        "stations --file part.toml --json part.toml",
        "--json part.toml is the file of the stations itself",
    ),
    "patterns": (
        "901.ngc",
        ROOT / "nc_files" / "patterns" / "901.ngc",
        "patterns --folder . --json 901.ngc",
        "is a pattern itself",
    ),
}


@pytest.mark.parametrize("name, content, command, said", READ.values(), ids=[name.replace(" ", "_") for name in READ])
def test_what_is_read_is_not_replaced(tmp_path, name, content, command, said):
    path = tmp_path / name
    if os.path.isfile(content):
        shutil.copy(content, path)
    else:
        path.write_text(content)
    (tmp_path / "other.ngc").write_text(PROGRAM)
    (tmp_path / "link.html").symlink_to(path)
    before = path.read_bytes()
    done = chipwise(tmp_path, *command.split())
    assert path.read_bytes() == before
    assert done.returncode == 2 and said in done.stderr and "; name another file" in done.stderr, done.stderr


@pytest.mark.parametrize(
    "command, said",
    [
        ("check part.ngc --json out --report ./out", "--report and --json are the same file"),
        (f"patterns --folder {ROOT}/nc_files/patterns --json out.svg -o out.svg", "-o and --json are the same file"),
    ],
)
def test_two_outputs_are_two_files(tmp_path, command, said):
    (tmp_path / "part.ngc").write_text(PROGRAM)
    done = chipwise(tmp_path, *command.split())
    assert done.returncode == 2 and said in done.stderr and not list(tmp_path.glob("out*")), done.stderr
