# SPDX-License-Identifier: GPL-2.0-or-later
"""The C core under ASan and UBSan: `make sanitized` once for all tests of a run, and programs started with it.

A library with ASan needs ASan's own to be the first in the process, so Python is started with both preloaded. What Python itself
never frees is not looked at.
"""
import fcntl
import os
import subprocess
import sys

from support import ROOT

FOLDER = ROOT / "build/sanitized"
FLAGS = ["-O1", "-g", "-fPIC", "-fno-omit-frame-pointer", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
TIMEOUT_S = 900     # a loaded machine


def folder():
    """build/sanitized, up to date; one process builds it, the others wait."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with open(FOLDER / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(["make", "-s", "sanitized"], cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT_S)
    assert done.returncode == 0, done.stdout
    return FOLDER


def run(command, library=None):
    """-> exit status and what was printed. library: the core that Python is to load, which has the sanitizers."""
    env = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0", "UBSAN_OPTIONS": "print_stacktrace=1"}
    if library:
        runtimes = [subprocess.run(["gcc", f"-print-file-name=lib{name}.so"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
                    for name in ("asan", "ubsan")]
        env.update(LD_PRELOAD=" ".join(runtimes), CHIPWISE_CORE=str(library))
    done = subprocess.run(list(map(str, command)), cwd=ROOT, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace", timeout=TIMEOUT_S)
    return done.returncode, done.stdout


def run_tests(library, *arguments):
    """Python's tests with a library that has the sanitizers -> exit status and what was printed."""
    return run([sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", *arguments], library)
