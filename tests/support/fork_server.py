# SPDX-License-Identifier: GPL-2.0-or-later
"""The process that forks for each call of bin/chipwise. A program, started by forked.py, not a module.

    fork_server.py SOCKET

A message is JSON (argv, cwd, env, nursery, execute, nurse) with four handles: standard input, output and error of the
process that is forked, and one to which its number is written, and its exit status when it has ended. The server ends
when the socket does. A forked process leaves serve() and executes argv[0] as the interpreter would, so its end is that
of an interpreter; with `execute` it becomes the program argv[0] instead. With `nursery` chipwise's own processes
(planner, contour subs, reader) are forked as well: rs274_site/fork_popen.py. With `nurse` it is the nursery of the
process at the other end of its standard input, a socket.
"""

import contextlib
import gc
import io
import json
import os
import runpy
import select
import signal
import socket
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[0] = os.path.join(ROOT, "remap")
sys.path.append(os.path.join(ROOT, "tests", "support", "rs274_site"))
import fork_popen  # noqa: E402

COMMANDS = ("check", "contour", "patterns", "rewrite", "setup", "surface")
ORDER_BYTES = 1 << 18


def load():
    """What a call imports."""
    import gcode  # noqa: F401
    from chipwise import cli
    from chipwise.program import program_code  # noqa: F401
    from chipwise.check import run  # noqa: F401
    from chipwise.planner import client, plans  # noqa: F401
    from chipwise.contour_sub import run as sub  # noqa: F401
    from chipwise.pattern import run as pattern  # noqa: F401
    from chipwise.program import motion_modes, records, tool_calls  # noqa: F401

    cli.build_parser(COMMANDS)
    gc.collect()
    gc.freeze()


def open_streams():
    """sys.stdin, stdout and stderr of the handles 0, 1 and 2, as a new interpreter opens them."""
    for name, handle, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
        old = getattr(sys, f"__{name}__")
        buffer = open(handle, f"{mode}b", closefd=False, buffering=0 if old.write_through and mode == "w" else -1)
        new = io.TextIOWrapper(
            buffer,
            encoding=old.encoding,
            errors=old.errors,
            line_buffering=old.line_buffering,
            write_through=old.write_through,
        )
        setattr(sys, name, new)
        setattr(sys, f"__{name}__", new)


def become(argv, cwd, env, handles):
    """Make this forked process look like one that was just started, with handles as 0, 1 and 2."""
    kept = [os.dup(handle) for handle in handles]
    for number, handle in enumerate(kept):
        os.dup2(handle, number)
    os.closerange(3, os.sysconf("SC_OPEN_MAX") if os.sysconf("SC_OPEN_MAX") < 1 << 16 else 1 << 16)
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    open_streams()
    sys.argv = list(argv)
    sys.path[0] = os.path.dirname(argv[0])


def have_nursery():
    """Fork a child that forks what this process has started of chipwise (rs274_site/fork_popen.py). -> handle of the
    socket to it."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        ours.close()
        order, handles = nurse(theirs)
        theirs.close()
        execute_in_fork(order["argv"], order["cwd"], order["env"], handles)
    theirs.close()
    return ours.detach()


def nurse(asked):
    """Fork for each order. -> (order, handles), in a process that was forked and belongs to the one that asked."""
    for handle in (0, 1, 2):  # a pipe ends with the process that was given it
        os.dup2(os.open(os.devnull, os.O_RDWR), handle)
    keeps = {0, 1, 2, asked.fileno()}
    for name in os.listdir("/proc/self/fd"):
        if int(name) not in keeps:
            with contextlib.suppress(OSError):
                os.close(int(name))
    while True:
        message, handles, _flags, _address = socket.recv_fds(asked, ORDER_BYTES, 3)
        if not message:
            os._exit(0)
        order = json.loads(message)
        between = os.fork()
        if between == 0:
            own = os.getpid()
            if os.fork():
                os._exit(0)
            while os.getppid() == own:
                time.sleep(0.0002)
            if os.getppid() != order["parent"]:
                os._exit(1)  # its parent has ended meanwhile
            asked.send(b"%d" % os.getpid())
            return order, handles
        for handle in handles:
            os.close(handle)
        os.waitpid(between, 0)


def execute_in_fork(argv, cwd, env, handles):
    """Be the interpreter that runs argv[0], from its first line to the process's end."""
    status = 1
    try:
        become(
            argv,
            cwd,
            {name: value for name, value in env.items() if name not in (fork_popen.VARIABLE, "PYTHONPATH")},
            handles,
        )
        fork_popen.use(have_nursery(), execute_in_fork)
        runpy.run_path(argv[0], run_name="__main__")
        status = 0
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:  # as an interpreter at its end
        sys.excepthook(*sys.exc_info())
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(status & 0xFF)


def serve(server):
    """Fork for each message. -> the order, in a process that was forked; None at the end."""
    running = {}  # pidfd: process, handle of the caller
    while True:
        ready, _, _ = select.select([server, *running], [], [])
        for handle in ready:
            if handle is not server:
                pid, caller = running.pop(handle)
                os.close(handle)
                status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                with contextlib.suppress(BrokenPipeError):  # the caller has stopped waiting
                    os.write(caller, f"{status}\n".encode())
                os.close(caller)
        if server in ready:
            message, handles, _flags, _address = socket.recv_fds(server, ORDER_BYTES, 4)
            if not message:
                return None
            pid = os.fork()
            if pid == 0:
                order = json.loads(message)
                become(order["argv"], order["cwd"], order["env"], handles[:3])
                return order
            for handle in handles[:3]:
                os.close(handle)
            with contextlib.suppress(BrokenPipeError):
                os.write(handles[3], f"{pid}\n".encode())
            running[os.pidfd_open(pid)] = pid, handles[3]


def main():
    server = socket.socket(fileno=int(sys.argv[1]))
    load()
    order = serve(server)
    if order is None:
        return
    server.detach()
    argv = order["argv"]
    if order["nurse"]:
        with socket.socket(fileno=os.dup(0)) as asked:
            order, handles = nurse(asked)
        execute_in_fork(order["argv"], order["cwd"], order["env"], handles)
    if order["execute"]:
        nursery = have_nursery()
        os.set_inheritable(nursery, True)
        os.execvpe(
            argv[0],
            argv,
            {**os.environ, fork_popen.VARIABLE: str(nursery), "PYTHONPATH": os.path.dirname(fork_popen.__file__)},
        )
    if order["nursery"]:
        fork_popen.use(have_nursery(), execute_in_fork)
    runpy.run_path(argv[0], run_name="__main__")


if __name__ == "__main__":
    main()
