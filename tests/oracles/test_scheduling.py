# SPDX-License-Identifier: GPL-2.0-or-later
"""Which process takes which tests (support/scheduling.py)."""
from types import SimpleNamespace

from support.scheduling import MACHINE_PROCESSES, machine_units, next_unit


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
    machines, others = ['machine%d' % k for k in range(2 * MACHINE_PROCESSES)], ['tests/a.py::test_%d' % k for k in range(4)]
    assert taken([*machines, *others], MACHINE_PROCESSES + 2) == [
        *(machines[k::MACHINE_PROCESSES] for k in range(MACHINE_PROCESSES)), others[0::2], others[1::2]]


def test_what_is_left_is_shared():
    """No process is idle while another has a unit to take."""
    machines, others = ['machine%d' % k for k in range(9)], ['tests/a.py::test_%d' % k for k in range(9)]
    for waiting in (machines, others, machines + others[:1], machines[:1] + others):
        found = taken(waiting, MACHINE_PROCESSES + 2)
        assert sorted(sum(found, [])) == sorted(waiting)
        assert max(map(len, found)) - min(map(len, found)) <= 1
    first = taken([*others[:1], *machines], MACHINE_PROCESSES + 1)[MACHINE_PROCESSES]
    assert first[:2] == [others[0], machines[2 * MACHINE_PROCESSES]]


def test_the_order_of_the_units():
    """Tests of the shipped form, then what has most tests; the tests of a unit stay together and in their order."""
    ids = ['tests/machine/test_a.py::test_1', 'tests/machine/test_b.py::test_1', 'tests/machine/test_a.py::test_2', 'tests/machine/test_b.py::test_2',
           'tests/shipped/test_c.py::test_1']
    items = [SimpleNamespace(nodeid=name) for name in ids]
    names, ordered = machine_units(items, lambda item: 'b' if 'test_b' in item.nodeid else item.nodeid)
    assert [item.nodeid for item in ordered] == [ids[k] for k in (4, 1, 3, 0, 2)]
    assert names == {ids[4]: 'machine0', 'b': 'machine1', ids[0]: 'machine2', ids[2]: 'machine3'}
