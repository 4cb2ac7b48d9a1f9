# SPDX-License-Identifier: GPL-2.0-or-later
"""Which process of xdist runs which test next: LinuxCNCs in three processes, everything else in the others.

Called by tests/conftest.py.  A unit is what has to run in one process: a test, the scenes of one LinuxCNC, the tests of
one run.  Each process takes the next unit when it comes to it, so those that run machines end together; and when one
kind is done, all processes share the rest.
"""

MACHINE_PROCESSES = (
    3  # each LinuxCNC waits for its simulated time, and needs a processor for a third of the while or less
)
MACHINE = "machine"  # first letters of the name of a machine unit
NICE = 5  # of the other processes, so that chipwise-monitor is not so late on a busy computer that it counts as dead


def niceness(process):
    """Of a process of xdist, by its name ("gw3"): those that run machines come first."""
    return 0 if int(process.removeprefix("gw") or 0) < MACHINE_PROCESSES else NICE


def machine_units(items, key, seconds):
    """{key: name of its unit}, and the tests of machines in their order: of the shipped form first, then the longest
    unit first.

    key      function: item -> what it shares with the tests of its unit
    seconds  {nodeid: s} that the test takes (durations.py)
    """
    size = {}
    for item in items:
        size[key(item)] = size.get(key(item), 0.0) + seconds[item.nodeid]
    names = {}
    for item in sorted(items, key=lambda item: ("tests/shipped/" not in item.nodeid, -size[key(item)])):
        names.setdefault(key(item), f"{MACHINE}{len(names)}")
    order = list(names)
    return names, sorted(items, key=lambda item: order.index(key(item)))


def next_unit(waiting, process):
    """The name of the unit that a process takes; waiting: names in their order, process: its number."""
    own = process < MACHINE_PROCESSES
    return next((name for name in waiting if name.startswith(MACHINE) == own), next(iter(waiting)))


def scheduler(config, log):
    """What xdist asks for with --dist loadgroup."""
    from xdist.scheduler import LoadGroupScheduling  # not installed everywhere

    class Scheduler(LoadGroupScheduling):
        def _assign_work_unit(self, node):
            self.workqueue.move_to_end(next_unit(self.workqueue, self.nodes.index(node)), last=False)
            super()._assign_work_unit(node)

    return Scheduler(config, log)
