# SPDX-License-Identifier: GPL-2.0-or-later
"""Where the tool is when milltask or motion is gone (monitor/tool_place.py)."""
import types

from chipwise.monitor.tool_place import LINE, TIP, ToolPlace

STATUS = types.SimpleNamespace(position=(9.0, 8.0, 7.0, 0.0), tool_offset=(0.0, 0.0, 2.0, 0.0), motion_line=5)


def test_the_pins_count_and_then_their_last_values():
    """The status of a milltask that was killed stays as it was."""
    pins = {name: float(k) for k, name in enumerate(name for pair in TIP for name in pair)}
    pins[LINE] = 33
    there = True

    def get_value(name):
        if not there:
            raise RuntimeError("pin not found")
        return pins[name]
    place = ToolPlace(get_value)
    assert place.look(STATUS) == ([-1.0, -1.0, -1.0], 33)
    pins[TIP[0][0]] = 50.0
    assert place.look(STATUS) == ([49.0, -1.0, -1.0], 33)
    there = False
    assert place.look(STATUS) == ([49.0, -1.0, -1.0], 33)
    assert ToolPlace(get_value).look(STATUS) == ([9.0, 8.0, 5.0], 5), "without these pins"
