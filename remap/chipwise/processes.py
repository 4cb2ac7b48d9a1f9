"""What the parent of a child process asks the kernel about it.  Called by planner.py, subs.py and check/reader.py."""

import math
import os
import signal

PR_SET_PDEATHSIG = 1


def cpu_s(pid):
    """Computing time (s) a process and its ended children have had; infinite when it is gone."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            fields = file.read().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return math.inf


def tree_cpu_s(pid):
    """cpu_s() of a process and its living descendants."""
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
            children = list(map(int, file.read().split()))
    except (OSError, ValueError):
        children = []
    return cpu_s(pid) + sum(used for used in map(tree_cpu_s, children) if used < math.inf)


def die_with_parent(parent):
    """Have the kernel kill this process when its parent ends; at once when `parent` (pid) is not the parent any more."""
    import ctypes
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
