# SPDX-License-Identifier: GPL-2.0-or-later
"""Works many programs, each in a process of its own on this computer.  Called by check/run.py and
cli/rewrite_folder.py.

Results come as they are ready.  If one program's process ends early (a crash, the kernel's out-of-memory killer), its
result says so and the others continue.  A process ends with its parent.
"""

import gc
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys

from chipwise.host.processes import die_with_parent

PATIENCE_S = 2.0  # for a process that is to end
PROGRESS_STEPS = 100


def _work(sender, parent, work, program, arguments):
    """The process of one program."""
    die_with_parent(parent)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # with the reader's files removed
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles it
    sent = 0

    def progress(share):
        nonlocal sent
        step = min(PROGRESS_STEPS - 1, int(share * PROGRESS_STEPS))
        if step > sent:
            sent = step
            sender.send(step / PROGRESS_STEPS)

    result = work(program, progress, arguments)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # the parent ends us when it has the result: no exit within the exit
    sender.send(result)


class _Job:
    """One program under way."""

    def __init__(self, context, number, program, work, arguments):
        self.number, self.program, self.share = number, program, 0.0
        self.receiver, sender = context.Pipe(duplex=False)
        self.process = context.Process(target=_work, args=(sender, os.getpid(), work, program, arguments), daemon=True)
        self.process.start()
        sender.close()

    def receive(self, failed):
        """A message of the process: its result, or None while it is running."""
        try:
            message = self.receiver.recv()
        except (EOFError, OSError):
            self.process.join(PATIENCE_S)
            code = self.process.exitcode
            how = f"was ended by signal {-code}" if code is not None and code < 0 else f"ended with status {code}"
            return failed(self.program, f"its process {how}; try again with a larger --cell")
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


def _size_of(path):
    """Bytes of a program; 0 if there is none."""
    try:
        return os.path.getsize(path)
    except OSError:
        return 0


def on_processes(jobs, work, programs, arguments, failed, progress=None):
    """Yield (number, result) of each program as it is ready; `jobs` at a time.

    The largest programs come first, so that no processor is left with one at the end.
    work(program, progress, arguments): the result of one, progress called with its share (0..1) that is done;
    failed(program, text):  that of one whose process has died; progress: called with the share of all that is done.
    """
    context = multiprocessing.get_context("fork")
    waiting = sorted(enumerate(programs), key=lambda entry: (_size_of(entry[1]), -entry[0]))
    running: dict = {}
    ended: list = []
    done = 0
    gc.freeze()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                job = _Job(context, *waiting.pop(), work, arguments)
                running[job.receiver] = job
            while ended:  # after the next one is under way: it takes a while
                ended.pop().end()
            for receiver in multiprocessing.connection.wait(list(running)):
                job = running[receiver]
                result = job.receive(failed)
                if result is not None:
                    ended.append(running.pop(receiver))
                    done += 1
                    yield job.number, result
            if progress:
                progress((done + sum(job.share for job in running.values())) / len(programs))
    finally:
        for job in (*running.values(), *ended):
            job.end()
