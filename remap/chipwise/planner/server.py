# SPDX-License-Identifier: GPL-2.0-or-later
"""Plans cycles for its parent until that ends.  A program, not a module: planner/client.py starts it.

    /usr/bin/python3 -s planner/server.py PARENT_PID

Orders (planner/plans.py) come on stdin, outcomes or CycleErrors go to stdout, pickled, each after its length.  The
parent limits the computing time, this program its own memory.
"""

import os
import pickle
import resource
import sys

sys.path[0] = os.path.dirname(
    os.path.dirname(sys.path[0])
)  # the modules are those of the package, not those beside this file

from chipwise.planner import plans  # noqa: E402
from chipwise.errors import CycleError, LibraryError, braceless, unnamed  # noqa: E402
from chipwise.planner.client import HEAD  # noqa: E402
from chipwise.host.processes import die_with_parent, limit_memory  # noqa: E402

TRIES = 2  # the second one without what earlier plans have left


def answer(order):
    """The reply to an Order; what earlier plans have left in memory never decides."""
    limit_memory(order.memory_mb)
    for _ in range(TRIES):
        try:
            return pickle.dumps(plans.packed(plans.make(order)))
        except CycleError as error:
            return pickle.dumps(error)
        except MemoryError:
            pass  # first what the plan held has to go, with the exception
        except LibraryError as error:
            return pickle.dumps(CycleError(braceless(unnamed(error))))
        except Exception as error:
            text = f"{type(error).__name__}: {error}".splitlines()[0].replace("{", "{{").replace("}", "}}")
            return pickle.dumps(CycleError(f"internal error: {text}", "report the program"))
        plans.forget()
    return pickle.dumps(
        CycleError(
            f"planning takes more than {order.memory_mb} MB of memory",
            "use a larger step, fewer passes or a simpler contour, or raise [CHIPWISE]PLAN_MEMORY",
        )
    )


def read(count):
    """So many bytes from the parent; ends the program with it."""
    data = b""
    while len(data) < count:
        part = os.read(0, count - len(data))
        if not part:
            sys.exit(0)
        data += part
    return data


def main():
    die_with_parent(int(sys.argv[1]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    out = os.dup(1)
    os.dup2(2, 1)  # what a library prints must not be read as a reply
    while True:
        reply = answer(pickle.loads(read(*HEAD.unpack(read(HEAD.size)))))
        rest = memoryview(HEAD.pack(len(reply)) + reply)
        while rest:
            rest = rest[os.write(out, rest) :]


if __name__ == "__main__":
    main()
