# SPDX-License-Identifier: GPL-2.0-or-later
"""A stock that is assumed for a loaded program ([CHIPWISE]SHADOW): it is cut, nothing acts on it, the machine moves as without chipwise."""

import numpy as np
import pytest

from support.headless_rig import WITH_LOG
from support.operate import BOX, operate

pytestmark = pytest.mark.machine

# A traverse in the middle of what is assumed: with M250 the guard stops it.  G61 for the first move: else it begins half as fast if the task has sent
# the second one in time, as a blend.
PROGRAM = """(T1 D=6. CR=0. - ZMIN=-4. - flat end mill)
G21 G90
T1 M6
G61 G0 X0 Y0 Z5
G64 P0.01
G1 Z-4 F600
G1 X30 F900
G2 X30 Y20 I0 J10
G1 X0
G0 X0 Y10
G0 X20
G0 Z5
M2
"""
STATE = ['pins', 'stock-tracker.0.stock-defined', 'stock-tracker.0.certain', 'stock-tracker.0.removed-volume', 'chipwise-guard.0.reason',
         'volumetric-feed.0.air-time', 'volumetric-feed.0.cut-time']
SHADOW = WITH_LOG + '\ns/^KEEP_STOCK = .*/KEEP_STOCK = no\\nSHADOW = {}/'


def _rows(path):
    """Positions from the first motion to the end, in servo periods."""
    log = np.load(path)
    at = np.column_stack([log[name] for name in "xyz"])
    moves = np.flatnonzero(np.abs(np.diff(at, axis=0)).max(axis=1) > 0)
    return at[moves[0]:moves[-1] + 2]


def test_it_is_cut_and_nothing_acts(tmp_path):
    """The stock is there when the program is loaded, and is cut; the rows are those of a machine without it; M251 finds no stock; M250 is certain."""
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM)
    home, ran = ['mdi', 'G0 X-10 Y-10 Z20'], ['log', str(path)]
    off = operate(tmp_path, [home, ran, STATE, ['messages'], home, ran], edit=SHADOW.format('no'), speed=1)
    on = operate(tmp_path, [home, ['open', str(path)], ['messages', 'a stock is assumed'], STATE, ran, STATE, home, ran, STATE, home, ['mdi', 'M251 Q6'],
                            ['mdi', BOX], STATE, ran], edit=SHADOW.format('yes'), speed=1)
    _, (errors, log_off), none, quiet, _, (_, second_off) = off
    assert none[:2] == ['FALSE', 'FALSE'] and errors == [] and not any('assumed' in text for text in quiet)
    _, _, said, before, (errors, log_on), after, _, (_, second_on), goes_on, _, m251, _, certain, stopped = on
    assert said == ['chipwise: part.ngc: a stock is assumed from its path, from -3 -3 -4 to 33 23 0 mm, and nothing acts on it; define it with M250']
    assert before[:3] == ['TRUE', 'FALSE', '0'] and errors == []
    assert after[:2] == ['TRUE', 'FALSE'] and after[3] == '0'
    assert float(after[2]) > 2000 and float(after[4]) > 0 and float(after[5]) > 1
    assert goes_on[:3] == after[:3]                     # the same path in the same stock
    assert any('no stock is defined' in text for text in m251)
    assert stopped == 'failed: a guard has stopped the program (line 10)'
    assert certain[:3] == ['TRUE', 'TRUE', '0']
    rows = [_rows(log) for log in (log_off, second_off, log_on, second_on)]
    assert len(rows[0]) > 5000
    for other in rows[1:]:
        assert len(other) == len(rows[0]) and np.abs(other - rows[0]).max() == 0.0
