# SPDX-License-Identifier: GPL-2.0-or-later
"""The process that forks for each call of bin/chipwise. A program, started by forked.py, not a module.

    fork_server.py SOCKET

A message is JSON (argv, cwd, env) with four handles: standard input, output and error of the process that is forked, and one to which its
number is written, and its exit status when it has ended. The server ends when the socket does. A forked process leaves serve() and
executes argv[0] as the interpreter would, so its end is that of an interpreter. It starts LinuxCNC's interpreter (chipwise.program.reader)
by a fork as well.
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
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[0] = os.path.join(ROOT, 'remap')

COMMANDS = ('check', 'rewrite', 'setup')
ORDER_BYTES = 1 << 18


def load():
    """What a call imports."""
    import gcode                        # noqa: F401
    from chipwise import cli
    from chipwise.program import program_code     # noqa: F401
    from chipwise.check import run      # noqa: F401
    from chipwise.program import motion_modes, records, tool_calls      # noqa: F401
    cli.build_parser(COMMANDS)
    gc.collect()
    gc.freeze()


def open_streams():
    """sys.stdin, stdout and stderr of the handles 0, 1 and 2, as a new interpreter opens them."""
    for name, handle, mode in (('stdin', 0, 'r'), ('stdout', 1, 'w'), ('stderr', 2, 'w')):
        old = getattr(sys, f'__{name}__')
        buffer = open(handle, f'{mode}b', closefd=False, buffering=0 if old.write_through and mode == 'w' else -1)
        new = io.TextIOWrapper(buffer, encoding=old.encoding, errors=old.errors, line_buffering=old.line_buffering,
                               write_through=old.write_through)
        setattr(sys, name, new)
        setattr(sys, f'__{name}__', new)


def become(argv, cwd, env, handles):
    """Make this forked process look like one that was just started, with handles as 0, 1 and 2."""
    kept = [os.dup(handle) for handle in handles]
    for number, handle in enumerate(kept):
        os.dup2(handle, number)
    os.closerange(3, os.sysconf('SC_OPEN_MAX') if os.sysconf('SC_OPEN_MAX') < 1 << 16 else 1 << 16)
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    open_streams()
    sys.argv = list(argv)
    sys.path[0] = os.path.dirname(argv[0])


class Forked(subprocess.Popen):
    """Popen of the reader: [python, -s, reader_runner.py, ..] is a fork of this process, everything else a process."""

    def _execute_child(self, args, executable, preexec_fn, close_fds, pass_fds, cwd, env, startupinfo, creationflags, shell,
                       p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite, *others):
        from chipwise.program import reader
        if args[1:3] != ['-s', reader.RUNNER]:
            super()._execute_child(args, executable, preexec_fn, close_fds, pass_fds, cwd, env, startupinfo, creationflags, shell,
                                   p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite, *others)
            return
        self.pid = os.fork()
        if self.pid == 0:
            execute_in_fork(args[2:], cwd or os.getcwd(), os.environ if env is None else dict(env), (p2cread, c2pwrite, errwrite))
        self._child_created = True
        self._close_pipe_fds(p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite)


def execute_in_fork(argv, cwd, env, handles):
    """Below a program's own frames: its handlers must not see what this one raises."""
    status = 1
    try:
        become(argv, cwd, env, handles)
        sys.path[0] = os.path.join(ROOT, 'remap')
        runpy.run_path(argv[0], run_name='__main__')
        status = 0
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:               # as an interpreter at its end
        sys.excepthook(*sys.exc_info())
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(status & 0xff)


def serve(server):
    """Fork for each message. -> argv, in a process that was forked; None at the end."""
    running = {}                # pidfd: process, handle of the caller
    while True:
        ready, _, _ = select.select([server, *running], [], [])
        for handle in ready:
            if handle is not server:
                pid, caller = running.pop(handle)
                os.close(handle)
                status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                with contextlib.suppress(BrokenPipeError):      # the caller has stopped waiting
                    os.write(caller, f'{status}\n'.encode())
                os.close(caller)
        if server in ready:
            message, handles, _flags, _address = socket.recv_fds(server, ORDER_BYTES, 4)
            if not message:
                return None
            pid = os.fork()
            if pid == 0:
                order = json.loads(message)
                become(order['argv'], order['cwd'], order['env'], handles[:3])
                return order['argv']
            for handle in handles[:3]:
                os.close(handle)
            with contextlib.suppress(BrokenPipeError):
                os.write(handles[3], f'{pid}\n'.encode())
            running[os.pidfd_open(pid)] = pid, handles[3]


def main():
    server = socket.socket(fileno=int(sys.argv[1]))
    load()
    argv = serve(server)
    if argv is not None:
        server.detach()
        from chipwise.program import reader
        reader.subprocess = type(sys)('subprocess')
        reader.subprocess.__dict__.update(vars(subprocess), Popen=Forked)
        runpy.run_path(argv[0], run_name='__main__')


if __name__ == '__main__':
    main()
