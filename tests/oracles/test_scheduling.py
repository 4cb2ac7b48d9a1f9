# SPDX-License-Identifier: GPL-2.0-or-later
"""Which process takes which tests (support/scheduling.py)."""

import gc
import os
from types import SimpleNamespace

from support.scheduling import MACHINE_PROCESSES, NICE, machine_units, next_unit, niceness


def taken(waiting, processes):
    """[process: its units] where each takes one in turn until none is left."""
    waiting, result = list(waiting), [[] for _ in range(processes)]
    while waiting:
        for number, units in enumerate(result):
            if waiting:
                units.append(next_unit(waiting, number))
                waiting.remove(units[-1])
    return result


def test_machines_in_processes_of_their_own():
    machines, others = (
        ["machine%d" % k for k in range(2 * MACHINE_PROCESSES)],
        ["tests/a.py::test_%d" % k for k in range(4)],
    )
    assert taken([*machines, *others], MACHINE_PROCESSES + 2) == [
        *(machines[k::MACHINE_PROCESSES] for k in range(MACHINE_PROCESSES)),
        others[0::2],
        others[1::2],
    ]


def test_machines_come_first():
    """A process that computes leaves them the processor; it is nice from its start, so all that it starts is as
    nice."""
    assert [niceness(f"gw{number}") for number in range(MACHINE_PROCESSES + 2)] == MACHINE_PROCESSES * [0] + 2 * [NICE]
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    assert worker is None or os.nice(0) >= niceness(worker)


def test_what_is_left_is_shared():
    """No process is idle while another has a unit to take."""
    machines, others = ["machine%d" % k for k in range(9)], ["tests/a.py::test_%d" % k for k in range(9)]
    for waiting in (machines, others, machines + others[:1], machines[:1] + others):
        found = taken(waiting, MACHINE_PROCESSES + 2)
        assert sorted(sum(found, [])) == sorted(waiting)
        assert max(map(len, found)) - min(map(len, found)) <= 1
    first = taken([*others[:1], *machines], MACHINE_PROCESSES + 1)[MACHINE_PROCESSES]
    assert first[:2] == [others[0], machines[2 * MACHINE_PROCESSES]]


def test_the_order_of_the_units():
    """Tests of the shipped form, then what takes longest; the tests of a unit stay together and in their order."""
    ids = [
        "tests/machine/test_a.py::test_1",
        "tests/machine/test_b.py::test_1",
        "tests/machine/test_a.py::test_2",
        "tests/machine/test_b.py::test_2",
        "tests/shipped/test_c.py::test_1",
    ]
    items = [SimpleNamespace(nodeid=name) for name in ids]
    key, seconds = (
        lambda item: "b" if "test_b" in item.nodeid else item.nodeid,
        dict(zip(ids, (1.0, 2.0, 5.0, 2.0, 0.1))),
    )
    names, ordered = machine_units(items, key, seconds)
    assert [item.nodeid for item in ordered] == [ids[k] for k in (4, 2, 1, 3, 0)]
    assert names == {ids[4]: "machine0", ids[2]: "machine1", "b": "machine2", ids[0]: "machine3"}
    _names, ordered = machine_units(items, key, {**seconds, ids[3]: 3.5})
    assert [item.nodeid for item in ordered] == [ids[k] for k in (4, 1, 3, 2, 0)]


def test_the_garbage_collector_leaves_alone_what_was_collected():
    """It works, but not on pytest's modules and tests (conftest.py: pytest_collection)."""
    assert gc.isenabled() and gc.get_freeze_count() > 20_000
