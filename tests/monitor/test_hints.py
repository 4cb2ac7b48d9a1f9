# SPDX-License-Identifier: GPL-2.0-or-later
"""What chipwise-monitor says of the realtime side of a machine (monitor/hints.py)."""
import pytest

from chipwise.monitor import hints
from chipwise.monitor.messages import PATH_REFUSALS
from chipwise.stock.layout import PathRefusal


@pytest.fixture
def looks(monkeypatch):
    """(pins, the texts said, a list that is empty while commands are under way, a function that looks once)."""
    pins, said, quiet = {'path-refused': 0, 'mode': 0}, [], []
    monkeypatch.setattr(hints, 'Quiet', lambda _linuxcnc: lambda _now: bool(quiet))
    hint = hints.Hints(pins, said.append, None)
    return pins, said, quiet, lambda: hint.follow(1.0)


def test_a_path_that_is_not_read(looks):
    """What was refused at the start is said when no command is under way; what fails later under M251 only; each once."""
    pins, said, quiet, look = looks
    look()
    pins['path-refused'] = PathRefusal.NOT_OURS
    look()
    assert said == []
    quiet.append(True)
    for _ in range(3):
        look()
    pins['path-refused'] = PathRefusal.CHAIN
    look()
    assert len(said) == 1 and 'another user' in said[0]
    pins['mode'] = 1
    for code in (PathRefusal.CHAIN, 0, PathRefusal.CHAIN, PathRefusal.POSITION, 77):
        pins['path-refused'] = code
        look()
    assert len(said) == 4 and 'do not join' in said[1] and 'external offsets' in said[2] and 'check 77' in said[3]


def test_every_refusal_has_its_sentence():
    """Which the screen shows whole: 250 characters."""
    assert set(PATH_REFUSALS) == set(PathRefusal) - {PathRefusal.NONE}
    assert max(len(f'chipwise: {text}') for text in PATH_REFUSALS.values()) <= 250
