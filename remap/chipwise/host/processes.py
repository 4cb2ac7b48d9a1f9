# SPDX-License-Identifier: GPL-2.0-or-later
"""What the kernel knows of processes and shared memory: the one reader of /proc.

Called by all modules that start or watch processes, and by stock/shared.py.  A process that ends while it is read is
treated as one that does not exist.
"""

import contextlib
import math
import os
import resource
import signal
import sys
import threading
from typing import Iterator, Union

PR_SET_PDEATHSIG = 1
PF_EXITING = 0x4  # include/linux/sched.h
MEGABYTE = 1 << 20
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h
OWN_MAPPING = 1 << 20  # bytes
REMAP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def environment() -> dict[str, str]:
    """Environment of another process of chipwise: Python finds chipwise, and behind it what it finds here, as the
    modules of a LinuxCNC that is run in place
    (its rip-environment sets PYTHONPATH; another LinuxCNC's modules do not fit its libraries)."""
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([REMAP, *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]),
    }


def pids() -> list[int]:
    """Numbers of all processes."""
    return [int(entry) for entry in os.listdir("/proc") if entry.isdigit()]


def stat_fields(pid: int) -> list[str]:
    """Fields of /proc/PID/stat after the name (0: state, 1: parent, 6: flags, 11..14: computing time); [] if there is
    no such process."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            return file.read().rpartition(")")[2].split()
    except OSError:
        return []


def lives(pid: int) -> bool:
    """Whether a process runs; a zombie does not, nor does one that was killed and returns its memory, which may take
    0.1 s."""
    fields = stat_fields(pid)
    return fields[:1] not in ([], ["Z"], ["X"]) and not int(fields[6]) & PF_EXITING


def command_line(pid: int) -> list[bytes]:
    """Program and arguments as bytes; [] if there is no such process, and for the kernel's own."""
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            return file.read().split(b"\0")[:-1]
    except OSError:
        return []


def named(*names: str) -> list[int]:
    """Numbers of the living processes with one of these names (at most 15 characters)."""
    found = []
    for pid in pids():
        try:
            with open(f"/proc/{pid}/comm", encoding="utf-8", errors="replace") as file:
                name = file.read().rstrip("\n")
        except OSError:
            continue
        if name in names and lives(pid):
            found.append(pid)
    return found


def is_near(pid: int) -> bool:
    """Whether a process is this user's, and not in a sandbox with shared memory of its own."""
    try:
        if os.stat(f"/proc/{pid}").st_uid != os.geteuid():
            return False
        return os.stat(f"/proc/{pid}/ns/ipc").st_ino == os.stat("/proc/self/ns/ipc").st_ino
    except PermissionError:  # it has rights that this one has not
        return True
    except OSError:
        return False


def cpu_s(pid: int) -> float:
    """Computing time (s) a process and its ended children have had; infinite when it is gone."""
    try:
        return sum(map(int, stat_fields(pid)[11:15] or ["gone"])) / os.sysconf("SC_CLK_TCK")
    except ValueError:
        return math.inf


def children(pid: int) -> list[int]:
    """Numbers of a process's children."""
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
            return list(map(int, file.read().split()))
    except (OSError, ValueError):
        return []


def descendants(ancestor: int) -> list[int]:
    """Numbers of all children, their children and so on."""
    parents = {pid: int(fields[1]) for pid in pids() if (fields := stat_fields(pid))}
    found: list[int] = []
    layer = {ancestor}
    while layer:
        layer = {pid for pid, parent in parents.items() if parent in layer}
        found += layer
    return found


def tree_cpu_s(pid: int) -> float:
    """cpu_s() of a process and its living descendants."""
    return cpu_s(pid) + sum(used for used in map(tree_cpu_s, children(pid)) if used < math.inf)


def memory_bytes(pid: Union[int, str] = "self") -> tuple[int, int, int]:
    """(address space, resident, shared with files) of a process in bytes.  Raises OSError."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        size, resident, shared = map(int, file.read().split()[:3])
    page = os.sysconf("SC_PAGE_SIZE")
    return size * page, resident * page, shared * page


def limit_memory(megabytes: int) -> None:
    """Let the address space of this process grow by so much from here."""
    now, _resident, _shared = memory_bytes()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = now + megabytes * MEGABYTE
    resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))


def mappings() -> Iterator[tuple[int, int, str]]:
    """Yield (first address, last address, line) of this process's memory."""
    with open("/proc/self/maps", encoding="utf-8", errors="replace") as file:
        for line in file:
            first, last = line.split()[0].split("-")
            yield int(first, 16), int(last, 16), line


def shared_memory() -> list[dict[str, int]]:
    """The machine's System V shared memory: dicts of key, shmid, perms, size, nattch, uid, ..  Raises OSError."""
    with open("/proc/sysvipc/shm", encoding="ascii") as file:
        names, *rows = [line.split() for line in file]
    return [{name: int(text, 8 if name == "perms" else 10) for name, text in zip(names, row)} for row in rows]


def is_ours(block: dict[str, int]) -> bool:
    """Whether a row of shared_memory() is this user's alone, as components/linuxcnc_planner.c says it: the block of a
    setuid rtapi_app has been made by root and given to the user."""
    us = (os.getuid(), os.geteuid(), 0)
    return block["uid"] in us and block["cuid"] in us and not block["perms"] & 0o077


def return_freed_arrays() -> None:
    """From now on this process gives the room of each array of OWN_MAPPING bytes back to the kernel when the array is
    deleted.

    Otherwise glibc raises this size to that of the largest array that has been deleted, up to 32 MB, and takes all
    smaller ones from its heap, where the room between two that are in use stays.
    """
    import ctypes

    with contextlib.suppress(AttributeError):  # not glibc
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(M_MMAP_THRESHOLD, OWN_MAPPING)
        mallopt(M_TRIM_THRESHOLD, 4 * OWN_MAPPING)


def return_heap() -> None:
    """Give the kernel back what is free in this process's heap: holes of the smaller arrays that a phase has had."""
    import ctypes

    with contextlib.suppress(AttributeError):  # not glibc
        ctypes.CDLL(None).malloc_trim(0)


def exit_on_sigterm() -> None:
    """From here on SIGTERM ends the process as sys.exit(143), with its temporary files removed.  In another thread than
    the first, where Python allows no handler, nothing changes."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))


def die_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent ends; at once when `parent` (pid) is not the parent any
    more."""
    import ctypes

    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
