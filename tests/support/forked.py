# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise, previews and rs274 without the start of interpreters: a process that has chipwise, numpy and gcode
loaded (fork_server.py) forks for each call.

run() is subprocess.run() for [bin/chipwise, ..], preview() for preview_probe.py, rs274() for the program rs274, each
with standard input from nowhere. The process it makes has the caller's working directory and environment, the standard
handles it is given and no other ones, Python's own signals, and its own exit status; it runs bin/chipwise itself, so an
error that nobody catches ends it with a traceback and status 1. What an interpreter reads when it starts is the
server's: where the environment differs in that, the call starts an interpreter. Tests about limits of memory, users,
closed handles, signals and the beginning of a process call subprocess.

In a call of check, contour, patterns, resume, rewrite or setup, in a preview and inside rs274 the planner, contour subs
and the reader are forked as well, each a child of the process that starts it; in here() those of the calling process,
too. rs274 itself, and the interpreter inside it, start as ever. Files of other folders than this repository's remap/
are not forked.

Called by check_runs.py, setup_runs.py, rewrite_rig.py, canon.py, lathe_preview.py and tests.
"""

import atexit
import contextlib
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import threading
import time

from support import ROOT
from support.rs274_site import fork_popen

CHIPWISE = str(ROOT / "bin/chipwise")
PREVIEW = str(ROOT / "tests/support/preview_probe.py")
SERVER = str(ROOT / "tests/support/fork_server.py")
AT_START = (
    "PYTHON",
    "LC_",
    "LANG",
    "LD_",
    "MALLOC_",
    "GLIBC_",
    "OPENBLAS_",
    "OMP_",
    "CHIPWISE_CORE",
)  # first letters of names
NURSED = ("check", "contour", "patterns", "resume", "rewrite", "setup")

_starting = threading.Lock()
_servers = {}  # process: socket, environment it was started with


def _server():
    """Socket to this process's server, and the environment that it was started with."""
    if os.getpid() not in _servers:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            child = subprocess.Popen(
                [sys.executable, SERVER, str(theirs.fileno())],
                cwd=ROOT,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
            )
        _servers[os.getpid()] = ours, dict(os.environ)
        atexit.register(_end, os.getpid(), ours, child)
    return _servers[os.getpid()]


def _end(owner, ours, child):
    if os.getpid() == owner:
        ours.close()  # the server ends with it
        child.wait()


def _at_start(environment):
    return {name: value for name, value in environment.items() if name.startswith(AT_START)}


def run(command, *, timeout, env=None, cwd=None, errors="strict"):
    """-> subprocess.CompletedProcess with text. command: [CHIPWISE, ..]; errors: of what is not UTF-8."""
    assert command[0] == CHIPWISE, command
    return _run(command, timeout, env, cwd, errors=errors, nursery=command[1:2] and command[1] in NURSED)


def preview(arguments, *, timeout, env, cwd=None):
    """The same of preview_probe.py."""
    return _run([PREVIEW, *arguments], timeout, env, cwd, nursery=True, before=[sys.executable])


def rs274(arguments, *, timeout, env, cwd=None):
    """The same of rs274."""
    return _run(["rs274", *arguments], timeout, env, cwd, nursery=True, execute=True)


def _run(command, timeout, env, cwd, before=(), errors="strict", **how):
    """how: of the order (fork_server.py); before: what stands before the command where an interpreter is started."""
    command, env = list(map(str, command)), dict(os.environ if env is None else env)
    with _starting:
        server, started_with = _server()
    if _at_start(env) != _at_start(started_with):
        return subprocess.run(
            [*before, *command],
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            timeout=timeout,
            env=env,
            cwd=cwd,
            check=False,
            errors=errors,
        )
    ends = [os.pipe() for _ in range(3)]  # standard output and error, and the server's word of the end
    with open(os.devnull, "r+b") as nowhere:
        _ask(server, [nowhere.fileno(), *(write for _, write in ends)], command, cwd, env, **how)
    for _, write in ends:
        os.close(write)
    try:
        out, said, word = _read([read for read, _ in ends], command, timeout)
    finally:
        for read, _ in ends:
            os.close(read)
    status = int(word.split()[1])
    return subprocess.CompletedProcess(command, status, out.decode(errors=errors), said.decode(errors=errors))


def _ask(server, handles, command, cwd, env, **how):
    """Send the server an order."""
    order = {
        "nursery": False,
        "execute": False,
        "nurse": False,
        **how,
        "argv": command,
        "cwd": os.path.abspath(cwd or os.getcwd()),
        "env": env,
    }
    socket.send_fds(server, [json.dumps(order).encode()], handles)


@contextlib.contextmanager
def here():
    """Meanwhile the planner, contour subs and the reader that this process itself starts are forked."""
    with _starting:
        server, _started_with = _server()
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs, open(os.devnull, "r+b") as nowhere:
        _ask(server, [theirs.fileno(), *3 * [nowhere.fileno()]], [SERVER], None, dict(os.environ), nurse=True)
    fork_popen.use(ours.detach())
    try:
        yield
    finally:
        fork_popen.leave()


def _read(handles, command, timeout):
    """All that comes from the handles until each is at its end."""
    found, until = {handle: bytearray() for handle in handles}, time.monotonic() + timeout
    with selectors.DefaultSelector() as waiting:
        for handle in handles:
            waiting.register(handle, selectors.EVENT_READ)
        while waiting.get_map():
            ready = waiting.select(max(0.0, until - time.monotonic()))
            if not ready and not found[handles[2]]:
                until = time.monotonic() + timeout  # the server has only begun
            elif not ready:
                os.kill(int(found[handles[2]].split()[0]), signal.SIGKILL)
                raise subprocess.TimeoutExpired(command, timeout)
            for key, _ in ready:
                part = os.read(key.fd, 1 << 16)
                found[key.fd] += part
                if not part:
                    waiting.unregister(key.fd)
    return [bytes(found[handle]) for handle in handles]
