# SPDX-License-Identifier: GPL-2.0-or-later
"""What milltask says of itself (chipwise/glue/task.py), for each of its states."""

import ctypes

import pytest

from chipwise.glue import task


@pytest.mark.parametrize(
    "flag, mode, restoring",
    [
        (0, "EMC_TASK_MODE_AUTO", True),
        (0, "EMC_TASK_MODE_MDI", False),
        (1, "EMC_TASK_MODE_AUTO", False),
        (2, "EMC_TASK_MODE_AUTO", False),
        (0, "", True),
        (1, "", False),
        (None, "", False),
    ],
)  # without a mode: LinuxCNC 2.10
def test_the_line_after_an_abort(monkeypatch, flag, mode, restoring):
    monkeypatch.setattr(task, "_open_flag", lambda: None if flag is None else ctypes.c_int(flag))
    monkeypatch.setattr(task, "_mode", lambda: mode)
    assert task.is_restoring() is restoring
