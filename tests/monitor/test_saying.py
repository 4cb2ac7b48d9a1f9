# SPDX-License-Identifier: GPL-2.0-or-later
"""What set-up and shadow have for the operator (monitor/saying.py)."""

import pytest

from chipwise.monitor import saying


@pytest.fixture
def voice(monkeypatch):
    """(Saying, the texts shown, a list that is empty while commands are under way)."""
    shown, quiet = [], []
    monkeypatch.setattr(saying, "Quiet", lambda _linuxcnc: lambda: bool(quiet))
    return saying.Saying(shown.append), shown, quiet


def test_it_waits_until_it_is_quiet(voice):
    one, shown, quiet = voice
    one.tell("first")
    one.tell("second \udcff")
    one.speak(None)
    assert shown == []
    quiet.append(True)
    one.speak(None)
    one.speak(None)
    assert shown == ["first", "second \\udcff"]  # a name that is not UTF-8


def test_the_same_again_is_not_said(voice):
    """Until something else has been said; what is forgotten is not shown."""
    one, shown, quiet = voice
    quiet.append(True)
    for text in ("a", "a", "b", "a"):
        one.tell(text)
        one.speak(None)
    assert shown == ["a", "b", "a"]
    one.tell("c")
    one.forget()
    one.speak(None)
    assert shown == ["a", "b", "a"]
