# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs work.py in a process of its own, for a limited time, with limited memory.  Called by cli/filter.py.

1. At the end of the time the process is killed, and the program is judged by what is known then.
2. The kernel kills the process when the filter ends, whatever ends it, and so on down to LinuxCNC's interpreter
   (processes.die_with_parent).  wait() returns when all of them are gone.
3. A program that begins with a byte order mark, which LinuxCNC refuses, is judged and opened without it.
4. Nothing of it writes to the GUI: its standard output and standard error are /dev/null.
"""

import codecs
import multiprocessing.connection
import os
import select
import shutil
import signal
import stat
import sys
import tempfile
import time

from chipwise.program.program_file import MAX_BYTES, Unreadable, check_file
from chipwise.errors import of_unexpected
from chipwise.filter import verdict as verdicts
from chipwise.filter.model import is_model, made
from chipwise.filter.loops import may_loop
from chipwise.host.files import open_regular
from chipwise.host.processes import descendants, die_with_parent, limit_memory, lives

GONE_S = 1.0  # for killed processes to end
QUIET_S = 10  # computing time without a block of moves
READER_MB = 512  # least memory of LinuxCNC's interpreter with the cycles
GUI_ENDED = 143  # exit status
RESERVE_S = 60  # of computing time beyond FILTER_TIME: the clock ends the process, not its computing time


class Work:
    """The process that judges one program."""

    def __init__(self, program, ini, settings, folder):
        self._settings, self._loops, self._model = settings, True, is_model(program)  # loops: until it is known
        self._receiver, sender = multiprocessing.connection.Pipe(duplex=False)
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            status = 1
            try:
                die_with_parent(parent)
                self._receiver.close()
                _child(sender, program, ini, settings, folder)
                status = 0
            finally:
                os._exit(status)
        sender.close()

    def verdict(self, deadline, progress):
        """Wait for it until a time.monotonic(); progress(share).  Ends the filter if the GUI has ended."""
        events = select.poll()
        events.register(self._receiver, select.POLLIN)
        if stat.S_ISFIFO(os.fstat(2).st_mode):
            events.register(2, 0)  # POLLERR: nobody can read it any more
        while True:
            left = deadline - time.monotonic()
            if left <= 0 and self._model:
                return verdicts.late_model(self._settings["FILTER_TIME"])
            if left <= 0:
                return verdicts.late(self._settings["FILTER_TIME"], self._loops, self._settings["FILTER_REFUSE"])
            ready = [handle for handle, _event in events.poll(1000.0 * left)]
            if 2 in ready:
                sys.exit(GUI_ENDED)
            if not ready:
                continue
            try:
                message = self._receiver.recv()
            except (EOFError, OSError):
                return self._died()
            if isinstance(message, float):
                progress(message)
            elif isinstance(message, bool):
                self._loops = message
            else:
                return message

    def _died(self):
        if self._model:
            return verdicts.not_opened(
                "the planning ended early, for want of memory or by a signal; raise [CHIPWISE]PLAN_MEMORY, "
                "or export the model with a larger tolerance"
            )
        return verdicts.unfinished(
            "the check ended early, for want of memory or by a signal; raise [CHIPWISE]PLAN_MEMORY, "
            "or report it with the program",
            self._loops,
            self._settings["FILTER_REFUSE"],
        )

    def end(self):
        """Kill it and all that it has started, and wait for them."""
        if self.pid is None:
            return
        family = [self.pid, *descendants(self.pid)]
        for pid in family:
            try:
                os.kill(pid, signal.SIGKILL)
            except OSError:
                pass
        end = time.monotonic() + GONE_S
        while any(map(lives, family)) and time.monotonic() < end:
            time.sleep(0.005)
        os.waitpid(self.pid, os.WNOHANG)
        self.pid = None


def _unmarked(program, folder):
    """A copy without the byte order mark that the program begins with; without one, the program."""
    try:
        with open_regular(program, MAX_BYTES) as file:
            if file.read(len(codecs.BOM_UTF8)) != codecs.BOM_UTF8:
                return program
            with open(os.path.join(folder, os.path.basename(program)), "xb") as copy:
                shutil.copyfileobj(file, copy)
            return copy.name
    except OSError:
        return program  # check_file() says what it is


def _without_mark(verdict, copy):
    """The verdict on a program that is opened as its copy without a mark."""
    if verdict.status == verdicts.OPENED:
        verdict.path = verdict.path or copy
        verdict.note("its byte order mark is left out, which LinuxCNC refuses")
    return verdict


def _child(sender, program, ini, settings, folder):
    """In the process: send bool (it has loops), floats (progress), then the Verdict."""
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    null = os.open(os.devnull, os.O_RDWR)
    for handle in (0, 1, *(() if os.environ.get("CHIPWISE_TRACEBACK") else (2,))):
        os.dup2(null, handle)
    os.environ["TMPDIR"] = tempfile.tempdir = folder
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    given = program
    if not is_model(program):
        program = _unmarked(given, folder)
        try:
            check_file(program)  # before numpy is imported: most files that cannot be used are seen here
        except Unreadable as error:
            sender.send(verdicts.not_opened(str(error)))
            return
        loops = may_loop(program)
        sender.send(loops)
    last = 0.0

    def progress(share):
        nonlocal last
        if share >= last + 0.01:
            last = float(share)
            sender.send(last)

    try:
        if is_model(program):
            limit_memory(settings["PLAN_MEMORY"])
            sender.send(made(program, ini, folder, progress))
            return
        from chipwise.filter.work import judged

        limit_memory(settings["PLAN_MEMORY"])
        limits = {
            "cpu_s": int(settings["FILTER_TIME"]) + RESERVE_S,
            "quiet_s": QUIET_S,
            "needs_end": True,
            "memory_mb": max(settings["PLAN_MEMORY"], READER_MB),
        }
        found = judged(program, ini, limits, folder, loops, progress)
        found = found if program == given else _without_mark(found, program)
    except MemoryError:
        return  # its end says it
    except Exception as error:
        if os.environ.get("CHIPWISE_TRACEBACK"):
            raise
        found = verdicts.unfinished(of_unexpected(error), is_model(program) or loops, settings["FILTER_REFUSE"])
    sender.send(found)
