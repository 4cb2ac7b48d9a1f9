# SPDX-License-Identifier: GPL-2.0-or-later
"""host/clock.py: limits for processes that wait for a processor."""

import pytest

from chipwise.host import clock


@pytest.mark.parametrize(
    "speed, monitor_s, expected",
    [
        (None, None, (3.0, 3.0)),
        ("4", None, (12.0, 12.0)),
        ("4", "60", (12.0, 240.0)),
        ("4", "2", (12.0, 12.0)),
        (None, "0", (3.0, 3.0)),
        *[(text, text, (3.0, 3.0)) for text in ("", "x", "nan", "inf", "-60", "1e9")],
    ],
)
def test_seconds(monkeypatch, speed, monitor_s, expected):
    """Real seconds; with chipwise-monitor at least those of the environment."""
    for name, value in (("CHIPWISE_SPEED", speed), ("CHIPWISE_MONITOR_S", monitor_s)):
        monkeypatch.delenv(name, raising=False) if value is None else monkeypatch.setenv(name, value)
    assert (clock.patience(3.0), clock.monitor_patience(3.0)) == expected
