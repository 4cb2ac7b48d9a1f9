# SPDX-License-Identifier: GPL-2.0-or-later
"""Works one program on a worker of a cluster.  A program, not a module.

    /usr/bin/python3 -s cluster_runner.py  < pickle of the order  > pickle of the result

Started by a worker of Dask through batch/cluster.py; it ends with that worker.

Order:   (version, name of a task, path of the program, arguments of the task)
Result:  (version, result of the task); nothing if the versions differ
"""

import os
import pickle
import signal
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))

from chipwise import version  # noqa: E402
from chipwise.host.processes import die_with_parent  # noqa: E402


def check(program, arguments):
    """As answer.check."""
    from chipwise.check.run import checked

    return checked(program, None, arguments)


def rewrite(program, arguments):
    """As rewrite.one.one."""
    from chipwise.rewrite.batch_job import one

    return one(program, lambda share: None, arguments)


TASKS = {"check": check, "rewrite": rewrite}


def main():
    die_with_parent(os.getppid())
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # with the reader's files removed
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # whoever prints does not spoil the result
        other, task, program, arguments = pickle.loads(sys.stdin.buffer.read())
        result = TASKS[task](program, arguments) if other == version() else None
        pickle.dump((version(), result), out, pickle.HIGHEST_PROTOCOL)


if __name__ == "__main__":
    main()
