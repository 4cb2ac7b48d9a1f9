# SPDX-License-Identifier: GPL-2.0-or-later
"""Works many programs on the workers of a Dask cluster.  Called by cli/check.py and cli/rewrite_folder.py.

What a worker does is the standard library's subprocess.run of cli/cluster_runner.py, a process of its own for each
 program:
 1. the Python of a worker needs nothing of chipwise, only the files under the same paths (a shared folder);
 2. a crash, or a program that takes all memory, ends this process and not the worker;
 3. the process ends with its worker.

If a worker is lost, the scheduler gives its programs to the others; a program whose workers were lost again and again
has an error instead of a result.  The scheduler is asked every PING_S whether it answers: if it does not, or has no
worker, for LOST_S, the whole ends with ClusterError.  Read in distributed 2022.12 and 2024.12: client.py, scheduler.py.
"""

import logging
import os
import pickle
import queue
import re
import subprocess
import threading
import time
import uuid

from chipwise import version
from chipwise.errors import printable

PYTHON = "/usr/bin/python3"
RUNNER = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "cli", "cluster_runner.py")
CONNECT_S = 10.0  # for the first connection
OVERTIME_S = 2.0  # by which it may be late
PING_S = 5.0  # between two questions to the scheduler
LOST_S = 30.0  # without an answer, or without a worker
FETCH_S = 5.0  # for one result
CANCELLED_S = 0.5  # between two looks at a lost connection
TRIES = 3  # of a program that the scheduler has given up
SHOWN = 300  # characters of what another process has said


class ClusterError(Exception):
    """The cluster cannot be used, or no longer: str() is the message."""


def _connect(address):
    """(module distributed, Client)."""
    if not re.fullmatch(r"(\w+://)?[^/\s]+:\d+", address):
        raise ClusterError(
            f"{printable(address) or 'an empty text'} is not the address of a Dask scheduler; use tcp://HOST:PORT"
        )
    try:
        import distributed
    except ImportError:
        raise ClusterError(
            "--scheduler needs Dask, which is not installed; apt-get install python3-distributed, or use --jobs"
        ) from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)  # what matters is said here
    try:
        return distributed, _within(
            CONNECT_S + OVERTIME_S,
            lambda: distributed.Client(address, timeout=CONNECT_S, set_as_default=False, name="chipwise"),
        )
    except Exception as error:  # OSError, ValueError, TypeError, .. with the address
        what = printable(str(error) or type(error).__name__).splitlines()[0][:SHOWN]
        raise ClusterError(
            f"no Dask scheduler answers at {address} within {CONNECT_S:g} s ({what}); start dask-scheduler, or "
            "correct the address"
        ) from None


def _within(seconds, action):
    """Result of the action; TimeoutError if it takes longer.  distributed 2024.12 waits for ever for a scheduler that
    accepts the connection and says nothing."""
    answer: queue.SimpleQueue = queue.SimpleQueue()

    def act():
        try:
            answer.put((action(), None))
        except Exception as error:
            answer.put((None, error))

    threading.Thread(target=act, daemon=True).start()
    try:
        result, error = answer.get(timeout=seconds)
    except queue.Empty:
        raise TimeoutError("it accepts the connection and says nothing") from None
    if error:
        raise error
    return result


def on_cluster(address, task, programs, arguments, failed, progress=None):
    """Cluster.work(), and the connection closed at the end."""
    cluster = Cluster(address)
    try:
        yield from cluster.work(task, programs, arguments, failed, progress)
    finally:
        cluster.close()


class Cluster:
    """A connection to a scheduler, for one command."""

    def __init__(self, address):
        self.address = address
        self._distributed, self._client = _connect(address)
        self._ready: queue.SimpleQueue = queue.SimpleQueue()
        self._name, self._tries = uuid.uuid4().hex, {}
        self._asked = self._well = time.monotonic()

    def close(self):
        """Give up what is not done, and the connection."""
        try:
            self._client.close(timeout=1)
        except Exception:  # of a scheduler that is gone
            pass

    def work(self, task, programs, arguments, failed, progress=None):
        """Yield (number, result) of each program as it is ready.

        task: of cluster_runner.TASKS; arguments: of it; failed(program, text): the result of one that could not be
        worked; progress: called with the share that is done.
        """
        orders = [pickle.dumps((version(), task, os.path.abspath(program), arguments)) for program in programs]
        # the Future of each program is kept: the scheduler forgets what nobody holds
        held = {number: self._submit(number, order) for number, order in enumerate(orders)}
        while held:
            number = self._next()
            if number is None:
                continue
            try:
                result = self._result(held[number], programs[number])
            except _Again:
                held[number] = self._submit(number, orders[number])
                continue
            except _NotYet:
                self._ping()
                self._watch(held[number], number)
                continue
            except _Failed as error:
                result = failed(programs[number], str(error))
            del held[number]
            result.program = programs[number]
            yield number, result
            if progress:
                progress(1 - len(held) / len(programs))

    def _submit(self, number, order):
        self._tries[number] = self._tries.get(number, 0) + 1
        future = self._client.submit(
            subprocess.run,
            [PYTHON, "-s", RUNNER],
            input=order,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            pure=False,
            key=f"chipwise-{self._name}-{number}-{self._tries[number]}",
        )
        self._watch(future, number)
        return future

    def _watch(self, future, number):
        future.add_done_callback(lambda _future: self._ready.put(number))

    def _next(self):
        """The number of a program that is done; None after a while without one.  Raises ClusterError."""
        try:
            return self._ready.get(
                timeout=max(0.0, self._asked + PING_S - time.monotonic()) if self._ready.empty() else 0.0
            )
        except queue.Empty:
            self._ping()
            return None

    def _ping(self):
        """Raises ClusterError when the scheduler has not answered for LOST_S, or has had no worker."""
        if self._client.status in ("closing", "closed"):  # it has tried for CONNECT_S to reach the scheduler again
            raise ClusterError(
                f"the connection to the Dask scheduler {self.address} is lost; start the command again when it answers"
            )
        trouble = f"has no worker for {LOST_S:g} s; start dask-worker"
        try:
            found = self._client.sync(self._client.scheduler.identity, callback_timeout=PING_S)
            if found["workers"]:
                self._well = time.monotonic()
        except Exception:  # OSError, CommClosedError, TimeoutError, ..
            trouble = f"does not answer for {LOST_S:g} s; start the command again when it does"
        self._asked = time.monotonic()
        if self._asked - self._well > LOST_S:
            raise ClusterError(f"the Dask scheduler {self.address} {trouble}")

    def _result(self, future, program):
        """What cli/cluster_runner.py has sent."""
        again = self._tries_left(future)
        try:
            done = future.result(timeout=FETCH_S)
        except self._distributed.TimeoutError:
            raise _NotYet from None  # lost with its worker: it is being made again
        except self._distributed.CancelledError:  # by a scheduler that was started anew, or with the connection
            if self._client.status == "running":
                raise _Again from None
            time.sleep(CANCELLED_S)
            raise _NotYet from None
        except self._distributed.scheduler.KilledWorker:
            if again:
                raise _Again from None
            raise _Failed("the workers that had it were lost; try again with a larger --cell, or more memory") from None
        except Exception as error:
            if again:
                raise _Again from None
            text = _short(str(error) or type(error).__name__)
            raise _Failed(
                f"its worker cannot run it ({text}); see whether chipwise and its programs are in a shared folder"
            ) from None
        if done.returncode:
            said = _short(done.stderr.decode("utf-8", "replace"))
            raise _Failed(
                f"its process on the cluster ended with status {done.returncode} ({said}); try again with a larger "
                f"--cell, "
                "or see whether chipwise is in the same folder there"
            )
        found, result = pickle.loads(done.stdout)
        if found != version():
            raise _Failed(f"the worker has chipwise {found}, this is {version()}; install the same one")
        return result

    def _tries_left(self, future):
        number, tries = map(int, future.key.split("-")[-2:])
        return tries < TRIES


class _Again(Exception):
    """To be given to the cluster once more."""


class _NotYet(Exception):
    """The result is being made again."""


class _Failed(Exception):
    """The program's error."""


def _short(text):
    """The last line of what another process has said."""
    lines = printable(text).strip().splitlines() or [""]
    return lines[-1][:SHOWN]
