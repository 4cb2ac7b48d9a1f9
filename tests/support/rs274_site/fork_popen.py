# SPDX-License-Identifier: GPL-2.0-or-later
"""Popen that has chipwise's own processes forked: [python, -s, one of its runners, ..] is a fork of the nursery,
everything else a process.

A nursery is a child that has chipwise, numpy, shapely and gcode loaded and has run nothing (fork_server.py). It forks
twice: the process between ends at once, and the runner's parent is then the nearest ancestor that asks for orphans,
which is the process that called Popen. So it waits, kills and is waited for as for a process it has started.
"""

import contextlib
import ctypes
import json
import os
import socket
import subprocess
import threading
import time

REMAP = os.path.join(
    os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))), "remap", "chipwise"
)
VARIABLE = "CHIPWISE_NURSERY"  # number of the handle, in a program that was executed
PR_SET_CHILD_SUBREAPER = 36

# socket, number of the process whose orphans are its children, execute_in_fork() of fork_server.py or None
_nursery = []
_asking = threading.Lock()
_own = set()  # numbers of this process's children that somebody waits for


class Forked(subprocess.Popen):
    """See the head."""

    def _execute_child(self, args, *given):
        cwd, env = given[4:6]
        pipes = given[9:15]  # p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite
        _asked, owner, execute = _nursery
        runner = not isinstance(args, str) and list(args[1:2]) == ["-s"] and str(args[2]).startswith(REMAP + os.sep)
        if not runner or owner != os.getpid() and execute is None:
            with _asking if owner == os.getpid() else contextlib.nullcontext():
                super()._execute_child(args, *given)
                _own.add(self.pid)
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
            adopt(True)
            order = json.dumps({"argv": argv, "cwd": cwd, "env": env, "parent": owner}).encode()
            with _asking:
                _reap()
                socket.send_fds(asked, [order], own)
                self.pid = int(asked.recv(64))
                _own.add(self.pid)
        else:  # a fork of the owner, whose child it has to be
            self.pid = os.fork()
            if self.pid == 0:
                execute(argv, cwd, env, own)


def adopt(orphans):
    """Whether the orphans of this process's descendants become its children."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, int(orphans), 0, 0, 0)


def _children():
    """Numbers of this process's children."""
    found = []
    for task in os.listdir("/proc/self/task"):
        with contextlib.suppress(OSError), open(f"/proc/self/task/{task}/children") as file:
            found += map(int, file.read().split())
    return found


def _reap():
    """Wait for the orphans that have ended: those of a runner that was killed, which nobody else waits for."""
    for number in set(_children()) - _own:
        with contextlib.suppress(ChildProcessError):
            os.waitpid(number, os.WNOHANG)


def use(handle, execute=None):
    """Have all of Popen in this process ask the nursery at the other end of a socket."""
    _nursery[:] = socket.socket(fileno=handle), os.getpid(), execute
    _own.clear()
    _own.update(_children())
    subprocess.Popen = Forked


def leave():
    """The opposite of use()."""
    subprocess.Popen = Forked.__base__
    adopt(False)
    _nursery[0].close()
    _nursery.clear()
    until = time.monotonic() + 5.0
    while set(_children()) - _own and time.monotonic() < until:  # what its runners have left is about to end
        _reap()
        time.sleep(0.002)
