# SPDX-License-Identifier: GPL-2.0-or-later
"""remap/chipwise/stock/mapped.py: who removes the memory of a map.  On blocks of this test's own, without HAL."""

import ctypes as C
import os

import pytest

from chipwise.host.processes import shared_memory
from chipwise.stock.mapped import Mapped

LIBC = C.CDLL(None, use_errno=True)
LIBC.shmat.restype = C.c_void_p
LIBC.shmdt.argtypes = [C.c_void_p]
CREATE, EXCLUSIVE, REMOVE = 0o1000, 0o2000, 0
SIZE = 8192


@pytest.fixture
def block():
    """-> key, number of a block that nobody has attached."""
    for key in range(0x43570000 + os.getpid() % 0x8000, 0x43580000):
        number = LIBC.shmget(key, SIZE, CREATE | EXCLUSIVE | 0o600)
        if number >= 0:
            break
    yield key, number
    LIBC.shmctl(number, REMOVE, None)


def is_there(number):
    """Under its key: one that is removed while somebody has it loses the key and stays."""
    return any(row["shmid"] == number and row["key"] for row in shared_memory())


def test_the_last_one_of_linuxcnc_removes_the_memory(block):
    key, number = block
    mapped = Mapped(key, False, SIZE, True)
    assert len(mapped.memory) == SIZE
    mapped.close()
    assert not is_there(number)
    mapped.close()


def test_memory_that_another_has_stays(block):
    key, number = block
    other = LIBC.shmat(number, None, 0)
    mapped = Mapped(key, False, SIZE, True)
    mapped.memory[17] = 5
    mapped.close()
    assert is_there(number) and C.string_at(other, SIZE)[17] == 5
    LIBC.shmdt(other)


def test_a_plan_that_reads_removes_nothing(block):
    key, number = block
    Mapped(key, True, SIZE, False).close()
    assert is_there(number)


def test_the_panel_that_is_last_removes_the_memory(block):
    """On a busy computer the page looks at the map a moment longer than the monitor."""
    key, number = block
    panel, monitor = Mapped(key, True, SIZE, True), Mapped(key, False, SIZE, True)
    monitor.close()
    assert is_there(number)
    panel.close()
    assert not is_there(number)
