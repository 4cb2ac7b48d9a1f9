# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks many programs, each in a process of its own.  Called by cli/check.py; filter/work.py has a process of its own.

Results come as they are ready.  If one program's process ends early (a crash, the kernel's out-of-memory killer), its result
says so and the others continue.  A process ends with its parent.
"""

import gc
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys

from chipwise.check.program_file import UNFINISHED
from chipwise.check.result import Result
from chipwise.check.simulate import check
from chipwise.processes import die_with_parent

SUFFIXES = (".ngc", ".nc", ".tap")
PATIENCE_S = 2.0            # for a process that is to end
PROGRESS_STEPS = 100


def programs_of(paths):
    """Paths of programs; of a folder those in it whose name ends as a program's does."""
    found = []
    for path in paths:
        if os.path.isdir(path):
            names = sorted(name for name in os.listdir(path) if name.lower().endswith(SUFFIXES))
            found += [os.path.join(path, name) for name in names]
        else:
            found.append(path)
    return found


def lines_of(path):
    """Lines of a program, at least 1: what progress is counted by."""
    count = 1
    try:
        if os.path.isfile(path):
            with open(path, "rb") as file:
                while part := file.read(1 << 20):
                    count += part.count(b"\n")
    except OSError:
        pass
    return count


def _size_of(path):
    """Bytes of a program; 0 if there is none."""
    try:
        return os.path.getsize(path)
    except OSError:
        return 0


def _work(sender, parent, program, arguments):
    """The process of one program."""
    die_with_parent(parent)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))         # with the reader's files removed
    signal.signal(signal.SIGINT, signal.SIG_IGN)                    # the parent handles it
    lines, sent = lines_of(program), 0

    def progress(line):
        nonlocal sent
        step = min(PROGRESS_STEPS - 1, line * PROGRESS_STEPS // lines)
        if step > sent:
            sent = step
            sender.send(step / PROGRESS_STEPS)

    result = checked(program, progress, arguments)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)       # the parent ends us when it has the result: no exit within the exit
    sender.send(result)


def checked(program, progress, arguments):
    """The Result, also after an unexpected error."""
    try:
        return check(program, progress=progress, **arguments)
    except MemoryError:
        return Result(program, error=("it needs more memory than there is; use a larger --cell", 0), state=UNFINISHED)
    except Exception as error:      # one bad program never stops the rest
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        return Result(program, error=(f"internal error: {type(error).__name__}: {error}; please report it with what "
                                      "CHIPWISE_TRACEBACK=1 adds", 0), state=UNFINISHED)


class _Job:
    """One program under way."""

    def __init__(self, context, number, program, arguments):
        self.number, self.program, self.share = number, program, 0.0
        self.receiver, sender = context.Pipe(duplex=False)
        self.process = context.Process(target=_work, args=(sender, os.getpid(), program, arguments), daemon=True)
        self.process.start()
        sender.close()

    def receive(self):
        """A message of the process: its Result, or None while it is running."""
        try:
            message = self.receiver.recv()
        except (EOFError, OSError):
            self.process.join(PATIENCE_S)
            code = self.process.exitcode
            how = f"was ended by signal {-code}" if code is not None and code < 0 else f"ended with status {code}"
            return Result(self.program, error=(f"its process {how}; try again with a larger --cell", 0), state=UNFINISHED)
        if isinstance(message, float):
            self.share = message
            return None
        return message

    def end(self):
        self.process.terminate()
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.receiver.close()


def check_all(programs, jobs, progress=None, **arguments):
    """Yield (number, Result) of each program as it is ready; `jobs` at a time.  arguments: as for simulate.check.

    The largest programs come first, so that no processor is left with one at the end.
    progress: called with the share (0..1) of all that is done.
    """
    context = multiprocessing.get_context("fork")
    waiting = sorted(enumerate(programs), key=lambda entry: (_size_of(entry[1]), -entry[0]))
    running, ended, done = {}, [], 0
    gc.freeze()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                job = _Job(context, *waiting.pop(), arguments)
                running[job.receiver] = job
            while ended:                                # after the next one is under way: it takes a while
                ended.pop().end()
            for receiver in multiprocessing.connection.wait(list(running)):
                job = running[receiver]
                result = job.receive()
                if result is not None:
                    ended.append(running.pop(receiver))
                    done += 1
                    yield job.number, result
            if progress:
                progress((done + sum(job.share for job in running.values())) / len(programs))
    finally:
        for job in (*running.values(), *ended):
            job.end()
