# SPDX-License-Identifier: GPL-2.0-or-later
"""program_out.py: the whole program or nothing, wherever the filter ends."""

import os
import random
import subprocess
import sys

import pytest

from chipwise.filter import program_out
from chipwise.filter.program_out import BARRIER, BEGINNING, PART, Changed, put_program
from support import ROOT

SIZES = [0, 1, len(BARRIER), BEGINNING - 1, BEGINNING, BEGINNING + 1, 3 * BEGINNING, PART + BEGINNING, 2 * PART + 17]


def program(tmp_path, size):
    path = tmp_path / "part.nc"
    path.write_bytes(random.Random(size).randbytes(size))
    return path


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("target", ["file", "behind something", "append", "pipe"])
def test_every_byte(size, target, tmp_path):
    path, out = program(tmp_path, size), tmp_path / "out"
    head = b"before\n" if target == "behind something" else b""
    if target == "pipe":
        reader = subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=open(out, "wb"))
        put_program(reader.stdin.fileno(), path)
        reader.stdin.close()
        assert reader.wait() == 0
    else:
        with open(out, "ab" if target == "append" else "wb", buffering=0) as file:
            file.write(head)
            put_program(file.fileno(), path)
            file.write(b"after")
    assert out.read_bytes() == head + path.read_bytes() + (b"" if target == "pipe" else b"after")


KILLED = """
import os, sys
sys.path.insert(0, sys.argv[1])
from chipwise.filter import program_out
count, write = [int(sys.argv[3])], os.pwrite

def killed(handle, data, place):
    if not count[0]:
        write(handle, bytes(data)[:len(data) // 2 if len(data) > program_out.BEGINNING else 0], place)
        os.kill(os.getpid(), 9)
    count[0] -= 1
    return write(handle, data, place)

os.pwrite = killed
program_out.put_program(1, sys.argv[2])
"""


def verdict(data, whole):
    """'' if the file is the whole program, or none that runs."""
    return "" if data == whole or data == b"" or data.startswith(b"M2 ") else f"{data[:40]!r} of {len(data)} bytes runs"


def test_killed_at_every_write(tmp_path):
    path = tmp_path / "part.nc"
    path.write_bytes(b"G1 X1 F100\n" * 250_000)
    whole, ends = path.read_bytes(), []
    for count in range(8):
        with open(tmp_path / "out", "wb") as out:
            done = subprocess.run(
                [sys.executable, "-c", KILLED, os.path.join(ROOT, "remap"), path, str(count)], stdout=out
            )
        data = (tmp_path / "out").read_bytes()
        assert verdict(data, whole) == ""
        ends.append((done.returncode, data == whole))
    assert ends[0] == (-9, False) and ends[-1] == (0, True) and sum(code == -9 for code, _whole in ends) >= 4


def test_the_verdict_sees_half_a_program():
    whole = b"G1 X1 F100\n" * 10
    assert verdict(whole[:55], whole) and verdict(b"\0" * 20 + whole[20:], whole) and not verdict(whole, whole)


def test_an_error_in_the_middle_leaves_an_empty_file(tmp_path, monkeypatch):
    path, count = program(tmp_path, 3 * PART), [2]

    def full(handle, data, place, write=os.pwrite):
        count[0] -= 1
        if count[0] < 0:
            raise OSError(28, "No space left on device")
        return write(handle, data, place)

    monkeypatch.setattr(program_out.os, "pwrite", full)
    with open(tmp_path / "out", "wb") as file, pytest.raises(OSError):
        put_program(file.fileno(), path)
    assert (tmp_path / "out").read_bytes() == b""


def test_another_file_than_the_one_that_was_judged(tmp_path):
    path = program(tmp_path, 100)
    judged = os.stat(path)
    path.write_bytes(b"G0 Z-50\n")
    with open(tmp_path / "out", "wb") as file, pytest.raises(Changed):
        put_program(file.fileno(), path, judged)
    assert (tmp_path / "out").read_bytes() == b""
