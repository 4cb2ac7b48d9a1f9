# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise.headless.session: what is kept of an error state of LinuxCNC's task."""

from types import SimpleNamespace

import linuxcnc
import pytest

from chipwise.headless.session import Session


@pytest.mark.parametrize("execution, names_timeout", [(linuxcnc.EXEC_ERROR, True), (linuxcnc.EXEC_DONE, False)])
def test_an_error_state_without_a_message_has_a_cause_and_a_remedy(execution, names_timeout):
    """The task gives up without a word if motion does not answer a command in time: the execution is in error then; the
    first report stays."""
    session = Session.__new__(Session)
    session.failure = ""
    session.status = SimpleNamespace(current_line=269, interp_state=2, exec_state=execution, motion_line=29)
    session.note_failure("in an error state")
    assert session.failure.startswith("LinuxCNC was in an error state at line 269 (interpreter 2, ")
    assert ("[EMCMOT]COMM_TIMEOUT" in session.failure) is names_timeout
    first = session.failure
    session.status.current_line = 300
    session.note_failure("left with an interpreter error")
    assert session.failure == first
