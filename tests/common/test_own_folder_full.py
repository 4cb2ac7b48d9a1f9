# SPDX-License-Identifier: GPL-2.0-or-later
"""A folder for temporary files without room: whatever the first file that does not fit, each command says so, and
writes nothing."""

import subprocess

import pytest

from support import ROOT
from support.rewrite_rig import HEAD, make_machine

# kB; the tool table of LinuxCNC takes 112, what follows it are texts of ours, some of which do not fit
SIZES = (4, 12, 60, 116, 120, 124, 132, 140, 148, 156, 164, 180, 240, 3000)
FULL = "No space left on device in the folder for temporary files; make room there, or name another folder with TMPDIR"
LOOP = (
    "#1=0\no1 repeat [3]\n#1=[#1+1]\n(a remark that takes its room in every copy of this program)\nG0 X-10 Y30 Z5\n"
    "G0 Z-[8*#1+8]\nG1 X110 F400\nG0 Z5\no1 endrepeat\n"
)
PROGRAM = (
    HEAD + "M250 P0 Q0 R-40 I100 J60 K40\nT1 M6\nS8000 M3\n" + LOOP + "M2\n" + "(what LinuxCNC does not read)\n" * 700
)
SCRIPT = """disk=$1 kept=$2; shift 2
for size in SIZES; do
    mount -t tmpfs -o size=${size}k none $disk || exit 77
    echo kept >$kept
    said=$(TMPDIR=$disk "$@" 2>&1 | grep -v '^FILTER_PROGRESS'; exit ${PIPESTATUS[0]})
    echo "$size|$?|$(ls -A $disk)|$(head -c 4 $kept)|$(tail -n 1 <<<"$said")"
    umount $disk
done
""".replace("SIZES", " ".join(map(str, SIZES)))
COMMANDS = {"check": ["--ini"], "rewrite": ["--flute", "-o", "OUT", "--ini"], "try": ["--ini"]}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_room(tmp_path, command):
    ini, program, out, disk = (
        make_machine(tmp_path / "mill"),
        tmp_path / "part.ngc",
        tmp_path / "out.ngc",
        tmp_path / "disk",
    )
    program.write_text(PROGRAM)
    disk.mkdir()
    words = [str(out) if word == "OUT" else word for word in COMMANDS[command]]
    done = subprocess.run(
        [
            "unshare",
            "--user",
            "--map-root-user",
            "--mount",
            "bash",
            "-c",
            SCRIPT,
            "bash",
            str(disk),
            str(out),
            str(ROOT / "bin/chipwise"),
            command,
            str(program),
            *words,
            str(ini),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode == 77 or "unshare:" in done.stderr:
        pytest.skip("no file system can be mounted here")
    rows = [line.split("|", 4) for line in done.stdout.splitlines()]
    assert [int(size) for size, *_ in rows] == list(SIZES)
    begun = [status != "2" for _, status, *_ in rows]
    assert 2 < begun.index(True) < len(SIZES) - 2 and all(begun[begun.index(True) :]), rows
    name = "" if command == "try" else f"{program}: "
    for size, status, left, kept, said in rows:
        assert not left and (status != "2" or (said.removeprefix("chipwise: ") == name + FULL and kept == "kept")), (
            size,
            status,
            left,
            kept,
            said,
        )
