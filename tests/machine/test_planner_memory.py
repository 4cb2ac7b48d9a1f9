# SPDX-License-Identifier: GPL-2.0-or-later
"""The motion planner's queue is read on the machine: the checks of who owns its memory and whether it runs let the real one through."""

import pytest

from support.operate import operate

pytestmark = pytest.mark.machine


@pytest.mark.parametrize('ini', ['mill.ini', 'mill_inch.ini'])
def test_the_path_ahead_is_known(tmp_path, ini):
    """In a feed at constant velocity, and while the operator has paused it."""
    *_, moving, _pause, paused, _resume, _said = operate(tmp_path, [
        ['mdi', 'T1 M6'], ['mdi', 'G21'], ['mdi', 'M250 P0 Q0 R-10 I40 J40 K10'], ['start', 'G21 G90\nG0 X0 Y0 Z5\nF300\nG1 X20\nG1 Y20\nM2\n'],
        ['until', 'motion.motion-type', '>', 1.5], ['sleep', 0.5], ['over', 0.5, 'stock-tracker.0.path-known'], ['pause'],
        ['over', 0.3, 'stock-tracker.0.path-known'], ['resume'], ['finish']], ini=ini)
    assert moving == [[1, 1]] and paused == [[1, 1]]
