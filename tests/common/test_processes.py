# SPDX-License-Identifier: GPL-2.0-or-later
"""Processes that are killed."""

import os
import signal
import subprocess
import sys

from chipwise import processes

MEGABYTES = 100
MUCH_MEMORY = f"memory = bytearray({MEGABYTES} << 20)\nfor at in range(0, len(memory), 4096): memory[at] = 1\nprint(flush=True)\ninput()\n"


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
