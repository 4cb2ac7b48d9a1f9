# SPDX-License-Identifier: GPL-2.0-or-later
"""Processes that are killed."""

import os
import signal
import subprocess
import sys
import time

import pytest

from chipwise.check import asked
from chipwise.host import processes

FOLDER = os.path.dirname(os.path.dirname(os.path.dirname(processes.__file__)))
MEGABYTES = 100
MUCH_MEMORY = (
    f"memory = bytearray({MEGABYTES} << 20)\nfor at in range(0, len(memory), 4096): memory[at] = 1\n"
    f"print(flush=True)\ninput()\n"
)


def test_a_process_that_returns_its_memory_lives_no_more():
    """The kernel forgets the command line first; the process is a zombie only later."""
    killed = subprocess.Popen([sys.executable, "-c", MUCH_MEMORY], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    killed.stdout.readline()
    assert processes.lives(killed.pid) and processes.command_line(killed.pid)
    os.kill(killed.pid, signal.SIGKILL)
    while processes.command_line(killed.pid):
        pass
    assert not processes.lives(killed.pid)
    killed.communicate()
    assert not processes.lives(killed.pid)


def test_freed_arrays_are_returned_to_the_kernel():
    """Each second of 40 arrays of 2 MB, after a larger one: glibc alone keeps their room, because those between are in
    use."""
    freed = (
        "def rss():\n    return int(open('/proc/self/statm').read().split()[1]) * 4096 >> 20\n"
        "large = bytearray(30 << 20)\ndel large\nkept = [bytearray(b'1') * (2 << 20) for _ in range(40)]\n"
        "full = rss()\n"
        "for k in range(0, 40, 2):\n    kept[k] = None\nprint(full - rss())\n"
    )
    begin = "from chipwise.host.processes import return_freed_arrays\nreturn_freed_arrays()\n"
    room = [
        int(
            subprocess.run(
                [sys.executable, "-c", text], env={**os.environ, "PYTHONPATH": FOLDER}, capture_output=True, check=True
            ).stdout
        )
        for text in (freed, begin + freed)
    ]
    assert room[0] < 10 and room[1] >= 38


def test_processes_that_share_no_memory_with_this_one():
    """Another user's, and one in a namespace of its own: LinuxCNC there is not the one that runs here."""
    assert processes.is_near(os.getpid()) and not processes.is_near(2**22 + 1)
    others = [["unshare", "--ipc", "sleep", "600"], ["setpriv", "--reuid", "65534", "sleep", "600"]]
    if os.geteuid() != 0:
        pytest.skip("only root can start them")
    for command in others:
        with subprocess.Popen(command, stdin=subprocess.DEVNULL) as process:
            try:
                end = time.monotonic() + 300
                while processes.named("sleep").count(process.pid) == 0 and time.monotonic() < end:
                    time.sleep(0.01)
                assert not processes.is_near(process.pid), command
            finally:
                process.kill()


@pytest.mark.parametrize("named", [["{}"], ["", "{}", ""], []])
def test_a_process_of_chipwise_finds_the_modules_of_a_linuxcnc_in_place(tmp_path, monkeypatch, named):
    """Of the folders in PYTHONPATH chipwise's comes first, and an empty entry, which would be the current folder, is
    left out."""
    (tmp_path / "chipwise").mkdir()
    (tmp_path / "gcode_in_place.py").write_text(
        "import json, chipwise.report\nprint(json.load(__import__('sys').stdin))\n", encoding="utf-8"
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(named).format(tmp_path))
    with asked.start("gcode_in_place") as child:
        answer = child.communicate(b'"read"')[0]
    assert answer == (b"read\n" if named else b"")
    assert processes.environment()["PYTHONPATH"].split(os.pathsep) == [FOLDER] + (len(named) > 0) * [str(tmp_path)]
