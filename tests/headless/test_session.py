# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise.headless.session: what is kept of an error state of LinuxCNC's task, and commands that it drops."""

from types import SimpleNamespace

import linuxcnc
import pytest

from chipwise.headless import session as steps
from chipwise.headless.session import WAITED, Session


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


def test_a_traverse_that_has_waited_is_no_error_of_the_run():
    """A busy computer: the guard's component says so by an error, and the program goes on by itself."""
    said = [
        (linuxcnc.NML_ERROR, f"{WAITED}8 yet; it goes on by itself, after some seconds without a guard\n"),
        (linuxcnc.OPERATOR_ERROR, "chipwise: rapid stopped\n"),
        (linuxcnc.OPERATOR_TEXT, "chipwise: it runs"),
        None,
    ]
    session = Session.__new__(Session)
    session.errors, session.messages, session.notes = [], [], []
    session.channel = SimpleNamespace(poll=lambda: said.pop(0))
    session.collect_messages()
    assert session.errors == ["chipwise: rapid stopped"] and session.messages == ["chipwise: it runs"]
    assert len(session.notes) == 1 and WAITED in session.notes[0]


def test_it_is_what_the_guard_says(root):
    assert f'"{WAITED}' in (root / "components/chipwise_guard.comp").read_text()


@pytest.mark.parametrize("dropped", [0, 1, 3])
def test_a_state_is_commanded_again_where_the_task_drops_it(monkeypatch, dropped):
    """Its io has not answered in time.  What is taken is commanded once."""
    clock, sent = [100.0], []
    monkeypatch.setattr(steps.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(steps.time, "sleep", lambda seconds: clock.__setitem__(0, clock[0] + seconds))
    monkeypatch.setattr(steps, "task_runs", lambda: True)
    session = Session.__new__(Session)
    session.deadline, session.status = 1e9, SimpleNamespace(task_state=linuxcnc.STATE_ESTOP)
    session.poll = lambda: None

    def taken(state):
        sent.append(state)
        if sent.count(state) > dropped:
            session.status.task_state = state

    session.command = SimpleNamespace(state=taken)
    session.switch_on()
    assert sent == [linuxcnc.STATE_ESTOP_RESET] * (dropped + 1) + [linuxcnc.STATE_ON] * (dropped + 1)
    assert clock[0] < 100.0 + 2 * dropped * 1.1 * steps.AGAIN_S + 1.0
