# SPDX-License-Identifier: GPL-2.0-or-later
"""A worker of chipwise-monitor that is killed while it holds the semaphore of one of LinuxCNC's buffers: its parent
gives it back."""

import ctypes
import os
import signal
import time

import pytest

from chipwise.monitor import buffers, supervisor

CREATE, EXCLUSIVE, REMOVE, GET, SET = 0o1000, 0o2000, 0, 12, 16  # <sys/ipc.h>, <sys/sem.h>
LIBC = ctypes.CDLL(None, use_errno=True)


@pytest.fixture
def semaphores(monkeypatch):
    """Three free semaphores of this test in place of LinuxCNC's."""
    keys, numbers = [], []
    key = 0x5EED0000 + os.getpid()
    while len(keys) < 3:
        key += 1
        number = LIBC.semget(key, 1, CREATE | EXCLUSIVE | 0o600)
        if number >= 0:
            LIBC.semctl(number, 0, SET, 1)
            keys.append(key)
            numbers.append(number)
    monkeypatch.setattr(buffers, "KEYS", (*keys, key + 1))  # the last does not exist
    yield numbers
    for number in numbers:
        LIBC.semctl(number, 0, REMOVE)


def child_that_takes(numbers, gives_back=()):
    """A process that has taken them and waits to be killed; -> its id."""
    ready, told = os.pipe()
    pid = os.fork()
    if not pid:
        for change, those in ((-1, numbers), (1, gives_back)):
            for number in those:
                LIBC.semop(number, ctypes.byref(buffers.Step(0, change, 0)), 1)
        os.write(told, b"x")
        while True:
            time.sleep(60)
    os.read(ready, 1)
    os.close(ready)
    os.close(told)
    return pid


def values(numbers):
    return [LIBC.semctl(number, 0, GET) for number in numbers]


@pytest.mark.parametrize("ends", ["ended", "end"])
def test_what_a_killed_worker_held_is_free_again(semaphores, monkeypatch, ends):
    first, second, third = semaphores
    other = child_that_takes([third])
    one = supervisor.Child(child_that_takes([first, second], [second]))
    assert values(semaphores) == [0, 1, 0]
    if ends == "end":
        monkeypatch.setattr(supervisor, "LAST_WORDS_S", 0.0)
        one.end()
    else:
        one.kill()
        while one.ended() is None:
            time.sleep(0.01)
    assert values(semaphores) == [1, 1, 0]  # a semaphore of somebody who lives is not touched
    os.kill(other, signal.SIGKILL)
    os.waitpid(other, 0)


def test_a_worker_that_held_nothing_changes_nothing(semaphores):
    pid = child_that_takes(semaphores, semaphores)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    assert values(semaphores) == [1, 1, 1] and buffers.give_back(pid) == 0
    assert values(semaphores) == [1, 1, 1]
