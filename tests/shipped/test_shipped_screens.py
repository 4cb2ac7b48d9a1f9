# SPDX-License-Identifier: GPL-2.0-or-later
"""The installed mill, started by an ordinary user, with its screens: from E-stop to the end line of a program, and quit."""
import re

import pytest

from support import samples

pytestmark = pytest.mark.machine

CUT_MM3 = 60 * 10 * 5                       # a slot across the stock of PROGRAM, and nothing beside it


def check(found):
    assert re.fullmatch(r'chipwise: cut\.ngc: [0-9.]+ s, [0-9.]+ s (more|less) than at F; peak [0-9.]+, target 30 cm3/min', found['line']), found['line']
    assert float(found['line'].split('peak ')[1].split(',')[0]) <= 30 * 1.02
    assert found['removed'] == pytest.approx(CUT_MM3, rel=0.003) and found['fault'] == '0'
    assert found['page'][0] == 200 and '<html' in found['page'][1] and 'chipwise' in found['page'][1]
    assert found['left'] == {}, 'these still run after LinuxCNC has ended'


def test_axis(scene):
    check(scene('scenes.axis'))


def test_gmoccapy(scene):
    if samples.missing(samples.named('gmoccapy')):
        pytest.skip(samples.missing(samples.named('gmoccapy')))
    check(scene('scenes.gmoccapy'))


def test_a_start_from_a_menu_that_fails(scene):
    """The window with the reason is there, above LinuxCNC's own."""
    windows = scene('machines.menu')['windows']
    assert windows[-1] == 'chipwise' and len(windows) > 1, windows
