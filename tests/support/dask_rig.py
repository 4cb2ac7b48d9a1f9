# SPDX-License-Identifier: GPL-2.0-or-later
"""A Dask cluster on this computer: a scheduler and workers, each a process of its own.  Used by tests/batch."""

import contextlib
import json
import os
import signal
import subprocess
import time

from support import ROOT

PYTHON = "/usr/bin/python3"
START_S = 240.0  # of a process on a busy computer
PACKAGE = "python3-distributed"


def installed():
    """Whether Dask can be imported, after an attempt to install it."""

    def here():
        return subprocess.run([PYTHON, "-c", "import distributed"], capture_output=True, check=False).returncode == 0

    return here() or (
        subprocess.run(
            [ROOT / "tools/deps", PACKAGE], stdin=subprocess.DEVNULL, capture_output=True, check=False
        ).returncode
        == 0
        and here()
    )


def wait_for(fact, what, seconds=START_S):
    """-> the first true value of fact()."""
    end = time.monotonic() + seconds
    while not (found := fact()):
        assert time.monotonic() < end, f"{what}: not within {seconds:g} s"
        time.sleep(0.05)
    return found


class Cluster:
    """scheduler, workers: Popen; address: of the scheduler."""

    def __init__(self, folder, workers=2):
        self.folder, self.workers = folder, []
        self.file = folder / "scheduler.json"
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")
        self.address = wait_for(self._address, "scheduler")
        for _ in range(workers):
            self.add_worker()

    def _start(self, module, *options):
        log = open(self.folder / f"{module}-{len(self.workers)}.log", "wb")  # closed with the Popen's owner
        with log:
            return subprocess.Popen(
                [
                    PYTHON,
                    "-m",
                    f"distributed.cli.{module}",
                    "--scheduler-file",
                    str(self.file),
                    "--no-dashboard",
                    *options,
                ],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=self.folder,
            )

    def _address(self):
        assert self.scheduler.poll() is None, "the scheduler has ended"
        with contextlib.suppress(OSError, ValueError):
            return json.loads(self.file.read_text())["address"]

    def add_worker(self):
        name = f"worker{len(self.workers)}"
        worker = self._start(
            "dask_worker", "--no-nanny", "--nthreads", "1", "--name", name, "--local-directory", str(self.folder / name)
        )
        self.workers.append(worker)
        log = self.folder / f"dask_worker-{len(self.workers) - 1}.log"
        wait_for(lambda: b"Registered to" in log.read_bytes(), name)

    @staticmethod
    def runners(worker):
        """Numbers of the processes with which a worker works programs."""
        found = []
        for pid in filter(str.isdigit, os.listdir("/proc")):
            with contextlib.suppress(OSError):
                with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
                    fields = file.read().rpartition(")")[2].split()
                with open(f"/proc/{pid}/cmdline", "rb") as file:
                    command = file.read()
                if int(fields[1]) == worker.pid and fields[0] != "Z" and b"cluster_runner.py" in command:
                    found.append(int(pid))
        return found

    def close(self):
        for process in (*self.workers, self.scheduler):
            with contextlib.suppress(OSError):
                process.send_signal(signal.SIGCONT)
                process.kill()
            process.wait()
