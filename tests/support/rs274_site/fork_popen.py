# SPDX-License-Identifier: GPL-2.0-or-later
"""Popen that has chipwise's own processes forked: [python, -s, one of its runners, ..] is a fork of the nursery,
everything else a process.

A nursery is a child that has chipwise, numpy, shapely and gcode loaded and has run nothing (fork_server.py). It forks
twice: the process between ends at once, and the runner's parent is then the nearest ancestor that asks for orphans,
which is the process that called Popen. So it waits, kills and is waited for as for a process it has started.
"""

import ctypes
import json
import os
import socket
import subprocess

REMAP = os.path.join(
    os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))), "remap", "chipwise"
)
VARIABLE = "CHIPWISE_NURSERY"  # number of the handle, in a program that was executed
PR_SET_CHILD_SUBREAPER = 36

# socket, number of the process whose orphans are its children, execute_in_fork() of fork_server.py or None
_nursery = []


class Forked(subprocess.Popen):
    """See the head."""

    def _execute_child(self, args, *given):
        cwd, env = given[4:6]
        pipes = given[9:15]  # p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite
        _asked, owner, execute = _nursery
        runner = not isinstance(args, str) and list(args[1:2]) == ["-s"] and str(args[2]).startswith(REMAP + os.sep)
        if not runner or owner != os.getpid() and execute is None:
            super()._execute_child(args, *given)
            return
        argv, cwd, env = (
            list(map(str, args[2:])),
            os.path.abspath(cwd or os.getcwd()),
            dict(os.environ if env is None else env),
        )
        own = [pipe if pipe >= 0 else number for number, pipe in enumerate((pipes[0], pipes[3], pipes[5]))]
        self._run_fork(argv, cwd, env, own)
        self._child_created = True
        self._close_pipe_fds(*pipes)

    def _run_fork(self, argv, cwd, env, own):
        """pid becomes that of a runner with these arguments, files and variables."""
        asked, owner, execute = _nursery
        if owner == os.getpid():
            ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
            socket.send_fds(asked, [json.dumps({"argv": argv, "cwd": cwd, "env": env, "parent": owner}).encode()], own)
            self.pid = int(asked.recv(64))
        else:  # a fork of the owner, whose child it has to be
            self.pid = os.fork()
            if self.pid == 0:
                execute(argv, cwd, env, own)


def use(handle, execute=None):
    """Have all of Popen in this process ask the nursery at the other end of a socket."""
    _nursery[:] = socket.socket(fileno=handle), os.getpid(), execute
    subprocess.Popen = Forked
