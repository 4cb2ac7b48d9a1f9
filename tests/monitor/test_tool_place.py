# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool is when milltask or motion is gone (monitor/tool_place.py)."""

import types

from chipwise.monitor import tool_place
from chipwise.monitor.tool_place import LINE, TIP, ToolPlace

STATUS = types.SimpleNamespace(position=(9.0, 8.0, 7.0, 0.0), tool_offset=(0.0, 0.0, 2.0, 0.0), motion_line=5)


def test_the_pins_count_where_the_status_stays_and_then_their_last_values(monkeypatch):
    """The status of a milltask that was killed stays as it was.  The pins are read twice a second, and not while the
    status changes."""
    pins = {name: float(k) for k, name in enumerate(name for pair in TIP for name in pair)}
    pins[LINE] = 33
    there, asked, now = True, 0, 100.0

    def get_value(name):
        nonlocal asked
        asked += 1
        if not there:
            raise RuntimeError("pin not found")
        return pins[name]

    monkeypatch.setattr(tool_place.time, "monotonic", lambda: now)
    place = ToolPlace(get_value)
    assert place.look(STATUS) == ([9.0, 8.0, 5.0], 5) and asked == 0
    assert place.look(STATUS) == ([-1.0, -1.0, -1.0], 33) and asked == 7
    pins[TIP[0][0]] = 50.0
    now += 0.4
    assert place.look(STATUS) == ([-1.0, -1.0, -1.0], 33) and asked == 7
    now += 0.2
    assert place.look(STATUS) == ([49.0, -1.0, -1.0], 33) and asked == 14
    there = False
    now += 0.6
    assert place.look(STATUS) == ([49.0, -1.0, -1.0], 33)
    moved = types.SimpleNamespace(**{**vars(STATUS), "motion_line": 6})
    before = asked
    assert place.look(moved) == ([9.0, 8.0, 5.0], 6) and asked == before
    other = ToolPlace(get_value)
    assert [other.look(STATUS) for _ in range(2)] == [([9.0, 8.0, 5.0], 5)] * 2, "without these pins"
