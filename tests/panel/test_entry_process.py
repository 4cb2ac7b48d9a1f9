# SPDX-License-Identifier: GPL-2.0-or-later
"""The process that works out an order of the panel page, where it may keep LinuxCNC waiting."""

import os

import pytest

from chipwise.errors import CycleError
from chipwise.panel import entry_process


class Looked:
    """As entry/mdi.py; `seen` has each look at LinuxCNC's status, and where the process lets others come first."""

    def __init__(self, monkeypatch, error=None):
        self.seen, self.error = [], error
        monkeypatch.setattr(os, "nice", lambda more: self.seen.append(f"nice {more}"))

    def read(self):
        self.seen.append("read")
        if self.error:
            raise self.error
        return "state"

    def scene(self):
        self.seen.append("scene")
        return "scene"

    def check(self):
        return "checked"


def _work(_order, machine):
    return [machine.read(), machine.scene(), machine.read(), machine.check()]


@pytest.mark.parametrize("nice, seen", [(7, ["read", "scene", "nice 7"]), (0, ["read", "scene", "read"])])
def test_no_look_at_the_status_once_others_come_first(monkeypatch, nice, seen):
    """A process that waits for a processor with the lock of LinuxCNC's status buffer keeps the task waiting."""
    machine = Looked(monkeypatch)
    monkeypatch.setitem(entry_process._WORK, "look", _work)
    assert entry_process.answer({"do": "look"}, machine, nice) == ["state", "scene", "state", "checked"]
    assert machine.seen == seen


def test_no_linuxcnc_is_said(monkeypatch):
    monkeypatch.setitem(entry_process._WORK, "look", _work)
    machine = Looked(monkeypatch, CycleError("LinuxCNC is not running here", "start it"))
    assert entry_process.answer({"do": "look"}, machine, 5)["error"].startswith("LinuxCNC is not running here")
