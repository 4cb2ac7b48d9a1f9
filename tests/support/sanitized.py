# SPDX-License-Identifier: GPL-2.0-or-later
"""The C core under ASan and UBSan: `make sanitized` once for all tests of a run, and programs started with it.

A library with ASan needs ASan's own to be the first in the process, so Python is started with both preloaded. What
Python itself never frees is not looked at.
"""

import fcntl
import os
import subprocess
import sys

from support import ROOT

FOLDER = ROOT / "build/sanitized"
TIMEOUT_S = 900  # a loaded machine


def folder():
    """build/sanitized, up to date; one process builds it, the others wait."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    with open(FOLDER / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(
            ["make", "-s", "sanitized"],
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=TIMEOUT_S,
        )
    assert done.returncode == 0, done.stdout
    return FOLDER


def library_with(folder_of_it, source, fault):
    """The library with a fault (fault.h) compiled into one source, named as core/NAME or offline/NAME; -> its path."""
    built, objects, library = folder(), folder_of_it / "faulty.o", folder_of_it / "libchipwise.so"
    flags = subprocess.run(
        ["make", "-s", "sanitizers"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    ).stdout.split()
    subprocess.run(
        ["gcc", *flags, f'-DCHIPWISE_FAULT="{fault}"', "-Icomponents", "-c", "-o", objects, f"components/{source}.c"],
        cwd=ROOT,
        check=True,
    )
    others = [
        path
        for part in ("core", "offline")
        for path in sorted((built / part).glob("*.o"))
        if path != built / f"{source}.o" and (ROOT / "components" / path.relative_to(built)).with_suffix(".c").is_file()
    ]
    made = [ROOT / "build/version.o", ROOT / "build/layout_table.o"]
    subprocess.run(["gcc", *flags, "-shared", "-o", library, objects, *others, *made, "-lm"], check=True)
    return library


def run(command, library=None):
    """-> exit status and what was printed. library: the core that Python is to load, which has the sanitizers."""
    env = {
        **os.environ,
        "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }
    if library:
        runtimes = [
            subprocess.run(
                ["gcc", f"-print-file-name=lib{name}.so"], stdout=subprocess.PIPE, text=True, check=True
            ).stdout.strip()
            for name in ("asan", "ubsan")
        ]
        env.update(LD_PRELOAD=" ".join(runtimes), CHIPWISE_CORE=str(library))
    done = subprocess.run(
        list(map(str, command)),
        cwd=ROOT,
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        timeout=TIMEOUT_S,
    )
    return done.returncode, done.stdout


def run_tests(library, *arguments):
    """Python's tests with a library that has the sanitizers -> exit status and what was printed, the sanitizers' report
    included."""
    return run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", *arguments],
        library,
    )
